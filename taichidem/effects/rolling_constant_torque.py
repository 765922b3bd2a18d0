"""Rolling resistance as a couple of constant size against the relative rotation."""

from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale


class RollingConstantTorque(ContactEffect):
    """Directional constant torque (model A of Ai et al.).

    M = −μ_r R* F_el ω_r/|ω|,  ω = ω_i − ω_j,  ω_r = ω without its part along the normal,  F_el the elastic normal force

    The couple of size μ_r R* F_el opposes the whole relative spin, and its part along the normal, which would be twisting
    resistance, is left out; so a contact that twists as well resists rolling less. LIGGGHTS does the same. With a couple
    that opposes ω_r alone a drum at 20 rpm came out 1.6° steeper (μ_r 0.12, four seeds).

    Expected behaviour: a rolling ball slows down at (5/7) μ_r g; heaps and drums grow steeper. Limits: the couple has
    no memory, so a grain at rest trembles around its sign change and creeps on a slope; use `rolling_spring_dashpot`
    where grains must come to rest. It stands for what keeps spheres from rolling as real grains do not: grains whose form is
    simulated need less of it, since their form does that itself. There R* is that of the curvatures at the contact.
    """

    name: ClassVar[str] = "rolling_constant_torque"
    title: ClassVar[str] = "Rolling resistance, constant torque"
    family: ClassVar[str] = "rolling"
    stage: ClassVar[Stage] = Stage.ROLLING
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="rolling_friction",
            unit="1",
            low=0.0,
            high=10.0,
            plausible=(0.0, 0.4),
            vanishing=0.0,
            meaning="Rolling couple over normal force times effective radius.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("rolling_friction",)
    visible_as: ClassVar[str] = "steeper heaps and drums, grains that stop rolling on the flat"
    similarity: ClassVar[Similarity] = Similarity("rolling couple over weight times radius", *UNDER_WEIGHT)
    source: ClassVar[str] = "Ai, Chen, Rotter & Ooi (2011), doi 10.1016/j.powtec.2010.09.030, model A"

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return μ_r = 0.2, at which spheres roll hardly better than angular grains."""
        return {"rolling_friction": 0.2}

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        spin = c.spin_i - c.spin_j
        size = spin.dot(spin)
        couple = vec3(0.0)
        if size > 0.0:
            rolling = spin - spin.dot(c.normal) * c.normal
            couple = (-p.rolling_friction * c.radius * c.elastic_force / ti.sqrt(size)) * rolling
        return Wrench(force=vec3(0.0), torque=couple)
