"""Sort the facets of a mesh into the cells of a grid in the mesh's own frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FINEST = 64  # cells along the longest side


@dataclass(frozen=True)
class MeshGrid:
    """Which facets a grain may touch, by the cell its centre lies in.

    Attributes:
        lower: corner of the grid [m], (3,).
        cell_size: [m].
        cells: number of cells along x, y, z.
        starts: first entry of each cell in `facets`, with one more at the end.
        facets: facet numbers, cell by cell.
    """

    lower: np.ndarray
    cell_size: float
    cells: tuple[int, int, int]
    starts: np.ndarray
    facets: np.ndarray


def sort_facets(corners: np.ndarray, normals: np.ndarray, near: float) -> MeshGrid:
    """Return the grid of a mesh.

    Args:
        corners: of each facet [m], (m, 3, 3), in the mesh's frame.
        normals: (m, 3).
        near: distance [m] from a facet up to which a grain's centre must find it.
    """
    lower = corners.min(axis=(0, 1)) - near
    upper = corners.max(axis=(0, 1)) + near
    size = max(2 * near, float((upper - lower).max()) / FINEST)
    cells = tuple(int(n) for n in np.floor((upper - lower) / size) + 1)
    entries = [
        _cells_of(corner, normal, near, lower, size, cells) for corner, normal in zip(corners, normals, strict=True)
    ]
    cell = np.concatenate(entries)
    facet = np.repeat(np.arange(len(entries)), [len(e) for e in entries])
    order = np.argsort(cell, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=int(np.prod(cells))))])
    return MeshGrid(lower, size, cells, starts, facet[order])  # type: ignore[arg-type]


def _cells_of(corner, normal, near, lower, size, cells) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Return the cells that hold a point within `near` of a facet's box and plane."""
    first = np.maximum(np.floor((corner.min(0) - near - lower) / size).astype(int), 0)
    last = np.minimum(np.floor((corner.max(0) + near - lower) / size).astype(int), np.array(cells) - 1)
    x, y, z = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(first, last, strict=True)), indexing="ij")
    centre = lower + size * (np.stack([x, y, z], -1).reshape(-1, 3) + 0.5)
    height = np.abs((centre - corner[0]) @ normal)
    kept = height <= near + 0.8661 * size  # half the diagonal of a cell
    number = (z * cells[1] + y) * cells[0] + x
    return number.reshape(-1)[kept]
