"""A drag that grows in proportion to speed."""

from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, BodyEffect, Parameter, Similarity
from taichidem.effects.probe import ProbeScale


class AirDragLinear(BodyEffect):
    """A drag in proportion to speed, with one coefficient for every grain, in a fluid at rest; no buoyancy.

    F = −c v

    In creeping flow c = 6 π μ R (Stokes). As a description with a fitted constant it looks like a drag that is in truth
    quadratic at the speed where c = ½ ρ_f C_D π R² |v|. A coarse grain that stands for s³ grains has s³ times their
    coefficient.

    Expected behaviour: speeds die away as exp(−c t/m), falls come to the terminal velocity m g/c. Limits: exact for
    Re = 2 ρ_f R |v|/μ below about 0.1; grains of several sizes share the coefficient; `air_drag` holds the correlation for
    every speed and size.
    """

    name: ClassVar[str] = "air_drag_linear"
    title: ClassVar[str] = "Drag in proportion to speed"
    family: ClassVar[str] = "drag"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="coefficient",
            unit="kg/s",
            low=0.0,
            high=1e6,
            plausible=(0.0, 1e-3),
            vanishing=0.0,
            per_pair=False,
            coarse_graining=3.0,
            meaning="Drag on a grain over its speed; plausible for grains of millimetres, and more for a ball.",
        ),
    )
    visible_as: ClassVar[str] = "falls and flights slow down, slow ones in the same share as fast ones"
    similarity: ClassVar[Similarity] = Similarity("drag over weight at the same speed", *UNDER_WEIGHT)
    source: ClassVar[str] = (
        "Stokes (1851), Trans. Cambridge Philos. Soc. 9, 8; the limit of creeping flow in "
        "Brown & Lawler (2003), doi 10.1061/(ASCE)0733-9372(2003)129:3(222)"
    )

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return a drag as large as the weight at the speed of the tests."""
        return {"coefficient": scale.weight / scale.speed}

    @ti.func
    def wrench(self, p, b: ti.template()):
        return Wrench(force=-p.coefficient * b.velocity, torque=vec3(0.0))
