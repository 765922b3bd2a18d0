"""Grains charged alike, which repel each other and are drawn to conducting walls by their images."""

import math
from typing import Any, ClassVar

import taichi as ti
from scipy.constants import epsilon_0

from taichidem.bodies import Kind
from taichidem.contact import Wrench, vec3
from taichidem.effects.base import ContactEffect, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair

BREAKDOWN = 2.7e-5  # [C/m²] at which air breaks down at a flat surface, ε₀ times 3 MV/m


class ElectrostaticCharge(ContactEffect):
    """Coulomb's force between grains of one surface charge density, and that of their images in conducting walls.

    q = σ 4 π R²;  F = q_i q_j/(4 π ε0) (1/r² − 1/r_c²) between grains, r the distance of their centres;
    F = −q²/(16 π ε0) (1/d² − 1/d_c²) at a wall, d the distance of the centre from it

    Both act up to a surface gap, the cut-off: r_c = R_i + R_j + cut-off, d_c = R + cut-off. The force is shifted by its
    value there, so that it ends without a jump and the energy is kept; a longer cut-off comes nearer to Coulomb's law.
    Every wall, also an insulating one, counts as a conductor and as an infinite plane through its nearest point, and
    only the first image counts: of the grain itself, in each wall, not of other grains nor of images in other walls.

    Expected behaviour: looser packings, grains that spread and that creep up walls and stay there. Limits: charges stay
    as they are and sit in the centres (no polarisation, no exchange at contact); cut off, a pile lacks its far field.
    Spheres only: of overlapping spheres of one body each would carry the charge of its hidden surface too, and of a
    superquadric a contact knows the curvature, which tells neither the surface nor the distance of the centre. Each
    facet of a mesh above which a grain stands is a wall of its own, so a round wall made of facets counts several times
    (twice half-way to the axis of a tube of 32): take the exact walls Cylinder, Cone, Disc and Plane. The cost grows with
    the grains in reach, a little less than (1 + cut-off/diameter)³: in a bed of 3 mm grains a step took 2, 6 and 18 times
    as long with a cut-off of 1, 3 and 6 mm.
    """

    name: ClassVar[str] = "electrostatic_charge"
    title: ClassVar[str] = "Electrostatic charge"
    stage: ClassVar[Stage] = Stage.ADHESION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="surface_charge_density",
            unit="C/m^2",
            low=0.0,
            high=1e-2,
            plausible=(0.0, 2e-5),  # below BREAKDOWN
            vanishing=0.0,
            per_pair=False,
            coarse_graining=1 / 2,  # σ² R⁴/r² ∝ s³, as the weight, where r ∝ s
            meaning="Charge over surface of every grain; its sign doesn't matter, since all have the same.",
        ),
        Parameter(
            name="cut_off",
            unit="m",
            low=0.0,
            high=1.0,
            plausible=(1e-3, 1e-2),
            default=3e-3,
            open_low=True,
            per_pair=False,
            coarse_graining=1.0,
            meaning="Surface gap beyond which nothing acts.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("strength", "cut_off")
    shapes: ClassVar[tuple[Kind, ...]] = ("sphere",)
    shapes_reason: ClassVar[str] = "its charge is that of a sphere's surface and sits in the centre of a sphere"
    conservative: ClassVar[bool] = True
    visible_as: ClassVar[str] = "grains that keep apart and that stick to walls which they have not been pressed to"
    similarity: ClassVar[Similarity] = Similarity("Coulomb's force over weight at gaps that scale", 1.0, 0.5, 3.0)
    source: ClassVar[str] = (
        "Matsusaka, Maruyama, Matsuyama & Ghadiri (2010), doi 10.1016/j.ces.2010.07.005; shifted force: Toxvaerd & Dyre "
        "(2011), doi 10.1063/1.3558787"
    )

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return σ with a repulsion π σ² R²/ε₀ of a third of a weight at touch, below the breakdown of air; cut off at R/3."""
        density = math.sqrt(scale.weight / 3 * epsilon_0 / math.pi) / scale.radius
        return {"surface_charge_density": min(density, BREAKDOWN), "cut_off": scale.radius / 3}

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 4 π σ²/ε0 [N/m²] and the cut-off [m]."""
        density = self.value("surface_charge_density", pair)
        return {"strength": 4 * math.pi * density**2 / epsilon_0, "cut_off": self.value("cut_off", pair)}

    def reach(self, pair: MaterialPair, largest_radius: float) -> float:
        """Return the cut-off [m], or 0 where there is no charge."""
        return self.value("cut_off", pair) if self.value("surface_charge_density", pair) else 0.0

    @ti.func
    def product(self, p, c: ti.template()):
        """Return q_i q_j/(4 π ε0) [N m²], of which a grain and its image, twice as far away, count a quarter."""
        square_i = c.radius_i * c.radius_i
        square_j = -0.25 * square_i
        if c.radius_j > 0.0:
            square_j = c.radius_j * c.radius_j
        return p.strength * square_i * square_j

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > -p.cut_off:
            touching = c.radius_i + c.radius_j
            near = 1.0 / (touching - c.overlap)
            far = 1.0 / (touching + p.cut_off)
            force = self.product(p, c) * (near - far) * (near + far)
        return Wrench(force=force * c.normal, torque=vec3(0.0))

    @ti.func
    def energy(self, p, c: ti.template()):
        """Return the work [J] that the force does on the way out to the cut-off."""
        distance = c.radius_i + c.radius_j - c.overlap
        limit = c.radius_i + c.radius_j + p.cut_off
        left = ti.max(limit - distance, 0.0)
        return self.product(p, c) * left * left / (distance * limit * limit)
