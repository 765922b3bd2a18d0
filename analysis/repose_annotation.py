"""Draw on a heap picture what was measured in it: outline, fit window, flank lines, angles."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.flank_regression import FlankLine
from analysis.repose_view import ReposeView

Picture = NDArray[np.uint8]
Point = tuple[float, float]

WIDTH = 1100
OUTLINE = (60, 200, 60)
FLANKS = ((40, 60, 235), (235, 120, 20))  # left red, right blue (BGR)
BASE = (120, 120, 120)
INK = (40, 30, 30)
PAPER = (255, 255, 255)
STRIP = 64
FONT = cv2.FONT_HERSHEY_DUPLEX
SUBPIXEL_BITS = 4


def annotate_view(view: ReposeView) -> Picture:
    """Return the region of interest with outline, window, flank lines and angles drawn on it, BGR."""
    scale = WIDTH / view.picture.shape[1]
    interpolation = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
    canvas = np.asarray(cv2.resize(view.picture, None, fx=scale, fy=scale, interpolation=interpolation), np.uint8)
    _shade_windows(canvas, view, scale)
    _draw_outline(canvas, view, scale)
    _draw_base(canvas, view, scale)
    for side, line, colour in ((-1.0, view.left, FLANKS[0]), (1.0, view.right, FLANKS[1])):
        _draw_flank(canvas, view, (side, scale), line, colour)
    tilt = round(view.silhouette.tilt_deg, 1) + 0.0
    caption = (
        f"{view.name}:  left {view.left.angle_deg:.1f}°  right {view.right.angle_deg:.1f}°  "
        f"mean {view.angle_deg:.1f}°  tilt {tilt:.1f}° ({view.silhouette.tilt_source})"
    )
    return np.vstack([_strip(caption, WIDTH, 0.75), canvas])


def contact_sheet(pictures: Sequence[Picture], angle: float, uncertainty: float) -> Picture:
    """Return the annotated views under one another in two columns, with the combined angle on top, BGR."""
    columns = 1 if len(pictures) == 1 else 2
    height = max(picture.shape[0] for picture in pictures)
    cells = [_pad(picture, height) for picture in pictures]
    cells += [np.full_like(cells[0], 255)] * (-len(cells) % columns)
    rows = [np.hstack(cells[start : start + columns]) for start in range(0, len(cells), columns)]
    sheet = np.vstack(rows)
    title = f"Angle of repose {angle:.1f}° ± {uncertainty:.1f}° (standard uncertainty)"
    return np.vstack([_strip(title, sheet.shape[1], 1.0), sheet])


def _pad(picture: Picture, height: int) -> Picture:
    missing = height - picture.shape[0]
    return np.asarray(cv2.copyMakeBorder(picture, 0, missing, 0, 0, cv2.BORDER_CONSTANT, value=PAPER), np.uint8)


def _strip(text: str, width: int, size: float) -> Picture:
    strip = np.full((STRIP, width, 3), 255, dtype=np.uint8)
    _text(strip, text, (18.0, STRIP * 0.64), size, INK)
    return strip


def _point(view: ReposeView, distance: float, height: float, scale: float) -> Point:
    """Return where a point given by distance from the axis and height above the base lies on the canvas."""
    column, row = view.silhouette.pixel(view.axis + distance, height)
    return (column + 0.5) * scale, (row + 0.5) * scale


def _fixed(points: Sequence[Point]) -> NDArray[np.int32]:
    """Return points in OpenCV's fixed-point pixels."""
    return np.round(np.array(points) * (1 << SUBPIXEL_BITS)).astype(np.int32)


def _polyline(canvas: Picture, points: Sequence[Point], colour: tuple[int, int, int], width: int) -> None:
    cv2.polylines(canvas, [_fixed(points)], False, colour, width, cv2.LINE_AA, SUBPIXEL_BITS)


