"""Friction that falls once a contact slides."""

from collections.abc import Mapping
from typing import ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Parameter, Similarity, Stage
from taichidem.materials import MaterialPair


class KineticFriction(ContactEffect):
    """A coefficient of friction that falls from the static to the kinetic one as a contact slides faster (Stribeck).

    μ(v) = μ_s (r + (1 − r) exp(−|v_t|/v_s)), with μ_s of the tangential effect and v_t the speed of slip

    It makes no force: it lowers the cap of the tangential effect. A contact that sticks has no slip but the trembling of
    its spring, so its cap is the static one.

    Expected behaviour: stick and slip; avalanches that run out farther and heaps that depend on how they were made; a
    block on a slope between tan⁻¹ rμ_s and tan⁻¹ μ_s stays if it rests and keeps going if it is fast enough. Limits: no
    strengthening with time of rest, no viscous branch at high speed.
    """

    name: ClassVar[str] = "kinetic_friction"
    title: ClassVar[str] = "Friction that falls with sliding speed"
    family: ClassVar[str] = "kinetic"
    needs: ClassVar[Mapping[str, tuple[str, ...]]] = {"tangential": ()}
    stage: ClassVar[Stage] = Stage.SLIDING
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="kinetic_ratio",
            unit="1",
            low=0.0,
            high=1.0,
            open_low=True,
            plausible=(0.5, 1.0),
            vanishing=1.0,
            meaning="Coefficient of friction of fast sliding over the static one.",
        ),
        Parameter(
            name="stribeck_velocity",
            unit="m/s",
            low=0.0,
            high=1e3,
            open_low=True,
            plausible=(1e-3, 0.1),
            default=0.01,
            meaning="Speed of slip at which 63 % of the fall is done.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("fall", "slowness")
    visible_as: ClassVar[str] = "stick and slip; avalanches that start late and run far"
    similarity: ClassVar[Similarity] = Similarity("friction over weight at equal speed of slip", *UNDER_WEIGHT)
    source: ClassVar[str] = (
        "Armstrong-Hélouvry, Dupont & Canudas de Wit (1994), doi 10.1016/0005-1098(94)90209-7, "
        "Stribeck curve in exponential form"
    )

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 1 − r [1] and 1/v_s [s/m]."""
        return {
            "fall": 1 - self.value("kinetic_ratio", pair),
            "slowness": 1 / self.value("stribeck_velocity", pair),
        }

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        if c.contact_radius > 0.0 or c.friction_load > 0.0:  # an adhesive contact may live at negative overlap
            slip = c.velocity - c.velocity.dot(c.normal) * c.normal
            c.friction_loss = p.fall * (1.0 - ti.exp(-p.slowness * slip.norm()))
        return Wrench(force=vec3(0.0), torque=vec3(0.0))
