"""Cohesion in proportion to the area in which two grains intersect."""

import math
from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale


class CohesionArea(ContactEffect):
    """An attraction k A, with A the area of the circle in which the undeformed surfaces intersect.

    F = −k A,  A = π (R_i² − x²),  x = (d² + R_i² − R_j²)/(2 d) for two spheres a distance d apart,
    A = π (R² − d²) for a sphere whose centre is a distance d from a wall

    For a small overlap δ between equal spheres A ≈ π R δ, at a wall A ≈ 2 π R δ. The attraction does not enter Coulomb's
    cap. It is not the theory of Johnson, Kendall and Roberts, though LIGGGHTS calls it "SJKR": it has no pull-off at touch,
    no hysteresis, and grows with the softness of the grains.

    Expected behaviour: steeper heaps and drums, looser packings, slower discharge; a pair at rest presses deeper, since the
    attraction acts against Hertz. Limits: Hertz alone carries the pull where k = 4/3 E* √(δ/(2R))/π between equal spheres
    and k = 2/3 E* √(δ/R)/π at a wall, so without any load a contact settles at δ = 2R (3πk/(4E*))² and R (3πk/(2E*))²;
    where that is no longer small beside R, grains sink into each other. Of overlapping elements of one body each pulls for
    itself, so that a body of several spheres sticks more than its outline would; of a superquadric the circle is that of
    spheres with the curvatures at the contact.
    """

    name: ClassVar[str] = "cohesion_area"
    title: ClassVar[str] = "Cohesion by contact area"
    family: ClassVar[str] = "cohesion"
    stage: ClassVar[Stage] = Stage.ADHESION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="energy_density",
            unit="J/m^3",
            low=0.0,
            high=1e9,
            plausible=(0.0, 1e5),
            vanishing=0.0,
            # Under its weight a Hertz contact has A ∝ s^(8/3), and the weight is ∝ s³.
            coarse_graining=1 / 3,
            meaning="Attraction per area of the circle of intersection; it scales with the stiffness of the grains.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("energy_density",)
    conservative: ClassVar[bool] = True
    visible_as: ClassVar[str] = "steeper heaps and drums, looser packings, lumps that fall off an edge"
    similarity: ClassVar[Similarity] = Similarity("attraction over weight under the grain's own weight", *UNDER_WEIGHT)
    source: ClassVar[str] = (
        "Kloss, Goniva, Hager, Amberger & Pirker (2012), doi 10.1504/PCFD.2012.047457 (the law of LIGGGHTS' cohesion model SJKR)"
    )

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return k at which two grains that four weights press together attract each other as much; as hard at walls.

        k = F/A,  A = π R δ(F) between grains, twice that at a wall
        """
        load = 4 * scale.weight
        k = load / (math.pi * scale.radius * scale.loaded_overlap(load))
        return {"energy_density": scale.between_grains_and_at_walls(k, k / 2)}

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > 0.0:
            # Products of sums and differences, so that nothing cancels at a small overlap δ.
            d = c.radius_i + c.radius_j - c.overlap
            square = c.overlap * (c.radius_i + d)
            if c.radius_j > 0.0:
                square = c.overlap * (2.0 * c.radius_i - c.overlap) * (2.0 * c.radius_j - c.overlap)
                square *= (d + c.radius_i + c.radius_j) / (4.0 * d * d)
            force = -math.pi * p.energy_density * square
        return Wrench(force=force * c.normal, torque=vec3(0.0))

    @ti.func
    def energy(self, p, c: ti.template()):
        """Return −k ∫ A dδ [J]."""
        top = c.radius_i + c.radius_j
        d = top - c.overlap
        half = 0.5 * (c.radius_i**2 + c.radius_j**2)
        skew = 0.25 * (c.radius_i**2 - c.radius_j**2) ** 2
        volume = half * (top - d) - (top**3 - d**3) / 12.0 + skew * (1.0 / top - 1.0 / d)
        if c.radius_j == 0.0:
            volume = c.radius_i * c.overlap**2 - c.overlap**3 / 3.0
        return -math.pi * p.energy_density * ti.select(c.overlap > 0.0, volume, 0.0)
