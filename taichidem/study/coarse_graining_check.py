"""Run the same tests with grains of several factors and say which observables moved."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from taichidem.coarse_graining import CoarseGraining
from taichidem.errors import InputError
from taichidem.experiments.base import Experiment
from taichidem.scene import Model
from taichidem.study.campaign import STORE, run_all
from taichidem.study.coarse_graining_chart import chart
from taichidem.study.coarse_graining_result import CoarseGrainingCheck, words
from taichidem.study.coarse_graining_rows import rows_of
from taichidem.study.comparison_run import writable
from taichidem.study.execution import Run
from taichidem.study.report.chart_style import save_png
from taichidem.study.result_file import RESULTS
from taichidem.study.run_counts import counted
from taichidem.study.run_store import RunStore
from taichidem.study.study_file import Study, read_study

Report = Callable[[str, float], None]
FACTORS = (1.0, 2.0, 4.0)
SEEDS = (1, 2, 3)
COVERAGE = 2.0
PICTURE = "coarse_graining.png"


@dataclass(frozen=True, eq=False)
class CheckPlan:
    """What a check will run.

    Attributes:
        title: of the result.
        tests: name → experiment before coarse graining.
        factors: in rising order.
        seeds: of the tests that have a scatter.
        coverage: k of the normal distribution.
        runs: with the factor of each.
        masses: (name, factor) → number of grains, mass over that before.
        refused: tests that can't be set up at a factor: experiment, factor, seed (None), reason.
    """

    title: str
    tests: Mapping[str, Experiment]
    factors: tuple[float, ...]
    seeds: tuple[int, ...]
    coverage: float
    runs: tuple[tuple[float, Run], ...]
    masses: Mapping[tuple[str, float], tuple[int, float]]
    refused: tuple[Mapping[str, Any], ...]


def check_coarse_graining(
    experiments: Experiment | Iterable[Experiment] | Mapping[str, Experiment],
    model: Model,
    factors: Sequence[float] = FACTORS,
    seeds: Sequence[int] = SEEDS,
    *,
    coverage: float = COVERAGE,
    store: RunStore | str | Path | None = None,
    report: Report | None = None,
    executor: Executor | None = None,
) -> CoarseGrainingCheck:
    """Run experiments with grains coarse-grained by several factors and say which observables moved.

    Args:
        experiments: one, several, or several by name.
        model: before coarse graining.
        factors: s of each; shifts are from the smallest.
        seeds: every test with a scatter is run with each; the others once.
        coverage: a shift of more than so many standard uncertainties counts as moved (wider by Student's t for few seeds).
        store: that keeps the runs, or its file; what is there isn't run again. Nothing is kept where left out.
        report: called with the stage and the share done.
        executor: workers that simulate, as for `run_all`.

    Raises:
        InputError: fewer than two factors or one below 1, no seed, an effect or experiment without rules, or no test that
            can be set up at two of the factors.
    """
    plan = planned(by_name(experiments), model, factors, seeds, coverage)
    with _opened(store) as kept:
        return carried_out(plan, kept, None, report, executor=executor)


def check_study(
    study: Study | str | Path,
    factors: Sequence[float] = FACTORS,
    seeds: Sequence[int] = SEEDS,
    tests: Iterable[str] | None = None,
    *,
    coverage: float = COVERAGE,
    store: RunStore | str | Path | None = None,
    output: str | Path | None = None,
    report: Report | None = None,
    retry_failed: bool = False,
    executor: Executor | None = None,
) -> CoarseGrainingCheck:
    """Check the tests of a study as `check_coarse_graining` does; write coarse_graining.json and a picture.

    Args:
        study: as `read_study` returns it, or its folder.
        tests: names of its experiments; all where left out.
        store: runs.sqlite in the study's folder where left out.
        output: folder of the results; results in the study's folder where left out.
        retry_failed: run those again that failed before.
        executor: workers that simulate, as for `run_all`.
    """
    read = study if isinstance(study, Study) else read_study(study)
    plan = study_plan(read, factors, seeds, tests, coverage)
    folder = writable(read.path / RESULTS if output is None else output)
    with _opened(read.path / STORE if store is None else store) as kept:
        return carried_out(plan, kept, folder, report, retry_failed=retry_failed, executor=executor)


def study_plan(
    study: Study,
    factors: Sequence[float],
    seeds: Sequence[int],
    tests: Iterable[str] | None,
    coverage: float = COVERAGE,
) -> CheckPlan:
    """Return what the check of a study will run."""
    names = list(study.experiments) if tests is None else list(dict.fromkeys(tests))
    chosen = {name: study.experiment(name) for name in names}
    return planned(chosen, study.model(), factors, seeds, coverage, study.title)


def planned(
    tests: Mapping[str, Experiment],
    model: Model,
    factors: Sequence[float],
    seeds: Sequence[int],
    coverage: float = COVERAGE,
    title: str = "",
) -> CheckPlan:
    """Return what a check will run, after everything that can be refused is refused."""
    if not tests or not seeds:
        raise InputError(f"There is no {'seed' if tests else 'experiment'} to run; give at least one.")
    if not (math.isfinite(coverage) and coverage > 0):
        raise InputError(f"coverage is {coverage!r}; give a number above 0, such as 2 for 95 %.")
    grainings = sorted((CoarseGraining(factor) for factor in factors), key=lambda g: g.factor)
    ordered = tuple(float(g.factor) for g in grainings)
    if len(set(ordered)) < 2 or len(set(ordered)) < len(ordered):
        raise InputError(f"factors are {list(factors)!r}; give two or more different ones from 1, such as 1, 2, 4.")
    runs, masses, refused = [], {}, []
    for graining in grainings:
        changed = graining.model(model)
        for name, test in tests.items():
            try:
                coarse = graining.experiment(test)
                _set_up(graining, coarse, changed)
            except InputError as error:
                refused.append({"experiment": name, "factor": graining.factor, "seed": None, "reason": str(error)})
                continue
            masses[name, float(graining.factor)] = (coarse.particles_needed(), graining.mass_kept(test))
            own = seeds if test.random else seeds[:1]
            runs += [(float(graining.factor), Run(coarse, changed, seed, name)) for seed in own]
    if not any((name, ordered[0]) in masses and (name, s) in masses for name in tests for s in ordered[1:]):
        raise InputError(f"No test can be set up at two of the factors. {refused[0]['reason']}")
    title = title or " on ".join(material.name for material in model.materials)
    return CheckPlan(title, dict(tests), ordered, tuple(seeds), float(coverage), tuple(runs), masses, tuple(refused))


def _set_up(graining: CoarseGraining, test: Experiment, model: Model) -> None:
    """Raise InputError, with the factor, where the scene of a test can't be built."""
    try:
        test.scene(model)
    except InputError as error:
        raise graining.refusal(test, error) from error


def carried_out(
    plan: CheckPlan,
    store: RunStore,
    folder: Path | None,
    report: Report | None = None,
    *,
    retry_failed: bool = False,
    executor: Executor | None = None,
) -> CoarseGrainingCheck:
    """Run a plan and return its result, written into a folder where one is given."""
    tell = report or (lambda stage, share: None)
    tell("simulating", 0.0)
    runs = [run for _, run in plan.runs]
    done = run_all(runs, store, partial(tell, "simulating"), retry_failed=retry_failed, executor=executor)
    done["factor"] = [factor for factor, _ in plan.runs]
    table = rows_of(plan.tests, done, plan.factors, plan.masses, plan.coverage)
    failed = done[done["status"] == "failed"]
    failures = (*plan.refused, *failed[["experiment", "factor", "seed", "reason"]].to_dict("records"))
    result = CoarseGrainingCheck(
        study=plan.title,
        factors=plan.factors,
        seeds=plan.seeds,
        coverage=plan.coverage,
        table=table,
        failures=failures,
        runs=counted(done),
        text=words(table, plan.factors, plan.coverage, len(failures)),
        folder=folder,  # type: ignore[arg-type]
        pictures={} if folder is None else {"coarse_graining": PICTURE},
    )
    if folder is not None:
        save_png(chart(result), folder / PICTURE)
        result.save()
    return result


def by_name(
    experiments: Experiment | Iterable[Experiment] | Mapping[str, Experiment],
) -> dict[str, Experiment]:
    """Return experiments by name: their type's, with a number where several have it."""
    if isinstance(experiments, Mapping):
        return dict(experiments)
    several = [experiments] if isinstance(experiments, Experiment) else list(experiments)
    types = [test.name for test in several]
    return {
        test.name if types.count(test.name) == 1 else f"{test.name}_{types[: k + 1].count(test.name)}": test
        for k, test in enumerate(several)
    }


@contextmanager
def _opened(store: RunStore | str | Path | None) -> Iterator[RunStore]:
    """Give an open store: that which is given, the one in a file, or one that is thrown away."""
    if isinstance(store, RunStore):
        yield store
    elif store is not None:
        with RunStore(store) as own:
            yield own
    else:
        with tempfile.TemporaryDirectory() as folder, RunStore(Path(folder) / STORE) as own:
            yield own
