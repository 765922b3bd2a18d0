"""The two halves of a shear box as meshes of rectangles, with the flanges that close what they uncover."""

from __future__ import annotations

import numpy as np

from taichidem.walls import Mesh

Corners = list[tuple[float, float, float]]


def lower_half(length: float, width: float, height: float, flange: float, material: str) -> Mesh:
    """Return floor, four sides up to `height`, and a flange behind the rim at x = 0 [m]."""
    floor: Corners = [(0, 0, 0), (length, 0, 0), (length, width, 0), (0, width, 0)]
    behind: Corners = [(-flange, 0, height), (0, 0, height), (0, width, height), (-flange, width, height)]
    return _rectangles("lower half", material, [floor, *_sides(length, width, 0.0, height), behind])


def upper_half(length: float, width: float, bottom: float, top: float, flange: float, material: str) -> Mesh:
    """Return four sides from `bottom` to `top`, and a flange before the rim at x = length [m]."""
    end = length + flange
    before: Corners = [(length, 0, bottom), (end, 0, bottom), (end, width, bottom), (length, width, bottom)]
    return _rectangles("upper half", material, [*_sides(length, width, bottom, top), before])


def _sides(length: float, width: float, low: float, high: float) -> list[Corners]:
    ring = [(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)]
    pairs = zip(ring, ring[1:] + ring[:1], strict=True)
    return [[(*a, low), (*b, low), (*b, high), (*a, high)] for a, b in pairs]


def _rectangles(name: str, material: str, rectangles: list[Corners]) -> Mesh:
    """Return one wall of rectangles; corners in common are joined, so that their edges count once."""
    first = 4 * np.arange(len(rectangles))[:, None, None]
    facets = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return Mesh(name=name, material=material, vertices=np.concatenate([np.array(r) for r in rectangles]), facets=facets)
