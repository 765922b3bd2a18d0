"""Angle of repose from pictures of a heap, photographed or rendered, by one and the same procedure.

Region of interest → distance to the background's colour → black and white (Otsu) → noise filter →
outline in x and y → straight line through each flank over a stated window. Several views of one heap
are combined.

Source: Sudsawat, Chongchitpaisan, Arunyanart 2023, doi 10.21303/2461-4262.2023.002968; the paper
states the steps, not the window.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.picture_input import PictureSource, load_picture, picture_name
from analysis.repose_annotation import annotate_view, contact_sheet
from analysis.repose_image_settings import ImageSettings
from analysis.repose_view import ReposeView, measure_view
from analysis.repose_window import FitWindow, combine, window_uncertainty


@dataclass(frozen=True)
class ReposeImageReport:
    """Angle of repose from one or several pictures of a heap.

    Attributes
    ----------
    angle_deg : mean over views and flanks [deg].
    left_deg, right_deg : mean of the left and of the right flanks [deg].
    standard_uncertainty_deg : root of the sum of squares of `components` [deg].
    components : standard uncertainties [deg] of "flanks" (left against right), "views" (what the views
        scatter beyond that), "window" (neighbouring windows) and "threshold" (0.75–1.25 × Otsu's).
    window : the fit window, in fractions of the base half-width.
    half_width_px : half-width of the base, mean of the views [px].
    pixels_per_metre : scale, None where it isn't known.
    views : what was measured in each picture.
    annotated : outline, window, lines and angles drawn on the pictures, BGR, shape (rows, columns, 3).
    """

    angle_deg: float
    left_deg: float
    right_deg: float
    standard_uncertainty_deg: float
    components: dict[str, float]
    window: FitWindow
    half_width_px: float
    pixels_per_metre: float | None
    views: tuple[ReposeView, ...]
    annotated: NDArray[np.uint8]

    @property
    def text(self) -> str:
        """One paragraph for a reader who doesn't program."""
        largest = max(self.components, key=lambda name: self.components[name])
        count = len(self.views)
        return (
            f"Angle of repose {self.angle_deg:.1f}° ± {self.standard_uncertainty_deg:.1f}° (standard uncertainty), "
            f"left flank {self.left_deg:.1f}°, right flank {self.right_deg:.1f}°, from "
            f"{count} {'view' if count == 1 else 'views'}. Lines were laid through the flanks from "
            f"{self.window.fit_from:.2f} to {self.window.fit_to:.2f} of the base half-width. "
            f"The largest part of the uncertainty is {SOURCES[largest]}. "
            "How much another heap of the same grains would differ isn't in it."
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers as plain types for JSON."""
        return {
            "angle_deg": self.angle_deg,
            "left_deg": self.left_deg,
            "right_deg": self.right_deg,
            "standard_uncertainty_deg": self.standard_uncertainty_deg,
            "components_deg": dict(self.components),
            "method": "picture",
            "fit_from": self.window.fit_from,
            "fit_to": self.window.fit_to,
            "half_width_px": self.half_width_px,
            "pixels_per_metre": self.pixels_per_metre,
            "views": [_view_dict(view) for view in self.views],
            "text": self.text,
        }

    def save_annotated(self, path: str | os.PathLike[str]) -> Path:
        """Write the annotated picture; the ending chooses the format.

        Raises
        ------
        AnalysisError : the file can't be written.
        """
        target = Path(path)
        try:
            written = cv2.imwrite(str(target), self.annotated)
        except cv2.error:
            written = False
        if not written:
            raise AnalysisError(
                f"The annotated picture can't be written to {target}. Allowed: a path ending in .png or .jpg in a "
                "folder that exists and may be written to."
            )
        return target


SOURCES = {
    "flanks": "the scatter between the left and the right flank (more views help)",
    "views": "the scatter between the views (more views help)",
    "window": "the choice of the fit window (the flank isn't straight)",
    "threshold": "the threshold of the binary image (a plainer background helps)",
}


def measure_repose_image(
    pictures: PictureSource | Sequence[PictureSource],
    settings: ImageSettings | None = None,
    names: Sequence[str] | None = None,
) -> ReposeImageReport:
    """Measure the angle of repose of one heap in one or several pictures, θ = mean of atan(−slope) of the flanks.

    Parameters
    ----------
    pictures : a path or array, or a sequence of them: views of the same heap from different azimuths.
        Views 180° apart are mirror images of each other and add nothing; spread them over half a turn.
    settings : region, window, scale, tilt; None takes the defaults.
    names : what the views are called, such as their azimuths; None takes the file names.

    Raises
    ------
    AnalysisError : no picture, an unreadable one, or one without a heap that has two flanks.

    Source: Sudsawat et al. 2023, doi 10.21303/2461-4262.2023.002968.
    """
    settings = settings if settings is not None else ImageSettings()
    single = isinstance(pictures, (str, os.PathLike, np.ndarray))
    sources: list[PictureSource] = [pictures] if single else list(pictures)  # type: ignore[list-item, arg-type]
    if not sources:
        raise AnalysisError("Pictures given: none. Allowed: one picture or more. Give a path or an array.")
    labels = [picture_name(source, number) for number, source in enumerate(sources)] if names is None else list(names)
    if len(labels) != len(sources):
        raise AnalysisError(f"{len(labels)} names given for {len(sources)} pictures. Allowed: one name for each.")
    views = tuple(
        measure_view(load_picture(source, settings.channel_order), settings, label)
        for source, label in zip(sources, labels, strict=True)
    )
    return _report(views, settings)


def _report(views: tuple[ReposeView, ...], settings: ImageSettings) -> ReposeImageReport:
    components = _components(views)
    half_width = float(np.mean([view.half_width for view in views]))
    angle = float(np.mean([view.angle_deg for view in views]))
    total = combine(components)
    return ReposeImageReport(
        angle_deg=angle,
        left_deg=float(np.mean([view.left.angle_deg for view in views])),
        right_deg=float(np.mean([view.right.angle_deg for view in views])),
        standard_uncertainty_deg=total,
        components=components,
        window=settings.window,
        half_width_px=half_width,
        pixels_per_metre=settings.scale(half_width),
        views=views,
        annotated=contact_sheet([annotate_view(view) for view in views], angle, total),
    )


def _components(views: tuple[ReposeView, ...]) -> dict[str, float]:
    """Return the standard uncertainties of the mean, u² = Σ u_k²."""
    count = len(views)
    differences = np.array([view.left.angle_deg - view.right.angle_deg for view in views])
    # Two flanks of a view have the variance (left − right)²/2; the mean rests on 2·count of them.
    flanks = math.sqrt(float(np.mean(differences**2)) / 2.0 / (2.0 * count))
    means = np.array([view.angle_deg for view in views])
    # The scatter of the views' means holds that of their flanks: only what is left is counted here.
    scatter = float(means.std(ddof=1)) / math.sqrt(count) if count > 1 else 0.0
    return {
        "flanks": flanks,
        "views": math.sqrt(max(scatter**2 - flanks**2, 0.0)),
        "window": _shared(views, "window_angles_deg"),
        "threshold": _shared(views, "threshold_angles_deg"),
    }


def _shared(views: tuple[ReposeView, ...], attribute: str) -> float:
    """Return the uncertainty by a choice that moves all views together: its mean over the views."""
    return float(np.mean([window_uncertainty(view.angle_deg, list(getattr(view, attribute))) for view in views]))


def _view_dict(view: ReposeView) -> dict[str, Any]:
    return {
        "name": view.name,
        "angle_deg": view.angle_deg,
        "left_deg": view.left.angle_deg,
        "right_deg": view.right.angle_deg,
        "left_r_squared": view.left.determination,
        "right_r_squared": view.right.determination,
        "tilt_deg": view.silhouette.tilt_deg,
        "tilt_source": view.silhouette.tilt_source,
        "half_width_px": view.half_width,
    }
