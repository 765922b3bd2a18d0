"""Walls that are pushed, moved, stopped and taken away while a simulation runs, and what grains do to them."""

import numpy as np
import pytest

from taichidem.errors import InputError
from taichidem.simulation import Simulation
from taichidem.walls import Cylinder, Motion, Plane
from tests.apparatus import ball, effects, scene

GRAVITY = (0.0, 0.0, -9.81)
FLOOR = Plane(name="floor", material="rigid", point=(0, 0, 0), normal=(0, 0, 1))
LID = Plane(
    name="lid", material="rigid", point=(0, 0, 0.05), normal=(0, 0, -1), motion=Motion(load=(0, 0, -3.0), mass=0.2)
)


@pytest.fixture(params=["worlds", "particles"])
def schedule(request):
    return request.param


def pressed(schedule, lid=LID):
    grains = ball([[0.0, 0.0, 0.0101], [0.03, 0.0, 0.0101]], velocity=(0.01, 0, 0))
    law = effects(restitution=0.3, friction=0.3, gravity=GRAVITY)
    return Simulation(scene(grains, walls=(FLOOR, lid), law=law), schedule)


def test_a_loaded_wall_rests_on_the_grains_and_the_floor_carries_all(schedule):
    simulation = pressed(schedule)
    simulation.run(1.0)
    grains = simulation.snapshot()
    lid, floor = simulation.wall("lid"), simulation.wall("floor")
    assert lid.force[2] == pytest.approx(3.0, rel=1e-3)
    assert floor.force[2] == pytest.approx(-3.0 - 9.81 * grains.mass.sum(), rel=1e-3)
    # Two equal grains: the line of action lies half way between them; τ = r × F about the origin.
    middle = grains.position[:, 0].mean()
    assert floor.torque[1] == pytest.approx(-middle * floor.force[2], rel=1e-3)
    assert 0.05 + lid.centre[2] == pytest.approx(0.02, abs=3e-4)
    assert abs(lid.velocity[2]) < 1e-4


def test_a_loaded_wall_falls_freely_as_its_mass_and_load_say(schedule):
    simulation = pressed(schedule)
    simulation.run(0.05)
    t = simulation.time()
    assert simulation.wall("lid").velocity[2] == pytest.approx(-3.0 / 0.2 * t, rel=1e-9)
    assert simulation.wall("lid").centre[2] == pytest.approx(-0.5 * 3.0 / 0.2 * t**2, rel=0.02)


def test_both_schedules_give_walls_the_same_bits():
    states = []
    for schedule in ("worlds", "particles"):
        simulation = pressed(schedule)
        simulation.run(0.3)
        states.append(
            [np.concatenate([w.centre, w.velocity, w.force, w.torque]) for w in map(simulation.wall, ("lid", "floor"))]
        )
    assert np.array_equal(states[0], states[1])


def test_cut_runs_with_a_loaded_wall_give_the_same_bits(schedule):
    states = []
    for pieces in ([1200], [600, 600], [1, 599, 300, 300]):
        simulation = pressed(schedule)
        for steps in pieces:
            simulation.run_steps(steps)
        lid, floor = simulation.wall("lid"), simulation.wall("floor")
        states.append(
            np.concatenate([lid.centre, lid.velocity, lid.force, floor.force, simulation.snapshot().position.ravel()])
        )
    assert np.array_equal(states[0], states[1])
    assert np.array_equal(states[0], states[2])


def test_a_loaded_wall_that_is_taken_away_stops_and_costs_nothing(schedule):
    simulation = pressed(schedule)
    simulation.run(0.4)
    simulation.remove_wall("lid")
    assert not np.any(simulation.wall("lid").force)
    place, before = simulation.wall("lid").centre, simulation.snapshot().rebuilds
    simulation.run(0.4)
    assert np.array_equal(simulation.wall("lid").centre, place)
    assert simulation.snapshot().rebuilds <= before + 3
    assert simulation.standing_walls() == ["floor"]


def test_walls_feel_the_evaluation_that_stopped_a_world():
    """Both schedules say the same of a world that failed."""
    forces = []
    for schedule in ("worlds", "particles"):
        grain = ball([[0.0, 0.0, 0.02]], velocity=(0, 0, -40.0))
        simulation = Simulation(scene(grain, walls=(FLOOR,), law=effects(), time_step=5e-5), schedule)
        simulation.run(0.01)
        assert "overlaps too far" in simulation.failure()
        forces.append(simulation.wall("floor").force)
    assert forces[0][2] < 0
    assert np.array_equal(*forces)


