"""Procedures of several worlds: each goes on alone when another ends or fails."""

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.effects import BodyGravity
from taichidem.errors import InputError
from taichidem.materials import Material
from taichidem.procedure import World, play
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation


def falling_worlds(count):
    model = Model([Material("grain", 1000.0, 1e6, 0.3)], [BodyGravity()])
    ball = Bodies.spheres(np.zeros((1, 3)), 0.01, 1000.0)
    scene = Scene(model=model, bodies=ball, domain=((-1, -1, -1), (1, 1, 1)))
    simulation = Simulation([scene] * count)
    return simulation, [World(simulation, k, np.random.default_rng(k)) for k in range(count)]


def waits(durations, error=None):
    yield from durations
    if error:
        raise error


def test_worlds_wait_as_long_as_they_ask_for():
    simulation, worlds = falling_worlds(2)
    shares = []
    play(simulation, [waits([0.1, 0.1]), waits([0.05])], worlds, shares.append)
    step = simulation.scenes[0].dt  # each wait is a whole number of steps
    assert [w.time for w in worlds] == pytest.approx([0.2, 0.05], abs=2 * step)
    assert shares[-1] == 1.0


def test_a_procedure_that_fails_costs_only_its_own_world():
    simulation, worlds = falling_worlds(2)
    play(simulation, [waits([0.1], InputError("the region is full")), waits([0.1, 0.1])], worlds)
    assert worlds[0].failure == "the region is full"
    assert worlds[1].failure is None
    assert worlds[1].time == pytest.approx(0.2, abs=2 * simulation.scenes[1].dt)


def test_an_error_that_every_world_meets_is_raised():
    simulation, worlds = falling_worlds(2)
    with pytest.raises(InputError, match="full"):
        play(simulation, [waits([0.1], InputError("full")), waits([], InputError("full"))], worlds)
