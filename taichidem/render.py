"""Pictures of grains, drawn off screen: side views to measure in, and heap pictures to look at."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError
from taichidem.grains import Grains
from taichidem.render_grains import add_grains, grain_mesh, shape_surface
from taichidem.render_heap import heap_picture
from taichidem.render_scene import off_screen, save_picture, shoot
from taichidem.render_walls import Wall, wall_surfaces
from taichidem.snapshot import Snapshot

__all__ = ["SideView", "grain_mesh", "heap_picture", "save_picture", "shape_surface", "side_view", "side_views"]

GRAIN_COLOUR = (38, 84, 138)
WALL_COLOUR = (150, 156, 164)
USUAL_WIDTH_PX = 1100
LARGEST_SIDE_PX = 8000
MARGIN = 0.12


@dataclass(frozen=True)
class SideView:
    """A picture without perspective, seen horizontally.

    Attributes
    ----------
    image : red, green, blue, shape (rows, columns, 3), uint8.
    azimuth_deg : where the camera stands [deg]; 0 on +x looking along −x, 90 on +y.
    pixels_per_metre : scale [px/m].
    origin_px : column and row of the point x = y = z = 0 [px].
    """

    image: NDArray[np.uint8]
    azimuth_deg: float
    pixels_per_metre: float
    origin_px: tuple[float, float]

    def pixel(self, point: Sequence[float]) -> tuple[float, float]:
        """Return column and row of a point x, y, z [m]."""
        azimuth = math.radians(self.azimuth_deg)
        across = -math.sin(azimuth) * point[0] + math.cos(azimuth) * point[1]
        column, row = self.origin_px
        return column + across * self.pixels_per_metre, row - point[2] * self.pixels_per_metre

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the picture as PNG; raises InputError where that can't be done."""
        return save_picture(self.image, path)


def side_view(grains: Grains | Snapshot, azimuth_deg: float = 0.0, **options: Any) -> SideView:
    """Draw grains from the side, without perspective; see `side_views` for the options and errors."""
    return side_views(grains, [azimuth_deg], **options)[0]


def side_views(
    grains: Grains | Snapshot,
    azimuths_deg: Iterable[float],
    *,
    pixels_per_metre: float | None = None,
    walls: Iterable[Wall] = (),
    extent: tuple[float, float, float] | None = None,
) -> list[SideView]:
    """Draw grains from the side, without perspective, from several azimuths on one scale.

    Parameters
    ----------
    grains : of any form, such as those of a snapshot, or `Grains.spheres(positions, radii)`.
    azimuths_deg : where the camera stands [deg], 0 on +x, 90 on +y.
    pixels_per_metre : scale [px/m]; None makes the picture 1100 px wide.
    walls : walls of a scene, or surfaces, drawn opaque in grey.
    extent : half-width, lowest and highest z of the picture [m]; None takes in all grains.

    Raises
    ------
    InputError : wrong shapes or values, or a picture wider or higher than 8000 px.
    EnvironmentProblem : nothing can be drawn on this machine; the message names the cure.
    """
    grains = Grains.of(grains)
    half_width, low, high = _extent(grains, extent)
    scale = USUAL_WIDTH_PX / (2.0 * half_width) if pixels_per_metre is None else float(pixels_per_metre)
    if not (math.isfinite(scale) and scale > 0):
        raise InputError(f"pixels_per_metre given: {pixels_per_metre}. Allowed: a positive number, or None.")
    columns, rows = round(2.0 * half_width * scale), round((high - low) * scale)
    if not (min(columns, rows) >= 1 and max(columns, rows) <= LARGEST_SIDE_PX):
        raise InputError(
            f"The picture would be {columns} × {rows} pixels. Allowed: 1 to {LARGEST_SIDE_PX} each way. "
            "Change pixels_per_metre or extent."
        )
    surfaces = wall_surfaces(walls)
    views = []
    with off_screen((columns, rows)) as plotter:
        _fill(plotter, grains, surfaces)
        for azimuth in azimuths_deg:
            _aim_level(plotter, float(azimuth), (low + rows / scale / 2.0), rows / scale / 2.0)
            image = shoot(plotter)
            # Pixel centres: column c shows across = (c + 1/2 − columns/2)/scale.
            origin = (columns / 2.0 - 0.5, rows - 0.5 + low * scale)
            views.append(SideView(image, float(azimuth), scale, origin))
    return views


def _fill(plotter: Any, grains: Grains, surfaces: list[pv.PolyData]) -> None:
    """Put grains and walls into a scene, each opaque in one colour."""
    # Without a graphics card smoothed edges cost spheres, whose own edges are never smoothed, a third more time, and meshes
    # five times as much.
    plotter.render_window.SetMultiSamples(0)
    add_grains(plotter, grains, np.full((len(grains), 3), GRAIN_COLOUR, np.uint8))
    for surface in surfaces:
        plotter.add_mesh(surface, color=WALL_COLOUR, render=False)


def _extent(grains: Grains, extent: tuple[float, float, float] | None) -> tuple[float, float, float]:
    """Return half-width, lowest and highest z of the picture, the same for every azimuth."""
    if extent is not None:
        half_width, low, high = (float(value) for value in extent)
        if not (all(map(math.isfinite, (half_width, low, high))) and half_width > 0 and low < high):
            raise InputError(f"extent given: {extent}. Allowed: half-width > 0 and lowest < highest z, in metres.")
        return half_width, low, high
    x, y, _ = grains.element_centre.T
    half_width = float((np.hypot(x, y) + grains.forms.radius).max())
    low, high = (float(z) for z in grains.bounds[:, 2])
    margin = MARGIN * max(half_width, (high - low) / 2.0)
    return half_width + margin, low - margin, high + margin


def _aim_level(plotter: Any, azimuth_deg: float, middle: float, half_height: float) -> None:
    """Look at the axis at height `middle` from an azimuth, along the horizontal, without perspective."""
    azimuth = math.radians(azimuth_deg)
    away = 10.0
    plotter.enable_parallel_projection()
    plotter.camera.position = (away * math.cos(azimuth), away * math.sin(azimuth), middle)
    plotter.camera.focal_point = (0.0, 0.0, middle)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.camera.parallel_scale = half_height
    plotter.renderer.ResetCameraClippingRange()
