"""A picture of a heap to look at: grains coloured by a quantity, the cup as glass, a scale bar."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError
from taichidem.grains import Array, Grains
from taichidem.render_colours import Shown, shown
from taichidem.render_grains import add_grains
from taichidem.render_scene import off_screen, save_picture, shoot
from taichidem.render_walls import Wall, wall_surfaces
from taichidem.snapshot import Snapshot

INK = "#27313c"
GLASS = "#7f93a8"
COLOUR_MAP = "viridis"
FREE_SPACE = 1.28
ROUND_LENGTHS = (1.0, 2.0, 5.0)
USUAL_LABELS = 5


@dataclass(frozen=True)
class HeapLook:
    """How a heap picture looks.

    Parameters
    ----------
    azimuth_deg : where the camera stands [deg], 0 on +x, 90 on +y.
    elevation_deg : height of the camera above the horizontal [deg], 0–89.
    size : columns and rows of the picture [px].
    colour_map : name of a matplotlib colour map.
    title : a line at the top; empty for none.

    Raises
    ------
    InputError : an elevation or size outside its bounds.
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 18.0
    size: tuple[int, int] = (1600, 1000)
    colour_map: str = COLOUR_MAP
    title: str = ""

    def __post_init__(self) -> None:
        if not 0.0 <= self.elevation_deg <= 89.0:
            raise InputError(f"elevation_deg given: {self.elevation_deg}. Allowed: 0 to 89 degrees.")
        if len(self.size) != 2 or not all(100 <= side <= 8000 for side in self.size):
            raise InputError(f"size given: {self.size}. Allowed: columns and rows, each 100 to 8000 pixels.")


def heap_picture(
    grains: Grains | Snapshot,
    *,
    colour_by: str | None = None,
    values: Any = None,
    value_name: str = "",
    walls: Iterable[Wall] = (),
    look: HeapLook | None = None,
    path: str | os.PathLike[str] | None = None,
    limits: tuple[float, float] | None = None,
    bounds: Any = None,
) -> NDArray[np.uint8]:
    """Draw a heap in perspective, coloured by a quantity, with its walls as glass and a scale bar.

    Parameters
    ----------
    grains : of any form, such as those of a snapshot, or `Grains.spheres(positions, radii)`.
    colour_by : name of the quantity that colours the grains, one of `render_colours.QUANTITIES`; all but the height
        need a snapshot. None takes the height.
    values : any other quantity that colours the grains, shape (n,), in place of `colour_by`.
    value_name : its name and unit, beside the colour bar.
    walls : walls of a scene, or surfaces.
    look : camera, size, colour map, title.
    path : where to write the picture as PNG; None writes none.
    limits : lowest and highest value of the colours; None takes those of the grains.
    bounds : lowest and highest x, y, z that the camera takes in [m], shape (2, 3); None takes in all that is drawn.

    Returns
    -------
    red, green, blue, shape (rows, columns, 3), uint8.

    Raises
    ------
    InputError : wrong shapes or values, or a file that can't be written.
    EnvironmentProblem : nothing can be drawn on this machine; the message names the cure.
    """
    look = look if look is not None else HeapLook()
    quantity = shown(grains, colour_by, values, value_name)
    grains, surfaces = Grains.of(grains), wall_surfaces(walls)
    low, high = limits if limits is not None else quantity.limits
    limits = (low, max(high, low + 1e-12))
    colours = _colours(np.clip(quantity.values, *limits), limits, look.colour_map)
    with off_screen(look.size) as plotter:
        plotter.enable_anti_aliasing("ssaa")
        plotter.set_background("white", top="#dfe7ee")
        table = pv.LookupTable(look.colour_map, scalar_range=limits)
        add_grains(plotter, grains, colours)
        _add_glass(plotter, surfaces)
        bounds = _bounds(grains, surfaces) if bounds is None else np.asarray(bounds, float)
        _add_scale_bar(plotter, bounds, look)
        _add_colour_bar(plotter, table, quantity)
        if look.title:
            plotter.add_text(look.title, position=(0.03, 0.93), viewport=True, font_size=16, color=INK)
        _aim(plotter, bounds, look)
        image = shoot(plotter)
    if path is not None:
        save_picture(image, path)
    return image


def _colours(values: Array, limits: tuple[float, float], colour_map: str) -> NDArray[np.uint8]:
    from matplotlib import colormaps

    if colour_map not in colormaps:
        raise InputError(f"colour_map given: {colour_map!r}. Allowed: a name matplotlib knows, such as 'viridis'.")
    share = (values - limits[0]) / (limits[1] - limits[0])
    return np.asarray(np.round(colormaps[colour_map](share)[:, :3] * 255), dtype=np.uint8)


