"""Pictures and movies of an experiment: its apparatus as glass, its grains as they are, coloured by any quantity."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError
from taichidem.experiments.base import Experiment, Outcome
from taichidem.grains import Grains
from taichidem.procedure import Frame
from taichidem.render_colours import Quantity, limits_of, quantity_named
from taichidem.render_heap import HeapLook, heap_picture
from taichidem.render_walls import wall_surface
from taichidem.scene import Model

FRAMES_PER_SECOND = 12.5  # of a movie; browsers show GIFs in steps of 10 ms
ABOVE = 0.8  # room above the highest grain up to which walls are drawn, of the grains' height
AT_REST = 0.01  # [m/s]
USUAL_SIZE = (900, 720)
MOVIE_SIZE = (720, 576)


def picture(
    experiment: Experiment,
    model: Model,
    outcome: Outcome,
    path: str | os.PathLike[str] | None = None,
    size: tuple[int, int] = USUAL_SIZE,
    colour_by: str | None = None,
) -> NDArray[np.uint8]:
    """Draw the frame that tells most of a run, as PNG where a path is given.

    Args:
        experiment, model, outcome: what was run, and what it gave.
        path: of the picture.
        size: columns and rows [px].
        colour_by: name of what colours the grains, one of `render_colours.QUANTITIES`; their speed where left out, or
            their height once they rest.

    Raises:
        InputError: no frame holds a grain, an unknown quantity, or a file that can't be written.
        EnvironmentProblem: nothing can be drawn on this machine.
    """
    frames = _with_grains(experiment, outcome)
    frame = frames[round(experiment.shown_at * (len(frames) - 1))]
    return _draw(experiment, model, [frame], size, colour_by, path)[0]


def movie(
    experiment: Experiment,
    model: Model,
    outcome: Outcome,
    path: str | os.PathLike[str],
    size: tuple[int, int] = MOVIE_SIZE,
    colour_by: str | None = None,
) -> Path:
    """Write all frames of a run as an animated GIF, which needs no video codec and plays in any browser; see `picture`.

    Raises:
        InputError: fewer than two frames, an unknown quantity, or a file that is no .gif or can't be written.
        EnvironmentProblem: nothing can be drawn on this machine.
    """
    from PIL import Image

    target = Path(path)
    if target.suffix.lower() != ".gif":
        raise InputError(
            f"The movie's file is {str(target)!r}; movies are written as GIF. Give a name that ends in .gif."
        )
    frames = _with_grains(experiment, outcome)
    if len(frames) < 2:
        raise InputError(
            f"A movie needs at least two frames; run the experiment with frames={experiment.frame_interval:g}, say."
        )
    shots = _draw(experiment, model, frames, size, colour_by)
    palette = Image.fromarray(np.concatenate([shots[0], shots[-1]])).quantize(255, method=Image.Quantize.MAXCOVERAGE)
    images = [Image.fromarray(shot).quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG) for shot in shots]
    try:
        images[0].save(target, save_all=True, append_images=images[1:], duration=1000 / FRAMES_PER_SECOND, loop=0)
    except OSError as problem:
        raise InputError(f"The movie can't be written to {target} ({problem.strerror or problem}).") from problem
    return target


def _with_grains(experiment: Experiment, outcome: Outcome) -> list[Frame]:
    frames = [frame for frame in outcome.frames if len(frame.snapshot.mass)]
    if not frames:
        raise InputError(
            f"No frame of {experiment.name} with seed {outcome.seed} holds a grain ({outcome.failure or 'all left'}). Run it "
            f"with frames={experiment.frame_interval:g}, say, to see what happens on the way."
        )
    return frames


def _draw(
    experiment: Experiment,
    model: Model,
    frames: Sequence[Frame],
    size: tuple[int, int],
    colour_by: str | None,
    path: Any = None,
) -> list[NDArray[np.uint8]]:
    """Return one picture a frame, all with one camera and one range of colours."""
    surfaces = [_surfaces(experiment, model, frame, _top(frames)) for frame in frames]
    bounds = _bounds(frames, surfaces)
    name, limits = _shown(frames, colour_by)
    look = HeapLook(azimuth_deg=experiment.view[0], elevation_deg=experiment.view[1], size=size)
    return [
        heap_picture(
            frame.snapshot,
            colour_by=name,
            walls=walls,
            look=look,
            limits=limits,
            bounds=bounds,
            path=path,
        )
        for frame, walls in zip(frames, surfaces, strict=True)
    ]


def _shown(frames: Sequence[Frame], colour_by: str | None) -> tuple[str, tuple[float, float]]:
    """Return what colours the grains and its limits over all frames."""
    if colour_by is not None:
        return colour_by, _limits(frames, quantity_named(colour_by))
    limits = _limits(frames, quantity_named("speed"))
    return ("speed", limits) if limits[1] > AT_REST else ("height", _limits(frames, quantity_named("height")))


def _limits(frames: Sequence[Frame], quantity: Quantity) -> tuple[float, float]:
    return limits_of(np.concatenate([quantity.of(frame.snapshot) for frame in frames]), quantity)


def _top(frames: Sequence[Frame]) -> float:
    """Return the height up to which walls are worth drawing [m]."""
    heights = [Grains.of(frame.snapshot).bounds[:, 2] for frame in frames]
    low, high = float(np.min(heights)), float(np.max(heights))
    return high + ABOVE * (high - low)


def _surfaces(experiment: Experiment, model: Model, frame: Frame, top: float) -> list[pv.PolyData]:
    """Return the walls that are there, where they are now, as far as they lie in the domain and below a height."""
    lower, upper = (np.asarray(corner, float) for corner in experiment.parts()[0].scene(model).domain)
    box = np.column_stack([lower, [upper[0], upper[1], min(upper[2], top)]]).ravel()
    surfaces = []
    for wall in experiment.parts()[0].walls(model):
        if wall.name in frame.walls:
            moved = wall_surface(wall).translate(frame.walls[wall.name] - np.asarray(wall.motion.centre, float))
            kept = moved.clip_box(box, invert=False).extract_surface(algorithm=None)
            surfaces += [kept] if kept.n_points else []
    return surfaces


def _bounds(frames: Sequence[Frame], surfaces: Sequence[Sequence[pv.PolyData]]) -> NDArray[np.float64]:
    """Return the lowest and highest x, y, z of all that is drawn [m], (2, 3)."""
    corners = [Grains.of(frame.snapshot).bounds for frame in frames]
    corners += [np.asarray(s.bounds).reshape(3, 2).T for each in surfaces for s in each]
    points = np.concatenate(corners)
    return np.stack([points.min(axis=0), points.max(axis=0)])
