"""Compare a simulated quantity with its measurement: E = S − D against the validation uncertainty.

Terms as in ASME V&V 20: simulation result S, measured value D, comparison error E = S − D, validation
uncertainty u_val² = u_D² + u_S² + u_num² + u_input². u_S is the scatter of the mean over seeds, which a
granular simulation has and a deterministic one hasn't.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

from analysis.comparison_text import advice_text, verdict_text
from analysis.errors import AnalysisError

CONFIDENCE = 0.95


@dataclass(frozen=True)
class SimulatedMean:
    """A simulated mean with what is known of its scatter over seeds.

    Parameters
    ----------
    value : mean over the seeds.
    uncertainty : standard uncertainty of that mean (scatter of one seed / √n), or None for one seed.
    seeds : number of seeds n.

    Raises
    ------
    AnalysisError : values that aren't finite, a negative uncertainty, fewer than one seed.
    """

    value: float
    uncertainty: float | None = None
    seeds: int = 1

    def __post_init__(self) -> None:
        known = self.uncertainty is None or (math.isfinite(self.uncertainty) and self.uncertainty >= 0)
        if not math.isfinite(self.value) or not known or self.seeds < 1:
            raise AnalysisError(
                f"Simulated mean given: value {self.value}, uncertainty {self.uncertainty}, seeds {self.seeds}. "
                "Allowed: a finite value, an uncertainty ≥ 0 or None, one seed or more."
            )

    @classmethod
    def from_values(cls, values: Sequence[float]) -> SimulatedMean:
        """Return mean and standard uncertainty s/√n of one value a seed, shape (n,)."""
        numbers = np.asarray(values, dtype=float).ravel()
        if numbers.size == 0 or not np.isfinite(numbers).all():
            raise AnalysisError(
                f"Simulated values given: {numbers.tolist()}. Allowed: one finite number for each seed. Leave out runs "
                "that failed, and say so."
            )
        if numbers.size == 1:
            return cls(float(numbers[0]))
        return cls(float(numbers.mean()), float(numbers.std(ddof=1) / math.sqrt(numbers.size)), int(numbers.size))


@dataclass(frozen=True)
class ComparisonReport:
    """The comparison of one quantity.

    Attributes
    ----------
    quantity, unit : what is compared, and its unit.
    simulated, simulated_uncertainty : S and u_S, the standard uncertainty of the mean over seeds.
    seeds : number of seeds behind S.
    seed_scatter_known : whether u_S rests on several seeds or a stated scatter; otherwise it is 0 and
        u_val a lower bound.
    measured, measured_uncertainty : D and u_D.
    other_uncertainties : u_num, u_input and the like, by name.
    error : E = S − D.
    validation_uncertainty : u_val, root of the sum of squares of all of them.
    ratio : |E|/u_val.
    degrees_of_freedom : of u_val, after Welch and Satterthwaite; infinite where no scatter is estimated.
    coverage_factor : Student's factor for 95 % at these degrees of freedom.
    verdict : "within_uncertainty" (|E| ≤ u_val), "model_differs" (above the coverage factor), or
        "not_established" (between the two, or above them while the seed scatter isn't known).
    text : one paragraph for a reader who doesn't program.
    advice : what to measure or run next.
    """

    quantity: str
    unit: str
    simulated: float
    simulated_uncertainty: float
    seeds: int
    seed_scatter_known: bool
    measured: float
    measured_uncertainty: float
    other_uncertainties: dict[str, float]
    error: float
    validation_uncertainty: float
    ratio: float
    degrees_of_freedom: float
    coverage_factor: float
    verdict: str
    text: str
    advice: str

    @property
    def relative_error(self) -> float | None:
        """E/D [1], or None where D is 0."""
        return self.error / self.measured if self.measured != 0 else None

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers as plain types for JSON; infinite degrees of freedom become None."""
        names = [name for name in self.__dataclass_fields__ if name != "other_uncertainties"]
        numbers: dict[str, Any] = {name: getattr(self, name) for name in names}
        numbers["other_uncertainties"] = dict(self.other_uncertainties)
        numbers["relative_error"] = self.relative_error
        if math.isinf(self.degrees_of_freedom):
            numbers["degrees_of_freedom"] = None
        return numbers


def compare(
    simulated: Sequence[float] | SimulatedMean,
    measured: float,
    measured_uncertainty: float,
    *,
    quantity: str = "angle of repose",
    unit: str = "°",
    seed_scatter: float | None = None,
    other_uncertainties: Mapping[str, float] | None = None,
) -> ComparisonReport:
    """Compare simulation and measurement, E = S − D, u_val² = u_D² + u_S² + Σ u_k².

    Parameters
    ----------
    simulated : one value for each seed, or a `SimulatedMean`.
    measured, measured_uncertainty : D and its standard uncertainty u_D > 0, in `unit`.
    quantity, unit : how the report calls them.
    seed_scatter : standard deviation from seed to seed known from elsewhere, used where there is one seed.
    other_uncertainties : standard uncertainties by name, such as {"time step": 0.1, "fit window": 0.6}.

    Raises
    ------
    AnalysisError : values that aren't finite, u_D ≤ 0, negative uncertainties.

    Source: terms of ASME V&V 20; degrees of freedom after JCGM 100:2008 (GUM), annex G.
    """
    mean = simulated if isinstance(simulated, SimulatedMean) else SimulatedMean.from_values(simulated)
    others = _checked(measured, measured_uncertainty, seed_scatter, dict(other_uncertainties or {}))
    u_simulated, known = _seed_uncertainty(mean, seed_scatter)
    error = mean.value - measured
    u_val = math.sqrt(u_simulated**2 + measured_uncertainty**2 + sum(u**2 for u in others.values()))
    freedom = _degrees_of_freedom(mean, u_simulated, u_val)
    factor = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, freedom))
    numbers: dict[str, Any] = {
        "quantity": quantity,
        "unit": unit,
        "simulated": mean.value,
        "simulated_uncertainty": u_simulated,
        "seeds": mean.seeds,
        "seed_scatter_known": known,
        "measured": float(measured),
        "measured_uncertainty": float(measured_uncertainty),
        "other_uncertainties": others,
        "error": error,
        "validation_uncertainty": u_val,
        "ratio": abs(error) / u_val,
        "degrees_of_freedom": freedom,
        "coverage_factor": factor,
        "verdict": _verdict(abs(error) / u_val, factor, known),
    }
    return ComparisonReport(**numbers, text=verdict_text(numbers), advice=advice_text(numbers))


