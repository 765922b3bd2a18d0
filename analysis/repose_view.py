"""The angle of repose in one picture: both flanks, the window, and what the number depends on."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.flank_regression import FlankLine, fit_flank
from analysis.heap_refusal import no_heap
from analysis.heap_silhouette import Silhouette, trace_silhouette
from analysis.picture_binary import BinaryImage, binarise
from analysis.picture_input import crop
from analysis.repose_image_settings import ImageSettings
from analysis.repose_window import FitWindow

FEWEST_COLUMNS = 12
FLATTEST_DEG = 2.0
STEEPEST_DEG = 75.0
LARGEST_DIFFERENCE_DEG = 20.0
SMALLEST_DETERMINATION = 0.35
LOWEST_SUMMIT = 0.85
# Shares of Otsu's threshold that a careful eye would have accepted as well.
THRESHOLD_FACTORS = (0.75, 1.25)


@dataclass(frozen=True)
class ReposeView:
    """The flanks of a heap in one picture.

    Attributes
    ----------
    name : what the picture is called.
    left, right : the two flank lines; distances from the axis and heights above the base [px].
    silhouette : outline, base and tilt, in pixels of the region of interest.
    corner : column and row of the region's upper left corner in the picture [px].
    axis : position of the heap's axis along the base [px].
    half_width : half-width of the base that the window refers to [px].
    window : the window used.
    window_angles_deg : mean of both flanks over each neighbouring window [deg].
    threshold_angles_deg : the same at 0.75 and 1.25 times the threshold [deg].
    picture : the region of interest, BGR.
    """

    name: str
    left: FlankLine
    right: FlankLine
    silhouette: Silhouette
    corner: tuple[int, int]
    axis: float
    half_width: float
    window: FitWindow
    window_angles_deg: tuple[float, ...]
    threshold_angles_deg: tuple[float, ...]
    picture: NDArray[np.uint8]

    @property
    def angle_deg(self) -> float:
        """Mean of the left and the right flank [deg]; a tilt that was missed cancels in it."""
        return (self.left.angle_deg + self.right.angle_deg) / 2.0


def measure_view(picture: NDArray[np.uint8], settings: ImageSettings, name: str) -> ReposeView:
    """Measure both flanks in one picture.

    Parameters
    ----------
    picture : BGR, shape (rows, columns, 3).
    settings : region, window, scale, tilt.
    name : the picture's name in messages.

    Raises
    ------
    AnalysisError : no heap with two flanks is seen.
    """
    part, corner = crop(picture, settings.region)
    binary = binarise(part, settings.noise_filter_px, name)
    silhouette = trace_silhouette(binary.mask(), settings.tilt_deg, name)
    half_width = settings.half_width(silhouette.half_width, name)
    axis = silhouette.middle if settings.axis_px is None else silhouette.along_base(settings.axis_px - corner[0])
    left, right = _flanks(silhouette, axis, half_width, settings.window)
    _check_flanks(left, right, name)
    _check_summit(silhouette, axis, left, right, name)
    view = ReposeView(name, left, right, silhouette, corner, axis, half_width, settings.window, (), (), part)
    return replace(
        view,
        window_angles_deg=_window_angles(view),
        threshold_angles_deg=_threshold_angles(view, binary, settings),
    )


def _flanks(silhouette: Silhouette, axis: float, half_width: float, window: FitWindow) -> tuple[FlankLine, FlankLine]:
    distance = silhouette.across - axis
    limits = window.limits(half_width)
    left = fit_flank(-distance, silhouette.height, limits, FEWEST_COLUMNS)
    return left, fit_flank(distance, silhouette.height, limits, FEWEST_COLUMNS)


def _check_flanks(left: FlankLine, right: FlankLine, name: str) -> None:
    """Refuse what doesn't fall away to both sides in about the same straight way."""
    angles = (left.angle_deg, right.angle_deg)
    seen = f"left flank {angles[0]:.1f}°, right flank {angles[1]:.1f}°"
    if min(angles) < FLATTEST_DEG or max(angles) > STEEPEST_DEG:
        raise no_heap(name, f"it has no two flanks of {FLATTEST_DEG:.0f}–{STEEPEST_DEG:.0f}° ({seen})")
    if abs(angles[0] - angles[1]) > LARGEST_DIFFERENCE_DEG:
        raise no_heap(name, f"its flanks differ by more than {LARGEST_DIFFERENCE_DEG:.0f}° ({seen})")
    worst = min(left.determination, right.determination)
    if worst < SMALLEST_DETERMINATION:
        raise no_heap(name, f"its flanks are no straight lines (R² = {worst:.2f}; {seen})")


def _check_summit(silhouette: Silhouette, axis: float, left: FlankLine, right: FlankLine, name: str) -> None:
    """Refuse an outline that falls away between its flanks: two heaps, or a heap with a hole."""
    central = np.abs(silhouette.across - axis) <= left.low / 2.0
    shoulder = (left.height(left.low) + right.height(right.low)) / 2.0
    if central.any() and np.median(silhouette.height[central]) < LOWEST_SUMMIT * shoulder:
        raise no_heap(name, "the outline dips between its two flanks, as that of two heaps does")


def _mean_angle(silhouette: Silhouette, axis: float, half_width: float, window: FitWindow) -> float:
    try:
        left, right = _flanks(silhouette, axis, half_width, window)
    except AnalysisError:
        # A neighbouring window may leave the picture; the window asked for didn't.
        return math.nan
    return (left.angle_deg + right.angle_deg) / 2.0


def _window_angles(view: ReposeView) -> tuple[float, ...]:
    angles = (_mean_angle(view.silhouette, view.axis, view.half_width, window) for window in view.window.alternatives())
    return tuple(angle for angle in angles if math.isfinite(angle))


def _threshold_angles(view: ReposeView, binary: BinaryImage, settings: ImageSettings) -> tuple[float, ...]:
    angles = []
    for factor in THRESHOLD_FACTORS:
        try:
            silhouette = trace_silhouette(binary.mask(factor), settings.tilt_deg, view.name)
        except AnalysisError:
            # Too bold a threshold swallows a faint heap; the angle then rests on the others.
            continue
        angles.append(_mean_angle(silhouette, view.axis, view.half_width, view.window))
    return tuple(angle for angle in angles if math.isfinite(angle))
