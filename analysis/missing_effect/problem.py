"""What a search for a missing effect knows: measurements, parameters that may move, and candidate effects."""

from __future__ import annotations

from collections.abc import Sequence
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
            raise AnalysisError(
                f"There are {m} responses with {len(self.tests)} tests, {len(self.measured)} values and {len(self.u)} "
                "uncertainties. At least one response is needed, and one of each for every response."
            )
        _check_names(self.labels, "Responses")
        _check_names([p.key for p in self.parameters], "Parameters")
        _check_names([c.name for c in self.candidates], "Candidates")
        for label, value, u in zip(self.labels, self.measured.tolist(), self.u.tolist(), strict=True):
            if not (np.isfinite(value) and np.isfinite(u) and u > 0):
                raise AnalysisError(
                    f"{label}: measured {value:g} with u = {u:g}. A value must be finite and its standard uncertainty above 0."
                )
        for parameter in self.parameters:
            _check_parameter(parameter)
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
        """Which parameters are coded by their logarithm (p,).

        Those whose range spans more than a factor WIDE, unless 0 or less is believed of them, which has none.
        """
        believed = np.array([p.believed for p in self.parameters], float)
        return (self.low > 0) & (self.high > WIDE * self.low) & (believed > 0)

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


def _check_names(names: Sequence[str], what: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise AnalysisError(f"{what} need different names; given more than once: {', '.join(twice)}.")


def _check_parameter(p: Parameter) -> None:
    if not (np.isfinite(p.low) and np.isfinite(p.high) and p.low < p.high):
        raise AnalysisError(
            f"{p.key}: range from {p.low:g} to {p.high:g}. It must be finite and rise; a parameter that can't move "
            "is left out instead."
        )
    if not np.isfinite(p.believed):
        raise AnalysisError(f"{p.key}: believed {p.believed:g}. Give the number that the model holds now.")
    if p.value is not None and not (np.isfinite(p.value) and p.u is not None and np.isfinite(p.u) and p.u > 0):
        raise AnalysisError(
            f"{p.key}: measured directly as {p.value:g} with u = {p.u}. The value must be finite and u above 0; without a "
            "direct measurement leave both out."
        )