def test_a_removed_wall_no_longer_carries(schedule):
    simulation = pressed(schedule)
    simulation.run(0.3)
    simulation.remove_wall("floor")
    before = simulation.snapshot()
    simulation.run(0.05)
    after = simulation.snapshot()
    assert np.all(after.position[:, 2] < before.position[:, 2] - 0.01)
    assert not np.any(simulation.wall("floor").force)


def test_a_wall_may_be_loaded_and_held_during_a_run(schedule):
    held = Plane(name="lid", material="rigid", point=(0, 0, 0.05), normal=(0, 0, -1))
    simulation = pressed(schedule, held)
    simulation.run(0.2)
    assert not np.any(simulation.wall("lid").centre)
    simulation.move_wall("lid", load=(0.0, 0.0, -3.0), mass=0.2)
    simulation.run(1.0)
    assert simulation.wall("lid").force[2] == pytest.approx(3.0, rel=1e-2)
    simulation.move_wall("lid", spin=(0.0, 0.0, 1.0))  # what is left out stays, the load too
    simulation.run(0.1)
    assert simulation.wall("lid").force[2] == pytest.approx(3.0, rel=1e-2)
    simulation.move_wall("lid", load=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.02))
    simulation.run(0.1)
    assert simulation.wall("lid").velocity.tolist() == [0.0, 0.0, 0.02]
    assert not np.any(simulation.wall("lid").force)


def test_a_wall_set_in_motion_carries_its_grain_along():
    """A plane that starts to move sideways drags a grain up to rolling: a friction force acts and the plane feels it."""
    law = effects(restitution=0.3, friction=0.5, gravity=GRAVITY)
    simulation = Simulation(scene(ball([[0.0, 0.0, 0.0099]]), walls=(FLOOR,), law=law))
    simulation.run(0.2)
    simulation.move_wall("floor", velocity=(1.0, 0.0, 0.0))
    simulation.run(0.02)
    weight = 9.81 * simulation.snapshot().mass[0]
    assert simulation.snapshot().velocity[0, 0] == pytest.approx(0.5 * 9.81 * 0.02, rel=0.02)
    assert simulation.wall("floor").force[0] == pytest.approx(-0.5 * weight, rel=0.02)
    assert simulation.wall("floor").centre == pytest.approx([0.02, 0, 0], rel=1e-2)
    simulation.move_wall("floor", velocity=(0.0, 0.0, 0.0))
    held = simulation.wall("floor").centre
    simulation.run(0.01)
    assert np.array_equal(simulation.wall("floor").centre, held)


def test_a_drum_set_turning_lifts_its_grain():
    drum = Cylinder(name="drum", material="rigid", base=(0, -0.05, 0), axis=(0, 1, 0), radius=0.05, height=0.1)
    law = effects(restitution=0.3, friction=0.5, rolling=0.2, gravity=GRAVITY)
    simulation = Simulation(scene(ball([[0.0, 0.0, -0.0399]]), walls=(drum,), law=law))
    simulation.run(0.2)
    assert abs(simulation.snapshot().position[0, 0]) < 1e-9
    simulation.move_wall("drum", spin=(0.0, 2.0, 0.0))
    simulation.run(0.1)
    assert simulation.wall("drum").spin.tolist() == [0.0, 2.0, 0.0]
    # Turning about +y carries the bottom towards −x.
    assert simulation.snapshot().position[0, 0] < -1e-3


def test_wall_names_and_loads_are_checked():
    simulation = pressed("worlds")
    with pytest.raises(InputError, match=r"Unknown wall 'flor'\. Allowed: floor, lid\. Did you mean 'floor'"):
        simulation.wall("flor")
    with pytest.raises(InputError, match=r"Motion\.velocity"):
        simulation.move_wall("floor", velocity=(0, np.nan, 0))
    with pytest.raises(InputError, match="less than the lightest grain"):
        simulation.move_wall("floor", load=(0, 0, -1.0), mass=1e-3)
    twice = Simulation(scene(ball([[0, 0, 0.02]]), walls=(FLOOR, FLOOR)))
    with pytest.raises(InputError, match="2 walls are named 'floor'"):
        twice.remove_wall("floor")
    light = Motion(load=(0, 0, -1.0), mass=1e-3)
    with pytest.raises(InputError, match=r"'lid' is loaded and has a mass of 0\.001 kg, less than the lightest grain"):
        pressed("worlds", Plane(name="lid", material="rigid", point=(0, 0, 0.05), normal=(0, 0, -1), motion=light))
    for wrong in ({"load": (0, 0, -1.0)}, {"mass": 1.0}, {"load": (0, 0, -1.0), "mass": -1.0}):
        with pytest.raises(InputError, match="a loaded wall needs both"):
            Motion(**wrong)
