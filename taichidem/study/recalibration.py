"""Re-calibrate a model, with and without one effect more, by simulation: the surrogate proposes, fresh runs correct it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import Any

import pandas as pd

from taichidem.errors import InputError
from taichidem.scene import Model
from taichidem.study.campaign import run_all
from taichidem.study.diagnosis_plan import Plan
from taichidem.study.diagnosis_run import analyse
from taichidem.study.execution import Run
from taichidem.study.hypothesis import Hypothesis
from taichidem.study.run_store import RunStore
from taichidem.study.screening import EFFECT, SEED, SHARE
from taichidem.study.screening_runs import response_table

FITTING_SEEDS = (11, 12, 13, 14)  # of the runs that correct the surrogate where it was led to
ROUNDS = 3
SETTLED = 0.02  # of a parameter's range, and of an effect's strongest setting: further rounds would move nothing


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where a re-calibration ended.

    Attributes:
        values: key → number.
        share: of the effect's strongest setting; 0 without it.
        report: of the analyser, the effect being its only candidate.
    """

    values: Mapping[str, float]
    share: float
    report: Any


@dataclass(frozen=True, eq=False)
class Recalibrated:
    """The model without and with the effect, each where the measurements want it."""

    without: Estimate
    with_effect: Estimate
    runs: tuple[Run, ...]
    outcomes: pd.DataFrame


def recalibrate(
    planned: Plan,
    hypothesis: Hypothesis,
    store: RunStore,
    tell: Callable[[str, float], None],
    rounds: int = ROUNDS,
    *,
    executor: Executor | None = None,
) -> Recalibrated:
    """Return parameters, and jointly the strength of one effect, that agree best with the measurements.

    Each round simulates both models where the surrogate puts them, adds these runs to what it knows, and asks it again, until
    it stays where it is.

    Args:
        planned: with the effect as its only hypothesis.
        hypothesis: the effect.
        store: that keeps the runs.
        tell: called with the stage and the share done.
        rounds: at most.
        executor: workers that simulate, as for `run_all`.
    """
    runs = list(planned.runs)
    outcomes = run_all(runs, store, partial(tell, "screening"), executor=executor)
    table = planned.table(outcomes)
    before = _estimates(planned, table)
    for number in range(1, rounds + 1):
        points = [_point_runs(planned, hypothesis, estimate) for estimate in before]
        added = [run for rows in points for row in rows for run in row.values()]
        more = run_all(added, store, partial(tell, f"round {number}"), executor=executor)
        runs, outcomes = runs + added, pd.concat([outcomes, more], ignore_index=True)
        known = [_known(planned, e, hypothesis, rows, more) for e, rows in zip(before, points, strict=True)]
        table = planned.distinct(pd.concat([table, *known], ignore_index=True))
        after = _estimates(planned, table)
        moved = max(_distance(planned, a, b) for a, b in zip(before, after, strict=True))
        before = after
        if moved < SETTLED:
            break
    return Recalibrated(*before, tuple(runs), outcomes)


def _estimates(planned: Plan, table: pd.DataFrame) -> tuple[Estimate, Estimate]:
    """Return where the surrogate puts the model without and with the effect."""
    report = analyse(planned, table)
    found = report.details["search"]
    if not found.trials:
        (reason,) = report.details["not_tested"].values()
        raise InputError(f"{planned.hypotheses.tested[0].name} can't be added: {reason}")
    keys = [entry.key for entry in planned.study.calibrate]
    ends = []
    for fit in (found.base.fit, found.trials[0].fit):
        values = dict(zip(keys, fit.problem.natural(fit.x).tolist(), strict=True))
        share = float(fit.share[0]) if fit.effects else 0.0
        ends.append(Estimate(values, planned.hypotheses.tested[0].possible(share, planned.study.model()), report))
    return ends[0], ends[1]


def model_at(planned: Plan, hypothesis: Hypothesis, estimate: Estimate) -> Model:
    """Return the model at an estimate, with the effect if it has a strength."""
    model = planned.study.at(estimate.values).model
    return hypothesis.joined(model, estimate.share) if estimate.share else model


def estimate_runs(
    planned: Plan, hypothesis: Hypothesis, estimate: Estimate, seeds: Sequence[int]
) -> list[dict[str, Run]]:
    """Return the runs of every test at an estimate, a dictionary per seed."""
    model = model_at(planned, hypothesis, estimate)
    tests = planned.study.at(estimate.values).experiments
    return [{name: Run(tests[name], model, seed, name) for name in planned.study.experiments} for seed in seeds]


def _point_runs(planned: Plan, hypothesis: Hypothesis, estimate: Estimate) -> list[dict[str, Run]]:
    return estimate_runs(planned, hypothesis, estimate, FITTING_SEEDS)


def _known(
    planned: Plan, estimate: Estimate, hypothesis: Hypothesis, rows: list[dict[str, Run]], outcomes: pd.DataFrame
) -> pd.DataFrame:
    """Return the rows that these runs add to what the surrogate knows."""
    effect = hypothesis.name if estimate.share else ""
    points = pd.DataFrame(
        [{**estimate.values, EFFECT: effect, SHARE: estimate.share, SEED: seed} for seed in FITTING_SEEDS]
    )
    return response_table(points, rows, outcomes, planned.responses)


def _distance(planned: Plan, a: Estimate, b: Estimate) -> float:
    """Return how far two estimates are apart, in ranges of the parameters and strongest settings."""
    spans = [abs(a.values[c.key] - b.values[c.key]) / (c.high - c.low) for c in planned.study.calibrate]
    return max([abs(a.share - b.share), *spans])