def _bounds(grains: Grains, surfaces: list[pv.PolyData]) -> Array:
    """Return the lowest and highest x, y, z of everything drawn [m], shape (2, 3)."""
    corners = [*grains.bounds]
    corners += [np.array(surface.bounds)[start::2] for surface in surfaces for start in (0, 1)]
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)])


def _add_glass(plotter: Any, surfaces: list[pv.PolyData]) -> None:
    for surface in surfaces:
        plotter.add_mesh(surface, color=GLASS, opacity=0.28, specular=0.6, specular_power=40, render=False)
        edges = surface.extract_feature_edges(
            boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
        )
        if edges.n_points:
            plotter.add_mesh(edges, color=INK, line_width=2.5, opacity=0.8, render=False)


def _round_length(longest: float) -> float:
    """Return the largest of 1, 2, 5 · 10ⁿ that isn't above `longest`."""
    power = 10.0 ** math.floor(math.log10(longest))
    return max(step * power for step in ROUND_LENGTHS if step * power <= longest * (1 + 1e-9))


def _sideways(look: HeapLook) -> Array:
    azimuth = math.radians(look.azimuth_deg)
    return np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])


def _add_scale_bar(plotter: Any, bounds: Array, look: HeapLook) -> None:
    """Lay a bar of a round length on the floor in front of the heap, with its length under it."""
    span = float(np.hypot(*(bounds[1] - bounds[0])[:2]) / math.sqrt(2.0))
    length = _round_length(span / 3.0)
    azimuth = math.radians(look.azimuth_deg)
    middle = (bounds[0] + bounds[1]) / 2.0
    middle[2] = bounds[0, 2]
    front = middle + 0.62 * span * np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    half = _sideways(look) * length / 2.0
    bar = pv.Line(front - half, front + half).tube(radius=0.006 * span)
    plotter.add_mesh(bar, color=INK, ambient=1.0, diffuse=0.0, render=False)
    for end in (front - half, front + half):
        tick = pv.Line(end, end + np.array([0.0, 0.0, 0.03 * span])).tube(radius=0.006 * span)
        plotter.add_mesh(tick, color=INK, ambient=1.0, diffuse=0.0, render=False)
    label = f"{length * 1e3:.4g} mm" if length < 1.0 else f"{length:.4g} m"
    plotter.add_point_labels(
        [front - np.array([0.0, 0.0, 0.035 * span])],
        [label],
        font_size=24,
        text_color=INK,
        shape=None,
        show_points=False,
        always_visible=True,
        justification_horizontal="center",
        justification_vertical="top",
        render=False,
    )


def _add_colour_bar(plotter: Any, table: Any, quantity: Shown) -> None:
    # The grains' own mappers take ready colours; this one, in no scene, only lends its table.
    owner = pv.DataSetMapper()
    owner.lookup_table = table
    owner.scalar_range = table.scalar_range
    plotter.add_scalar_bar(
        title=f"{quantity.label}\n",
        mapper=owner,
        vertical=True,
        position_x=0.88,
        position_y=0.2,
        width=0.045,
        height=0.6,
        n_labels=_labels(quantity, float(np.ptp(table.scalar_range))),
        fmt="%.0f" if np.ptp(table.scalar_range) > 20 else "%.3g",
        title_font_size=22,
        label_font_size=20,
        color=INK,
        render=False,
    )


def _labels(quantity: Shown, span: float) -> int:
    """Return how many numbers stand beside the colour bar: one for each where these are few and whole."""
    return round(span) + 1 if quantity.whole and 1 <= span <= 6 else USUAL_LABELS


def _aim(plotter: Any, bounds: Array, look: HeapLook) -> None:
    """Look at the middle of everything drawn, from far enough to see it whole."""
    azimuth, elevation = math.radians(look.azimuth_deg), math.radians(look.elevation_deg)
    toward = np.array(
        [math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)]
    )
    view = math.radians(26.0)
    lowest, highest = bounds
    half_width = 0.5 * float(np.hypot(*(highest - lowest)[:2])) / math.sqrt(2.0)
    # As an upright cylinder is seen: its height foreshortened, and its round ends opened.
    half_height = 0.5 * float(highest[2] - lowest[2]) * math.cos(elevation) + half_width * math.sin(elevation)
    aspect = look.size[0] / look.size[1]
    away = half_width + FREE_SPACE * max(half_height, half_width / (0.8 * aspect)) / math.tan(view / 2.0)
    middle = (lowest + highest) / 2.0
    # Room below for the scale bar.
    middle[2] -= 0.12 * half_height
    plotter.camera.view_angle = math.degrees(view)
    plotter.camera.focal_point = tuple(middle)
    plotter.camera.position = tuple(middle + toward * away)
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.renderer.ResetCameraClippingRange()
