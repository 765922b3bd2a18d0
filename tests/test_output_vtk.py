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
from taichidem.output_vtk import GrainSeries, write_grains, write_walls
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