def _checked(
    measured: float, measured_uncertainty: float, seed_scatter: float | None, others: dict[str, float]
) -> dict[str, float]:
    if not math.isfinite(measured):
        raise AnalysisError(f"Measured value given: {measured}. Allowed: a finite number.")
    if not (math.isfinite(measured_uncertainty) and measured_uncertainty > 0):
        raise AnalysisError(
            f"Measured uncertainty given: {measured_uncertainty}. Allowed: a positive number, the standard uncertainty "
            "of the mean. Without it nothing can be said; estimate it from repeats."
        )
    stated = {"seed_scatter": seed_scatter} if seed_scatter is not None else {}
    for name, value in {**stated, **others}.items():
        if not (math.isfinite(value) and value >= 0):
            raise AnalysisError(f"Uncertainty {name!r} given: {value}. Allowed: a finite number ≥ 0.")
    return {name: float(value) for name, value in others.items()}


def _seed_uncertainty(mean: SimulatedMean, seed_scatter: float | None) -> tuple[float, bool]:
    """Return u_S and whether it is known."""
    if mean.uncertainty is not None and mean.seeds > 1:
        return mean.uncertainty, True
    if mean.uncertainty is not None and mean.uncertainty > 0:
        return mean.uncertainty, True
    if seed_scatter is not None:
        return seed_scatter / math.sqrt(mean.seeds), True
    return 0.0, False


def _degrees_of_freedom(mean: SimulatedMean, u_simulated: float, u_val: float) -> float:
    """Return ν = u_val⁴ / (u_S⁴/(n − 1)), all other parts taken as known."""
    if mean.seeds < 2 or u_simulated == 0.0:
        return math.inf
    return (u_val / u_simulated) ** 4 * (mean.seeds - 1)


def _verdict(ratio: float, factor: float, known: bool) -> str:
    if ratio <= 1.0:
        return "within_uncertainty"
    # Without a seed scatter u_val is only a lower bound, which can't convict the model.
    return "model_differs" if ratio > factor and known else "not_established"
