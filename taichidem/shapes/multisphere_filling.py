"""Filling a closed surface of triangles with overlapping spheres from inside."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from taichidem.errors import InputError
from taichidem.shapes.multisphere_files import metres

BALLS = 1500  # points of the surface where the largest inner ball is tried
POINTS = 6000  # points of the inside that count what a ball covers
BISECTIONS = 30
SLACK = 1e-6  # share of the surface's size by which a ball may be smaller than its distance to the surface


@dataclass(frozen=True)
class Surface:
    """A closed surface: its triangles as a PyVista mesh with outward normals, and the volume inside [m³]."""

    mesh: Any
    volume: float

    @property
    def size(self) -> float:
        """Diagonal of the box about it [m]."""
        return float(self.mesh.length)

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Return how deep points lie inside [m], below 0 outside, (n,)."""
        import vtk
        from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

        distance, values = vtk.vtkImplicitPolyDataDistance(), vtk.vtkDoubleArray()
        distance.SetInput(self.mesh)
        distance.FunctionValue(numpy_to_vtk(np.ascontiguousarray(points), deep=True), values)
        return -vtk_to_numpy(values).copy()


def read_surface(path: Path, unit: str) -> Surface:
    """Return the surface of an STL file in metres.

    Raises:
        InputError: no such file, not readable, no triangle, not closed, or a unit that is no length.
    """
    import pyvista

    scale = metres(unit, path)
    if not path.is_file():
        raise InputError(f"{path}: no such file. Give the path of an STL file.")
    try:
        mesh = pyvista.STLReader(str(path)).read()
        mesh.points = np.asarray(mesh.points, float) * scale
        mesh = mesh.clean(tolerance=1e-7, absolute=False).triangulate()
    except Exception as error:
        raise InputError(f"{path}: can't be read as STL ({error}). Write it again as ASCII or binary STL.") from error
    if mesh.n_cells == 0:
        raise InputError(f"{path}: holds no facets. Check that it is an STL file of a surface.")
    if mesh.n_open_edges > 0:
        raise InputError(
            f"{path}: its surface isn't closed, {mesh.n_open_edges} edges don't join exactly two triangles. "
            "Only a closed surface has an inside to fill: mend the holes and doubled faces, then write it again."
        )
    mesh = mesh.compute_normals(consistent_normals=True, auto_orient_normals=True, split_vertices=False)
    volume = abs(float(mesh.volume))
    if not volume > 1e-12 * mesh.length**3:
        raise InputError(f"{path}: its surface holds no volume; give a closed surface with an inside.")
    return Surface(mesh, volume)


def filled(surface: Surface, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (m, 3) and radii (m,) of at most `count` inner balls that cover most [m].

    The largest is taken first, then always the one that covers most points of the inside not covered yet and overlaps a
    ball taken before.
    """
    from scipy.spatial.distance import cdist

    centres, radii = _medial_balls(surface, rng)
    points = _inside(surface, rng)
    holds = cdist(centres, points) <= radii[:, None]
    chosen = [int(radii.argmax())]
    bare = ~holds[chosen[0]]
    joined = _overlaps(centres, radii, chosen[0])
    while len(chosen) < count:
        gain = np.where(joined, holds @ bare.astype(np.float32), 0.0)
        best = int(np.lexsort((radii, gain))[-1])
        if gain[best] < 1:
            break
        chosen.append(best)
        bare &= ~holds[best]
        joined |= _overlaps(centres, radii, best)
    return centres[chosen], radii[chosen]


def _overlaps(centres: np.ndarray, radii: np.ndarray, one: int) -> np.ndarray:
    """Return which balls overlap one, by more than a point, (n,)."""
    return np.linalg.norm(centres - centres[one], axis=1) < radii + radii[one] - 0.1 * np.minimum(radii, radii[one])


def _medial_balls(surface: Surface, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return for points of the surface the largest ball that touches it there from inside, by bisection of its radius."""
    corners = surface.mesh.points[surface.mesh.faces.reshape(-1, 4)[:, 1:]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1)
    cell = rng.choice(len(area), BALLS, p=area / area.sum())
    share = rng.dirichlet((1.0, 1.0, 1.0), BALLS)
    points = np.einsum("pk,pki->pi", share, corners[cell])
    inward = -normal[cell] / area[cell, None]
    slack = SLACK * surface.size
    low, high = np.zeros(BALLS), np.full(BALLS, 0.5 * surface.size)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        fits = surface.depth(points + middle[:, None] * inward) >= middle - slack
        low, high = np.where(fits, middle, low), np.where(fits, high, middle)
    centres = points + low[:, None] * inward
    radii = surface.depth(centres)
    kept = radii > 10 * slack
    return centres[kept], radii[kept]


def _inside(surface: Surface, rng: np.random.Generator) -> np.ndarray:
    """Return points spread evenly over the inside, one somewhere in each cell of a grid."""
    low, high = np.array(surface.mesh.bounds).reshape(3, 2).T
    step = (surface.volume / POINTS) ** (1 / 3)
    counts = np.maximum(1, np.ceil((high - low) / step)).astype(int)
    cells = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    points = low + (cells + rng.random(cells.shape)) * (high - low) / counts
    return points[surface.depth(points) > 0]
