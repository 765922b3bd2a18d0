"""A photographed heap beside the simulated one, both measured by the same procedure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.picture_input import load_picture
from analysis.repose_annotation import Picture, annotate_view
from analysis.repose_image import ReposeImageReport, measure_repose_image
from analysis.repose_image_settings import ImageSettings
from taichidem.errors import InputError, SimulationError, TaichidemError
from taichidem.experiments import FixedFunnel, LiftingCylinder
from taichidem.experiments.base import Experiment
from taichidem.grains import Grains
from taichidem.heap_views import grains_on_base, measure_heap
from taichidem.output_vtk import read_grains, write_grains
from taichidem.scene import Model

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Experiments whose heap stands free, with two flanks to be seen from the side.
PICTURED = (FixedFunnel, LiftingCylinder)
OBSERVABLE = "angle_of_repose"
FEWEST_VIEWS = 4  # of the simulated heap, of those all around it: a coarse one has sides that are no straight flanks
#: What can be wrong with a picture or a run of its heap.
FAULTS = (TaichidemError, AnalysisError)


@dataclass(frozen=True)
class HeapPair:
    """A heap in photographs and its simulation in rendered pictures.

    Attributes:
        photograph, simulated: what was measured in each.
        seed: of the simulated heap.
        text: both angles in a sentence.
    """

    photograph: ReposeImageReport
    simulated: ReposeImageReport
    seed: int
    text: str


def check_photograph(experiment: Experiment, observable: str, path: Path) -> None:
    """Refuse what can't be compared with a photograph, before anything is simulated.

    Raises:
        InputError: an experiment or observable without a heap to be seen from the side, or a file that is no picture.
    """
    if not isinstance(experiment, PICTURED) or observable != OBSERVABLE:
        names = " and ".join(kind.name for kind in PICTURED)
        raise InputError(
            f"a photograph is given for {observable} of {experiment.name}; photographs are compared for {OBSERVABLE} of "
            f"{names} alone. Leave it out."
        )
    try:
        load_picture(path)
    except AnalysisError as error:
        raise InputError(str(error)) from error


def grains_of(experiment: Experiment, model: Model, seed: int, file: Path) -> Grains:
    """Return the grains at the end of a run: from its file, or by making the run again into it.

    Raises:
        SimulationError: the run fails.
    """
    if not file.is_file():
        (outcome,) = experiment.run(model, [seed])
        if outcome.snapshot is None or outcome.failure:
            raise SimulationError(f"Seed {seed} can't be pictured: {outcome.failure}")
        write_grains(file, outcome.snapshot, time=outcome.snapshot.time)
    return read_grains(file)


def measure_pair(
    experiment: Experiment,
    grains: Grains,
    observables: Mapping[str, float],
    seed: int,
    photographs: Sequence[Path],
) -> HeapPair:
    """Measure photographs and rendered pictures of a heap over the same part of the flank.

    Args:
        experiment: one of `PICTURED`.
        grains: those at the end of its run.
        observables: what that run measured.
        seed: of that run.
        photographs: views of one heap.

    Raises:
        AnalysisError: no heap with two flanks is seen in one of the pictures; the message says in which.
        EnvironmentProblem: nothing can be drawn on this machine.
    """
    s = experiment.settings
    window = {"fit_from": s.fit_from, "fit_to": s.fit_to}
    photograph = measure_repose_image(list(photographs), ImageSettings(**window))
    base = s.cup_radius if isinstance(experiment, FixedFunnel) else observables["run_out_radius"]
    simulated = measure_heap(grains_on_base(grains, base), base, **window, fewest=FEWEST_VIEWS)
    text = (
        f"In pictures, measured by the same code over {s.fit_from:g} to {s.fit_to:g} of the base, the heap is "
        f"{_angle(photograph)} in the photograph and {_angle(simulated)} in the simulation (seed {seed}, "
        f"{len(simulated.views)} views)."
    )
    return HeapPair(photograph, simulated, seed, text)


def _angle(report: ReposeImageReport) -> str:
    return f"{report.angle_deg:.1f}° ± {report.standard_uncertainty_deg:.1f}°"


def draw_pair(pair: HeapPair, name: str) -> Figure:
    """Return photograph and simulation side by side, outline, window and lines drawn in, both angles above."""
    from matplotlib.figure import Figure

    views = sorted(pair.simulated.views, key=lambda view: abs(view.angle_deg - pair.simulated.angle_deg))
    shown = [[annotate_view(view) for view in pair.photograph.views]]
    shown.append([annotate_view(view) for view in views[: len(shown[0])]])
    height = max(_height(pictures) for pictures in shown)
    figure = Figure(figsize=(13.0, 1.1 + 6.4 * height), dpi=110, layout="constrained")
    simulated = f"simulated, seed {pair.seed}: {_angle(pair.simulated)}, mean of {len(views)} views"
    headings = (f"photograph: {_angle(pair.photograph)}", simulated)
    for axes, pictures, heading in zip(figure.subplots(1, 2), shown, headings, strict=True):
        axes.imshow(_stacked(pictures))
        axes.set_title(heading, fontsize=12, loc="left")
        axes.set_axis_off()
        axes.set_anchor("N")
    figure.suptitle(f"{name}: angle of repose in pictures, measured alike", fontsize=13)
    return figure


def _stacked(pictures: Sequence[Picture]) -> Any:
    return np.vstack(pictures)[:, :, ::-1]  # BGR to RGB


def _height(pictures: Sequence[Picture]) -> float:
    """Return how high these pictures of one width are under one another, in widths."""
    return sum(picture.shape[0] for picture in pictures) / pictures[0].shape[1]
