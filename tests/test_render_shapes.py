"""Grains that are no spheres: their surfaces, and how they are drawn and turned."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista as pv
from matplotlib.path import Path as Outline

from taichidem.errors import InputError
from taichidem.grains import Grains, rotation_matrices
from taichidem.heap_views import grains_on_base, measure_heap
from taichidem.output_vtk import write_grains
from taichidem.render import grain_mesh, shape_surface, side_view
from taichidem.render_grains import usual_fineness
from taichidem.render_scene import off_screen, shoot
from taichidem.shapes import Elements, Forms, Superquadric
from taichidem.shapes.surface import unit_surface
from tests.analysis.test_repose_end_to_end import CUP, poured

SHAPES = [
    Superquadric.spheroid(2.5, 0.003),
    Superquadric.spheroid(0.4, 0.003),
    Superquadric(0.003, 0.002, 0.004, 8, 2),
    Superquadric(0.004, 0.003, 0.002, 3.3, 5.7),
    Superquadric(0.004, 0.003, 0.002, 40, 40),
]
CLUMP = Elements(np.array([[0, 0, 0], [0.004, 0, 0], [0, 0.003, 0], [0, 0, 0.005]]), np.array([3, 2, 2.5, 1.5]) * 1e-3)
TURNED = np.array([0.7, 0.5, -0.1, 0.5])
AT = np.array([0.003, -0.002, 0.01])
EXTENT, SCALE = (0.016, -0.006, 0.026), 20_000.0


def lying(shapes, position, orientation=None) -> Grains:
    """Return one grain of each shape."""
    parts = [shape if isinstance(shape, Elements) else shape.elements for shape in shapes]
    body = np.repeat(np.arange(len(parts)), [len(p.radius) for p in parts])
    forms = Forms(
        body,
        np.concatenate([p.offset for p in parts]),
        np.concatenate([p.radius for p in parts]),
        None if parts[0].axes is None else np.concatenate([p.axes for p in parts]),
        None if parts[0].axes is None else np.concatenate([p.exponents for p in parts]),
    )
    return Grains(np.atleast_2d(position), forms, None if orientation is None else np.atleast_2d(orientation))


def mask(view) -> np.ndarray:
    return view.image.min(axis=2) < 240


def plane(view) -> tuple[np.ndarray, np.ndarray]:
    """Return across and z of every pixel's centre [m]."""
    rows, columns = np.indices(view.image.shape[:2])
    return (columns - view.origin_px[0]) / view.pixels_per_metre, (view.origin_px[1] - rows) / view.pixels_per_metre


def sideways(azimuth) -> np.ndarray:
    """Return the world's directions to the right and up in a side view, (2, 3)."""
    a = np.radians(azimuth)
    return np.array([[-np.sin(a), np.cos(a), 0], [0, 0, 1]])


def outline(shape, rotation, azimuth) -> np.ndarray:
    """Return the silhouette of a convex shape about its centre [m]: its farthest point along each direction seen."""
    angles = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    directions = np.column_stack([np.cos(angles), np.sin(angles)]) @ sideways(azimuth)
    return shape.support(directions @ rotation) @ rotation.T @ sideways(azimuth).T


@pytest.mark.parametrize("shape", SHAPES)
def test_surfaces_lie_on_the_shape_with_its_normals(shape):
    mesh = shape_surface(shape)
    x, y, z = (np.abs(mesh.points / (shape.a, shape.b, shape.c))).T
    section = x**shape.n2 + y**shape.n2
    assert section ** (shape.n1 / shape.n2) + z**shape.n1 == pytest.approx(np.ones(len(x)), abs=1e-12)
    inner = np.maximum(section, 1e-300) ** (shape.n1 / shape.n2 - 1)
    gradient = np.column_stack([inner * x ** (shape.n2 - 1), inner * y ** (shape.n2 - 1), z ** (shape.n1 - 1)])
    gradient *= np.sign(mesh.points) / (shape.a, shape.b, shape.c)
    gradient /= np.linalg.norm(gradient, axis=1)[:, None]
    assert mesh.point_data["Normals"] == pytest.approx(gradient, abs=1e-9)


@pytest.mark.parametrize("shape", SHAPES)
def test_surfaces_are_closed_look_outward_and_hold_the_volume(shape):
    coarse, fine = shape_surface(shape, 4), shape_surface(shape, 16)
    assert fine.is_manifold
    assert fine.n_open_edges == 0
    corners = fine.points[fine.regular_faces]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(np.einsum("fi,fi->f", facing, corners.mean(axis=1)) > 0)
    volume = np.einsum("fi,fi->", facing, corners[:, 0]) / 6
    assert volume == pytest.approx(shape.volume, rel=0.01)
    assert abs(fine.volume - shape.volume) < abs(coarse.volume - shape.volume) / 4


