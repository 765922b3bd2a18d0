"""What every picture needs: an off-screen scene, the shot, and the file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError
from taichidem.graphics import require_graphics
from taichidem.whole_file import whole_file


def save_picture(image: NDArray[np.uint8], path: str | os.PathLike[str]) -> Path:
    """Write red, green, blue of shape (rows, columns, 3) as PNG.

    Raises
    ------
    InputError : the file can't be written there.
    """
    from matplotlib.image import imsave

    target = Path(path)
    try:
        with whole_file(target) as fresh:
            imsave(fresh, np.ascontiguousarray(image), format="png")
    except OSError as problem:
        raise InputError(
            f"Picture can't be written to {target} ({problem.strerror or problem}). Allowed: a file in a folder that "
            "exists and may be written to."
        ) from problem
    return target


@contextmanager
def off_screen(size: tuple[int, int]) -> Iterator[Any]:
    require_graphics()
    plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="light kit")
    plotter.set_background("white")
    try:
        yield plotter
    finally:
        plotter.close()


def shoot(plotter: Any) -> NDArray[np.uint8]:
    """Draw the scene anew and return it: a screenshot alone repeats the first picture."""
    if plotter.render_window.GetNeverRendered():
        plotter.show(auto_close=False)
    else:
        plotter.render()
    return np.array(plotter.screenshot(None, return_img=True), dtype=np.uint8)[:, :, :3]
