"""Adhesion of soft elastic grains by Johnson, Kendall and Roberts, with the hysteresis of their contact."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Memory, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair

FOLD = (1 / 6) ** (1 / 3)  # y = √(a/a0) where the contact gives way under controlled displacement
DEEPEST = 3 * FOLD**4  # and the gap there, over a0²/R*
NEGLIGIBLE = 1e-150  # [m] a0³/R*²; powers of overlaps over so small an a0² would pass the largest float
SLOPE = math.sqrt(6) * FOLD
BETWEEN = (0.6316, 1.1020)  # least largest relative error of the start of `above_fold`
EQUILIBRIUM_SPACING = 1.65e-10  # [m] between the surfaces of touching solids


def zero_load_radius(work_of_adhesion: float, radius: float, modulus: float) -> float:
    """Return a0 = (9 π w R*²/(2 E*))^(1/3) [m], the contact radius of a pair that no force presses.

    Args:
        work_of_adhesion: w [J/m²].
        radius: R* [m].
        modulus: E* [Pa].
    """
    return (9 * math.pi * work_of_adhesion * radius**2 / (2 * modulus)) ** (1 / 3)


def tabor_parameter(
    work_of_adhesion: float, radius: float, modulus: float, spacing: float = EQUILIBRIUM_SPACING
) -> float:
    """Return μ_T = (R* w²/(E*² z0³))^(1/3) [1]: well above 1 `cohesion_jkr` holds, well below 1 `cohesion_dmt`.

    Args:
        work_of_adhesion: w [J/m²].
        radius: R* [m].
        modulus: E* [Pa] of the real solids; softened ones raise it.
        spacing: z0 [m], over which the surface forces reach.

    Source: Tabor (1977), doi 10.1016/0021-9797(77)90366-6.
    """
    return (radius * work_of_adhesion**2 / (modulus**2 * spacing**3)) ** (1 / 3)


class CohesionJkr(ContactEffect):
    """What the adhesion of soft elastic spheres adds to Hertz, so that both together are the JKR curve.

    F = 4 E* a³/(3 R*) − √(8 π w E* a³),  δ = a²/R* − √(2 π w a/E*),  w = 2γ for like surfaces

    A contact forms at touch, δ = 0, with F = −8/9 F_c, and lives on at negative overlap, where F passes its least value
    −F_c = −1.5 π w R*, until δ = −0.27516 a0²/R*; there it tears at −5/9 F_c. A pair that parts thus loses the work
    W = 7.092 (w⁵ R*⁴/E*²)^(1/3), and sticks when it meets more slowly than V_s = √(2 W/m*); above, e = √(1 − (V_s/V)²).

    With y = √(a/a0) the second equation is y⁴ − 2/3 y = δ R*/a0². It has a double root where the contact tears; measured
    from there, z = y − 6^(−1/3), it is z⁴ + 4 c z³ + 6 c² z² = (δ + 0.27516 a0²/R*) R*/a0², regular on the whole branch,
    and two steps of Halley from a rational start find z to round-off; the closed form is slower and cancels at large δ.

    Coulomb's cap is μ (F + 2 F_c) (Thornton & Yin), that of rolling and twisting effects likewise: this effect leaves
    F + 2 F_c as the elastic force and 4/3 E* a as the normal stiffness, which stay positive at negative overlap, and its
    own a as the contact radius. Damping is the normal effect's and acts at positive overlap only.

    Expected behaviour: grains cling, small ones more; slow impacts stick, fast ones don't notice. Steeper heaps and
    drums, lumps, blocked outlets. Limits: spheres on spheres or flats, a Tabor parameter well above 1 (see
    `tabor_parameter`), F_c that does not press grains deeper than small overlaps. A contact at negative overlap that
    rolls over the edge of a mesh is a new one and forms at touch. Of a superquadric R* is that of the curvatures at the
    contact, so that its flat sides hold more firmly; one flatter than the sphere about the grain may tear early, at the
    gap of that sphere. Of a body of several spheres each holds for itself.
    """

    name: ClassVar[str] = "cohesion_jkr"
    title: ClassVar[str] = "Adhesion of soft spheres (JKR)"
    family: ClassVar[str] = "cohesion"
    stage: ClassVar[Stage] = Stage.ADHESION
    needs: ClassVar[Mapping[str, tuple[str, ...]]] = {"normal": ("normal_hertz", "normal_viscoelastic")}
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="work_of_adhesion",
            unit="J/m^2",
            low=0.0,
            high=1e3,
            plausible=(0.0, 1.0),
            vanishing=0.0,
            # Keeps a0²/R* ∝ s^(5/3), as the overlap under the grain's weight, and w R* ∝ s³.
            coarse_graining=2.0,
            meaning="Energy per area to part the surfaces, twice the surface energy where they are alike.",
        ),
    )
    # R* for which the other one holds, 0 while apart; and a0, whose cube root is not drawn again at every step.
    memory: ClassVar[tuple[Memory, ...]] = (
        Memory("joined_radius", size=1, odd=False),
        Memory("zero_load_radius", size=1, odd=False),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("pull_off", "softness", "stiffness")
    visible_as: ClassVar[str] = (
        "grains that cling to each other and to walls, the smaller the more; slow impacts that stick"
    )
    similarity: ClassVar[Similarity] = Similarity("pull-off force over weight", *UNDER_WEIGHT)
    source: ClassVar[str] = (
        "Johnson, Kendall & Roberts (1971), doi 10.1098/rspa.1971.0141; friction: Thornton & Yin (1991), "
        "doi 10.1016/0032-5910(91)80178-L"
    )

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return w with a pull-off 3/2 π w R* of one and a half weights, between grains as at walls."""
        w = 1.5 * scale.weight / (1.5 * math.pi * scale.radius / 2)
        return {"work_of_adhesion": scale.between_grains_and_at_walls(w, w / 2)}

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return F_c/R* = 1.5 π w [N/m], a0³/R*² = 9 π w/(2 E*) [m] and 4/3 E* [Pa]."""
        energy = self.value("work_of_adhesion", pair)
        return {
            "pull_off": 1.5 * math.pi * energy,
            "softness": zero_load_radius(energy, 1.0, pair.youngs_modulus) ** 3,
            "stiffness": 4 / 3 * pair.youngs_modulus,
        }

    def reach(self, pair: MaterialPair, largest_radius: float) -> float:
        """Return the gap [m] at which the largest grain tears off a wall, 0.27516 a0²/R*; it grows with R*."""
        a0 = zero_load_radius(self.value("work_of_adhesion", pair), largest_radius, pair.youngs_modulus)
        return DEEPEST * a0**2 / largest_radius

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        added = 0.0
        if p.softness > NEGLIGIBLE and (c.overlap >= 0.0 or m.joined_radius > 0.0):
            if m.joined_radius != c.radius:
                m.joined_radius = c.radius
                m.zero_load_radius = ti.pow(p.softness * c.radius * c.radius, 1.0 / 3.0)
            a0 = m.zero_load_radius
            beyond = c.overlap * (c.radius / (a0 * a0)) + DEEPEST
            if beyond < 0.0:
                m.joined_radius = 0.0
            else:
                y = FOLD + self.above_fold(beyond)
                cube = y * y * y
                pull_off = p.pull_off * c.radius
                force = 4.0 * pull_off * cube * (cube - 1.0)
                added = force - c.elastic_force
                c.friction_load = c.friction_load + added + 2.0 * pull_off
                c.elastic_force = force + 2.0 * pull_off
                c.contact_radius = a0 * y * y
                c.normal_stiffness = p.stiffness * c.contact_radius
        return Wrench(force=added * c.normal, torque=vec3(0.0))

    @ti.func
    def above_fold(self, beyond):
        """Return the z ≥ 0 with z⁴ + 4 c z³ + 6 c² z² = `beyond`, to round-off for any number from 0."""
        # Right in both limits, z → √(beyond/(6 c²)) and z → beyond^(1/4) − c; two fitted numbers bring it within 0.1 %
        # between them, which two steps of third order take to round-off.
        root = ti.sqrt(beyond)
        q = ti.sqrt(root)
        z = root * (BETWEEN[0] + (BETWEEN[1] + q) * q)
        z /= SLOPE * BETWEEN[0] + (SLOPE * BETWEEN[1] + (BETWEEN[1] + FOLD + q) * q) * q
        for _ in ti.static(range(2)):
            value = ((z + 4.0 * FOLD) * z + 6.0 * FOLD * FOLD) * z * z - beyond
            slope = 4.0 * z * ((z + 3.0 * FOLD) * z + 3.0 * FOLD * FOLD)
            bend = 12.0 * (z + FOLD) * (z + FOLD)
            z -= 2.0 * value * slope / ti.max(2.0 * slope * slope - value * bend, 1e-300)
        return z
