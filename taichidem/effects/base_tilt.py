"""An apparatus that stands out of level."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from taichidem.effects.base import Effect, Parameter, SetupEffect
from taichidem.effects.probe import ProbeScale


class BaseTilt(SetupEffect):
    """A base out of level: in the frame of the apparatus gravity leans towards an azimuth.

    g′ = g (sin θ cos φ, sin θ sin φ, −cos θ) for gravity g along −z, and the same rotation for any other direction

    Expected behaviour: a drum reads the tilt nearly one to one, a ledge that leans towards its edge empties further than
    that (3° took 9° off its slope); a heap averaged over all azimuths, a density and a discharge hardly notice it.
    """

    name: ClassVar[str] = "base_tilt"
    title: ClassVar[str] = "Apparatus out of level"
    family: ClassVar[str] = "base_tilt"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="angle",
            unit="deg",
            low=0.0,
            high=45.0,
            plausible=(0.0, 3.0),
            vanishing=0.0,
            per_pair=False,
            meaning="Angle between the apparatus' axis and the vertical.",
        ),
        Parameter(
            name="azimuth",
            unit="deg",
            low=-360.0,
            high=360.0,
            plausible=(-180.0, 180.0),
            default=0.0,
            per_pair=False,
            meaning="Horizontal direction towards which things lean, from x towards y.",
        ),
    )
    two_sided: ClassVar[bool] = True
    visible_as: ClassVar[str] = "slopes on one side steeper, on the other flatter; averaged heaps stay as they are"
    source: ClassVar[str] = "rigid rotation of the field of gravity"

    @classmethod
    def at_strength(cls, share: float, scale: ProbeScale, present: Sequence[Effect]) -> Effect:
        """Return a lean towards +x for a positive share, towards −x for a negative one."""
        return cls(angle=abs(share) * cls.strongest(scale)["angle"], azimuth=0.0 if share >= 0 else 180.0)

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return 3°, which nobody would overlook."""
        return {"angle": 3.0}

    def gravity(self, gravity: np.ndarray) -> np.ndarray:
        angle, azimuth = math.radians(self.value("angle")), math.radians(self.value("azimuth"))
        if angle == 0.0:
            return gravity
        lean = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        axis = np.cross([0.0, 0.0, -1.0], lean)  # turning −z about it leads towards the lean
        along = axis * (axis @ gravity)
        return along + math.cos(angle) * (gravity - along) + math.sin(angle) * np.cross(axis, gravity)
