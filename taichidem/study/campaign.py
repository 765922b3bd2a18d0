"""Run many simulations: drop those that are in the store, compute the others here or on workers, keep every outcome."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor

import pandas as pd

from taichidem import runtime
from taichidem.errors import InputError
from taichidem.experiments.base import Outcome
from taichidem.scene import Model
from taichidem.study.execution import Report, Run, batches, execute, reason_of, stored_run
from taichidem.study.executors import computed, threads_of
from taichidem.study.run_store import LARGEST_SEED, RunStore
from taichidem.study.study_file import Study

# Worlds per thread in one batch. A killed campaign loses the batch that was under way, so it should be small; but the worlds
# of a batch end together, and a thread with one world idles while the slowest is at work. With two each the differences
# even out: 16 small heaps on two threads took 8.6 s with one world per thread, 7.2 s with two, four or eight. A single thread
# has nothing to even out: one world alone keeps to its cache (5 % faster), and no worker waits long for the last ones.
WORLDS_PER_THREAD = 2
STORE = "runs.sqlite"


def run_all(
    runs: Iterable[Run],
    store: RunStore,
    report: Report | None = None,
    *,
    retry_failed: bool = False,
    worlds: int | None = None,
    executor: Executor | None = None,
) -> pd.DataFrame:
    """Make every run that is not in the store, write each outcome at once, and return them all.

    Several processes may do so at once with one store: each asks it before every batch what is still to be made.

    Args:
        runs: in any order; equal ones are made once.
        store: where outcomes are kept; what is there already is not run again.
        report: called with the share done, 0 to 1.
        retry_failed: run those again that are in the store as failed.
        worlds: simulated at once; by default twice the threads of the runtime, one on a single thread.
        executor: workers that simulate, such as `SpawnedProcesses(4)` or the `get_executor()` of a Dask client; in this process
            where left out. Rows are the same to the last bit, and only this process writes them.

    Returns:
        One row per run, in the order given: the columns of `RunStore.table`, and `stored` (True where this
        call did not simulate it: it was there before, or another process wrote it meanwhile).

    Raises:
        InputError: the store can't be written or does not take a seed, or no run of a campaign that has not begun can be
            set up.
        CompositionError, EnvironmentProblem: faults of all runs at once; any other failure is a row with its reason.
    """
    wanted, report = list(runs), report or (lambda share: None)
    _check_seeds(wanted)
    statuses = store.statuses(run.key for run in wanted)
    there = _settled(statuses, retry_failed)
    pending = list({run.key: run for run in wanted if run.key not in there}.values())
    sound, weights = _set_up(pending, store, begun=bool(statuses))
    if sound:
        there |= _simulate(sound, store, _Progress(weights, report), retry_failed, worlds, executor)
    report(1.0)
    table = store.named([run.key for run in wanted], [run.name for run in wanted])
    table["stored"] = [run.key in there for run in wanted]
    return table


def _check_seeds(runs: Iterable[Run]) -> None:
    for run in runs:
        if not 0 <= run.seed <= LARGEST_SEED:
            raise InputError(
                f"A seed of {run.name or run.experiment.name} is {run.seed}; give whole numbers from 0 to {LARGEST_SEED}, "
                "the largest that a run store holds."
            )


def _settled(statuses: Mapping[str, str], retry_failed: bool) -> set[str]:
    """Return the keys of runs that need not be made: they are done, or failed and shall not be tried again."""
    return {key for key, status in statuses.items() if status == "done" or not retry_failed}


def _simulate(
    sound: Sequence[Run],
    store: RunStore,
    progress: _Progress,
    retry_failed: bool,
    worlds: int | None,
    executor: Executor | None,
) -> set[str]:
    """Simulate runs, here or on workers, and write them; return the keys of those that another process made meanwhile."""
    if worlds is None:
        worlds = worlds_at_once(runtime.start().threads if executor is None else threads_of(executor))
    rest = _Rest(batches(sound, worlds), store, progress, retry_failed)
    finished = (
        (execute(part, progress.within([run.key for run in part])) for part in rest)
        if executor is None
        else computed(rest, executor)
    )
    for rows in finished:
        if store.add(*rows) < len(rows):
            rest.elsewhere()
        progress.add([row.key for row in rows])
    return rest.found


def worlds_at_once(threads: int) -> int:
    """Return how many worlds make a batch for a number of threads."""
    on_one_core = threads == 1 and runtime.in_use().arch == "cpu"
    return 1 if on_one_core else WORLDS_PER_THREAD * threads


class _Rest:
    """The batches that are left of a campaign, without runs that another process has written into the store by then.

    Attributes:
        found: keys of those.
    """

    def __init__(self, parts: Iterable[list[Run]], store: RunStore, progress: _Progress, retry_failed: bool) -> None:
        self.parts, self.at = list(parts), 0
        self.store, self.progress, self.retry_failed = store, progress, retry_failed
        self.found: set[str] = set()

    def __iter__(self) -> Iterator[list[Run]]:
        while self.parts:
            if self.at >= len(self.parts):
                self.at = 0
            part = self.parts.pop(self.at)
            there = _settled(self.store.statuses(run.key for run in part), self.retry_failed)
            if there:
                self.found |= there
                self.progress.add(list(there))
            left = [run for run in part if run.key not in there]
            if left:
                yield left

    def elsewhere(self) -> None:
        """Go on from the middle of what is left: another process is at work where this one was.

        Two that began at the same moment would else take the same batches, one after the other, to the end.
        """
        self.at = len(self.parts) // 2


class _Progress:
    """The share of a campaign that is done, by what each run weighs."""

    def __init__(self, weights: Mapping[str, float], report: Report) -> None:
        self.weights, self.report = weights, report
        self.done, self.total = 0.0, sum(weights.values()) or 1.0  # an experiment of one's own may have no grains

    def within(self, keys: Sequence[str]) -> Report:
        """Return a report for a batch under way."""
        share = sum(self.weights[key] for key in keys)
        return lambda part: self.report((self.done + part * share) / self.total)

    def add(self, keys: Sequence[str]) -> None:
        """Count a batch as done."""
        self.done += sum(self.weights[key] for key in keys)
        self.report(self.done / self.total)


def _set_up(pending: Sequence[Run], store: RunStore, begun: bool) -> tuple[list[Run], dict[str, float]]:
    """Return the runs whose scenes can be built, and for progress how many grains each has; write the others as failed.

    A scene that can't be built would have its whole batch made again, run by run.

    Args:
        pending: what is to be simulated.
        store: where the others are written.
        begun: whether the store holds a run of this campaign.

    Raises:
        InputError: no scene of a campaign that has not begun can be built.
    """
    weights: dict[str, float] = {}
    refused: list[tuple[Run, str]] = []
    known: dict[tuple[int, int], float | str] = {}  # runs that differ in the seed alone have one scene
    for run in pending:
        pair = id(run.experiment), id(run.model)
        if pair not in known:
            known[pair] = _room(run)
        found = known[pair]
        if isinstance(found, str):
            refused.append((run, found))
        else:
            weights[run.key] = found
    if refused and not weights and not begun:
        raise InputError(f"No run can be set up. {refused[0][1]}")
    if refused:
        store.add(*(stored_run(run, Outcome({}, run.seed, reason), 0.0) for run, reason in refused))
    return [run for run in pending if run.key in weights], weights


def _room(run: Run) -> float | str:
    """Return how many grains a run has, or why its scene can't be built."""
    try:
        return float(run.experiment.scene(run.model).room)
    except Exception as error:
        return reason_of(error)


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
    executor: Executor | None = None,
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
        executor: workers that simulate, as for `run_all`.

    Returns:
        The table of `run_all`, in the order experiment, model, seed.

    Raises:
        InputError: an unknown experiment, no seed, or a store that can't be written.
    """
    runs = study_runs(study, experiments, seeds, models)
    if store is not None:
        return run_all(runs, store, report, retry_failed=retry_failed, executor=executor)
    with RunStore(study.path / STORE) as own:
        return run_all(runs, own, report, retry_failed=retry_failed, executor=executor)
