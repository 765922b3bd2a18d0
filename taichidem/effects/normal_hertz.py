"""Elastic spheres pressed together, with a dashpot that gives the wanted restitution."""

import math
from typing import ClassVar

import taichi as ti
from scipy.optimize import brentq

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import IN_COLLISION, ContactEffect, Parameter, Similarity, Stage
from taichidem.errors import InputError
from taichidem.materials import MaterialPair

STRONGEST = 1e3  # damping ratio; beyond it a collision takes longer than any step resolves


def damping_ratio_attractive(restitution: float) -> float:
    """Return β = −ln e / √(π² + ln² e) [1], exact for any speed when the force may become attractive.

    Source: Antypov & Elliott (2011), doi 10.1209/0295-5075/94/50004.
    """
    logarithm = math.log(restitution)
    return -logarithm / math.hypot(math.pi, logarithm)


def restitution_clipped(damping_ratio: float) -> float:
    """Return e = exp(−2 z acos z / √(1 − z²)) [1] of a contact that ends when its force would turn attractive.

    Args:
        damping_ratio: z ≥ 0; beyond 1 the arc cosine becomes its hyperbolic sister.

    Source: Schwager & Pöschel (2008), doi 10.1007/s10035-007-0065-z, linear law; the Hertz law with the √(5/6) form has
    the same closed form.
    """
    z = damping_ratio
    if abs(z - 1) < 1e-9:
        return math.exp(-2.0)
    if z < 1:
        return math.exp(-2 * z * math.acos(z) / math.sqrt(1 - z * z))
    return math.exp(-2 * z * math.acosh(z) / math.sqrt(z * z - 1))


def damping_ratio_clipped(restitution: float) -> float:
    """Return the z [1] for which `restitution_clipped` is the wanted restitution."""
    if restitution >= 1:
        return 0.0
    if restitution < restitution_clipped(STRONGEST):
        raise InputError(
            f"normal_hertz.restitution is {restitution!r}; without attraction the least that a dashpot can give here is "
            f"{restitution_clipped(STRONGEST):.1g}. Take that or more, or attraction=True."
        )
    return brentq(lambda z: restitution_clipped(z) - restitution, 0.0, STRONGEST, xtol=1e-14)


class NormalHertz(ContactEffect):
    """Hertz repulsion with viscous damping that realises a coefficient of restitution at any impact speed.

    F = 4/3 E* √R* δ^1.5 − 2 √(5/6) β √(S_n m*) v_n,  S_n = 2 E* √(R* δ)

    Near the end of a collision the dashpot may pull. With `attraction=True` (the usual law, and that of the reference
    data) it does and β = −ln e/√(π² + ln² e) is exact; with `attraction=False` the force is cut at zero and β solves
    e = exp(−2β acos β/√(1 − β²)), which is exact for that law.

    Expected behaviour: two grains rebound with e times their approach speed. Small e damps a pour within a few impacts
    and steepens heaps; e near 1 keeps grains hopping and flattens them. Limits: small overlaps (δ ≪ R), no plasticity.
    Where grains are no spheres, R* is that of the curvatures at the contact, and m* the mass that a push there moves, turning
    counted, so that e also holds for impacts beside the centre of mass.
    """

    name: ClassVar[str] = "normal_hertz"
    title: ClassVar[str] = "Hertz contact with restitution"
    family: ClassVar[str] = "normal"
    stage: ClassVar[Stage] = Stage.NORMAL
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="restitution",
            unit="1",
            low=0.0,
            high=1.0,
            open_low=True,
            plausible=(0.2, 0.97),
            vanishing=None,
            meaning="Rebound speed over approach speed of a head-on impact.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("stiffness", "damping")
    visible_as: ClassVar[str] = "how high grains bounce; with little restitution heaps are steeper and settle sooner"
    similarity: ClassVar[Similarity] = Similarity("overlap over radius, and restitution, in a collision", *IN_COLLISION)
    conservative: ClassVar[bool] = True
    source: ClassVar[str] = "Antypov & Elliott (2011), doi 10.1209/0295-5075/94/50004"

    def __init__(self, attraction: bool = True, **values) -> None:  # type: ignore[no-untyped-def]
        super().__init__(**values)
        self.attraction = attraction

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return stiffness 4/3 E* [Pa] and damping 2 √(5/6) β √(2 E*) [√Pa]."""
        e = self.value("restitution", pair)
        beta = damping_ratio_attractive(e) if self.attraction else damping_ratio_clipped(e)
        modulus = pair.youngs_modulus
        return {"stiffness": 4 / 3 * modulus, "damping": 2 * math.sqrt(5 / 6) * beta * math.sqrt(2 * modulus)}

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > 0.0:
            c.contact_radius = ti.sqrt(c.radius * c.overlap)
            c.normal_stiffness = p.stiffness * c.contact_radius
            c.elastic_force = c.normal_stiffness * c.overlap
            c.normal_damping = p.damping * ti.sqrt(c.contact_radius * c.mass)
            force = c.elastic_force - c.normal_damping * c.velocity.dot(c.normal)
            if ti.static(not self.attraction):
                force = ti.max(force, 0.0)
        c.normal_force = force
        return Wrench(force=force * c.normal, torque=vec3(0.0))

    @ti.func
    def energy(self, p, c: ti.template()):
        """Return the elastic energy 2/5 F δ [J]."""
        delta = ti.max(c.overlap, 0.0)
        return 0.4 * p.stiffness * ti.sqrt(c.radius * delta) * delta * delta
