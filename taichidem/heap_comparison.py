"""The whole road once: pour heaps, picture them, measure their angle, compare with the laboratory."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.comparison import ComparisonReport, compare
from analysis.errors import AnalysisError
from analysis.plots_repose import plot_profile
from analysis.repose_image import ReposeImageReport
from taichidem import __version__
from taichidem.errors import InputError, SimulationError
from taichidem.experiments import FixedFunnel, Outcome
from taichidem.grains import Grains
from taichidem.graphics import require_graphics
from taichidem.heap_views import grains_on_base, measure_heap
from taichidem.library import PAPER_HEAP
from taichidem.output_vtk import write_grains, write_walls
from taichidem.render import heap_picture
from taichidem.scene import Model
from taichidem.whole_file import whole_file, write_whole

# [deg], angle of repose of polypropylene as Sudsawat et al. (2023) print it, "30.18° ± 0.51°". They don't say what ± means;
# it is taken as the standard uncertainty. If it were the scatter of single heaps, u_D would be smaller by √n.
LABORATORY = (30.18, 0.51)
NOT_COUNTED = (
    "u_val holds seed scatter, measurement, fit window and threshold. It holds no term for the time step and the softened "
    "stiffness (no shift beyond seed scatter is known), nor for the uncertainty of the model's own inputs."
)

Report = Callable[[str, float], None]


@dataclass(frozen=True)
class HeapComparison:
    """A simulated heap beside a measured one.

    Attributes:
        comparison: S ± u_S, D ± u_D, E, u_val and the sentence.
        pictures: the picture measurement of each heap that was poured.
        outcomes: of every seed, failed ones included.
        files: what was written, by name.
        experiment, model: as used.
        pictured_seed: seed of the heap in heap.png, profile.png and angle.png, the one nearest to the mean.
    """

    comparison: ComparisonReport
    pictures: tuple[ReposeImageReport, ...]
    outcomes: tuple[Outcome, ...]
    files: dict[str, Path]
    experiment: FixedFunnel
    model: Model
    pictured_seed: int

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers as plain types for JSON."""
        good = [o for o in self.outcomes if o.failure is None]
        return {
            "comparison": self.comparison.as_dict(),
            "from_pictures_deg": {str(o.seed): p.angle_deg for o, p in zip(good, self.pictures, strict=True)},
            "from_positions_deg": {str(o.seed): o.observables["angle_of_repose"] for o in good},
            "window": {"fit_from": self.experiment.settings.fit_from, "fit_to": self.experiment.settings.fit_to},
            "failures": {str(o.seed): o.failure for o in self.outcomes if o.failure},
            "not_counted": NOT_COUNTED,
            "pictured_seed": self.pictured_seed,
            "settings": self.experiment.settings.model_dump(),
            "model": {
                "materials": [asdict(material) for material in self.model.materials],
                "effects": {effect.name: effect.values for effect in self.model.effects},
            },
            "time_step": self.experiment.scene(self.model).dt,
            "version": __version__,
            "files": {name: str(path) for name, path in self.files.items()},
        }


def compare_heap(
    model: Model,
    seeds: Sequence[int],
    output: str | Path,
    *,
    experiment: FixedFunnel | None = None,
    measured: tuple[float, float] = LABORATORY,
    report: Report | None = None,
) -> HeapComparison:
    """Pour one heap per seed, picture and measure each, and compare the mean angle with the laboratory's.

    Args:
        model: materials and effects.
        seeds: one heap each; two or more give the scatter from heap to heap.
        output: folder for heap.png, profile.png, angle.png, result.json, walls.vtp and grains_seed_N.vtp.
        experiment: settings of the pour; the paper's by default.
        measured: angle and its standard uncertainty [deg].
        report: called with the stage and the share done, for a progress bar.

    Raises:
        InputError: the folder can't be written.
        EnvironmentProblem: nothing can be drawn on this machine.
        SimulationError: every heap failed.
    """
    folder = writable_folder(output)
    require_graphics()  # better now than after minutes of pouring
    experiment = experiment or FixedFunnel(**PAPER_HEAP)
    tell = report or (lambda stage, share: None)
    tell("pouring", 0.0)
    outcomes = experiment.run(model, seeds, report=lambda share: tell("pouring", share))
    write_seeds(folder, outcomes)
    outcomes, pictures = _measure(experiment, outcomes, tell)
    good = [o for o in outcomes if o.failure is None]
    if not good:
        reasons = " ".join(f"Seed {o.seed}: {o.failure}" for o in outcomes)
        raise SimulationError(f"No heap could be measured; grains of those that were poured are in {folder}. {reasons}")
    comparison = compare([p.angle_deg for p in pictures], *measured, other_uncertainties=_common(pictures))
    tell("writing", 0.0)
    typical = int(np.abs([p.angle_deg - comparison.simulated for p in pictures]).argmin())
    files = _write(folder, experiment, model, good[typical], pictures[typical], measured)
    files |= {f"grains_seed_{o.seed}": folder / f"grains_seed_{o.seed}.vtp" for o in good}
    result = HeapComparison(comparison, tuple(pictures), tuple(outcomes), files, experiment, model, good[typical].seed)
    write_whole(files["result"], json.dumps(result.as_dict(), indent=2) + "\n")
    tell("writing", 1.0)
    return result


