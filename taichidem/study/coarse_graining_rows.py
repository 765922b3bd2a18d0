"""From runs at several factors of coarse graining to shifts, their uncertainties and what moved."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import erf
from scipy.stats import t as student

from taichidem.experiments.base import Experiment

NUMERICAL = 5e-3  # standard uncertainty of any result as a share of it: time step, start of the motion
UNTOLD = math.nan
COLUMNS = (
    "experiment observable unit factor grains n mean u shift u_shift z limit moved wall_time time_ratio mass_kept"
).split()


def rows_of(
    tests: Mapping[str, Experiment],
    runs: pd.DataFrame,
    factors: Sequence[float],
    masses: Mapping[tuple[str, float], tuple[int, float]],
    coverage: float,
) -> pd.DataFrame:
    """Return a row per experiment, observable and factor.

    u² = s²/n + (0.005 mean)² from the scatter s over n seeds and the numerics; z = shift/u(shift); what moved has |z| above
    the quantile of Student's t that covers as much as ± coverage does of the normal distribution, with the degrees of
    freedom of Welch and Satterthwaite.

    Args:
        tests: name → experiment before coarse graining.
        runs: as `run_all` returns them, with a column factor.
        factors: in rising order; shifts are from the first.
        masses: (name, factor) → number of grains, mass over that before; what isn't there was not run.
        coverage: k of the normal distribution.
    """
    rows: list[dict[str, Any]] = []
    for name, test in tests.items():
        own = runs[runs["experiment"] == name]
        for observable in test.observables:
            base: dict[str, Any] | None = None
            for factor in factors:
                if (name, factor) not in masses:
                    continue
                here = own[own["factor"] == factor]
                values = here[observable.name].dropna() if observable.name in here else []
                grains, mass = masses[name, factor]
                row = _scatter(np.asarray(values, float), test.random)
                row |= {"experiment": name, "observable": observable.name, "unit": observable.unit, "factor": factor}
                row |= {"grains": grains, "mass_kept": mass, "wall_time": float(here["wall_time"].mean())}
                if factor == factors[0]:
                    base = row
                rows.append(row | shift(base, row, coverage))
    return pd.DataFrame(rows, columns=[*COLUMNS])


def _scatter(values: np.ndarray, random: bool) -> dict[str, Any]:
    n = len(values)
    mean = float(values.mean()) if n else UNTOLD
    scatter = float(values.std(ddof=1) / math.sqrt(n)) if n > 1 else 0.0 if n and not random else UNTOLD
    return {"n": n, "mean": mean, "scatter": scatter, "u": math.hypot(scatter, NUMERICAL * mean)}


def shift(base: Mapping[str, Any] | None, row: Mapping[str, Any], coverage: float) -> dict[str, Any]:
    """Return how far a row is from the base, and whether that is more than chance.

    Args:
        base, row: n, mean, scatter (standard uncertainty from seeds, 0 where there are none), u, wall_time; None where the
            smallest factor could not be run.
        coverage: k of the normal distribution.
    """
    if base is None:
        return dict.fromkeys(("shift", "u_shift", "z", "limit", "time_ratio"), UNTOLD) | {"moved": None}
    found: dict[str, Any] = {"time_ratio": row["wall_time"] / base["wall_time"], "limit": coverage, "moved": None}
    found["shift"] = row["mean"] - base["mean"]
    if row is base:
        return found | {"u_shift": 0.0, "z": 0.0}
    found["u_shift"] = math.hypot(row["u"], base["u"])
    found["z"] = found["shift"] / found["u_shift"] if found["u_shift"] else 0.0 if found["shift"] == 0 else math.inf
    if math.isfinite(found["u_shift"]):
        found["limit"] = limit(base, row, found["u_shift"], coverage)
        found["moved"] = bool(abs(found["z"]) > found["limit"])
    return found


def limit(base: Mapping[str, Any], row: Mapping[str, Any], u_shift: float, coverage: float) -> float:
    """Return the |z| that a shift without cause keeps below as often as ± coverage says, for so few seeds."""
    share = sum(part["scatter"] ** 4 / (part["n"] - 1) for part in (base, row) if part["n"] > 1)
    freedom = u_shift**4 / share if share > 0 else math.inf
    return float(student.ppf((1 + erf(coverage / math.sqrt(2))) / 2, freedom)) if math.isfinite(freedom) else coverage
