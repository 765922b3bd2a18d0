"""Heaps whose grains and pictures are kept: poured once, measured in pictures, timed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from analysis.comparison import ComparisonReport, compare
from taichidem import runtime
from taichidem.errors import SimulationError
from taichidem.experiments import FixedFunnel
from taichidem.heap_comparison import LABORATORY
from taichidem.heap_views import grains_on_base, measure_heap
from taichidem.output_vtk import read_grains, write_grains
from taichidem.paper.session import Session
from taichidem.render import heap_picture
from taichidem.scene import Model
from taichidem.simulation import Simulation
from taichidem.study import Run, StoredRun
from taichidem.study.campaign import worlds_at_once
from taichidem.study.execution import stored_run
from taichidem.whole_file import whole_file

POURING = "pouring_s"  # detail of a stored run: processor time of its share of the pour, nothing compiled or measured
SHARED = {"window": "choice of the fit window", "threshold": "threshold of the picture"}


@dataclass(frozen=True)
class KeptHeaps:
    """Heaps of one kind.

    Attributes:
        diameter: of the grains [m].
        seeds: of the heaps that were measured.
        angles: in pictures [deg].
        profile_angles: from positions, over the same window [deg].
        shared: uncertainties of the picture measurement that all heaps share, by name [deg].
        pouring: processor time of one heap's pour [s]; nan where every pour was stopped and taken up again.
        shown: seed of the pictured heap, the one nearest to the mean.
        pictures: name → file, relative to the session's folder.
        failures: seed → why it failed.
    """

    diameter: float
    seeds: tuple[int, ...]
    angles: tuple[float, ...]
    profile_angles: tuple[float, ...]
    shared: dict[str, float]
    pouring: float
    shown: int
    pictures: dict[str, str]
    failures: dict[int, str]

    @property
    def mean(self) -> float:
        """Mean angle in pictures [deg]."""
        return float(np.mean(self.angles))

    @property
    def u(self) -> float:
        """Standard uncertainty of the mean by the scatter from heap to heap [deg]; nan for one heap."""
        count = len(self.angles)
        return float(np.std(self.angles, ddof=1) / np.sqrt(count)) if count > 1 else float("nan")

    def comparison(self) -> ComparisonReport:
        """Return the comparison with the laboratory: E, u_val of heaps, laboratory and picture, and the verdict."""
        return compare(self.angles, *LABORATORY, other_uncertainties=self.shared)

    def as_dict(self) -> dict[str, Any]:
        """Return all, with mean, u and the comparison, in plain types."""
        failures = {str(seed): reason for seed, reason in self.failures.items()}
        derived = {"mean": self.mean, "u": self.u, "comparison": self.comparison().as_dict()}
        return {**vars(self), **derived, "failures": failures}


def pour_and_keep(session: Session, name: str, heap: FixedFunnel, model: Model, seeds: Sequence[int]) -> KeptHeaps:
    """Pour those heaps that were not poured before, and return what was measured of all.

    Raises:
        SimulationError: every heap failed.
    """
    folder = session.folder / name
    folder.mkdir(exist_ok=True)
    runs = [Run(heap, model, seed, name) for seed in seeds]
    missing = [run for run in runs if not _is_kept(session, folder, run)]
    if missing:
        _pour(session, folder, missing, 1 - len(missing) / len(runs))
    for state in folder.glob("*.state"):  # of lots kept just before a kill, or cut otherwise, on more processors
        state.unlink()
    stored = {run.key: run for run in session.store.runs(run.key for run in runs)}
    rows = [stored[run.key] for run in runs]
    good = [row for row in rows if row.status == "done"]
    failures = {row.seed: row.reason for row in rows if row.status == "failed"}
    if not good:
        raise SimulationError(f"Every heap of {name} failed. The first: {next(iter(failures.values()))}")
    angles = [row.responses["angle_of_repose"] for row in good]
    shown = good[int(np.abs(np.array(angles) - np.mean(angles)).argmin())]
    pictures = _draw(folder, heap, model, shown.key)
    return KeptHeaps(
        diameter=heap.settings.diameter,
        seeds=tuple(row.seed for row in good),
        angles=tuple(angles),
        profile_angles=tuple(float(row.details["profile"]["angle_deg"]) for row in good),
        shared=_shared(good),
        pouring=_mean([row.details[POURING] for row in good]),
        shown=shown.seed,
        pictures={kind: str(path.relative_to(session.folder)) for kind, path in pictures.items()},
        failures=failures,
    )


def _mean(seconds: Sequence[float | None]) -> float:
    known = [value for value in seconds if value is not None]
    return float(np.mean(known)) if known else float("nan")


def _shared(rows: Sequence[StoredRun]) -> dict[str, float]:
    """Return the mean over heaps of the uncertainties that more heaps don't lower [deg]."""
    parts = [row.details.get("pictures", {}).get("components_deg", {}) for row in rows]
    return {meaning: float(np.mean([part.get(name, 0.0) for part in parts])) for name, meaning in SHARED.items()}


