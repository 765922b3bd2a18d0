"""Look at a simulated heap from all around, and measure its angle in these pictures as in photographs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.errors import AnalysisError
from analysis.repose_image import ReposeImageReport, measure_repose_image
from analysis.repose_image_settings import ImageSettings
from taichidem.grains import Grains
from taichidem.render import SideView, side_views

AZIMUTHS = tuple(range(0, 180, 20))  # [deg], half a turn; the other half holds the same outlines mirrored
PIXELS_PER_METRE = 8000.0
WIDTHS_PX = (600.0, 3000.0)  # of a picture; the scale gives way where a heap is much smaller or larger than usual ones


def measure_heap(
    grains: Grains,
    base_radius: float,
    fit_from: float,
    fit_to: float,
    *,
    fewest: int = len(AZIMUTHS),
) -> ReposeImageReport:
    """Measure the angle of a heap on a base of known radius from side views all around it.

    Args:
        grains: those of the heap, of any form; z = 0 is its floor.
        base_radius: of the cup or of the heap [m].
        fit_from, fit_to: fit window in fractions of the base radius.
        fewest: views that must show a heap with two flanks; the others are left out. All by default.

    Raises:
        AnalysisError: fewer views show such a heap; the message says why the first other doesn't.
        EnvironmentProblem: nothing can be drawn on this machine.
    """
    reach = 1.15 * base_radius
    scale = min(max(PIXELS_PER_METRE, WIDTHS_PX[0] / (2 * reach)), WIDTHS_PX[1] / (2 * reach))
    top = float(grains.bounds[1, 2])
    extent = (reach, -0.1 * base_radius, top + 0.25 * base_radius)
    views = side_views(grains, AZIMUTHS, pixels_per_metre=scale, extent=extent)
    settings = ImageSettings(
        fit_from=fit_from,
        fit_to=fit_to,
        base_width_m=2 * base_radius,
        pixels_per_metre=scale,
        axis_px=views[0].origin_px[0],
        tilt_deg=0.0,
        channel_order="RGB",
    )
    try:
        return _measured(views, settings)
    except AnalysisError:
        good = [view for view in views if _shows_a_heap(view, settings)]
        if len(good) == len(views) or len(good) < fewest:
            raise
    return _measured(good, settings)


def grains_on_base(grains: Grains, base_radius: float) -> Grains:
    """Return the grains above z = 0 whose centres lie within 1.1 radii of a base [m], which make its heap."""
    x, y, z = grains.position.T
    return grains.rows((z > 0) & (np.hypot(x, y) < 1.1 * base_radius))


def _measured(views: Sequence[SideView], settings: ImageSettings) -> ReposeImageReport:
    return measure_repose_image([v.image for v in views], settings, [f"{v.azimuth_deg:.0f}°" for v in views])


def _shows_a_heap(view: SideView, settings: ImageSettings) -> bool:
    try:
        _measured([view], settings)
    except AnalysisError:
        return False
    return True
