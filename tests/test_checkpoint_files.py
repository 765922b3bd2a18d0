"""Checkpoint files that can't be used are refused with a sentence; one that is being written never costs the one before."""

from __future__ import annotations

import json
import os
from dataclasses import replace

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.checkpoints.file import FORMAT, PHYSICS_VERSION
from taichidem.checkpoints.packing import Packer
from taichidem.effects import BodyGravity
from taichidem.errors import InputError
from taichidem.materials import Material
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from taichidem.walls import Plane

MODEL = Model([Material("grain", 1000.0, 1e6, 0.3)], [BodyGravity()])
SCENE = Scene(
    model=MODEL,
    walls=[Plane(material="grain", point=(0, 0, -1), normal=(0, 0, 1), name="floor")],
    bodies=Bodies.spheres(np.zeros((1, 3)), 0.01, 1000.0),
    domain=((-1, -1, -1), (1, 1, 1)),
)


@pytest.fixture
def saved(tmp_path):
    simulation = Simulation(SCENE)
    simulation.run(0.1)
    simulation.save(tmp_path / "state.npz")
    return tmp_path / "state.npz"


def changed(path, **entries):
    """Give the header of a file other entries."""
    with np.load(path) as archive:
        header, data = json.loads(archive["header"].tobytes()), archive["data"]
    text = np.frombuffer(json.dumps(header | entries).encode(), np.uint8)
    with path.open("wb") as file:
        np.savez(file, header=text, data=data)


def test_times_and_forms_come_back(saved):
    again = Simulation.load(saved, SCENE)
    assert again.time() == pytest.approx(0.1, abs=SCENE.dt)
    assert again.snapshot().position[0, 2] == pytest.approx(-0.5 * 9.81 * 0.01, rel=1e-3)
    assert again.snapshot().forms.radius == pytest.approx([0.01])


@pytest.mark.parametrize(
    ("entries", "sentence"),
    [
        (
            {"format": 0},
            "is of format version 0; this one, .* goes on from format version 1 alone. Finish it with the program",
        ),
        ({"physics": "1"}, "is of physics version '1'; this one"),
        ({"program": "other"}, "is no checkpoint of taichidem"),
        ({"content": "experiment"}, "is of experiment, not of simulation"),
        ({"state": {"mapping": {"columns": {"mapping": {}}}}}, "holds other tables than this version's engine"),
    ],
)
def test_other_versions_and_programs(saved, entries, sentence):
    changed(saved, **entries)
    with pytest.raises(InputError, match=sentence):
        Simulation.load(saved, SCENE)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_cut_off(saved, share):
    whole = saved.read_bytes()
    saved.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match="damaged, cut off, or no checkpoint"):
        Simulation.load(saved, SCENE)


def test_one_flipped_bit(saved):
    whole = bytearray(saved.read_bytes())
    whole[len(whole) * 2 // 3] ^= 1
    saved.write_bytes(bytes(whole))
    with pytest.raises(InputError, match="damaged"):
        Simulation.load(saved, SCENE)


def test_files_of_others(tmp_path):
    np.save(tmp_path / "array.npy", np.zeros(3))
    np.savez(tmp_path / "arrays.npz", a=np.zeros(3))
    np.save(tmp_path / "objects.npy", np.array([{}]), allow_pickle=True)
    for name in ("array.npy", "arrays.npz"):
        with pytest.raises(InputError, match="is no checkpoint of taichidem"):
            Simulation.load(tmp_path / name, SCENE)
    (tmp_path / "notes.txt").write_text("my notes")
    for name in ("notes.txt", "objects.npy"):
        with pytest.raises(InputError, match="can't be read: it is damaged, cut off, or no checkpoint"):
            Simulation.load(tmp_path / name, SCENE)
    with pytest.raises(InputError, match="There is no checkpoint"):
        Simulation.load(tmp_path / "missing", SCENE)


@pytest.mark.parametrize(
    ("scenes", "schedule", "difference"),
    [
        ([SCENE, SCENE], "worlds", r"number of worlds \(1 there, 2 here\)"),
        (SCENE, "particles", r"schedule \(worlds there, particles here\)"),
        (replace(SCENE, time_step=1e-5), "worlds", "time step"),
        (replace(SCENE, model=MODEL.with_value("body_gravity.z", -1.6)), "worlds", "model"),
        (replace(SCENE, walls=[]), "worlds", "walls"),
        (replace(SCENE, bodies=Bodies.spheres(np.ones((1, 3)), 0.01, 1000.0)), "worlds", "grains"),
        (replace(SCENE, domain=((-1, -1, -1), (1, 1, 2))), "worlds", "domain"),
        (replace(SCENE, skin=1e-3), "worlds", "neighbour lists"),
    ],
)
def test_other_scenes(saved, scenes, schedule, difference):
    with pytest.raises(InputError, match=rf"doesn't belong to this run, which differs in its {difference}\."):
        Simulation.load(saved, scenes, schedule)


def test_where_it_cannot_be_written(tmp_path):
    simulation = Simulation(SCENE)
    with pytest.raises(InputError, match="in a folder that doesn't exist"):
        simulation.save(tmp_path / "nowhere" / "state")
    with pytest.raises(InputError, match="is a folder"):
        simulation.save(tmp_path)


def test_a_write_that_breaks_off_leaves_the_old_file(saved, monkeypatch):
    before = saved.read_bytes()
    simulation = Simulation.load(saved, SCENE)
    simulation.run(0.1)

    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"can't be written \(No space left on device\)"):
        simulation.save(saved)
    assert saved.read_bytes() == before
    assert list(saved.parent.iterdir()) == [saved]


def test_a_simulation_whose_engine_went_to_another_is_not_saved(tmp_path):
    from taichidem.errors import SimulationError

    first = Simulation(SCENE)
    Simulation(SCENE)
    with pytest.raises(SimulationError, match="handed to a newer one"):
        first.save(tmp_path / "state")


def test_what_is_packed_comes_back_to_the_bit():
    body = Bodies.spheres(np.zeros((2, 3)), 0.1 + 0.2, 1000.0)
    value = {
        "plain": [None, True, 0.1 + 0.2, -7, "ä", float("inf"), 2**100],
        "arrays": (
            np.arange(6, dtype=np.int32).reshape(2, 3)[:, ::2],
            np.array([np.nan, -0.0]),
            np.zeros((0, 3)),
            np.array("a"),
        ),
        "number": np.float32(0.1),
        "body": body,
    }
    packer = Packer((Bodies,))
    text = json.dumps(packer.pack(value))
    found = Packer((Bodies,), bytes(packer.data)).unpack(json.loads(text))
    assert found["plain"] == value["plain"]
    for one, two in zip(found["arrays"], value["arrays"], strict=True):
        assert (one.dtype, one.shape) == (two.dtype, two.shape)
        assert one.tobytes() == np.ascontiguousarray(two).tobytes()
    assert isinstance(found["number"], np.float32)
    assert found["number"] == value["number"]
    assert np.array_equal(found["body"].radius, body.radius)
    assert found["body"].element_axes is None


@pytest.mark.parametrize("value", [object(), {1: 2}, np.array([None]), {1, 2}])
def test_what_cannot_be_packed_is_refused(value):
    with pytest.raises(InputError, match="can't be kept in a checkpoint"):
        Packer().pack(value)


def test_the_program_and_the_version_stand_in_the_file(saved):
    with np.load(saved) as archive:
        header = json.loads(archive["header"].tobytes())
    assert header["program"] == "taichidem"
    assert (header["format"], header["physics"]) == (FORMAT, PHYSICS_VERSION)
