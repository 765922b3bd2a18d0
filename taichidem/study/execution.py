"""One batch of runs: simulate it, once more where a world stopped, and turn what came out into rows of the store."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from functools import cached_property
from typing import Any

import numpy as np

from taichidem.errors import CompositionError, EnvironmentProblem, TaichidemError
from taichidem.experiments.base import Experiment, Outcome
from taichidem.experiments.together import run_together
from taichidem.physics_version import PHYSICS_VERSION
from taichidem.scene import Model
from taichidem.study.content_hash import canonical, canonical_json, experiment_text, model_text, run_key
from taichidem.study.run_store import StoredRun
from taichidem.study.setting_key import movable_settings

Report = Callable[[float], None]

LONGEST_DETAIL = 10_000  # characters of JSON that the details of one run may take in the store
FIRST_FAILURE = "first_failure"  # the detail that tells why a run that was repeated had failed before


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

    @property
    def group(self) -> tuple[str, frozenset, str]:
        """What runs have in common that can share one call of the engine: the experiment, the effects' composition, and the
        kind of the grains.

        Tests that differ in a height or a speed share one too, unless their type runs in a way of its own.
        """
        effects, kind = frozenset(e.composition for e in self.model.effects), self.model.grain_kind
        if type(self.experiment).run is not Experiment.run:
            return experiment_text(self.experiment), effects, kind
        settings, moved = self.experiment.settings, movable_settings(self.experiment)
        same = {name: getattr(settings, name) for name in type(settings).model_fields if name not in moved}
        return canonical_json([self.experiment.name, same]), effects, kind


def batches(runs: Iterable[Run], worlds: int) -> Iterator[list[Run]]:
    """Yield runs that go through the engine together, at most `worlds` each."""
    groups: dict[tuple, list[Run]] = defaultdict(list)
    known: dict[tuple[int, int], tuple] = {}  # runs that differ in the seed alone are of one group
    for run in runs:
        pair = id(run.experiment), id(run.model)
        if pair not in known:
            known[pair] = run.group
        groups[known[pair]].append(run)
    for group in groups.values():
        for first in range(0, len(group), worlds):
            yield group[first : first + worlds]


def execute(batch: Sequence[Run], report: Report | None = None) -> list[StoredRun]:
    """Simulate runs of one group together and return their rows; touches no store, so that any process may do it.

    A run whose world stopped is repeated once with another random stream, which follows from its seed alone.

    Raises:
        CompositionError, EnvironmentProblem: a fault of all runs; any other error becomes the reason of failed rows.
    """
    began = time.perf_counter()
    outcomes = _outcomes(batch, [run.seed for run in batch], report)
    again = [k for k, run in enumerate(batch) if outcomes[k].stopped and run.experiment.random]
    reasons = {k: outcomes[k].failure for k in again}
    if again:
        repeated = _outcomes([batch[k] for k in again], [second_seed(batch[k].seed) for k in again], None)
        for k, outcome in zip(again, repeated, strict=True):
            outcomes[k] = outcome
    wall_time = (time.perf_counter() - began) / len(batch)
    return [stored_run(run, outcomes[k], wall_time, reasons.get(k)) for k, run in enumerate(batch)]


def second_seed(seed: int) -> int:
    """Return the seed of the random stream with which a run is repeated whose world stopped."""
    return int(np.random.SeedSequence([int(seed), 1]).generate_state(1, np.uint64)[0])


def _outcomes(batch: Sequence[Run], seeds: Sequence[int], report: Report | None) -> list[Outcome]:
    """Return what the runs gave with these seeds; if one breaks the batch each is made alone, so that it costs only itself.

    What a run gives must not depend on which others share its batch, nor a row's reason.
    """
    try:
        return _simulated(batch, seeds, report)
    except Exception as error:
        reason = reason_of(error)
    if len(batch) == 1:
        return [Outcome({}, seeds[0], reason)]
    return [outcome for run, seed in zip(batch, seeds, strict=True) for outcome in _outcomes([run], [seed], None)]


def reason_of(error: Exception) -> str:
    """Return why a run failed, as its row tells it.

    Raises:
        CompositionError, EnvironmentProblem, errors of Taichi: the error itself, if it is a fault of all runs.
    """
    # A law that can't be compiled is a fault of the program, not of these runs.
    if isinstance(error, (CompositionError, EnvironmentProblem)) or type(error).__module__.startswith("taichi."):
        raise error
    return str(error) if isinstance(error, TaichidemError) else f"{type(error).__name__}: {error}"


def _simulated(batch: Sequence[Run], seeds: Sequence[int], report: Report | None) -> list[Outcome]:
    tests, models = [r.experiment for r in batch], [r.model for r in batch]
    if all(test.settings == tests[0].settings for test in tests):
        return list(tests[0].run(models, seeds, report=report))
    return run_together(tests, models, seeds, report=report)


def stored_run(run: Run, outcome: Outcome, wall_time: float, first_failure: str | None = None) -> StoredRun:
    """Return the row of a run; a response that is no finite number makes it a failed one.

    Args:
        run: what was asked for.
        outcome: what came out, of the second attempt where there were two.
        wall_time: its share of the batch's [s].
        first_failure: why the first attempt failed, where there was a second.
    """
    responses = {name: float(value) for name, value in outcome.observables.items()}
    strange = [f"{name} = {value}" for name, value in responses.items() if not np.isfinite(value)]
    reason = outcome.failure or (f"The measurement gave no number: {', '.join(strange)}." if strange else "")
    repeated = {} if first_failure is None else {FIRST_FAILURE: first_failure}
    return StoredRun(
        key=run.key,
        experiment_type=run.experiment.name,
        experiment=run.name or run.experiment.name,
        seed=int(run.seed),
        model=model_text(run.model),
        settings=canonical_json(run.experiment.settings),
        physics=PHYSICS_VERSION,
        status="failed" if reason else "done",
        responses={} if reason else responses,
        wall_time=wall_time,
        finished_at=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        reason=reason,
        details=_plain_details(outcome.details) | repeated,
        attempts=1 + len(repeated),
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