def _measure(
    experiment: FixedFunnel, outcomes: Sequence[Outcome], tell: Report
) -> tuple[list[Outcome], list[ReposeImageReport]]:
    """Picture and measure every heap that was poured; one that can't be measured fails alone."""
    measured: list[Outcome] = []
    pictures: list[ReposeImageReport] = []
    for done, outcome in enumerate(outcomes):
        tell("picturing", done / len(outcomes))
        if outcome.failure is None:
            try:
                pictures.append(picture_angle(experiment, outcome))
            except AnalysisError as error:
                outcome = replace(outcome, failure=f"The pictures can't be measured: {error}")
        measured.append(outcome)
    return measured, pictures


def write_seeds(folder: Path, outcomes: Sequence[Outcome]) -> None:
    """Write the grains of every heap before anything else can go wrong."""
    for outcome in outcomes:
        s = outcome.snapshot
        if s is not None:
            fields = {"velocity": s.velocity, "angular_velocity": s.spin, "id": s.identity, "mass": s.mass}
            write_grains(folder / f"grains_seed_{outcome.seed}.vtp", s, fields=fields, time=s.time)


def _common(pictures: Sequence[ReposeImageReport]) -> dict[str, float]:
    """Return the uncertainties that all heaps share, so that more seeds don't lower them [deg]."""
    names = {"window": "choice of the fit window", "threshold": "threshold of the picture"}
    return {name: float(np.mean([p.components[part] for p in pictures])) for part, name in names.items()}


def writable_folder(path: str | Path) -> Path:
    """Return a folder that exists and can be written, or raise InputError before anything is simulated."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise InputError(
            f"Output folder {folder}: can't be written ({error.strerror}). Give another with -o."
        ) from error
    return folder


def picture_angle(experiment: FixedFunnel, outcome: Outcome) -> ReposeImageReport:
    """Measure the angle of one heap from side views all around it."""
    assert outcome.snapshot is not None
    s = experiment.settings
    return measure_heap(heap_of(experiment, outcome), s.cup_radius, s.fit_from, s.fit_to)


def heap_of(experiment: FixedFunnel, outcome: Outcome) -> Grains:
    """Return the grains in or on the cup; what is falling past it is no part of the heap."""
    assert outcome.snapshot is not None
    return grains_on_base(Grains.of(outcome.snapshot), experiment.settings.cup_radius)


def _write(
    folder: Path,
    experiment: FixedFunnel,
    model: Model,
    outcome: Outcome,
    picture: ReposeImageReport,
    measured: tuple[float, float],
) -> dict[str, Path]:
    """Write the pictures of one heap, and the walls."""
    walls = experiment.walls(model)
    names = ("heap.png", "profile.png", "angle.png", "walls.vtp", "result.json")
    files = {Path(name).stem: folder / name for name in names}
    heap_picture(heap_of(experiment, outcome), walls=walls, path=files["heap"])
    title = f"Heap of seed {outcome.seed}, from positions"
    with whole_file(files["profile"]) as profile, whole_file(files["angle"]) as angle:
        plot_profile(outcome.details["profile"], profile, measured, title)
        picture.save_annotated(angle)
    write_walls(files["walls"], walls)
    return files
