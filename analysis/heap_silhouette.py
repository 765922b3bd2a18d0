"""The outline of a heap in a black-and-white picture, as heights above its level base.

Coordinates: column c to the right and row r downwards in the picture; x along the base and height at
right angles to it in the silhouette, x = c cos τ − r sin τ, y = −c sin τ − r cos τ, with τ the angle by
which the horizontal rises to the right in the picture (the camera's tilt).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.flank_regression import fit_line
from analysis.heap_ground import BaseLine, cut_at_ground, touches
from analysis.heap_refusal import no_heap

LARGEST_SHARE_OF_FRAME = 0.95
SMALLEST_SHARE_OF_FRAME = 0.002
SMALLEST_SHARE_OF_FOREGROUND = 0.6
SMALLEST_SOLIDITY = 0.6
ROUGHEST_BASE = 0.08
STEEPEST_TILT_DEG = 15.0
BASE_SHARE = 0.8


@dataclass(frozen=True)
class Silhouette:
    """The upper outline of a heap above its base.

    Attributes
    ----------
    across : position along the base [px], shape (n,).
    height : outline above the base [px], shape (n,).
    left, right : ends of the base on the same axis [px].
    tilt_deg : angle by which the horizontal rises to the right in the picture [deg].
    tilt_source : "base line", "ground line", "given" or "taken as level".
    level : y of the base [px].
    """

    across: NDArray[np.float64]
    height: NDArray[np.float64]
    left: float
    right: float
    tilt_deg: float
    tilt_source: str
    level: float

    @property
    def middle(self) -> float:
        """Middle of the base [px]."""
        return (self.left + self.right) / 2.0

    @property
    def half_width(self) -> float:
        """Half the width of the base [px]."""
        return (self.right - self.left) / 2.0

    def pixel(self, across: float, height: float) -> tuple[float, float]:
        """Return column and row of a point given along the base and above it."""
        tilt = math.radians(self.tilt_deg)
        y = height + self.level
        return (
            across * math.cos(tilt) - y * math.sin(tilt),
            -(across * math.sin(tilt) + y * math.cos(tilt)),
        )

    def along_base(self, column: float) -> float:
        """Return the position along the base of a column, taken at the height of the base."""
        tilt = math.radians(self.tilt_deg)
        return (column + self.level * math.sin(tilt)) / math.cos(tilt)


def trace_silhouette(mask: NDArray[np.uint8], tilt_deg: float | None, name: str) -> Silhouette:
    """Return the outline of the one heap in a binary image.

    Parameters
    ----------
    mask : 1 where the heap (and its stand) is, shape (rows, columns).
    tilt_deg : camera tilt, positive where the horizontal rises to the right [deg]; None finds it from
        the base of the heap, or from the ground line if that crosses the whole picture.
    name : the picture's name in messages.

    Raises
    ------
    AnalysisError : there is no heap, or it is cut by the frame.
    """
    component = _largest_component(mask, name)
    if touches(component, "top"):
        raise no_heap(name, "what stands out reaches the upper edge of the picture")
    ground = None
    if touches(component, "left") or touches(component, "right"):
        component, ground = cut_at_ground(component, name)
    outline = _outline(component, name)
    base = ground if ground is not None else _base_line(outline, component.shape[0])
    if tilt_deg is not None:
        base = BaseLine(tilt_deg, "given")
    if abs(base.tilt_deg) > STEEPEST_TILT_DEG:
        raise no_heap(
            name, f"its base is tilted by {base.tilt_deg:.1f}°, allowed are {STEEPEST_TILT_DEG:.0f}°; turn the picture"
        )
    return _level(outline, base, name)


def _largest_component(mask: NDArray[np.uint8], name: str) -> NDArray[np.uint8]:
    """Return the largest connected region, its holes filled."""
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    areas = [cv2.contourArea(contour) for contour in contours]
    if not areas or max(areas) < SMALLEST_SHARE_OF_FRAME * mask.size:
        raise no_heap(name, "nothing that stands out is larger than specks")
    largest = int(np.argmax(areas))
    if areas[largest] > LARGEST_SHARE_OF_FRAME * mask.size:
        raise no_heap(name, "what stands out fills the whole frame")
    if areas[largest] < SMALLEST_SHARE_OF_FOREGROUND * sum(areas):
        raise no_heap(name, f"what stands out falls into {len(areas)} pieces, and the largest is too small a part")
    filled = np.zeros_like(mask)
    cv2.drawContours(filled, contours, largest, 1, thickness=cv2.FILLED)
    return filled


def _outline(component: NDArray[np.uint8], name: str) -> NDArray[np.float64]:
    """Return columns and rows of the border pixels, shape (n, 2), of a compact region."""
    contours, _ = cv2.findContours(component, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        raise no_heap(name, "nothing rises above the ground line")
    contour = max(contours, key=cv2.contourArea)
    solidity = cv2.contourArea(contour) / max(cv2.contourArea(cv2.convexHull(contour)), 1.0)
    if solidity < SMALLEST_SOLIDITY:
        raise no_heap(name, f"its outline is ragged (it fills {solidity:.0%} of its hull)")
    return _dense(contour[:, 0, :].astype(np.float64))


def _dense(contour: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the closed outline with points at most half a pixel apart.

    Turned pixel centres can lie more than a pixel apart along the base; a bin would then hold a point
    of the lower edge only, and its top would be the base.
    """
    step = np.roll(contour, -1, axis=0) - contour
    return np.concatenate([contour + share * step for share in (0.0, 1 / 3, 2 / 3)])


def _base_line(outline: NDArray[np.float64], rows: int) -> BaseLine:
    """Return the tilt of the lower edge, or a level base where the frame hides it."""
    across, lower = _envelope(outline[:, 0], outline[:, 1])
    if np.mean(lower >= rows - 1.5) > 0.3:
        return BaseLine(0.0, "taken as level")
    middle = (across[0] + across[-1]) / 2.0
    used = np.abs(across - middle) <= BASE_SHARE * (across[-1] - across[0]) / 2.0
    for _ in range(3):
        line = fit_line(across[used], -lower[used])
        miss = np.abs(-lower - line.intercept - line.slope * across)
        used &= miss <= max(3.0 * float(np.median(miss[used])), 1.0)
    return BaseLine(math.degrees(math.atan(line.slope)), "base line")


def _level(outline: NDArray[np.float64], base: BaseLine, name: str) -> Silhouette:
    """Return the outline turned so that the base is level."""
    tilt = math.radians(base.tilt_deg)
    x = outline[:, 0] * math.cos(tilt) - outline[:, 1] * math.sin(tilt)
    y = -outline[:, 0] * math.sin(tilt) - outline[:, 1] * math.cos(tilt)
    across, upper = _envelope(x, y)
    _, lower = _envelope(x, -y)
    half_width = (x.max() - x.min()) / 2.0
    central = np.abs(across - (x.max() + x.min()) / 2.0) <= BASE_SHARE * half_width
    level = float(np.median(-lower[central]))
    roughness = float(np.sqrt(np.mean((-lower[central] - level) ** 2)))
    if roughness > ROUGHEST_BASE * half_width:
        raise no_heap(name, "what stands out has no straight base")
    return Silhouette(across, upper - level, float(x.min()), float(x.max()), base.tilt_deg, base.source, level)


def _envelope(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the largest y of the points in each bin of one pixel in x; empty bins are left out."""
    bins = np.round(x - x.min()).astype(np.intp)
    upper = np.full(bins.max() + 1, -np.inf)
    np.maximum.at(upper, bins, y)
    filled = np.flatnonzero(np.isfinite(upper))
    return x.min() + filled, upper[filled]
