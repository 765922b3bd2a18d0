"""Heaps whose grains and pictures are kept: poured once, measured in pictures, timed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from taichidem.errors import SimulationError
from taichidem.experiments import FixedFunnel
from taichidem.heap_views import grains_on_base, measure_heap
from taichidem.output_vtk import read_grains, write_grains
from taichidem.paper.session import Session
from taichidem.render import heap_picture
from taichidem.scene import Model
from taichidem.simulation import Simulation
from taichidem.study import Run, StoredRun
from taichidem.study.execution import stored_run
from taichidem.whole_file import whole_file

POURING = "pouring_s"  # detail of a stored run: wall time of its share of the pour, compilation and measurement apart


@dataclass(frozen=True)
class KeptHeaps:
    """Heaps of one kind.

    Attributes:
        diameter: of the grains [m].
        seeds: of the heaps that were measured.
        angles: in pictures [deg].
        profile_angles: from positions, over the same window [deg].
        wall_time: of one heap's pour with all threads at work [s].
        shown: seed of the pictured heap, the one nearest to the mean.
        pictures: name → file, relative to the session's folder.
        failures: seed → why it failed.
    """

    diameter: float
    seeds: tuple[int, ...]
    angles: tuple[float, ...]
    profile_angles: tuple[float, ...]
    wall_time: float
    shown: int
    pictures: dict[str, str]
    failures: dict[int, str]

    @property
    def mean(self) -> float:
        """Mean angle in pictures [deg]."""
        return float(np.mean(self.angles))

    @property
    def u(self) -> float:
        """Standard uncertainty of the mean [deg]; nan for one heap."""
        count = len(self.angles)
        return float(np.std(self.angles, ddof=1) / np.sqrt(count)) if count > 1 else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """Return all, with mean and u, in plain types."""
        return {**vars(self), "mean": self.mean, "u": self.u, "failures": {str(k): v for k, v in self.failures.items()}}


def pour_and_keep(session: Session, name: str, heap: FixedFunnel, model: Model, seeds: Sequence[int]) -> KeptHeaps:
    """Pour heaps side by side, unless they were poured before, and return what was measured of them.

    Raises:
        SimulationError: every heap failed.
    """
    folder = session.folder / name
    folder.mkdir(exist_ok=True)
    runs = [Run(heap, model, seed, name) for seed in seeds]
    stored = {run.key: run for run in session.store.runs(run.key for run in runs)}
    if any(run.key not in stored or not _usable(stored[run.key], folder) for run in runs):
        _pour(session, name, folder, runs)
        stored = {run.key: run for run in session.store.runs(run.key for run in runs)}
    rows = [stored[run.key] for run in runs]
    good = [row for row in rows if row.status == "done"]
    failures = {row.seed: row.reason for row in rows if row.status == "failed"}
    if not good:
        raise SimulationError(f"Every heap of {name} failed. The first: {next(iter(failures.values()))}")
    angles = [row.responses["angle_of_repose"] for row in good]
    shown = good[int(np.abs(np.array(angles) - np.mean(angles)).argmin())].seed
    pictures = _draw(folder, heap, model, shown)
    return KeptHeaps(
        diameter=heap.settings.diameter,
        seeds=tuple(row.seed for row in good),
        angles=tuple(angles),
        profile_angles=tuple(float(row.details["profile"]["angle_deg"]) for row in good),
        wall_time=float(np.mean([row.details[POURING] for row in good])),
        shown=shown,
        pictures={kind: str(path.relative_to(session.folder)) for kind, path in pictures.items()},
        failures=failures,
    )


def _usable(row: StoredRun, folder: Path) -> bool:
    return row.status == "failed" or (POURING in row.details and _grains(folder, row.seed).is_file())


def _grains(folder: Path, seed: int) -> Path:
    return folder / f"grains_seed_{seed}.vtp"


def _pour(session: Session, name: str, folder: Path, runs: Sequence[Run]) -> None:
    heap, model, seeds = runs[0].experiment, runs[0].model, [run.seed for run in runs]
    Simulation([heap.scene(model)] * len(runs)).run_steps(1)  # compiles
    began = latest = perf_counter()

    def told(share: float) -> None:
        nonlocal latest
        latest = perf_counter()
        session.tell(name.replace("_", " "), share)

    outcomes = heap.run(model, seeds, report=told)
    each = (latest - began) / len(runs)  # the last report comes when the last grain rests, before anything is measured
    for outcome in outcomes:
        if outcome.snapshot is not None:
            write_grains(_grains(folder, outcome.seed), outcome.snapshot, time=outcome.snapshot.time)
    rows = [stored_run(run, outcome, each) for run, outcome in zip(runs, outcomes, strict=True)]
    session.store.add(*(StoredRun(**{**vars(row), "details": {**row.details, POURING: each}}) for row in rows))


def _draw(folder: Path, heap: FixedFunnel, model: Model, seed: int) -> dict[str, Path]:
    """Draw one heap as it lies and as it was measured, unless that was done before."""
    files = {kind: folder / f"{kind}_seed_{seed}.png" for kind in ("heap", "angle")}
    if not all(path.is_file() for path in files.values()):
        s = heap.settings
        grains = grains_on_base(read_grains(_grains(folder, seed)), s.cup_radius)
        heap_picture(grains, walls=heap.walls(model), path=files["heap"])
        with whole_file(files["angle"]) as fresh:
            measure_heap(grains, s.cup_radius, s.fit_from, s.fit_to).save_annotated(fresh)
    return files
