"""A constant pull while grains touch: its size, where it begins, what it gives back."""

import math

import numpy as np
import pytest

from taichidem.effects import CohesionDmt, NormalHertz, TangentialMindlin
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, ball, effective_modulus, impact_duration, scene
from tests.effect_bench import RADIUS, VELOCITY, Bench, at_rest, base_bench, bench

ENERGY = 2.0
OVERLAPS = np.array([-1e-5, -1e-300, 0.0, 1e-300, 1e-9, 1e-5, 1e-4])
JOINED = OVERLAPS > 0


def attraction(wall=0, **values):
    states = at_rest(OVERLAPS)
    both = bench(CohesionDmt, work_of_adhesion=ENERGY, **values).run(states, wall)[0]
    return base_bench(CohesionDmt).run(states, wall)[0][:, 0] - both[:, 0]


@pytest.mark.parametrize(("wall", "radius"), [(0, RADIUS / 2), (1, RADIUS)])
def test_pull_off_at_and_beyond_touch(wall, radius):
    """2 π w R* as soon as δ > 0, whatever the load, and nothing before."""
    assert attraction(wall) == pytest.approx(
        np.where(JOINED, 2 * math.pi * ENERGY * radius, 0.0), rel=1e-12, abs=1e-300
    )


def test_friction_rises_with_the_load_that_the_pull_puts_on():
    """Derjaguin: μ (F + 2 π w R*), which is μ times the Hertz force; none is left where that vanishes."""
    states = at_rest(np.repeat([1e-5, 1e-300], 20))
    states[:, VELOCITY + 1] = 10.0
    law = [NormalHertz(restitution=1.0), TangentialMindlin(static_friction=0.4), CohesionDmt(work_of_adhesion=ENERGY)]
    force = Bench(law).run(states)[0]
    pull = 2 * math.pi * ENERGY * RADIUS / 2
    assert force[19, 1] == pytest.approx(-0.4 * (force[19, 0] + pull), rel=1e-9)
    assert force[19, 0] < 0
    assert abs(force[39, 1]) < 1e-100


def test_a_pair_rests_where_hertz_carries_the_pull():
    grains = ball([[0, 0, 0], [0.01999, 0, 0]], RADIUS)
    law = [NormalHertz(restitution=0.1), CohesionDmt(work_of_adhesion=ENERGY)]
    simulation = Simulation(scene(grains, walls=(), law=law))
    simulation.run(0.5)
    x = simulation.snapshot().position
    overlap = 2 * RADIUS - np.linalg.norm(x[1] - x[0])
    hertz = 4 / 3 * effective_modulus(SOFT, SOFT) * math.sqrt(RADIUS / 2) * overlap**1.5
    assert hertz == pytest.approx(2 * math.pi * ENERGY * RADIUS / 2, rel=1e-6)


def test_a_cycle_costs_no_energy():
    """Undamped, a grain leaves a floor as fast as it came, also where the pull is far above what its speed would carry."""
    speed = 0.02
    duration = impact_duration(SOFT, RADIUS, speed)
    law = [NormalHertz(restitution=1.0), CohesionDmt(work_of_adhesion=ENERGY)]
    worlds = [
        scene(ball([0, 0, RADIUS + 1e-7], RADIUS, velocity=(0, 0, -speed)), law=law, time_step=duration / n)
        for n in (250, 1000)
    ]
    simulation = Simulation(worlds)
    simulation.run(3 * duration)
    ratio = np.array([simulation.snapshot(k).velocity[0, 2] / speed for k in range(2)])
    # The jump falls within a step, so that the energy is off by at most force × half a step's way, there and back.
    mass = SOFT.density * 4 / 3 * math.pi * RADIUS**3
    slack = 2 * math.pi * ENERGY * RADIUS * speed * (duration / np.array([250, 1000])) / (mass * speed**2)
    assert np.all(np.abs(ratio - 1) <= slack)
    assert slack[1] < 0.02


def test_damping_makes_slow_grains_stick():
    """The drop's speed at which 0.7 of restitution no longer frees it lies between two that are tried."""
    law = [NormalHertz(restitution=0.7), CohesionDmt(work_of_adhesion=ENERGY)]
    speeds = [0.005, 0.2]
    worlds = [scene(ball([0, 0, RADIUS], RADIUS, velocity=(0, 0, -v)), law=law, time_step=1e-5) for v in speeds]
    simulation = Simulation(worlds)
    simulation.run(0.2)
    height = [simulation.snapshot(k).position[0, 2] for k in range(2)]
    assert height[0] < RADIUS
    assert height[1] > 1.5 * RADIUS
