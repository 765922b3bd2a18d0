"""A diagnosis as tables: candidates, parameters, errors of every measurement."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from analysis.missing_effect.fit import Fit
from analysis.missing_effect.search import RIVAL, Search, Trial
from analysis.missing_effect.wording import uncertainty

AT_EDGE = 1e-3  # coded distance from the end of a range


def candidate_table(found: Search) -> pd.DataFrame:
    """Return a row per candidate, best first."""
    return pd.DataFrame([_candidate(found, trial) for trial in found.trials])


def _candidate(found: Search, trial: Trial) -> dict[str, Any]:
    (k,) = trial.effects
    c, fit, scores = found.problem.candidates[k], trial.fit, found.scores
    share, detectable = float(fit.share[k]), float(found.scores.detectable_share[k])
    return {
        "effect": c.name,
        "title": c.title,
        "parameter": c.parameter,
        "unit": c.unit,
        "strength": c.strength(share),
        "u_strength": abs(c.at_full - c.at_zero) * uncertainty(trial, k),
        "strongest_probed": c.at_full,
        "share": share,
        "chi2_drop": found.base.fit.chi2 - fit.chi2,
        "chi2": fit.chi2,
        "deviance": fit.deviance,
        "dof": fit.dof,
        "p_fit": fit.p_value,
        "score": float(scores.score[k]),
        "adjusted_p": float(scores.adjusted_p[k]),
        "eta": float(scores.eta[k]),
        "rho": {o.name: float(scores.rho[k, j]) for j, o in enumerate(found.problem.candidates) if j != k},
        "held_out_error": trial.held_out_error,
        "aicc": fit.aicc,
        "detection_limit": c.strength(detectable) if np.isfinite(detectable) else float("nan"),
        "detectable_share": detectable if np.isfinite(detectable) else float("nan"),
        "at_bound": [key for key, edge in edges(fit).items() if edge],
        "beyond_probed": abs(share) > 1.0,
        "in_class": fit.deviance <= found.trials[0].fit.deviance + RIVAL,
    }


def edges(fit: Fit) -> dict[str, str]:
    """Return for each parameter "low" or "high" where it is at an end of its range, else ""."""
    words = {-1: "low", 1: "high"}
    return {
        p.key: words[int(np.sign(x))] if 1 - abs(x) < AT_EDGE else ""
        for p, x in zip(fit.problem.parameters, fit.x.tolist(), strict=True)
    }


def parameter_table(found: Search, named: Trial | None) -> pd.DataFrame:
    """Return a row per parameter: believed, measured, re-calibrated without and with the effect."""
    problem, base = found.problem, found.base.fit
    rows = []
    for j, p in enumerate(problem.parameters):
        row: dict[str, Any] = {name: getattr(p, name) for name in ("key", "unit", "low", "high", "believed")}
        row |= {"measured": p.value, "u_measured": p.u}
        row |= _estimate(base, j, "recalibrated", "at_bound")
        row |= _estimate(None if named is None else named.fit, j, "with_effect", "at_bound_with_effect")
        rows.append(row)
    return pd.DataFrame(rows)


def _estimate(fit: Fit | None, j: int, name: str, edge: str) -> dict[str, Any]:
    if fit is None:
        return {name: float("nan"), f"u_{name}": float("nan"), edge: ""}
    u = float(np.sqrt(fit.covariance[j, j]) * fit.problem.natural_slope(fit.x)[j])
    return {name: float(fit.problem.natural(fit.x)[j]), f"u_{name}": u, edge: edges(fit)[fit.problem.parameters[j].key]}


def error_table(found: Search, named: Trial | None) -> pd.DataFrame:
    """Return a row per response: z of the model as believed, re-calibrated, with the effect, and of predictions."""
    nothing = np.full(len(found.problem.labels), np.nan)
    return pd.DataFrame(
        {
            "label": found.problem.labels,
            "test": found.problem.tests,
            "measured": found.problem.measured,
            "u_measured": found.problem.u,
            "believed": found.believed.z,
            "recalibrated": found.base.fit.z,
            "with_effect": nothing if named is None else named.fit.z,
            "held_out_before": found.base.held_out,
            "held_out_after": nothing if named is None else named.held_out,
        }
    )