def test_neighbouring_normals_of_a_sharp_box_differ_little():
    surface = unit_surface(40.0, 40.0, 12)
    ends = surface.normals[surface.triangles]
    turn = np.degrees(np.arccos(np.clip(np.einsum("fi,fi->f", ends[:, 0], ends[:, 1]), -1, 1)))
    assert turn.max() < 15


@pytest.mark.parametrize("azimuth", [0.0, 65.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_a_superquadric_is_drawn_as_it_is_turned(shape, azimuth):
    view = side_view(lying([shape], AT, TURNED), azimuth, pixels_per_metre=SCALE, extent=EXTENT)
    hull = outline(shape, rotation_matrices(TURNED[None])[0], azimuth) + sideways(azimuth) @ AT
    across, up = plane(view)
    expected = Outline(hull).contains_points(np.column_stack([across.ravel(), up.ravel()])).reshape(across.shape)
    drawn = mask(view)
    assert np.count_nonzero(drawn) == pytest.approx(np.count_nonzero(expected), rel=0.01)
    assert np.count_nonzero(drawn != expected) < 0.02 * np.count_nonzero(expected)
    rows, columns = np.nonzero(drawn)
    assert np.array([np.ptp(columns), np.ptp(rows)]) / SCALE == pytest.approx(np.ptp(hull, axis=0), abs=2 / SCALE)
    # Turned the other way it would be seen elsewhere.
    other = outline(shape, rotation_matrices(TURNED[None])[0].T, azimuth) + sideways(azimuth) @ AT
    wrong = Outline(other).contains_points(np.column_stack([across.ravel(), up.ravel()])).reshape(across.shape)
    assert np.count_nonzero(drawn != wrong) > 0.05 * np.count_nonzero(expected)


@pytest.mark.parametrize("azimuth", [0.0, 65.0])
def test_a_clump_is_drawn_as_all_its_spheres(azimuth):
    view = side_view(lying([CLUMP], AT, TURNED), azimuth, pixels_per_metre=SCALE, extent=EXTENT)
    centres = (AT + CLUMP.offset @ rotation_matrices(TURNED[None])[0].T) @ sideways(azimuth).T
    across, up = plane(view)
    discs = [np.hypot(across - c[0], up - c[1]) < r for c, r in zip(centres, CLUMP.radius, strict=True)]
    expected = np.any(discs, axis=0)
    assert np.count_nonzero(mask(view) != expected) < 0.01 * np.count_nonzero(expected)


def test_a_sphere_looks_the_same_however_it_is_described():
    options = {"pixels_per_metre": SCALE, "extent": EXTENT}
    plain = side_view(Grains.spheres([AT], 0.005), **options)
    same = side_view(lying([Superquadric.sphere(0.005)], AT, TURNED), **options)
    assert np.array_equal(plain.image, same.image)
    # A trace away from a sphere it is a mesh, with the same light on it.
    mesh = side_view(lying([Superquadric(0.005, 0.005, 0.005, 2, 2 + 1e-9)], AT, TURNED), **options)
    assert np.count_nonzero(mask(plain) != mask(mesh)) < 0.005 * np.count_nonzero(mask(plain))
    both = mask(plain) & mask(mesh)
    assert np.abs(plain.image[both].astype(int) - mesh.image[both]).mean() < 2


def from_the_side(add, size) -> np.ndarray:
    """Return the picture of a scene as `side_view` takes it at azimuth 0 in the extent of these tests."""
    with off_screen(size) as plotter:
        add(plotter)
        plotter.enable_parallel_projection()
        plotter.camera.position, plotter.camera.focal_point = (10, 0, 0.01), (0, 0, 0.01)
        plotter.camera.up, plotter.camera.parallel_scale = (0, 0, 1), 0.016
        plotter.renderer.ResetCameraClippingRange()
        return shoot(plotter)


def test_light_falls_on_a_stretched_mesh_as_on_one_with_its_own_normals():
    grains = lying([Superquadric(0.006, 0.002, 0.003, 3, 4)], AT, TURNED)
    view = side_view(grains, pixels_per_metre=SCALE, extent=EXTENT)
    colour = {"color": (38, 84, 138), "smooth_shading": True}
    image = from_the_side(lambda plotter: plotter.add_mesh(grain_mesh(grains), **colour), view.image.shape[1::-1])
    both = mask(view) & (image.min(axis=2) < 240)
    assert np.count_nonzero(both) > 0.98 * np.count_nonzero(mask(view))
    assert np.abs(image[both].astype(int) - view.image[both]).mean() < 3


def test_files_show_ellipsoids_with_the_settings_that_are_told_for_paraview(tmp_path):
    """ParaView's 3D Glyphs are this mapper, its sphere has the radius 0.5."""
    from vtkmodules.vtkRenderingCore import vtkActor, vtkGlyph3DMapper

    grains = lying([Superquadric(0.006, 0.002, 0.003)], AT, TURNED)
    view = side_view(grains, pixels_per_metre=SCALE, extent=EXTENT)
    actor, mapper = vtkActor(), vtkGlyph3DMapper()
    mapper.SetInputData(pv.read(write_grains(tmp_path / "grains.vtp", grains)))
    mapper.SetSourceData(pv.Sphere(radius=0.5, theta_resolution=60, phi_resolution=60))
    mapper.SetScaleArray("axes")
    mapper.SetScaleModeToScaleByVectorComponents()
    mapper.SetScaleFactor(2.0)
    mapper.SetOrientationArray("orientation")
    mapper.SetOrientationModeToQuaternion()
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.1, 0.1, 0.1)
    image = from_the_side(lambda plotter: plotter.add_actor(actor), view.image.shape[1::-1])
    assert np.count_nonzero((image.min(axis=2) < 240) != mask(view)) < 0.02 * np.count_nonzero(mask(view))


def test_one_mesh_holds_every_grain():
    grains = lying(SHAPES, np.arange(15).reshape(5, 3) * 0.01, np.tile(TURNED, (5, 1)))
    mesh = grain_mesh(grains, fineness=10)
    assert mesh.n_points == 5 * len(unit_surface(2.0, 2.0, 10).points)
    for number, shape in enumerate(SHAPES):
        own = mesh.points[mesh.point_data["body"] == number]
        assert own.mean(axis=0) == pytest.approx(grains.position[number], abs=1e-9)
        local = (own - grains.position[number]) @ rotation_matrices(TURNED[None])[0]
        assert np.abs(local).max(axis=0) == pytest.approx([shape.a, shape.b, shape.c], rel=1e-9)
    assert mesh.volume == pytest.approx(sum(shape.volume for shape in SHAPES), rel=0.01)
    assert shape_surface(CLUMP).bounds == pytest.approx((-0.003, 0.006, -0.003, 0.0055, -0.003, 0.0065), abs=1e-5)


def test_many_grains_are_drawn_with_coarser_meshes():
    assert usual_fineness(1) > usual_fineness(2000) > usual_fineness(20_000) > 2


def test_a_heap_of_spheroids_is_measured_in_pictures_as_one_of_spheres():
    centres, radii = poured()
    rng = np.random.default_rng(1)
    quaternions = rng.normal(size=(len(radii), 4))
    shape = Superquadric.spheroid(1.3, radii[0])
    grains = lying([shape] * len(radii), centres, quaternions / np.linalg.norm(quaternions, axis=1)[:, None])
    spheres = measure_heap(Grains.spheres(centres, radii), CUP, 0.4, 0.92)
    spheroids = measure_heap(grains_on_base(grains, CUP), CUP, 0.4, 0.92)
    assert spheroids.angle_deg == pytest.approx(spheres.angle_deg, abs=1.5)


def test_what_is_chosen_stays_what_it_was():
    grains = lying([CLUMP] * 3, np.arange(9).reshape(3, 3) * 0.01, np.tile(TURNED, (3, 1)))
    some = grains.rows(np.array([True, False, True]))
    assert len(some) == 2
    assert np.array_equal(some.element_centre, grains.element_centre[np.array([*range(4), *range(8, 12)])])


@pytest.mark.parametrize(
    ("forms", "orientation", "said"),
    [
        (Forms.spheres(np.ones(3)), None, "elements of 3 grains, numbered up to 2, for 2 positions"),
        (Forms.spheres(np.ones(1)), None, "elements of 1 grains"),
        (Forms(np.arange(2), np.zeros((2, 3)), np.ones(2), axes=np.ones((2, 3))), None, "both, or neither"),
        (Forms(np.arange(2), np.zeros((2, 2)), np.ones(2)), None, r"offsets of the forms given: shape \(2, 2\)"),
        (
            Forms(np.arange(2), np.zeros((2, 3)), np.ones(2), np.zeros((2, 3)), np.full((2, 2), 2.0)),
            None,
            "axes given hold",
        ),
        (Forms.spheres(np.ones(2)), [[1, 0, 0, 0]], r"Allowed: \(2, 4\)"),
        (Forms.spheres(np.ones(2)), [[1, 1, 0, 0]] * 2, "unit quaternions"),
    ],
)
def test_forms_that_do_not_fit_are_refused(forms, orientation, said):
    with pytest.raises(InputError, match=said):
        Grains(np.zeros((2, 3)), forms, orientation)
