"""How often a diagnosis is right when the answer is known: `python -m benchmarks.planted_truth` (= `make planted-truth`).

The bench is that of examples/hidden_effect. Truths of many kinds are simulated with parameters and seeds that
no diagnosis uses, noise is added several times to each, and every set of measurements is diagnosed. All diagnoses share the runs
of one screening design, so that simulations are what the truths cost.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks.hidden_effect import STUDY
from benchmarks.planted import measure, repeatability, truth_runs
from benchmarks.planted_cases import Case, cases
from benchmarks.planted_tables import draw, print_tables
from taichidem.study import RunStore, Study, read_study, run_all
from taichidem.study.diagnosis_plan import Plan, plan
from taichidem.study.diagnosis_run import evaluate
from taichidem.study.hypothesis import Hypotheses, hypotheses

DRAWS: dict[str, int] = {}  # sets of measurements per truth, where not the usual number
USUAL_DRAWS = 3


def simulate(study: Study, known: Hypotheses, every: list[Case], work: Path) -> dict[str, float]:
    """Make all runs, of design and truths, and return the wall time of each [s]."""
    seconds = {}
    with RunStore(work / "runs.sqlite") as store:
        stages = {
            "design": plan(study).runs,
            "truths": [run for case in every if not case.removed for run in truth_runs(study, known, case.truth)],
        }
        for name, runs in stages.items():
            began = time.perf_counter()
            run_all(runs, store, lambda share, name=name: _tell(f"{name}: {100 * share:.0f} %"))  # type: ignore[misc]
            seconds[name] = time.perf_counter() - began
        repeatability(study, store)
    return seconds


def _tell(text: str) -> None:
    print(f"\r{text:40s}", end="", file=sys.stderr, flush=True)


@cache
def _planned(work: Path, removed: tuple[str, ...]) -> tuple[Plan, pd.DataFrame]:
    """Return the plan without some effects, and the outcomes of its runs, from the store alone."""
    study = read_study(STUDY)
    known = [h.name for h in hypotheses(study).tested if h.name not in removed]
    planned = plan(study, known)
    with RunStore(work / "runs.sqlite") as store:
        return planned, run_all(planned.runs, store)


@cache
def _scatter(work: Path) -> dict[str, float]:
    with RunStore(work / "runs.sqlite") as store:
        return repeatability(read_study(STUDY), store)


def judge(job: tuple[Path, int, Case]) -> list[dict[str, Any]]:
    """Return a row per set of measurements of a case."""
    work, number, case = job
    planned, outcomes = _planned(work, case.removed)
    study = planned.study
    with RunStore(work / "runs.sqlite") as store:
        truth = run_all(truth_runs(study, hypotheses(study), case.truth), store)
    rows = []
    for draw_number in range(DRAWS.get(case.kind, USUAL_DRAWS)):
        rng = np.random.default_rng([case.truth.first_seed, draw_number])
        row = {"case": number, "kind": case.kind, "hidden": " + ".join(case.effects), "draw": draw_number}
        try:
            made = measure(study, truth, _scatter(work), rng)
            found = evaluate(_with_values(planned, made), outcomes, work)
        except ValueError as error:
            rows.append(row | {"verdict": "refused", "named": "", "note": str(error)})
            continue
        shares = {r["effect"]: r for r in found.table}
        limits = [shares[e]["detection_limit"] / shares[e]["strongest_probed"] for e in case.effects if e in shares]
        named = {
            "verdict": found.verdict,
            "named": " ".join(found.effects),
            "chi2_recalibrated": round(found.chi2["recalibrated"], 2),
            "chi2_with_effect": round(found.chi2["with_effect"], 2),
            "smallest_p": round(min((r["adjusted_p"] for r in found.table), default=1.0), 5),
            "measured": len(made),
            "detection_share": round(float(np.max(limits)), 3) if limits else float("nan"),
            "note": "",
        }
        rows.append(row | named)
    return rows


def _with_values(planned: Plan, made: pd.DataFrame) -> Plan:
    """Return the plan with other measurements."""
    values = made.set_index(["experiment", "observable"])[["value", "u"]].astype(float)
    keys = list(zip(planned.measurements["experiment"], planned.measurements["observable"], strict=True))
    there = [key in values.index for key in keys]
    kept = [key for key in keys if key in values.index]
    rows = planned.measurements[there].assign(
        value=values.loc[kept, "value"].to_numpy(), u=values.loc[kept, "u"].to_numpy()
    )
    labels = [label for label, measured in zip(planned.labels, there, strict=True) if measured]
    return replace(planned, measurements=rows.reset_index(drop=True), labels=labels)


def main() -> None:
    """Simulate, judge, print and write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("results/planted_truth"), help="folder for the runs")
    parser.add_argument(
        "--output", type=Path, default=Path("docs"), help="folder for planted_truth.csv and its picture"
    )
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, help="that judge at once")
    given = parser.parse_args()
    study = read_study(STUDY)
    given.work.mkdir(parents=True, exist_ok=True)
    known = hypotheses(study)
    every = cases(study, [h.name for h in known.tested])
    seconds = simulate(study, known, every, given.work)
    began = time.perf_counter()
    jobs = [(given.work, number, case) for number, case in enumerate(every)]
    jobs.sort(key=lambda job: job[2].removed)
    rows: list[dict[str, Any]] = []
    with multiprocessing.get_context("spawn").Pool(given.processes) as pool:
        for done, found in enumerate(pool.imap(judge, jobs, chunksize=4), 1):
            rows += found
            _tell(f"judged: {done} of {len(jobs)} truths")
    seconds["judging"] = time.perf_counter() - began
    table = pd.DataFrame(rows).sort_values(["case", "kind", "draw"])
    table.to_csv(given.output / "planted_truth.csv", index=False)
    draw(table, given.output / "pictures" / "planted_truth.png")
    print_tables(table)
    print("\n" + ", ".join(f"{name} {value:.0f} s" for name, value in seconds.items()))


if __name__ == "__main__":
    main()
