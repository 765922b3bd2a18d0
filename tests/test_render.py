"""Pictures drawn off screen: scale, place, direction, shape, walls, and what happens where none can be drawn."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import pytest
import pyvista as pv

from taichidem import graphics
from taichidem.errors import EnvironmentProblem, InputError
from taichidem.grains import Grains
from taichidem.render import heap_picture, side_view, side_views
from taichidem.render_heap import HeapLook
from taichidem.render_walls import wall_surface
from taichidem.walls import Cone, Cylinder, Disc, Mesh, Plane, cup

EXTENT = (0.02, -0.01, 0.03)
SCALE = 10_000.0


def seen(view) -> np.ndarray:
    """Return columns and rows where a picture isn't white, shape (n, 2)."""
    rows, columns = np.nonzero(view.image.min(axis=2) < 200)
    return np.stack([columns, rows], axis=1)


def one(position, azimuth=0.0, radius=0.004, **options):
    return side_view(Grains.spheres([position], radius), azimuth, pixels_per_metre=SCALE, extent=EXTENT, **options)


@pytest.mark.parametrize(("azimuth", "across"), [(0, 0.01), (90, 0.005), (180, -0.01), (270, -0.005), (45, 0.0106066)])
def test_a_sphere_is_drawn_where_it_is_and_as_large_as_it_is(azimuth, across):
    position = (-0.005, 0.01, 0.012)
    view = one(position, azimuth)
    pixels = seen(view)
    assert view.image.shape == (400, 400, 3)
    assert np.ptp(pixels, axis=0) == pytest.approx([80, 80], abs=2)
    centre = (pixels.min(axis=0) + pixels.max(axis=0)) / 2
    assert centre == pytest.approx(view.pixel(position), abs=1.0)
    assert view.origin_px == pytest.approx((199.5, 299.5))
    assert centre[0] - view.origin_px[0] == pytest.approx(across * SCALE, abs=1.0)
    assert view.origin_px[1] - centre[1] == pytest.approx(0.012 * SCALE, abs=1.0)


def test_a_sphere_is_round_and_not_a_polygon():
    view = one((0, 0, 0.01), radius=0.015)
    area = len(seen(view))
    assert area == pytest.approx(np.pi * 150**2, rel=0.005)


def test_there_is_no_perspective():
    near, far = one((0.015, 0, 0.01)), one((-0.015, 0, 0.01))
    assert len(seen(near)) == pytest.approx(len(seen(far)), rel=0.005)


def test_several_views_are_those_taken_one_by_one():
    grains = Grains.spheres([[0.005, 0.0, 0.0], [0.0, 0.012, 0.01]], [0.003, 0.005])
    options = {"pixels_per_metre": SCALE, "extent": EXTENT}
    together = side_views(grains, [0, 50], **options)
    apart = [side_view(grains, azimuth, **options) for azimuth in (0, 50)]
    assert all(np.array_equal(a.image, b.image) for a, b in zip(together, apart, strict=True))
    assert not np.array_equal(together[0].image, together[1].image)


def test_the_nearer_grain_hides_the_farther():
    large, both = [[-0.01, 0, 0.01]], [[0.01, 0, 0.01], [-0.01, 0, 0.01]]
    options = {"pixels_per_metre": SCALE, "extent": EXTENT}
    front, behind = side_views(Grains.spheres(both, [0.002, 0.006]), [0, 180], **options)
    alone = side_views(Grains.spheres(large, 0.006), [0, 180], **options)
    changed = np.argwhere(np.any(front.image != alone[0].image, axis=2))
    assert np.ptp(changed, axis=0) == pytest.approx([40, 40], abs=2)
    assert np.array_equal(behind.image, alone[1].image)


def test_walls_hide_the_grains_behind_them():
    bare = one((0, 0, 0.01))
    walled = one((0, 0, 0.01), walls=cup(0.015, 0.02, "steel"))
    assert np.ptp(seen(walled), axis=0) == pytest.approx([300, 200], abs=3)
    middle = tuple(round(value) for value in bare.pixel((0, 0, 0.01)))[::-1]
    assert np.ptp(walled.image[middle].astype(int)) < 25 < np.ptp(bare.image[middle].astype(int))


@pytest.mark.parametrize(
    ("wall", "bounds"),
    [
        (Cylinder(material="steel", base=(0, 0, -1), radius=2, height=4), (-2, 2, -2, 2, -1, 3)),
        (Cylinder(material="steel", base=(0, 0, 0), radius=2, height=3, axis=(0, 5, 0)), (-2, 2, 0, 3, -2, 2)),
        (Disc(material="steel", radius=2, centre=(1, 0, 4), normal=(1, 0, 0)), (1, 1, -2, 2, 2, 6)),
        (Cone(material="steel", base=(0, 0, 0), base_radius=1, top_radius=3, height=2), (-3, 3, -3, 3, 0, 2)),
        (Plane(material="steel", point=(0, 0, 1), normal=(0, 0, 1), picture_size=2), (-2, 2, -2, 2, 1, 1)),
        (
            Mesh(material="steel", vertices=[[0, 0, 0], [1, 0, 0], [0, 2, 5]], facets=[[0, 1, 2]]),
            (0, 1, 0, 2, 0, 5),
        ),
    ],
)
def test_walls_are_where_they_are_said_to_be(wall, bounds):
    assert np.array(wall_surface(wall).bounds) == pytest.approx(bounds, abs=1e-6)


