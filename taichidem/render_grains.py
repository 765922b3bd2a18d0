"""Drawable surfaces of grains: spheres drawn exactly on the graphics side, other shapes as meshes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError

Array = NDArray[np.float64]


def check_grains(positions: Any, radii: Any) -> tuple[Array, Array]:
    """Return positions (n, 3) and radii (n,) as float64 [m].

    Raises
    ------
    InputError : wrong shapes, no grains, values that aren't finite, radii that aren't positive.
    """
    places = np.asarray(positions, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or len(places) == 0:
        raise InputError(f"positions given: shape {places.shape}. Allowed: (n, 3) with n ≥ 1, in metres.")
    sizes = np.asarray(radii, dtype=np.float64)
    if sizes.shape not in ((), (len(places),)):
        raise InputError(f"radii given: shape {sizes.shape}. Allowed: ({len(places)},), or one number, in metres.")
    sizes = np.broadcast_to(sizes, (len(places),)).copy()
    if not (np.isfinite(places).all() and np.isfinite(sizes).all() and (sizes > 0).all()):
        raise InputError(
            "positions or radii given hold NaN, infinite or non-positive values. Allowed: finite positions and "
            "positive radii. Leave out removed grains."
        )
    return places, sizes


def rotation_matrices(orientations: Any, count: int) -> Array:
    """Return the rotations of unit quaternions, shape (n, 3, 3).

    Parameters
    ----------
    orientations : quaternions w, x, y, z that carry the body frame to the laboratory's, shape (n, 4).
    count : number of grains.

    Raises
    ------
    InputError : a wrong shape, or quaternions whose length isn't 1 within 1 %.
    """
    quaternions = np.asarray(orientations, dtype=np.float64)
    if quaternions.shape != (count, 4):
        raise InputError(
            f"orientations given: shape {quaternions.shape}. Allowed: ({count}, 4), quaternions w, x, y, z."
        )
    length = np.linalg.norm(quaternions, axis=1)
    if not np.all(np.abs(length - 1.0) < 0.01):
        raise InputError(
            f"orientations given: quaternions of length {length.min():.3g} to {length.max():.3g}. Allowed: unit "
            "quaternions w, x, y, z."
        )
    w, x, y, z = (quaternions / length[:, None]).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def grain_surface(positions: Array, radii: Array, geometry: pv.PolyData, orientations: Any) -> pv.PolyData:
    """Return one surface holding the shape of every grain, x = c + r R v.

    Parameters
    ----------
    positions : centres [m], shape (n, 3).
    radii : factor by which the shape is enlarged [m], shape (n,).
    geometry : shape of a grain of radius 1 about the origin.
    orientations : quaternions w, x, y, z, shape (n, 4), or None for none turned.
    """
    shape = geometry.triangulate()
    vertices = np.asarray(shape.points, dtype=np.float64)
    corners = np.asarray(shape.regular_faces)
    count = len(positions)
    if orientations is None:
        turned = np.broadcast_to(vertices, (count, *vertices.shape))
    else:
        turned = np.einsum("nij,vj->nvi", rotation_matrices(orientations, count), vertices)
    points = positions[:, None, :] + radii[:, None, None] * turned
    faces = corners[None] + (np.arange(count) * len(vertices))[:, None, None]
    return pv.PolyData.from_regular_faces(points.reshape(-1, 3).astype(np.float32), faces.reshape(-1, 3))


def sphere_actor(positions: Array, radii: Array, colours: NDArray[np.uint8]) -> Any:
    """Return an actor that draws true spheres, so that no facets spoil the outline.

    Parameters
    ----------
    positions : centres [m], shape (n, 3).
    radii : radii [m], shape (n,).
    colours : red, green, blue of each grain, shape (n, 3).
    """
    from vtkmodules.vtkRenderingCore import vtkActor
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSphereMapper

    points = pv.PolyData(positions.astype(np.float32))
    points.point_data["radius"] = radii.astype(np.float32)
    points.point_data["colour"] = colours
    mapper = vtkOpenGLSphereMapper()
    mapper.SetInputData(points)
    mapper.SetScaleArray("radius")
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("colour")
    mapper.SetColorModeToDirectScalars()
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor
