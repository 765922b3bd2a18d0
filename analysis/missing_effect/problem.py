"""What a search for a missing effect knows: measurements, parameters that may move, and candidate effects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from analysis.errors import AnalysisError

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]

NO_EFFECT = -1
WIDE = 3.0  # ratio of the ends of a range; friction from 0.1 to 0.6 does most of what it does below 0.3


@dataclass(frozen=True)
class Parameter:
    """A number of the model that may be re-calibrated.

    Args:
        key: its name.
        low, high: range that is believed, in `unit`.
        believed: what the model holds now.
        value, u: what a direct measurement gave with its standard uncertainty, or None.
        unit: for people.
        test: the one test that it belongs to, as a release height does; "" for what all tests share.
    """

    key: str
    low: float
    high: float
    believed: float
    value: float | None = None
    u: float | None = None
    unit: str = ""
    test: str = ""


@dataclass(frozen=True)
class Candidate:
    """An effect that the model may lack; its strength is a share β of the strongest setting that was simulated.

    Args:
        name: of the effect.
        two_sided: True if β may be negative.
        all_or_nothing: True if it was simulated at β = 1 only.
        title: for people.
        parameter, unit: what its strength is measured by.
        at_zero, at_full: value of that parameter at β = 0 and β = 1.
    """

    name: str
    two_sided: bool = False
    all_or_nothing: bool = False
    title: str = ""
    parameter: str = "share"
    unit: str = "1"
    at_zero: float = 0.0
    at_full: float = 1.0

    def strength(self, share: float) -> float:
        """Return the value of the measuring parameter at a share."""
        return self.at_zero + share * (self.at_full - self.at_zero)


@dataclass(frozen=True)
class Problem:
    """Measurements D_i ± u_i of responses, parameters θ with ranges, candidate effects.

    Parameters measured directly count as further measurements.

    Args:
        labels: name of each response, length m.
        tests: the test that each response belongs to, length m; what is left out together.
        measured, u: D and its standard uncertainty (m,).
        parameters: p of them.
        candidates: K of them.

    Raises:
        AnalysisError: numbers that do not fit together, u not above 0, or no more measurements than parameters.
    """

    labels: tuple[str, ...]
    tests: tuple[str, ...]
    measured: Array
    u: Array
    parameters: tuple[Parameter, ...]
    candidates: tuple[Candidate, ...]

    def __post_init__(self) -> None:
        m = len(self.labels)
        if not (len(self.tests) == len(self.measured) == len(self.u) == m > 0):
            raise AnalysisError(f"{m} responses need a test, a value and an uncertainty each; at least one is needed.")
        if not (np.all(np.isfinite(self.measured)) and np.all(np.isfinite(self.u)) and np.all(self.u > 0)):
            raise AnalysisError("Measured values must be finite and their standard uncertainties above 0.")
        if self.count <= len(self.parameters):
            raise AnalysisError(
                f"There are {self.count} measurements for {len(self.parameters)} parameters that may be re-calibrated. With as "
                "many knobs as measurements a perfect fit proves nothing: measure more, or fix parameters by removing "
                "them from [calibrate]."
            )

    @cached_property
    def direct(self) -> tuple[int, ...]:
        """Numbers of the parameters that were measured directly."""
        return tuple(j for j, p in enumerate(self.parameters) if p.value is not None)

    @property
    def count(self) -> int:
        """Number of measurements, those of parameters included."""
        return len(self.labels) + len(self.direct)

    @cached_property
    def low(self) -> Array:
        """Lower ends of the ranges (p,)."""
        return np.array([p.low for p in self.parameters], float)

    @cached_property
    def high(self) -> Array:
        """Upper ends of the ranges (p,)."""
        return np.array([p.high for p in self.parameters], float)

    @cached_property
    def direct_values(self) -> tuple[Array, Array]:
        """Values and uncertainties of the direct measurements, in the parameters' units."""
        value = np.array([self.parameters[j].value for j in self.direct], float)
        return value, np.array([self.parameters[j].u for j in self.direct], float)

    @cached_property
    def logarithmic(self) -> Flags:
        """Which parameters are coded by their logarithm: those whose range spans more than a factor WIDE (p,)."""
        return (self.low > 0) & (self.high > WIDE * self.low)

    @cached_property
    def _ends(self) -> tuple[Array, Array]:
        """Ends of the ranges, as logarithms where parameters are coded so."""
        safe = np.where(self.logarithmic, self.low, 1.0), np.where(self.logarithmic, self.high, 1.0)
        return tuple(np.where(self.logarithmic, np.log(s), v) for s, v in zip(safe, (self.low, self.high), strict=True))  # type: ignore[return-value]

    def coded(self, natural: Array) -> Array:
        """Return parameters coded −1 at the lower end of their range and +1 at the upper."""
        values, (low, high) = np.asarray(natural, float), self._ends
        with np.errstate(invalid="ignore", divide="ignore"):
            scaled = np.where(self.logarithmic, np.log(np.where(self.logarithmic, values, 1.0)), values)
        return 2 * (scaled - low) / (high - low) - 1

    def natural(self, coded: Array) -> Array:
        """Return parameters in their own units."""
        low, high = self._ends
        scaled = low + (np.asarray(coded, float) + 1) / 2 * (high - low)
        return np.where(self.logarithmic, np.exp(np.where(self.logarithmic, scaled, 0.0)), scaled)

    def natural_slope(self, coded: Array) -> Array:
        """Return the derivative of `natural` by the coded values (p,)."""
        low, high = self._ends
        return (high - low) / 2 * np.where(self.logarithmic, self.natural(coded), 1.0)

    def number(self, name: str) -> int:
        """Return the number of a candidate."""
        return [c.name for c in self.candidates].index(name)