@pytest.mark.parametrize(
    ("positions", "radii", "options", "said"),
    [
        ([[0, 0]], 0.01, {}, "positions given"),
        (np.zeros((0, 3)), 0.01, {}, "n ≥ 1"),
        ([[0, 0, np.nan]], 0.01, {}, "NaN"),
        ([[0, 0, 0]], [0.01, 0.02], {}, "radii given"),
        ([[0, 0, 0]], 0.0, {}, "non-positive"),
        ([[0, 0, 0]], 0.01, {"pixels_per_metre": -1}, "pixels_per_metre"),
        ([[0, 0, 0]], 0.01, {"pixels_per_metre": 1e9}, "pixels each way|Allowed: 1 to 8000"),
        ([[0, 0, 0]], 0.01, {"extent": (1.0, 2.0, 1.0)}, "extent given"),
    ],
)
def test_wrong_grains_are_refused(positions, radii, options, said):
    with pytest.raises(InputError, match=said):
        side_view(Grains.spheres(positions, radii), **options)


def test_a_heap_picture_shows_grains_cup_bar_and_colours(tmp_path):
    rng = np.random.default_rng(0)
    centres = rng.uniform([-0.03, -0.03, 0.0], [0.03, 0.03, 0.03], (300, 3))
    look = HeapLook(size=(640, 400))
    path = tmp_path / "heap.png"
    grains = Grains.spheres(centres, 0.003)
    plain = heap_picture(grains, look=look, path=path)
    assert plain.shape == (400, 640, 3)
    assert pv.read(path).dimensions[:2] == (640, 400)
    assert np.abs(heap_picture(grains, look=look).astype(int) - plain).max() == 0
    with_cup = heap_picture(grains, look=look, walls=cup(0.045, 0.02, "steel"))
    assert np.abs(with_cup.astype(int) - plain).mean() > 3.0
    # Low grains violet, high ones yellow.
    high = heap_picture(grains, look=look, values=np.r_[np.ones(299), 0.0])
    yellow = [np.count_nonzero((a[:, :, 0] > 140) & (a[:, :, 1] > 120) & (a[:, :, 2] < 90)) for a in (plain, high)]
    assert yellow[1] > 3 * yellow[0] > 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"values": [1.0, 2.0]}, "values given"),
        ({"values": [np.nan]}, "values given"),
        ({"look": HeapLook(colour_map="rainbows")}, "colour_map"),
        ({"path": "/no/such/folder/heap.png"}, "can't be written"),
    ],
)
def test_wrong_heap_pictures_are_refused(options, said):
    with pytest.raises(InputError, match=said):
        heap_picture(Grains.spheres([[0, 0, 0]], 0.01), **options)
    with pytest.raises(InputError, match="elevation"):
        HeapLook(elevation_deg=-5)
    with pytest.raises(InputError, match="size"):
        HeapLook(size=(10, 10))


def test_a_view_of_2500_spheres_takes_less_than_two_seconds():
    centres = np.random.default_rng(0).uniform([-0.05, -0.05, 0.0], [0.05, 0.05, 0.05], (2500, 3))
    side_view(Grains.spheres(centres[:1], 0.003))
    start = time.perf_counter()
    side_view(Grains.spheres(centres, 0.003))
    assert time.perf_counter() - start < 2.0


@pytest.fixture
def fresh_probe():
    """Forget that this process has found out how to draw, and again afterwards."""
    graphics.require_graphics.cache_clear()
    before = os.environ.pop(graphics.CHOICE, None)
    yield
    graphics.require_graphics.cache_clear()
    os.environ.pop(graphics.CHOICE, None)
    if before is not None:
        os.environ[graphics.CHOICE] = before


def test_a_crash_of_vtk_becomes_an_error_that_names_the_cure(fresh_probe, monkeypatch):
    monkeypatch.setattr(graphics, "PROBE", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    with pytest.raises(EnvironmentProblem, match="apt-get install") as caught:
        side_view(Grains.spheres([[0, 0, 0]], 0.01))
    assert "conda install" in str(caught.value)
    assert "crashed" in str(caught.value) or sys.platform == "win32"


@pytest.mark.parametrize("probe", ["raise ImportError('libGL.so.1: cannot open')", "print('drawn')", "pass"])
def test_a_missing_library_or_a_blank_picture_is_an_error_too(fresh_probe, monkeypatch, probe):
    monkeypatch.setattr(graphics, "PROBE", probe)
    with pytest.raises(EnvironmentProblem) as caught:
        graphics.require_graphics()
    assert ("libGL.so.1" if "libGL" in probe else "blank") in str(caught.value)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the choice of windows is Linux's")
def test_an_unknown_window_that_crashes_vtk_doesnt_crash_the_process():
    code = (
        "from taichidem.errors import EnvironmentProblem\n"
        "from taichidem.grains import Grains\n"
        "from taichidem.render import side_view\n"
        "try:\n    side_view(Grains.spheres([[0, 0, 0]], 0.01))\n"
        "except EnvironmentProblem as problem:\n    print('refused', 'NoSuchWindow' in str(problem))\n"
    )
    environment = {**os.environ, graphics.CHOICE: "NoSuchWindow", "LD_LIBRARY_PATH": ""}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    # Where OSMesa is installed VTK falls back to it and draws; without it the child crashes, not we.
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() in ("refused True", "")


def test_the_window_that_works_is_asked_for_without_warnings(fresh_probe, capfd):
    side_view(Grains.spheres([[0, 0, 0]], 0.01))
    assert "WARN" not in capfd.readouterr().err
