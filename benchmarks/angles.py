"""Angles of repeated heaps: mean, standard uncertainty, and how far two of them lie apart."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Angles:
    """One kind of heap, poured several times.

    Args:
        name: what was poured.
        angles: of repose [deg], one per seed.
        seconds: of wall time from the scenes to the measured angles, compilation apart.
        in_cup: grains left on the cup, one per seed.
        processor: time of the processors in all that [s], which other work on the machine changes little.
    """

    name: str
    angles: tuple[float, ...]
    seconds: float
    in_cup: tuple[int, ...] = ()
    processor: float = math.nan

    @property
    def mean(self) -> float:
        return float(np.mean(self.angles))

    @property
    def sd(self) -> float:
        """Standard deviation from seed to seed [deg]; NaN of a single heap."""
        return float(np.std(self.angles, ddof=1)) if len(self.angles) > 1 else math.nan

    @property
    def u(self) -> float:
        """Standard uncertainty of the mean, sd/√n [deg]."""
        return self.sd / math.sqrt(len(self.angles))

    def as_dict(self) -> dict[str, Any]:
        """Return plain values; None where there is no number."""
        numbers = {"processor": self.processor, "mean": self.mean, "sd": self.sd, "u": self.u}
        return {**vars(self), **{k: None if math.isnan(v) else v for k, v in numbers.items()}}

    @property
    def text(self) -> str:
        """Mean ± standard uncertainty."""
        return f"{self.mean:.2f}" + ("" if math.isnan(self.u) else f" ± {self.u:.2f}")


@dataclass(frozen=True)
class Difference:
    """Mean of the second heaps minus that of the first; a kind poured once takes the other's scatter for its own."""

    first: Angles
    second: Angles

    @property
    def value(self) -> float:
        """[deg]."""
        return self.second.mean - self.first.mean

    @property
    def u(self) -> float:
        """Combined standard uncertainty √(u₁² + u₂²) [deg]."""
        known = [heaps.sd for heaps in (self.first, self.second) if not math.isnan(heaps.sd)]
        if not known:
            return math.nan
        sds = [known[0] if math.isnan(heaps.sd) else heaps.sd for heaps in (self.first, self.second)]
        return math.hypot(
            *(sd / math.sqrt(len(h.angles)) for sd, h in zip(sds, (self.first, self.second), strict=True))
        )

    @property
    def standardised(self) -> float:
        """|difference| / u."""
        return abs(self.value) / self.u
