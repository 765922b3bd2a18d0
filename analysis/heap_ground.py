"""Part a heap from the table or ground it stands on, where both have the same colour."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.flank_regression import FlankLine, fit_line
from analysis.heap_refusal import no_heap

EDGE_SHARE = 0.05
NARROWEST_EDGE = 8
LARGEST_BEND_DEG = 4.0
LOWEST_RISE_PX = 3.0
LOWEST_RISE_SHARE = 0.03


@dataclass(frozen=True)
class BaseLine:
    """The tilt of the horizontal in a picture [deg], positive where it rises to the right, and its source."""

    tilt_deg: float
    source: str


def touches(component: NDArray[np.uint8], side: str) -> bool:
    """Return whether a region reaches an edge of the frame: "top", "left" or "right"."""
    edge = {"top": component[0], "left": component[:, 0], "right": component[:, -1]}[side]
    return bool(edge.any())


def cut_at_ground(component: NDArray[np.uint8], name: str) -> tuple[NDArray[np.uint8], BaseLine]:
    """Return the part of a region that rises above the ground line, and that line.

    The ground is the straight line through the upper edge of the region at both sides of the picture.

    Parameters
    ----------
    component : 1 in the region that reaches both sides of the frame, shape (rows, columns).

    Raises
    ------
    AnalysisError : one side only is reached, the edge bends there (a heap cut by the frame), or
        nothing rises above the ground.
    """
    if not (touches(component, "left") and touches(component, "right")):
        raise no_heap(name, "what stands out is cut by one side of the picture")
    columns = np.flatnonzero(component.any(axis=0))
    upper = -np.argmax(component[:, columns] > 0, axis=0).astype(np.float64)
    line = _ground(columns.astype(np.float64), upper, name)
    rise = upper - (line.intercept + line.slope * columns)
    first, last = _highest_run(rise)
    if rise.max() < LOWEST_RISE_PX or last - first < 2 * NARROWEST_EDGE:
        raise no_heap(name, "nothing rises above the ground line")
    return _above(component, line, columns[first], columns[last]), BaseLine(
        math.degrees(math.atan(line.slope)), "ground line"
    )


def _ground(columns: NDArray[np.float64], upper: NDArray[np.float64], name: str) -> FlankLine:
    """Return the line through the upper edge beside the heap, heights upwards."""
    edge = max(NARROWEST_EDGE, int(EDGE_SHARE * columns.size))
    left, right = fit_line(columns[:edge], upper[:edge]), fit_line(columns[-edge:], upper[-edge:])
    if abs(left.angle_deg - right.angle_deg) > LARGEST_BEND_DEG:
        raise no_heap(name, "the heap is cut by the sides of the picture")
    used = np.zeros(columns.size, dtype=bool)
    used[:edge] = used[-edge:] = True
    for _ in range(4):
        line = fit_line(columns[used], upper[used])
        used = np.abs(upper - line.intercept - line.slope * columns) < LOWEST_RISE_PX
        used[:edge] = used[-edge:] = True
    return line


def _highest_run(rise: NDArray[np.float64]) -> tuple[int, int]:
    """Return first and last column of the run around the summit that is clear of the ground."""
    clear = rise > max(LOWEST_RISE_PX, LOWEST_RISE_SHARE * float(rise.max()))
    summit = int(np.argmax(rise))
    low = np.flatnonzero(~clear[:summit])
    high = np.flatnonzero(~clear[summit:])
    first = int(low[-1]) + 1 if low.size else 0
    last = summit + int(high[0]) - 1 if high.size else rise.size - 1
    return first, last


def _above(component: NDArray[np.uint8], line: FlankLine, first: int, last: int) -> NDArray[np.uint8]:
    rows, columns = np.indices(component.shape)
    keep = (columns >= first) & (columns <= last) & (-rows >= line.intercept + line.slope * columns)
    return (component * keep).astype(np.uint8)
