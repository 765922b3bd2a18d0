"""Draw docs/pictures/grain_shapes.png: the shapes that grains may have, labelled.

Run `python -m benchmarks.grain_shapes`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from PIL import Image

from taichidem.render import shape_surface
from taichidem.render_scene import off_screen, shoot
from taichidem.shapes import Elements, Superquadric

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "grain_shapes.png"
INK, LABEL_PX = "#27313c", 22
ACROSS, APART = 4, (3.1, 3.7)  # shapes in a row; between columns and rows, in radii of the sphere
COLOURS = ("#3b6ea5", "#c8793a", "#4f8f5b", "#8a5aa3", "#b5505f", "#3f8f94", "#8d7a3c", "#62708a")


def shapes() -> dict[str, Superquadric | Elements]:
    """Return label → shape, one a line of the picture's text."""
    return {
        "sphere": Superquadric.sphere(1.0),
        "prolate spheroid\nlength 1.8 widths": Superquadric.spheroid(1.8, 0.95),
        "oblate spheroid\nlength 0.5 widths": Superquadric.spheroid(0.5),
        "rounded cylinder\nn1 = 8, n2 = 2": Superquadric(0.85, 0.85, 1.05, 8, 2),
        "rounded box\nn1 = n2 = 8": Superquadric(0.95, 0.8, 0.7, 8, 8),
        "box with sharp edges\nn1 = n2 = 40": Superquadric(0.9, 0.78, 0.72, 40, 40),
        "clump of 3 spheres": clump([(-0.75, 0, 0), (0, 0, 0), (0.75, 0, 0)], [0.6, 0.72, 0.6]),
        "clump of 5 spheres": clump(
            [(0, 0, 0), (0.62, 0.36, -0.25), (-0.62, 0.36, -0.25), (0, -0.72, -0.25), (0, 0, 0.75)],
            [0.62, 0.5, 0.5, 0.5, 0.5],
        ),
    }


def clump(centres: Any, radii: Any) -> Elements:
    """Return spheres as the elements of one shape."""
    return Elements(np.asarray(centres, float), np.asarray(radii, float))


def picture() -> np.ndarray:
    """Return the picture, red, green, blue."""
    with off_screen((1500, 860)) as plotter:
        plotter.enable_anti_aliasing("ssaa")
        for number, (label, shape) in enumerate(shapes().items()):
            row, column = divmod(number, ACROSS)
            at = np.array([(column - (ACROSS - 1) / 2) * APART[0], 0.0, -row * APART[1]])
            _add(plotter, shape, at, COLOURS[number])
            _label(plotter, label, at)
        plotter.enable_parallel_projection()
        plotter.camera.position, plotter.camera.focal_point = (0, -30, -2.0), (0, 0, -2.0)
        plotter.camera.up = (0, 0, 1)
        plotter.camera.parallel_scale = 3.75
        plotter.renderer.ResetCameraClippingRange()
        return shoot(plotter)


def _add(plotter: Any, shape: Superquadric | Elements, at: np.ndarray, colour: str) -> None:
    """Put a shape down so that it is seen from the front, a little from above and from its right."""
    surface = shape_surface(shape, fineness=24).rotate_z(-30).rotate_x(24).translate(at)
    light = {"ambient": 0.22, "diffuse": 0.9, "specular": 0.2, "specular_power": 30}
    plotter.add_mesh(surface, color=colour, **light, render=False)


def _label(plotter: Any, label: str, at: np.ndarray) -> None:
    plotter.add_point_labels(
        pv.PolyData(at - (0, 0, 1.42)),
        [label],
        font_size=LABEL_PX,
        text_color=INK,
        shape=None,
        show_points=False,
        always_visible=True,
        bold=False,
        justification_horizontal="center",
        justification_vertical="top",
        render=False,
    )


if __name__ == "__main__":
    Image.fromarray(picture()).save(PICTURE, optimize=True)
