"""Grains of several sizes."""

from typing import Any, ClassVar

import numpy as np

from taichidem.effects.base import Parameter, SetupEffect
from taichidem.effects.probe import ProbeScale

CLASSES = 5


class SizeSpread(SetupEffect):
    """Five sizes in equal numbers, evenly spaced about a middle one, with the mean volume of the nominal grain.

    R_k = R c (1 + h x_k),  x = −1, −½, 0, ½, 1,  c³ Σ (1 + h x_k)³ / 5 = 1

    Expected behaviour: the packing grows denser, since small grains fill the gaps of large ones; angles and discharge
    hardly change.
    """

    name: ClassVar[str] = "size_spread"
    title: ClassVar[str] = "Spread of grain sizes"
    family: ClassVar[str] = "size_spread"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="half_width",
            unit="1",
            low=0.0,
            high=0.7,
            plausible=(0.0, 0.4),
            vanishing=0.0,
            per_pair=False,
            meaning="Half the range of radii over the middle one.",
        ),
    )
    visible_as: ClassVar[str] = "a denser packing at nearly the same angles"
    source: ClassVar[str] = "five evenly spaced classes of equal number and given mean volume"

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return radii of ±35 %."""
        return {"half_width": 0.35}

    def relative_sizes(self) -> tuple[float, ...]:
        half_width = self.value("half_width")
        if half_width == 0.0:
            return (1.0,)
        sizes = 1 + half_width * np.linspace(-1, 1, CLASSES)
        return tuple((sizes / np.cbrt(np.mean(sizes**3))).tolist())
