"""Spheres of a viscoelastic material pressed together: restitution falls with speed."""

from collections.abc import Sequence
from typing import Any, ClassVar

import taichi as ti
from scipy.optimize import brentq

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import IN_COLLISION, ContactEffect, Effect, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair

SHARE = 1.5  # the elastic force is ∝ δ^1.5; its slope times A is the damping

LEAST_RESTITUTION = 0.1  # for which a dissipation time is looked for


def restitution(x: float) -> float:
    """Return the restitution at x = 1.5 A (4/3 E* √R*/m*)^(2/5) V^(1/5), by the Padé formula of Müller & Pöschel (2011)."""
    v = x**0.5
    return (1 + 0.501086 * v) / (1 + 0.501086 * v + 1.15345 * x + 0.577977 * v**3 + 0.532178 * x**2)


def dissipation_time(e: float, pair: MaterialPair, mass: float, radius: float, speed: float) -> float:
    """Return the A [s] with which an impact of reduced mass [kg] and radius [m] at a speed [m/s] has the restitution e."""
    if e >= 1.0:
        return 0.0
    x = brentq(lambda x: restitution(x) - max(e, LEAST_RESTITUTION), 0.0, 1e3)
    return x / (SHARE * (4 / 3 * pair.youngs_modulus * radius**0.5 / mass) ** 0.4 * speed**0.2)


class NormalViscoelastic(ContactEffect):
    """Hertz repulsion with the damping that follows from viscosity of the material, by a dissipation time A.

    F = 4/3 E* √R* (δ^1.5 + 1.5 A √δ δ̇)

    Restitution falls with speed, e = 1 − 1.15345 x + 0.79826 x² …, x = 1.5 A (4/3 E* √R*/m*)^(2/5) V^(1/5). With
    `attraction=True` the damping may pull until the undeformed surfaces part; with `attraction=False` the force is cut at
    zero, as dry surfaces can't pull. Both endings share the start of the series; the Padé formula of Müller & Pöschel holds for
    the cut one. For a softened modulus E′ take A′ = A (E/E′)^(2/5), which keeps e at every speed.

    Expected behaviour: gentle impacts bounce nearly elastically, hard ones less; a pour is damped by its fast impacts and
    goes on trembling at the end. Limits: small overlaps, deformation slow beside sound, no plasticity, no adhesion;
    R* and m* where grains are no spheres as for `normal_hertz`.
    """

    name: ClassVar[str] = "normal_viscoelastic"
    title: ClassVar[str] = "Viscoelastic contact"
    family: ClassVar[str] = "normal"
    stage: ClassVar[Stage] = Stage.NORMAL
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="dissipation_time",
            unit="s",
            low=0.0,
            high=1.0,
            plausible=(0.0, 5e-5),
            vanishing=0.0,
            # Duration of a collision of given speed.
            coarse_graining=1.0,
            meaning="Viscosity of the material over its elasticity; e is low where it comes near the duration of contact.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("stiffness", "damping_time")
    conservative: ClassVar[bool] = True
    all_or_nothing: ClassVar[bool] = True
    visible_as: ClassVar[str] = "fast impacts bounce relatively less than gentle ones"
    similarity: ClassVar[Similarity] = Similarity(
        "overlap over radius, and restitution at each speed, in a collision", *IN_COLLISION
    )
    source: ClassVar[str] = (
        "Brilliantov, Spahn, Hertzsch & Pöschel (1996), doi 10.1103/PhysRevE.53.5382; e: Schwager & Pöschel (2008), "
        "doi 10.1103/PhysRevE.78.051304, Müller & Pöschel (2011), doi 10.1103/PhysRevE.84.021302"
    )

    def __init__(self, attraction: bool = True, **values) -> None:  # type: ignore[no-untyped-def]
        super().__init__(**values)
        self.attraction = attraction

    @classmethod
    def at_strength(cls, share: float, scale: ProbeScale, present: Sequence[Effect]) -> Effect:
        """Return the law with which impacts at the tests' speed keep the restitution of the law that it replaces."""
        replaced = next((e for e in present if e.family == cls.family and "restitution" in e.values), None)
        if replaced is None:
            return super().at_strength(share, scale, present)
        mass = scale.weight / scale.gravity
        times: dict[str, Any] = {}
        for other in scale.materials:
            pair = MaterialPair(scale.materials[0], other)
            half = 2 if other is scale.materials[0] else 1  # two grains have half the mass and radius of one at a wall
            e = replaced.value("restitution", pair)
            time = dissipation_time(e, pair, mass / half, scale.radius / half, scale.speed)
            times[f"{pair.first.name}-{other.name}"] = share * time
        return cls(dissipation_time=times)

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return stiffness 4/3 E* [Pa] and 1.5 A [s]."""
        return {
            "stiffness": 4 / 3 * pair.youngs_modulus,
            "damping_time": SHARE * self.value("dissipation_time", pair),
        }

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > 0.0:
            c.contact_radius = ti.sqrt(c.radius * c.overlap)
            c.normal_stiffness = p.stiffness * c.contact_radius
            c.elastic_force = c.normal_stiffness * c.overlap
            c.normal_damping = p.damping_time * c.normal_stiffness
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
