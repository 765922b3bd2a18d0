"""Is elongation found, and told from rolling resistance? `python -m benchmarks.planted_elongation`

The bench and the method are those of benchmarks.planted_truth, with five candidates: elongation, both rolling resistances, a
cohesion and a spread of sizes.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from benchmarks.hidden_effect import STUDY
from benchmarks.planted import Truth, measure, repeatability, truth_runs
from benchmarks.planted_cases import true_values
from benchmarks.planted_truth import _with_values
from benchmarks.report import aligned
from taichidem.study import RunStore, read_study, run_all
from taichidem.study.diagnosis_plan import plan
from taichidem.study.diagnosis_run import evaluate
from taichidem.study.hypothesis import hypotheses

CANDIDATES = ("elongation", "rolling_constant_torque", "rolling_spring_dashpot", "cohesion_area", "size_spread")
#: Effect and share of its strongest setting; each truth has parameters and seeds of its own.
TRUTHS = (
    {"elongation": 0.9},
    {"elongation": 0.9},
    {"rolling_constant_torque": 0.9},
    {"elongation": 0.5},
    {},
    {"rolling_spring_dashpot": 0.9},
)
DRAWS = 2  # sets of measurements per truth
FIRST_SEED, SEEDS_APART = 90_000, 10
FIRST_PARAMETERS = 900


def main() -> None:
    """Simulate, diagnose and print a row per set of measurements."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", type=Path, default=Path("results/planted_elongation"), help="folder for the runs")
    work = parser.parse_args().work
    work.mkdir(parents=True, exist_ok=True)
    began, study = time.perf_counter(), read_study(STUDY)
    known, planned = hypotheses(study), plan(study, list(CANDIDATES))
    rows = [["hidden", "share", "verdict", "named", "χ² re-calibrated", "χ² with elongation", "with the best rolling"]]
    with RunStore(work / "runs.sqlite") as store:
        outcomes, scatter = run_all(planned.runs, store), repeatability(study, store)
        for number, shares in enumerate(TRUTHS):
            rng = np.random.default_rng(FIRST_PARAMETERS + number)
            truth = Truth(true_values(study, rng), shares, FIRST_SEED + SEEDS_APART * number)
            table = run_all(truth_runs(study, known, truth), store)
            for draw in range(DRAWS):
                made = measure(study, table, scatter, np.random.default_rng([number, draw]))
                found = evaluate(_with_values(planned, made), outcomes, work)
                chi2 = {row["effect"]: row["chi2"] for row in found.table}
                rolling = min(chi2[name] for name in CANDIDATES if name.startswith("rolling"))
                values = (found.chi2["recalibrated"], chi2["elongation"], rolling)
                hidden = ", ".join(shares) or "nothing"
                share = f"{max(shares.values(), default=0):g}"
                rows.append([hidden, share, found.verdict, ", ".join(found.effects), *(f"{v:.1f}" for v in values)])
    print(aligned(rows))
    print(f"{len(planned.runs)} runs of the design; {time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
