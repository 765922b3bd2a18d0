"""What draws grains: true spheres on the graphics side, and one mesh per kind of superquadric, set down for each grain."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.grains import Array, Grains, rotation_matrices
from taichidem.shapes.base import Elements, GrainShape
from taichidem.shapes.forms import Forms
from taichidem.shapes.surface import Surface, unit_surface

FINEST, COARSEST = 12, 3  # fineness of a surface, as `unit_surface` takes it
TRIANGLES = 4e6  # in a whole picture, which the graphics of a machine without a graphics card draw in seconds


def add_grains(plotter: Any, grains: Grains, colours: NDArray[np.uint8]) -> None:
    """Put grains into a scene, each in a colour of its own.

    Args:
        plotter: the scene.
        grains: of any form; clumps are drawn as all their spheres.
        colours: red, green, blue of each grain, (n, 3).
    """
    centre, axes, exponents = grains.element_centre, grains.element_axes, grains.element_exponents
    colour, turned = colours[grains.forms.body], grains.element_orientation
    sphere = grains.element_is_sphere
    if sphere.any():
        plotter.add_actor(_spheres(centre[sphere], axes[sphere, 0], colour[sphere]), render=False)
    fineness = usual_fineness(int(np.count_nonzero(~sphere)))
    for n1, n2 in np.unique(exponents[~sphere], axis=0):
        kind = ~sphere & np.all(exponents == (n1, n2), axis=1)
        template = unit_surface(n1, n2, fineness)
        actor = _superquadrics(template, centre[kind], axes[kind], turned[kind], colour[kind])
        plotter.add_actor(actor, render=False)


def usual_fineness(count: int) -> int:
    """Return how fine the surfaces of a number of grains are, so that many of them still draw quickly."""
    return int(np.clip(math.sqrt(TRIANGLES / (64 * max(count, 1))), COARSEST, FINEST))


def shape_surface(shape: GrainShape | Elements, fineness: int = FINEST) -> pv.PolyData:
    """Return the surface of a shape in its principal frame [m], with its normals.

    Args:
        shape: a shape, or its elements; a clump's surface is that of its spheres, what lies inside others included.
        fineness: k; each element has 8 k points around and 4 k from pole to pole.
    """
    e = shape if isinstance(shape, Elements) else shape.elements
    forms = Forms(np.zeros(len(e.radius), dtype=int), e.offset, e.radius, e.axes, e.exponents)
    return grain_mesh(Grains(np.zeros((1, 3)), forms), fineness)


def grain_mesh(grains: Grains, fineness: int | None = None) -> pv.PolyData:
    """Return one mesh that holds the surface of every grain where it lies [m].

    Args:
        grains: of any form.
        fineness: as in `shape_surface`; None suits it to the number of elements.

    Returns:
        Triangles with the point arrays Normals, (v, 3), and body, the number of the grain from 0, (v,).
    """
    k = usual_fineness(len(grains.forms.body)) if fineness is None else fineness
    exponents = grains.element_exponents
    parts = []
    for n1, n2 in np.unique(exponents, axis=0):
        kind = np.all(exponents == (n1, n2), axis=1)
        parts.append(_set_down(unit_surface(n1, n2, k), grains, kind))
    points, normals, body, faces = zip(*parts, strict=True)
    starts = np.cumsum([0, *map(len, points)])[:-1]
    joined = np.concatenate([f + start for f, start in zip(faces, starts, strict=True)])
    mesh = pv.PolyData.from_regular_faces(np.concatenate(points), joined)
    mesh.point_data["body"] = np.concatenate(body)
    mesh.point_data.active_normals = np.concatenate(normals)
    return mesh


def _set_down(template: Surface, grains: Grains, kind: NDArray[np.bool_]) -> tuple[NDArray[Any], ...]:
    """Return points x = c + R(q) (axes v), normals, grains and triangles of elements that share a template."""
    rotation = rotation_matrices(grains.element_orientation[kind])
    axes, count = grains.element_axes[kind], np.count_nonzero(kind)
    size = len(template.points)
    points = np.einsum("mij,mj,vj->mvi", rotation, axes, template.points) + grains.element_centre[kind][:, None]
    normals = np.einsum("mij,mj,vj->mvi", rotation, 1 / axes, template.normals)
    normals /= np.linalg.norm(normals, axis=2)[:, :, None]
    faces = template.triangles[None] + (np.arange(count) * size)[:, None, None]
    return points.reshape(-1, 3), normals.reshape(-1, 3), np.repeat(grains.forms.body[kind], size), faces.reshape(-1, 3)


def _spheres(centres: Array, radii: Array, colours: NDArray[np.uint8]) -> Any:
    """Return an actor that draws true spheres, so that no facets spoil the outline."""
    from vtkmodules.vtkRenderingCore import vtkActor
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSphereMapper

    points = pv.PolyData(centres.astype(np.float32))
    points.point_data["radius"] = radii.astype(np.float32)
    points.point_data["colour"] = colours
    mapper = vtkOpenGLSphereMapper()
    mapper.SetInputData(points)
    mapper.SetScaleArray("radius")
    _colour_by_point(mapper)
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def _superquadrics(
    template: Surface, centres: Array, axes: Array, quaternions: Array, colours: NDArray[np.uint8]
) -> Any:
    """Return an actor that sets a mesh of semi-axes 1 down at each centre, stretched, turned and coloured."""
    from vtkmodules.vtkRenderingCore import vtkActor, vtkGlyph3DMapper

    points = pv.PolyData(centres.astype(np.float32))
    points.point_data["axes"] = axes.astype(np.float32)
    points.point_data["orientation"] = quaternions.astype(np.float32)
    points.point_data["colour"] = colours
    mapper = vtkGlyph3DMapper()
    mapper.SetInputData(points)
    mapper.SetSourceData(_polygons(template))
    mapper.SetScaleArray("axes")
    mapper.SetScaleModeToScaleByVectorComponents()
    mapper.SetOrientationArray("orientation")
    mapper.SetOrientationModeToQuaternion()
    _colour_by_point(mapper)
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def _polygons(surface: Surface) -> pv.PolyData:
    mesh = pv.PolyData.from_regular_faces(surface.points.astype(np.float32), surface.triangles)
    mesh.point_data.active_normals = surface.normals.astype(np.float32)
    return mesh


def _colour_by_point(mapper: Any) -> None:
    """Take the point array "colour" as red, green, blue."""
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("colour")
    mapper.SetColorModeToDirectScalars()
