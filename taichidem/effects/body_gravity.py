"""Weight."""

from typing import ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, BodyEffect, Parameter, Similarity


def _component(name: str, default: float) -> Parameter:
    return Parameter(
        name=name,
        unit="m/s^2",
        low=-1e4,
        high=1e4,
        plausible=(-10.0, 10.0),
        vanishing=0.0,
        default=default,
        per_pair=False,
        meaning=f"Component {name} of the acceleration of free fall.",
    )


class BodyGravity(BodyEffect):
    """A uniform field of acceleration.

    F = m (x, y, z), by default (0, 0, −9.81) m/s².

    Expected behaviour: things fall.
    """

    name: ClassVar[str] = "body_gravity"
    title: ClassVar[str] = "Gravity"
    family: ClassVar[str] = "gravity"
    parameters: ClassVar[tuple[Parameter, ...]] = (_component("x", 0.0), _component("y", 0.0), _component("z", -9.81))
    visible_as: ClassVar[str] = "things fall"
    similarity: ClassVar[Similarity] = Similarity("acceleration of free fall", *UNDER_WEIGHT)
    source: ClassVar[str] = "CGPM 1901 for 9.80665; benches here use 9.81 m/s²"

    @ti.func
    def wrench(self, p, b: ti.template()):
        b.gravity = vec3(p.x, p.y, p.z)
        return Wrench(force=b.mass * b.gravity, torque=vec3(0.0))
