"""Multispheres from files of spheres and from closed surfaces."""

import math

import numpy as np
import pytest

from taichidem.errors import InputError
from taichidem.shapes import Multisphere

pyvista = pytest.importorskip("pyvista")


@pytest.mark.parametrize(
    "text",
    [
        "0 0 0 1\n0 0 1 1\n",
        "x,y,z,radius\n0, 0, 0, 1  # one\n\n# and\n0,0,1,1\n",
        "\ufeffx;y;z;r\r\n0;0;0;1\r\n0;0;1;1.0e0\r\n",
        "# mm\n x\ty\tz\tr\n0\t0\t0\t1\n0\t0\t1\t1",
    ],
)
def test_rows_of_spheres_are_read(tmp_path, text):
    path = tmp_path / "two.csv"
    path.write_bytes(text.encode())
    assert Multisphere.from_file(path, "mm") == Multisphere([(0, 0, 0), (0, 0, 0.001)], 0.001)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("0 0 0 1\n0 0 1\n", "m", ["line 2", "'0 0 1'", "four numbers"]),
        ("0 0 0 1\n0 0 one 1\n", "m", ["line 2", "four numbers"]),
        ("0 0 0 nan\n", "m", ["line 1", "isn't finite"]),
        ("0 0 0 -1\n", "m", ["line 1", "radius -1"]),
        ("x y z r\n", "m", ["holds no sphere"]),
        ("0 0 0 1\n0 0 3 1\n", "m", ["spheres.txt", "Spheres 0 and 1", "1 m apart"]),
        ("0 0 0 1\n", "kg", ["'kg'", "unit of length"]),
        ("0 0 0 1\n", "2 mm", ["'2 mm'", "unit of length"]),
    ],
)
def test_a_file_that_makes_no_body_is_refused(tmp_path, text, unit, words):
    path = tmp_path / "spheres.txt"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Multisphere.from_file(path, unit)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    for read in (Multisphere.from_file, lambda path: Multisphere.from_stl(path, 3)):
        with pytest.raises(InputError, match=r"nothing\.txt: no such file"):
            read(tmp_path / "nothing.txt")


@pytest.fixture
def cylinder(tmp_path):
    path = tmp_path / "cylinder.stl"
    pyvista.Cylinder(direction=(0, 0, 1), radius=1, height=4, resolution=24).triangulate().save(path)
    return path


def test_a_closed_surface_is_filled_from_inside(cylinder):
    shape = Multisphere.from_stl(cylinder, 12, unit="mm", seed=1)
    centres, radii = 1000 * np.array(shape.centres), 1000 * np.array(shape.radii)
    apothem = math.cos(math.pi / 24)  # of the polygon of 24 sides
    assert len(radii) == 12
    assert np.all(np.linalg.norm(centres[:, :2], axis=1) + radii <= 1 + 1e-6)
    assert np.all(np.abs(centres[:, 2]) + radii <= 2 + 1e-5)
    assert 0.998 * apothem < radii.max() < apothem * (1 + 1e-6)
    assert 0.8 < shape.covered < 1
    volume = 24 * 0.5 * math.sin(2 * math.pi / 24) * 4e-9
    assert shape.covered == pytest.approx(shape.volume / volume, rel=1e-6)


def test_the_same_seed_fills_the_same(cylinder):
    one = Multisphere.from_stl(cylinder, 4, seed=2)
    assert one == Multisphere.from_stl(cylinder, 4, seed=2)
    assert one != Multisphere.from_stl(cylinder, 4, seed=3)
    assert one.covered < Multisphere.from_stl(cylinder, 8, seed=2).covered


def test_an_ascii_file_and_inward_triangles_are_filled_alike(tmp_path, cylinder):
    path = tmp_path / "inward.stl"
    mesh = pyvista.read(cylinder)
    faces = mesh.faces.reshape(-1, 4)[:, [0, 1, 3, 2]]
    pyvista.PolyData(mesh.points, faces.ravel()).save(path, binary=False)
    assert Multisphere.from_stl(path, 3).covered == pytest.approx(Multisphere.from_stl(cylinder, 3).covered, abs=0.05)


def test_surfaces_with_no_inside_are_refused(tmp_path):
    path = tmp_path / "open.stl"
    pyvista.Cylinder(capping=False).triangulate().save(path)
    with pytest.raises(InputError, match=r"open\.stl: its surface isn't closed, \d+ edges"):
        Multisphere.from_stl(path, 3)
    path.write_text("no triangles here")
    with pytest.raises(InputError, match="STL"):
        Multisphere.from_stl(path, 3)
