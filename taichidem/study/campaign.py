"""Run many simulations: drop those that are in the store, send the others through the engine together, keep every outcome."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from taichidem import runtime
from taichidem.errors import CompositionError, EnvironmentProblem, InputError, TaichidemError
from taichidem.experiments.base import Experiment, Outcome
from taichidem.experiments.together import run_together
from taichidem.physics_version import PHYSICS_VERSION
from taichidem.scene import Model
from taichidem.study.content_hash import canonical, canonical_json, experiment_as_dict, model_as_dict, run_key
from taichidem.study.run_store import RunStore, StoredRun, as_table
from taichidem.study.setting_key import movable_settings
from taichidem.study.study_file import Study

Report = Callable[[float], None]

# Worlds per thread in one batch. A killed campaign loses the batch that was under way, so it should be small; but the worlds
# of a batch end together, and a thread with one world idles while the slowest is at work. With two each the differences
# even out: 16 small heaps on two threads took 8.6 s with one world per thread, 7.2 s with two, four or eight.
WORLDS_PER_THREAD = 2
LONGEST_DETAIL = 10_000  # characters of JSON that the details of one run may take in the store
STORE = "runs.sqlite"


@dataclass(frozen=True, eq=False)
class Run:
    """One simulation to be made: an experiment on a model with a seed, and what the caller calls the experiment."""

    experiment: Experiment
    model: Model
    seed: int
    name: str = ""

    @cached_property
    def key(self) -> str:
        """The hash of everything that its outcome depends on."""
        return run_key(self.experiment, self.model, self.seed)

    @cached_property
    def group(self) -> tuple[str, frozenset, str]:
        """What runs have in common that can share one call of the engine: the experiment, the effects' composition, and the
        kind of the grains.

        Tests that differ in a height or a speed share one too, unless their type runs in a way of its own.
        """
        effects, kind = frozenset(e.composition for e in self.model.effects), self.model.grain_kind
        if type(self.experiment).run is not Experiment.run:
            return canonical_json(experiment_as_dict(self.experiment)), effects, kind
        settings, moved = self.experiment.settings, movable_settings(self.experiment)
        same = {name: getattr(settings, name) for name in type(settings).model_fields if name not in moved}
        return canonical_json([self.experiment.name, same]), effects, kind


def run_all(
    runs: Iterable[Run],
    store: RunStore,
    report: Report | None = None,
    *,
    retry_failed: bool = False,
    worlds: int | None = None,
) -> pd.DataFrame:
    """Make every run that is not in the store, write each outcome at once, and return them all.

    Args:
        runs: in any order; equal ones are made once.
        store: where outcomes are kept; what is there already is not run again.
        report: called with the share done, 0 to 1.
        retry_failed: run those again that are in the store as failed.
        worlds: simulated at once; by default twice the threads of the runtime.

    Returns:
        One row per run, in the order given: the columns of `RunStore.table`, and `stored` (True where it was there before).

    Raises:
        InputError: the store can't be written, or no run of the campaign can be set up.
        CompositionError, EnvironmentProblem: faults of all runs at once; any other failure is a row with its reason.
    """
    wanted = list(runs)
    statuses = store.statuses(run.key for run in wanted)
    skip = {key for key, status in statuses.items() if status == "done" or not retry_failed}
    pending = list({run.key: run for run in wanted if run.key not in skip}.values())
    _simulate(pending, store, report or (lambda share: None), worlds)
    found = {run.key: run for run in store.runs(run.key for run in wanted)}
    table = as_table(_named(found[run.key], run.name) for run in wanted)
    table["stored"] = [run.key in skip for run in wanted]
    return table


def _named(stored: StoredRun, name: str) -> StoredRun:
    """Return a stored run under the name by which this caller knows the experiment."""
    return StoredRun(**{**vars(stored), "experiment": name or stored.experiment})


def _simulate(pending: Sequence[Run], store: RunStore, report: Report, worlds: int | None) -> None:
    if not pending:
        report(1.0)
        return
    sound, weights = _set_up(pending, store)
    total = sum(weights.values())
    done = 0.0
    for batch in batches(sound, worlds or WORLDS_PER_THREAD * runtime.start().threads):
        share = sum(weights[run.key] for run in batch)
        store.add(*execute(batch, lambda part, done=done, share=share: report((done + part * share) / total)))  # type: ignore[misc]
        done += share
    report(1.0)


def _set_up(pending: Sequence[Run], store: RunStore) -> tuple[list[Run], dict[str, float]]:
    """Return the runs whose scenes can be built, and for progress how many grains each has; write the others as failed.

    A scene that can't be built would take its whole batch with it.
    """
    weights: dict[str, float] = {}
    refused: list[tuple[Run, str]] = []
    for run in pending:
        try:
            weights[run.key] = float(run.experiment.scene(run.model).room)
        except InputError as error:
            refused.append((run, str(error)))
    if not weights:
        raise InputError(f"No run can be set up. {refused[0][1]}")
    store.add(*(stored_run(run, Outcome({}, run.seed, reason), 0.0) for run, reason in refused))
    return [run for run in pending if run.key in weights], weights


def batches(runs: Iterable[Run], worlds: int) -> Iterator[list[Run]]:
    """Yield runs that go through the engine together, at most `worlds` each."""
    groups: dict[tuple, list[Run]] = defaultdict(list)
    for run in runs:
        groups[run.group].append(run)
    for group in groups.values():
        for first in range(0, len(group), worlds):
            yield group[first : first + worlds]


def execute(batch: Sequence[Run], report: Report | None = None) -> list[StoredRun]:
    """Simulate runs of one group together and return their rows; touches no store, so that any process may do it.

    Raises:
        CompositionError, EnvironmentProblem: a fault of all runs; any other error becomes the reason of failed rows.
    """
    began = time.perf_counter()
    try:
        outcomes = _outcomes(batch, report)
    except (CompositionError, EnvironmentProblem):
        raise
    except Exception as error:
        if type(error).__module__.startswith("taichi."):
            raise  # a law that can't be compiled is a fault of the program, not of these runs
        reason = str(error) if isinstance(error, TaichidemError) else f"{type(error).__name__}: {error}"
        outcomes = [Outcome({}, run.seed, reason) for run in batch]
    wall_time = (time.perf_counter() - began) / len(batch)
    return [stored_run(run, outcome, wall_time) for run, outcome in zip(batch, outcomes, strict=True)]


def _outcomes(batch: Sequence[Run], report: Report | None) -> list[Outcome]:
    tests, models, seeds = [r.experiment for r in batch], [r.model for r in batch], [r.seed for r in batch]
    if all(test.settings == tests[0].settings for test in tests):
        return tests[0].run(models, seeds, report=report)
    return run_together(tests, models, seeds, report=report)


def stored_run(run: Run, outcome: Outcome, wall_time: float) -> StoredRun:
    """Return the row of a run; a response that is no finite number makes it a failed one."""
    responses = {name: float(value) for name, value in outcome.observables.items()}
    strange = [f"{name} = {value}" for name, value in responses.items() if not np.isfinite(value)]
    reason = outcome.failure or (f"The measurement gave no number: {', '.join(strange)}." if strange else "")
    return StoredRun(
        key=run.key,
        experiment_type=run.experiment.name,
        experiment=run.name or run.experiment.name,
        seed=int(run.seed),
        model=canonical_json(model_as_dict(run.model)),
        settings=canonical_json(run.experiment.settings),
        physics=PHYSICS_VERSION,
        status="failed" if reason else "done",
        responses={} if reason else responses,
        wall_time=wall_time,
        finished_at=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        reason=reason,
        details=_plain_details(outcome.details),
    )


def _plain_details(details: Mapping[str, Any]) -> dict[str, Any]:
    """Return those details that are plain and short, reports by their `as_dict`; the rest can be computed again."""
    kept = {}
    for name, value in details.items():
        try:
            plain = canonical(value.as_dict() if hasattr(value, "as_dict") else value)
        except TypeError:
            continue
        if len(canonical_json(plain)) <= LONGEST_DETAIL:
            kept[name] = plain
    return kept


def study_runs(
    study: Study, experiments: Iterable[str] | None, seeds: Sequence[int], models: Sequence[Model] | None = None
) -> list[Run]:
    """Return the runs of a study: every experiment on every model with every seed.

    Raises:
        InputError: an unknown experiment, or no seed.
    """
    names = list(study.experiments) if experiments is None else list(dict.fromkeys(experiments))
    if not seeds:
        raise InputError("No seed was given; give at least one, such as seeds=[1, 2, 3, 4].")
    tests = {name: study.experiment(name) for name in names}
    every = [study.model()] if models is None else list(models)
    return [Run(test, model, seed, name) for name, test in tests.items() for model in every for seed in seeds]


def simulate(
    study: Study,
    experiments: Iterable[str] | None = None,
    seeds: Sequence[int] = (1, 2, 3, 4),
    store: RunStore | None = None,
    models: Sequence[Model] | None = None,
    report: Report | None = None,
    *,
    retry_failed: bool = False,
) -> pd.DataFrame:
    """Run the experiments of a study into its run store; what is there already is not run again.

    Args:
        study: as `read_study` returns it.
        experiments: names of those to run; all by default.
        seeds: every experiment is run with each.
        store: by default runs.sqlite in the study's folder.
        models: to run instead of the study's own, each with every seed.
        report: called with the share done, 0 to 1.
        retry_failed: run those again that failed before.

    Returns:
        The table of `run_all`, in the order experiment, model, seed.

    Raises:
        InputError: an unknown experiment, no seed, or a store that can't be written.
    """
    runs = study_runs(study, experiments, seeds, models)
    if store is not None:
        return run_all(runs, store, report, retry_failed=retry_failed)
    with RunStore(study.path / STORE) as own:
        return run_all(runs, own, report, retry_failed=retry_failed)