def _is_kept(session: Session, folder: Path, run: Run) -> bool:
    (row,) = session.store.runs([run.key]) or (None,)
    return row is not None and (
        row.status == "failed" or (POURING in row.details and _grains(folder, run.key).is_file())
    )


def _grains(folder: Path, key: str) -> Path:
    return folder / f"grains_{key[:12]}.vtp"


def _pour(session: Session, folder: Path, runs: Sequence[Run], before: float) -> None:
    """Pour a few heaps at a time and keep each lot at once; a lot that is stopped is taken up from its checkpoint."""
    heap, model = runs[0].experiment, runs[0].model
    worlds = worlds_at_once(runtime.start().threads)
    Simulation([heap.scene(model)] * min(worlds, len(runs))).run_steps(1)  # compiles
    share = (1 - before) / len(runs)
    for first in range(0, len(runs), worlds):
        lot = runs[first : first + worlds]
        rows = _poured(session, folder, lot, before + share * first, share * len(lot))
        session.store.add(*rows)


def _poured(session: Session, folder: Path, lot: Sequence[Run], before: float, share: float) -> list[StoredRun]:
    heap, model, seeds = lot[0].experiment, lot[0].model, [run.seed for run in lot]
    started, began = perf_counter(), process_time()
    latest = began

    def told(done: float) -> None:
        nonlocal latest
        latest = process_time()
        session.tell(folder.name.replace("_", " "), before + share * done)

    state = folder / f"{sha256(''.join(run.key for run in lot).encode()).hexdigest()[:12]}.state"
    taken_up = state.exists()
    outcomes = heap.run(model, seeds, report=told, checkpoint=state)
    # The last report comes when the last grain rests, before anything is measured. Of a pour taken up nobody knows the time.
    known = None if taken_up else (latest - began) / len(lot)
    wall = (perf_counter() - started) / len(lot)
    for run, outcome in zip(lot, outcomes, strict=True):
        if outcome.snapshot is not None:
            write_grains(_grains(folder, run.key), outcome.snapshot, time=outcome.snapshot.time)
    rows = [stored_run(run, outcome, wall) for run, outcome in zip(lot, outcomes, strict=True)]
    return [replace(row, details={**row.details, POURING: known}) for row in rows]


def _draw(folder: Path, heap: FixedFunnel, model: Model, key: str) -> dict[str, Path]:
    """Draw one heap as it lies and as it was measured, unless that was done before."""
    files = {kind: folder / f"{kind}_{key[:12]}.png" for kind in ("heap", "angle")}
    if not all(path.is_file() for path in files.values()):
        s = heap.settings
        grains = grains_on_base(read_grains(_grains(folder, key)), s.cup_radius)
        heap_picture(grains, walls=heap.walls(model), path=files["heap"])
        with whole_file(files["angle"]) as fresh:
            measure_heap(grains, s.cup_radius, s.fit_from, s.fit_to).save_annotated(fresh)
    return files
