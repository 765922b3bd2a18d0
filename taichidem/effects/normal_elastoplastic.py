"""Spheres that yield: elastic up to a limiting contact pressure, then plastic, with a memory of the largest overlap."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import IN_COLLISION, ContactEffect, Effect, Memory, Parameter, Similarity, Stage
from taichidem.effects.normal_hertz import damping_ratio_attractive, damping_ratio_clipped
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair

NEVER = 1e9  # overlap over radius at which a contact yields that doesn't
LEAST_RATIO = 1e-4  # E*/p_y below which no contact yields; δ_y is 1e8 R* there, and far below it no float


class NormalElastoplastic(ContactEffect):
    """Hertz repulsion whose contact pressure is limited to p_y: Thornton & Ning's elastic–plastic contact without adhesion.

    loading    F = 4/3 E* √R* δ^1.5                  up to δ_y = (π p_y/(2 E*))² R*
               F = F_y + π p_y R* (δ − δ_y)          beyond
    unloading  F = 4/3 E* √R_p (δ − δ_p)^1.5,  R_p = R* F_elastic(δ_m)/F_m,  δ_p = δ_m − R* δ_m/R_p

    from the largest overlap δ_m with the force F_m; so also while loading again, until δ_m is passed. An impact yields above
    V_y = (π/(2 E*))² √(8 π R*³/(15 m*)) p_y^2.5, and then with q = V_y/V

    e = √(6√3/5) √(1 − q²/6) (q/(q + 2 √(6/5 − q²/5)))^¼,  at large speed 1.18 q^¼

    It is taken rather than Walton & Braun's two linear springs because it is Hertz below yield and its one parameter belongs
    to the material. p_y is given as E*/p_y, a pure number: 0 never yields, and it stays as it is where a modulus is softened
    (p_y itself would have to be softened with E, or grains would never yield). Metals 50 to 300, polymers and glass 5 to 30;
    p_y is 1.6 to 2.8 times the uniaxial yield stress.

    A dashpot 2 √(5/6) β √(2 E* a m*), with the contact radius a of the moment, gives the `restitution` of impacts below
    yield; 1 by default. `attraction=False` cuts the force at zero, as in `normal_hertz`. Later effects see
    a = √(R_p (δ − δ_p)), which doesn't jump where unloading begins, and 4/3 E* a, the secant stiffness over δ − δ_p.

    Expected behaviour: hard impacts bounce less, e ∝ V^(−¼); settled grains keep flats, press deeper and give little back
    when unloaded. Limits: small overlaps, no hardening, no adhesion; a contact that opened begins as new;
    R* and m* where grains are no spheres as for `normal_hertz`.
    """

    name: ClassVar[str] = "normal_elastoplastic"
    title: ClassVar[str] = "Elastic–plastic contact"
    family: ClassVar[str] = "normal"
    stage: ClassVar[Stage] = Stage.NORMAL
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="modulus_over_yield_pressure",
            unit="1",
            low=0.0,
            high=1e5,
            plausible=(0.0, 100.0),
            vanishing=0.0,
            meaning="Effective modulus E* over the limiting contact pressure p_y; 0 never yields.",
        ),
        Parameter(
            name="restitution",
            unit="1",
            low=0.0,
            high=1.0,
            open_low=True,
            plausible=(0.2, 1.0),
            vanishing=1.0,
            default=1.0,
            meaning="Rebound speed over approach speed of a head-on impact that doesn't yield.",
        ),
    )
    memory: ClassVar[tuple[Memory, ...]] = (Memory("largest_overlap", size=1, odd=False),)
    coefficients: ClassVar[tuple[str, ...]] = ("stiffness", "yield_overlap", "plastic_slope", "damping")
    visible_as: ClassVar[str] = "restitution falls with speed to the power −1/4; pressed grains keep flats"
    similarity: ClassVar[Similarity] = Similarity(
        "overlap over radius, yield speed and restitution in a collision", *IN_COLLISION
    )
    source: ClassVar[str] = (
        "Thornton & Ning (1998), doi 10.1016/S0032-5910(98)00099-0; e: Thornton (1997), J. Appl. Mech. 64, 383"
    )

    def __init__(self, attraction: bool = True, **values) -> None:  # type: ignore[no-untyped-def]
        super().__init__(**values)
        self.attraction = attraction

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return E*/p_y = 50, at which impacts of some decimetres per second leave flats."""
        return {"modulus_over_yield_pressure": 50.0}

    @classmethod
    def at_strength(cls, share: float, scale: ProbeScale, present: Sequence[Effect]) -> Effect:
        """Return the effect with the restitution of the law that it replaces, for impacts that don't yield."""
        replaced = next((effect.values for effect in present if effect.family == cls.family), {})
        return super().at_strength(share, scale, present).with_values(restitution=replaced.get("restitution", 1.0))

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 4/3 E* [Pa], δ_y/R* [1], π p_y [Pa] and 2 √(5/6) β √(2 E*) [√Pa]."""
        modulus, ratio = pair.youngs_modulus, self.value("modulus_over_yield_pressure", pair)
        yields = ratio > LEAST_RATIO
        e = self.value("restitution", pair)
        beta = damping_ratio_attractive(e) if self.attraction else damping_ratio_clipped(e)
        return {
            "stiffness": 4 / 3 * modulus,
            "yield_overlap": (math.pi / (2 * ratio)) ** 2 if yields else NEVER,
            "plastic_slope": math.pi * modulus / ratio if yields else 0.0,
            "damping": 2 * math.sqrt(5 / 6) * beta * math.sqrt(2 * modulus),
        }

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > 0.0:
            m.largest_overlap = ti.max(m.largest_overlap, c.overlap)
            deepest = m.largest_overlap
            elastic = ti.min(deepest, p.yield_overlap * c.radius)
            largest_force = p.stiffness * ti.sqrt(c.radius * elastic) * elastic
            largest_force += p.plastic_slope * c.radius * (deepest - elastic)
            widest = ti.sqrt(c.radius * deepest)
            # Of the largest overlap, this much springs back; below yield it is all of it.
            springs_back = largest_force / (p.stiffness * widest)
            left = ti.max(c.overlap - (deepest - springs_back), 0.0)
            c.contact_radius = widest * ti.sqrt(left / springs_back)
            c.normal_stiffness = p.stiffness * c.contact_radius
            c.elastic_force = c.normal_stiffness * left
            c.normal_damping = p.damping * ti.sqrt(c.contact_radius * c.mass)
            force = c.elastic_force - c.normal_damping * c.velocity.dot(c.normal)
            if ti.static(not self.attraction):
                force = ti.max(force, 0.0)
        else:
            m.largest_overlap = 0.0  # where another effect keeps the memory across a gap
        c.normal_force = force
        return Wrench(force=force * c.normal, torque=vec3(0.0))
