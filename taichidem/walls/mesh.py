"""Triangle meshes: reading, checking, and which feature (face, edge, corner) may touch, so that nothing counts twice."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taichidem.errors import InputError
from taichidem.walls.base import Wall
from taichidem.walls.mesh_topology import facet_rows

FLAT_ANGLE = 1e-6  # facets whose normals differ by less [rad] are one flat face


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh(Wall):
    """A two-sided surface of triangles.

    Args:
        vertices: corner points [m], shape (n, 3).
        facets: vertex numbers, shape (m, 3).

    Raises:
        InputError: no facets, NaN, vertex numbers out of range, or a facet without area.
    """

    vertices: np.ndarray
    facets: np.ndarray

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices, dtype=float)
        facets = np.array(self.facets, dtype=int)
        _check(vertices, facets, self.name or "mesh")
        vertices, facets = _merged(vertices, facets)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "facets", facets)

    @classmethod
    def from_stl(cls, path: str | Path, *, scale: float = 1.0, **wall) -> Mesh:  # type: ignore[no-untyped-def]
        """Read an STL file (ASCII or binary); `scale` converts its unit to metres.

        Raises:
            InputError: the file is missing, unreadable, or holds no usable facets.
        """
        import pyvista

        path = Path(path)
        if not path.is_file():
            raise InputError(f"{path}: no such file. Give the path of an STL file.")
        if not math.isfinite(scale) or scale <= 0:
            raise InputError(
                f"{path}: scale is {scale!r}; give the file's unit in metres, such as 0.001 for millimetres."
            )
        try:
            poly = pyvista.STLReader(str(path)).read()
            facets = np.asarray(poly.faces).reshape(-1, 4)[:, 1:]
            points = np.asarray(poly.points, float) * scale
        except Exception as error:
            raise InputError(
                f"{path}: can't be read as STL ({error}). Write it again as ASCII or binary STL."
            ) from error
        if len(facets) == 0:
            raise InputError(f"{path}: holds no facets. Check that it is an STL file of a surface.")
        return cls(vertices=points, facets=facets, name=wall.pop("name", path.stem), **wall)

    def kind(self) -> str:
        return "facet"

    def rows(self) -> list[dict]:
        return facet_rows(self.vertices - np.asarray(self.motion.centre, float), self.facets, FLAT_ANGLE)

    def extent(self) -> float:
        return float(np.linalg.norm(self.vertices - np.asarray(self.motion.centre, float), axis=1).max())

    def surface(self, resolution: int = 64) -> tuple[np.ndarray, np.ndarray]:
        return self.vertices, self.facets


def _check(vertices: np.ndarray, facets: np.ndarray, name: str) -> None:
    if facets.ndim != 2 or facets.shape[0] == 0 or facets.shape[1] != 3:
        raise InputError(f"Mesh {name!r} has facets of shape {facets.shape}; give at least one triangle, shape (m, 3).")
    if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.all(np.isfinite(vertices)):
        bad = "NaN or infinite coordinates" if vertices.ndim == 2 else f"shape {vertices.shape}"
        raise InputError(f"Mesh {name!r} has vertices with {bad}; give finite points of shape (n, 3), in metres.")
    if facets.min() < 0 or facets.max() >= len(vertices):
        raise InputError(
            f"Mesh {name!r} names vertex {facets.max()} of {len(vertices)}; numbers run from 0 to {len(vertices) - 1}."
        )


def _merged(vertices: np.ndarray, facets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Join equal vertices (STL repeats them) and drop facets without area."""
    size = np.ptp(vertices, axis=0).max()
    _, first, number = np.unique(np.round(vertices / (1e-7 * size)), axis=0, return_index=True, return_inverse=True)
    facets = number.reshape(-1)[facets]
    vertices = vertices[first]
    a, b, c = (vertices[facets[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    kept = facets[area > 1e-14 * size * size]
    if len(kept) == 0:
        raise InputError("The mesh has no facet with an area; check its scale and that it is a surface.")
    return vertices, kept