def _shade_windows(canvas: Picture, view: ReposeView, scale: float) -> None:
    """Tint the two parts of the picture that the lines are fitted over."""
    tint = canvas.copy()
    low, high = view.window.limits(view.half_width)
    top = max(view.left.intercept, view.right.intercept) * 1.08
    for side, colour in ((-1.0, FLANKS[0]), (1.0, FLANKS[1])):
        corners = [(low, 0.0), (low, top), (high, top), (high, 0.0)]
        shape = [_point(view, side * distance, height, scale) for distance, height in corners]
        cv2.fillPoly(tint, [_fixed(shape)], colour, cv2.LINE_AA, SUBPIXEL_BITS)
    cv2.addWeighted(tint, 0.16, canvas, 0.84, 0.0, dst=canvas)


def _draw_outline(canvas: Picture, view: ReposeView, scale: float) -> None:
    silhouette = view.silhouette
    points = [
        _point(view, across - view.axis, height, scale)
        for across, height in zip(silhouette.across, silhouette.height, strict=True)
    ]
    _polyline(canvas, points, OUTLINE, 4)


def _draw_base(canvas: Picture, view: ReposeView, scale: float) -> None:
    reach = 1.12 * view.half_width
    _polyline(canvas, [_point(view, -reach, 0.0, scale), _point(view, reach, 0.0, scale)], BASE, 2)
    top = 1.05 * max(view.left.intercept, view.right.intercept)
    for part in range(0, 20, 2):
        dash = [_point(view, 0.0, top * (part + step) / 20.0, scale) for step in (0, 1)]
        _polyline(canvas, dash, BASE, 1)


def _draw_flank(
    canvas: Picture, view: ReposeView, place: tuple[float, float], line: FlankLine, colour: tuple[int, int, int]
) -> None:
    """Draw a flank's line, bold in the window, with its angle beside it."""
    side, scale = place
    ends = (0.0, 1.08 * view.half_width)
    _polyline(canvas, [_point(view, side * end, line.height(end), scale) for end in ends], colour, 1)
    bold = [_point(view, side * end, line.height(end), scale) for end in (line.low, line.high)]
    _polyline(canvas, bold, colour, 3)
    label = f"{line.angle_deg:.1f}°"
    (width, _), _ = cv2.getTextSize(label, FONT, 1.2, 2)
    top = max(view.left.intercept, view.right.intercept) * 1.08
    column, row = _point(view, side * (line.low + line.high) / 2.0, top, scale)
    _text(canvas, label, (column - width / 2.0, max(row - 14.0, 40.0)), 1.2, colour)


def _text(canvas: Picture, text: str, place: Point, size: float, colour: tuple[int, int, int]) -> None:
    """Write text with a white rim; "°" and "±" are drawn, as OpenCV's fonts stop at ASCII."""
    column, row = place
    for part in text.replace("°", "\0°\0").replace("±", "\0±\0").split("\0"):
        if part in ("°", "±"):
            column += _symbol(canvas, part, (column, row), size, colour)
            continue
        origin = (round(column), round(row))
        thick = 2 if size >= 1 else 1
        cv2.putText(canvas, part, origin, FONT, size, PAPER, thick + 4, cv2.LINE_AA)
        cv2.putText(canvas, part, origin, FONT, size, colour, thick, cv2.LINE_AA)
        (width, _), _ = cv2.getTextSize(part, FONT, size, thick)
        column += width


def _symbol(canvas: Picture, symbol: str, place: Point, size: float, colour: tuple[int, int, int]) -> float:
    """Draw a degree or plus-minus sign and return its width."""
    column, row = place
    thick = 2 if size >= 1 else 1
    if symbol == "°":
        centre = (round(column + 6 * size), round(row - 19 * size))
        cv2.circle(canvas, centre, round(4.5 * size), colour, thick, cv2.LINE_AA)
        return 13.0 * size
    arm = 8 * size
    middle, plus = column + arm + 2, row - 12 * size
    for start, end in (
        ((middle - arm, plus), (middle + arm, plus)),
        ((middle, plus - arm), (middle, plus + arm)),
        ((middle - arm, row - size), (middle + arm, row - size)),
    ):
        _polyline(canvas, [start, end], colour, thick)
    return 2.0 * arm + 4.0
