"""Read pictures from files and arrays, and say clearly what is wrong with one that can't be used."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError

PictureSource: TypeAlias = str | os.PathLike[str] | NDArray[Any]
Region = tuple[int, int, int, int]

SMALLEST_SIDE = 40
READABLE = "PNG, JPEG, TIFF or BMP"


def load_picture(source: PictureSource, channel_order: str = "BGR") -> NDArray[np.uint8]:
    """Return a picture as an 8-bit BGR array.

    Parameters
    ----------
    source : path of a picture file, or an array of shape (rows, columns), (rows, columns, 1),
        (rows, columns, 3) or (rows, columns, 4); bool, uint8, uint16, or float in 0–1.
    channel_order : "BGR" (OpenCV's own) or "RGB" (PyVista, matplotlib, Pillow); only for arrays.

    Raises
    ------
    AnalysisError : the file is missing or no picture, or the array is none.
    """
    if isinstance(source, np.ndarray):
        return _from_array(source, channel_order)
    return _from_file(Path(source))


def picture_name(source: PictureSource, number: int) -> str:
    """Return how messages call the picture: its file name, or its number."""
    return f"picture {number + 1}" if isinstance(source, np.ndarray) else Path(source).name


def crop(picture: NDArray[np.uint8], region: Region | None) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    """Return the region of interest and the column and row of its corner.

    Parameters
    ----------
    picture : shape (rows, columns, 3).
    region : first column, first row, last column, last row (both last ones not included); None for all.

    Raises
    ------
    AnalysisError : the region is empty, too small, or outside the picture.
    """
    rows, columns = picture.shape[:2]
    left, top, right, bottom = region if region is not None else (0, 0, columns, rows)
    inside = 0 <= left < right <= columns and 0 <= top < bottom <= rows
    if not inside or right - left < SMALLEST_SIDE or bottom - top < SMALLEST_SIDE:
        raise AnalysisError(
            f"Region given: columns {left}–{right}, rows {top}–{bottom} of a picture with {columns} columns and {rows} "
            f"rows. Allowed: inside the picture and at least {SMALLEST_SIDE} pixels each way. "
            "Give region=(left, top, right, bottom) in pixels, or a larger picture."
        )
    return np.ascontiguousarray(picture[top:bottom, left:right]), (left, top)


def _from_file(path: Path) -> NDArray[np.uint8]:
    try:
        content = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as problem:
        raise AnalysisError(
            f"Picture given: {path}, which can't be read ({problem.strerror or problem}). "
            f"Allowed: a {READABLE} file. Check the path and its permissions."
        ) from problem
    picture = _decode(content)
    if picture is None:
        raise AnalysisError(
            f"Picture given: {path} ({content.size} bytes), which is no picture OpenCV can decode. "
            f"Allowed: a {READABLE} file. Open it in a picture viewer and save it anew as PNG."
        )
    return np.asarray(picture, dtype=np.uint8)


def _decode(content: NDArray[np.uint8]) -> NDArray[Any] | None:
    if content.size == 0:
        return None
    try:
        return cv2.imdecode(content, cv2.IMREAD_COLOR)
    except cv2.error:
        # Broken headers (absurd sizes) raise where merely unknown formats return None.
        return None


def _from_array(array: NDArray[Any], channel_order: str) -> NDArray[np.uint8]:
    if channel_order not in ("BGR", "RGB"):
        raise AnalysisError(f"Channel order given: {channel_order!r}. Allowed: 'BGR' or 'RGB'.")
    if array.ndim not in (2, 3) or (array.ndim == 3 and array.shape[2] not in (1, 3, 4)) or 0 in array.shape:
        raise AnalysisError(
            f"Picture array given: shape {array.shape}. Allowed: (rows, columns), or (rows, columns, 1, 3 or 4)."
        )
    eight_bit = _eight_bit(array)
    if eight_bit.ndim == 2 or eight_bit.shape[2] == 1:
        grey = eight_bit.reshape(eight_bit.shape[:2])
        return np.ascontiguousarray(np.repeat(grey[:, :, None], 3, axis=2))
    colour = eight_bit[:, :, :3]
    return np.ascontiguousarray(colour[:, :, ::-1] if channel_order == "RGB" else colour)


def _eight_bit(array: NDArray[Any]) -> NDArray[np.uint8]:
    if array.dtype == np.bool_:
        return array.astype(np.uint8) * 255
    if array.dtype == np.uint8:
        return array
    if array.dtype == np.uint16:
        return (array >> 8).astype(np.uint8)
    if np.issubdtype(array.dtype, np.floating) and np.all(np.isfinite(array)) and _within_unit(array):
        return np.round(array * 255).astype(np.uint8)
    raise AnalysisError(
        f"Picture array given: {array.dtype}, values {array.min()} to {array.max()}. "
        "Allowed: bool, uint8, uint16, or finite floats from 0 to 1. Convert it first."
    )


def _within_unit(array: NDArray[Any]) -> bool:
    return bool(array.min() >= 0.0 and array.max() <= 1.0)
