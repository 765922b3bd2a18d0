"""Files for ParaView: what is written is what VTK's own readers give back."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

from taichidem.errors import InputError
from taichidem.grains import Grains
from taichidem.output_vtk import GrainSeries, read_grains, write_grain_surfaces, write_grains, write_walls
from taichidem.shapes import Elements, Forms, Superquadric
from taichidem.walls import cup


@pytest.fixture
def grains():
    rng = np.random.default_rng(3)
    count = 17
    fields = {
        "velocity": rng.normal(size=(count, 3)),
        "angular_velocity": rng.normal(size=(count, 3)),
        "identifier": np.arange(count) + 100,
        "material": rng.integers(0, 3, count),
        "temperature": rng.normal(size=count),
    }
    return Grains.spheres(rng.normal(size=(count, 3)), rng.uniform(0.001, 0.003, count)), fields


def test_grains_come_back_to_the_last_bit(grains, tmp_path):
    spheres, fields = grains
    path = write_grains(tmp_path / "grains.vtp", spheres, fields=fields, time=0.25)
    read = pv.read(path)
    assert np.array_equal(read.points, spheres.position)
    assert read.points.dtype == np.float64
    assert np.array_equal(read["radius"], spheres.forms.radius)
    for name, values in fields.items():
        assert np.array_equal(read[name], values)
    assert read["identifier"].dtype == np.int64
    assert read.field_data["TimeValue"][0] == 0.25
    # One vertex a grain, or ParaView shows nothing.
    assert read.n_verts == len(spheres)
    assert list(tmp_path.iterdir()) == [path]


def turned(count):
    quaternions = np.random.default_rng(4).normal(size=(count, 4))
    return quaternions / np.linalg.norm(quaternions, axis=1)[:, None]


def clumps(count) -> Grains:
    """Return clumps of three spheres in a row along x, the first two metres from the middle."""
    e = Elements(np.array([[-2.0, 0, 0], [0, 0, 0], [1, 0, 0]]), np.array([0.5, 1, 0.7]))
    forms = Forms(np.repeat(np.arange(count), 3), np.tile(e.offset, (count, 1)), np.tile(e.radius, count))
    return Grains(np.arange(3.0 * count).reshape(count, 3), forms, turned(count))


def superquadrics(count, *exponents) -> Grains:
    shape = Superquadric(1.0, 2.0, 3.0, *exponents)
    bodies = shape.bodies(np.arange(3.0 * count).reshape(count, 3), 1000.0, orientation=turned(count))
    return Grains(bodies.position, Forms.of([bodies]), bodies.orientation)


def rotation(quaternion):
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_a_clump_is_a_point_for_each_sphere_that_knows_its_grain(tmp_path):
    grains = clumps(2)
    fields = {"identifier": [7, 9], "velocity": np.arange(6.0).reshape(2, 3)}
    read = pv.read(write_grains(tmp_path / "clumps.vtp", grains, fields=fields))
    assert read.n_points == read.n_verts == 6
    assert list(read["body"]) == [0, 0, 0, 1, 1, 1]
    assert list(read["identifier"]) == [7, 7, 7, 9, 9, 9]
    assert np.array_equal(read["velocity"][:3], np.tile([0, 1, 2], (3, 1)))
    assert np.array_equal(read["radius"], np.tile([0.5, 1, 0.7], 2))
    for first in (0, 3):
        along = rotation(read["orientation"][first])[:, 0]  # where x is turned to
        assert read.points[first] - read.points[first + 1] == pytest.approx(-2 * along)


@pytest.mark.parametrize("make", [clumps, lambda n: superquadrics(n, 3, 5)])
def test_grains_of_any_form_are_read_as_they_were(make, tmp_path):
    grains = make(3)
    back = read_grains(write_grains(tmp_path / "grains.vtp", grains))
    for name in ("body", "offset", "radius", "axes", "exponents"):
        assert np.array_equal(getattr(back.forms, name), getattr(grains.forms, name)), name
    assert back.orientation == pytest.approx(grains.orientation, abs=1e-15)
    assert back.position == pytest.approx(grains.position, abs=1e-12)
    assert back.element_centre == pytest.approx(grains.element_centre, abs=1e-12)


def test_spheres_are_read_as_spheres(grains, tmp_path):
    back = read_grains(write_grains(tmp_path / "grains.vtp", grains[0]))
    assert back.forms.round
    assert back.orientation is None
    assert np.array_equal(back.position, grains[0].position)
    with pytest.raises(InputError, match="isn't there"):
        read_grains(tmp_path / "other.vtp")
    with pytest.raises(InputError, match="lacks the array radius"):
        read_grains(write_walls(tmp_path / "walls.vtp", cup(0.05, 0.03, "steel")))


def test_surfaces_need_no_settings(tmp_path):
    grains = superquadrics(2, 3, 5)
    path = write_grain_surfaces(tmp_path / "surfaces.vtp", grains, fields={"identifier": [7, 9]}, time=0.5, fineness=10)
    read = pv.read(path)
    assert read.is_all_triangles
    assert set(read["body"][read["identifier"] == 9]) == {1}
    assert read.field_data["TimeValue"][0] == 0.5
    assert read.volume == pytest.approx(2 * Superquadric(1, 2, 3, 3, 5).volume, rel=0.01)
    own = read.points[read["body"] == 1]
    assert own.mean(axis=0) == pytest.approx(grains.position[1], abs=1e-6)
    assert np.linalg.norm(read["Normals"], axis=1) == pytest.approx(np.ones(read.n_points))


def test_a_series_names_its_moments(grains, tmp_path):
    spheres, fields = grains
    series = GrainSeries(tmp_path / "new" / "folder", "pour")
    assert "<Collection>" in series.index.read_text()
    times = [0.0, 0.1, 0.30000000000000004]
    for step, moment in enumerate(times):
        series.add(moment, replace(spheres, position=spheres.position + step), fields=fields)
        reader = pv.get_reader(series.index)
        assert reader.time_values == times[: step + 1]
    reader.set_active_time_value(times[1])
    assert np.array_equal(reader.read()[0].points, spheres.position + 1)
    assert sorted(path.name for path in series.folder.iterdir()) == [
        "pour.pvd",
        "pour_000000.vtp",
        "pour_000001.vtp",
        "pour_000002.vtp",
    ]


def test_the_list_of_moments_is_whole_or_as_it_was(grains, tmp_path, monkeypatch):
    series = GrainSeries(tmp_path, "pour")
    before = series.index.read_text()

    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("taichidem.output_vtk.write_grains", lambda path, *_, **__: path)  # had room
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"pour\.pvd can't be written \(No space left"):
        series.add(0.0, grains[0])
    assert series.index.read_text() == before
    assert list(tmp_path.iterdir()) == [series.index]


def test_moments_must_increase(grains, tmp_path):
    series = GrainSeries(tmp_path)
    series.add(1.0, grains[0])
    for moment in (1.0, 0.5, float("nan")):
        with pytest.raises(InputError, match="time given"):
            series.add(moment, grains[0])
    assert series.times == [1.0]


def test_walls_are_numbered_surfaces(tmp_path):
    walls = [*cup(0.05, 0.03, "steel"), pv.Plane()]
    read = pv.read(write_walls(tmp_path / "walls.vtp", walls))
    assert set(read["wall"]) == {0, 1, 2}
    cylinder = read.extract_cells(read["wall"] == 0)
    assert np.array(cylinder.bounds) == pytest.approx((-0.05, 0.05, -0.05, 0.05, 0.0, 0.03), abs=1e-6)
    assert "wall" not in walls[-1].cell_data
    only = pv.read(write_walls(tmp_path / "one.vtp", walls[:1]))
    assert only.n_cells == cylinder.n_cells


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"velocity": np.zeros((17, 2))}, r"velocity given.*\(17, 3\)"),
        ({"identifier": np.zeros(16)}, "identifier given"),
        ({"orientation": np.zeros((17, 4))}, "orientation given as a field"),
        ({"name": np.array(["a"] * 17)}, "name given"),
    ],
)
def test_wrong_fields_are_refused(grains, tmp_path, fields, said):
    with pytest.raises(InputError, match=said):
        write_grains(tmp_path / "grains.vtp", grains[0], fields=fields)
    assert not list(tmp_path.iterdir())


def test_places_that_cant_be_written_are_refused(grains, tmp_path, capfd):
    with pytest.raises(InputError, match=r"ends in \.vtp"):
        write_grains(tmp_path / "grains.vtk", grains[0])
    with pytest.raises(InputError, match="can't be written"):
        write_grains(tmp_path / "no" / "grains.vtp", grains[0])
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="can't be written"):
        GrainSeries(tmp_path / "file")
    with pytest.raises(InputError, match="none"):
        write_walls(tmp_path / "walls.vtp", [])
    # VTK's own complaint on the error stream would be noise beside ours.
    assert capfd.readouterr().err == ""


def test_files_are_written_without_any_window(grains, tmp_path):
    """No OpenGL may be asked for: a machine without it still gets its data."""
    code = (
        "import sys, numpy as np\n"
        "import taichidem.graphics as graphics\n"
        "graphics.require_graphics = None\n"
        "from taichidem.grains import Grains\n"
        "from taichidem.output_vtk import write_grains\n"
        "write_grains(sys.argv[1], Grains.spheres(np.zeros((2, 3)), 0.1))\n"
    )
    path = tmp_path / "grains.vtp"
    environment = {**os.environ, "VTK_DEFAULT_OPENGL_WINDOW": "NoSuchWindow"}
    done = subprocess.run([sys.executable, "-c", code, str(path)], env=environment, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert pv.read(path).n_points == 2
