"""Run experiments side by side, one world each, and measure them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from taichidem.checkpoints.checkpoint import about_scenes
from taichidem.checkpoints.keeper import EVERY, Keeper, discard
from taichidem.experiments.base import Experiment, Outcome
from taichidem.procedure import World, play
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation

Job = tuple[Experiment, Model, int]


def run_together(
    experiments: Sequence[Experiment],
    models: Sequence[Model],
    seeds: Sequence[int],
    *,
    schedule: str = "worlds",
    report: Callable[[float], None] | None = None,
    frames: float | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: float = EVERY,
) -> list[Outcome]:
    """Run one world per experiment, model and seed, all of them side by side, and measure them.

    Args:
        experiments: of one type, which may differ in their settings.
        models: one per experiment, of one composition of effects; those of another kind of grains run after the others.
        seeds: one per experiment.
        schedule, report, frames, checkpoint, checkpoint_every: as for `Experiment.run`.
    """
    jobs, scenes = _jobs_and_scenes(experiments, models, seeds)
    outcomes: dict[int, Outcome] = {}
    groups = [[k for k, s in enumerate(scenes) if s.kind == kind] for kind in dict.fromkeys(s.kind for s in scenes)]
    keeping: Keeper | nullcontext = nullcontext()
    if checkpoint is not None:
        keeping = Keeper(Path(checkpoint), checkpoint_every, _about(jobs, scenes, schedule, frames))
    with keeping as keeper:
        for group in groups:  # one engine knows one kind of grains
            told = _partly(report, len(outcomes) / len(jobs), len(group) / len(jobs))
            found = _side_by_side([jobs[k] for k in group], [scenes[k] for k in group], schedule, told, frames, keeper)
            outcomes |= dict(zip(group, found, strict=True))
        each = iter([outcomes[k] for k in range(len(jobs))])
        return [e.combine([next(each) for _ in e.parts()]) for e in experiments]


def discard_checkpoint(
    checkpoint: str | Path,
    experiments: Sequence[Experiment],
    models: Sequence[Model],
    seeds: Sequence[int],
    *,
    schedule: str = "worlds",
    frames: float | None = None,
) -> None:
    """Delete the checkpoint of a run, given as to `run_together`, once its results are kept elsewhere.

    A file that belongs to another run by now is left alone.
    """
    jobs, scenes = _jobs_and_scenes(experiments, models, seeds)
    discard(Path(checkpoint), _about(jobs, scenes, schedule, frames))


def _jobs_and_scenes(
    experiments: Sequence[Experiment], models: Sequence[Model], seeds: Sequence[int]
) -> tuple[list[Job], list[Scene]]:
    jobs = [(p, m, seed) for e, m, seed in zip(experiments, models, seeds, strict=True) for p in e.parts()]
    return jobs, [part.scene(m) for part, m, _ in jobs]


def _about(jobs: Sequence[Job], scenes: Sequence[Scene], schedule: str, frames: float | None) -> dict[str, Any]:
    """Return what a checkpoint of these jobs belongs to."""
    version = getattr(jobs[0][0], "version", None)
    return {
        "experiment": jobs[0][0].name,
        "version of the experiment": None if version is None else str(version),
        "list of seeds": [int(seed) for _, _, seed in jobs],
        "settings": [part.settings.model_dump(mode="json") for part, _, _ in jobs],
        "interval between frames": frames,
        **about_scenes(scenes, schedule),
    }


def _partly(report: Callable[[float], None] | None, before: float, share: float) -> Callable[[float], None] | None:
    """Return a report for a part of the work, of which some is done before."""
    return None if report is None else lambda done: report(before + share * done)


def _side_by_side(
    jobs: Sequence[tuple[Experiment, Model, int]],
    scenes: Sequence[Scene],
    schedule: str,
    report: Callable[[float], None] | None,
    frames: float | None,
    keeper: Keeper | None,
) -> list[Outcome]:
    """Run scenes of one kind of grains as worlds of one simulation and measure them."""
    simulation = Simulation(scenes, schedule)
    worlds = [World(simulation, k, np.random.default_rng(seed)) for k, (_, _, seed) in enumerate(jobs)]
    procedures = [part.procedure(w, m) for w, (part, m, _) in zip(worlds, jobs, strict=True)]
    play(simulation, procedures, worlds, report, frames, keeper)
    return [part.outcome(world, seed) for world, (part, _, seed) in zip(worlds, jobs, strict=True)]
