"""A simulation that was saved and loaded goes on to the same last bit as one that never stopped."""

from __future__ import annotations

import multiprocessing
from dataclasses import astuple, fields

import numpy as np
import pytest
import taichi as ti

from taichidem import runtime
from taichidem.bodies import Bodies
from taichidem.checkpoints.archive import RowAccess, kept_tables
from taichidem.checkpoints.checkpoint import archive_of
from taichidem.simulation import Simulation
from tests.conftest import share_engines
from tests.crowds import KINDS, crowd

INTEGERS = ("partner", "row", "stamp")  # of the table of slots
STEPS = {"sphere": 300, "multisphere": 900, "superquadric": 300}  # before the file
MORE = 200  # after it
NOT_KEPT = {  # tables that scenes are loaded into, and those that are made anew before they are read
    *("wall_elements", "corner_edges", "sides", "meshes", "mesh_cells", "mesh_facets"),
    *("cells", "pairs", "reactions", "flows"),
}


def begun(kind, schedule):
    """Return a simulation in the middle of things: worlds at different times, walls moved, grains that just came."""
    scenes = [crowd(kind, seed) for seed in (1, 2)]
    simulation = Simulation(scenes, schedule)
    simulation.run([1.37 * STEPS[kind] * scenes[0].dt, STEPS[kind] * scenes[1].dt])
    simulation.remove_wall("lid", world=0)
    simulation.move_wall("side", velocity=(-0.05, 0.0, 0.0), world=1)
    simulation.run([20.4 * scenes[0].dt, 7.4 * scenes[1].dt])
    height = simulation.snapshot(0).position[:, 2].max() + 0.008
    simulation.insert(late(scenes[0].bodies, height), world=0)
    simulation.check()
    return simulation


def late(bodies, height, count=4):
    """Return the first of some bodies in a row at a height [m]."""
    values = {f.name: getattr(bodies, f.name) for f in fields(bodies) if getattr(bodies, f.name) is not None}
    own = np.flatnonzero(bodies.element_body < count)
    values = {name: value[own if name.startswith("element_") else slice(count)] for name, value in values.items()}
    places = [[0.008 + 0.009 * k, 0.025, height] for k in range(count)]
    return Bodies(**values | {"position": np.array(places)})


def end(simulation):
    """Run on and return everything that can be seen, in plain arrays."""
    dt = [scene.dt for scene in simulation.scenes]
    simulation.run([MORE * dt[0], 1.21 * MORE * dt[1]])
    simulation.check()
    seen = []
    for world in range(len(simulation)):
        seen += flat(simulation.snapshot(world))
        seen += [part for name in ("lid", "side") for part in flat(simulation.wall(name, world))]
        seen += memories(simulation, world).values()
    return seen


def flat(value):
    parts = astuple(value)
    return [np.asarray(p) for part in parts for p in (part if isinstance(part, tuple) else [part]) if p is not None]


def memories(simulation, world):
    """Return what living contacts remember, by slot, for each effect that does."""
    archive = archive_of(simulation._engine)
    alive = archive.read(len(simulation))[world]
    stamps = alive["slots"][1][:, INTEGERS.index("stamp")]
    living = stamps == simulation._engine.access["worlds"].read(world)["evaluation"]
    return {name: alive[name][0][living] for name in alive if name.startswith("memory")}


def same(one, two):
    return len(one) == len(two) and all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, two, strict=True))


def poison(engine):
    """Fill every table that isn't loaded from scenes with rubbish: what a checkpoint forgets then shows."""
    tables = [table for table, _ in kept_tables(engine).values()]
    tables += [getattr(engine.state, name, None) for name in ("cells", "pairs", "reactions")]
    for table in filter(None, tables):
        access = RowAccess(table)
        floats, integers = access.empty(table.shape[0])
        access.write(0, floats + np.nan, integers + 1)


def assert_busy(simulation):
    """Hold that there is something of everything to keep."""
    times = [simulation.time(world) for world in range(2)]
    assert times[0] > 1.2 * times[1] > 0
    assert abs(simulation.wall("lid", 1).velocity[2]) > 1e-3
    assert simulation.wall("side", 1).centre[0] < 0
    for world in range(2):
        assert simulation.snapshot(world).rebuilds > 3
        held = memories(simulation, world)
        assert set(held) == {f"memory of {e.name}" for e in simulation.scenes[world].model.effects if memory(e)}
        for name, values in held.items():
            assert np.count_nonzero(np.any(values != 0, axis=1)) > 5, name


def memory(effect):
    return getattr(effect, "memory", ())


@pytest.mark.parametrize("schedule", ["worlds", "particles"])
@pytest.mark.parametrize("kind", KINDS)
def test_saved_and_loaded_is_never_stopped(kind, schedule, tmp_path):
    simulation = begun(kind, schedule)
    assert_busy(simulation)
    simulation.save(tmp_path / "state")
    saved = archive_of(simulation._engine).read(2)
    expected = end(simulation)
    poison(simulation._engine)
    again = Simulation.load(tmp_path / "state", [crowd(kind, seed) for seed in (1, 2)], schedule)
    assert again._engine is simulation._engine  # so that its tables were full of rubbish
    for before, after in zip(saved, archive_of(again._engine).read(2), strict=True):
        assert before.keys() == after.keys()
        for name, arrays in before.items():
            assert same(arrays, after[name]), name
    assert same(end(again), expected)


def go_on(path):
    """Return what comes of a file in a process that has never seen its simulation, on one thread; runs there."""
    runtime.start(threads=1)
    share_engines()
    return end(Simulation.load(path, [crowd("sphere", seed) for seed in (1, 2)], "particles"))


def test_another_process_on_one_thread_goes_on_to_the_same_bits(tmp_path):
    simulation = begun("sphere", "particles")
    simulation.save(tmp_path / "state")
    expected = end(simulation)
    with multiprocessing.get_context("spawn").Pool(1) as pool:  # a process that started Taichi must not be forked
        assert same(pool.apply(go_on, (tmp_path / "state",)), expected)


def test_every_table_is_kept_or_known_to_need_no_keeping():
    for kind in KINDS:
        engine = Simulation([crowd(kind, seed) for seed in (1, 2)], "particles")._engine
        tables = {name for name, held in vars(engine.state).items() if isinstance(held, ti.StructField)}
        kept = {name for name in kept_tables(engine) if not name.startswith("memory")}
        assert tables - kept == NOT_KEPT & tables
        remembering = [effect for effect in engine.law.contact if effect.memory]
        assert len(kept_tables(engine)) - len(kept) == len(remembering) > 1
