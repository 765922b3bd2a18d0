"""Grains that stick to walls and not to each other."""

import math

import numpy as np
import pytest

from taichidem.effects import BodyGravity, CohesionDmt, NormalHertz, TangentialMindlin, WallAdhesion
from taichidem.errors import InputError
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from taichidem.walls import Mesh, Plane
from tests.apparatus import BOX, RIGID, SOFT, ball, scene
from tests.effect_bench import RADIUS, VELOCITY, Bench, at_rest, base_bench, bench

ENERGY = 2.0
OVERLAPS = np.array([-1e-5, -1e-300, 0.0, 1e-300, 1e-5, 1e-4])
CEILING = Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, -1))


def law(energy, *more, restitution=0.2):
    return [NormalHertz(restitution=restitution), BodyGravity(), WallAdhesion(work_of_adhesion=energy), *more]


def test_pull_at_walls_from_touch_on_and_none_between_grains():
    made, base = bench(WallAdhesion, work_of_adhesion=ENERGY), base_bench(WallAdhesion)
    pull = base.run(at_rest(OVERLAPS), wall=1)[0] - made.run(at_rest(OVERLAPS), wall=1)[0]
    wanted = np.where(OVERLAPS > 0, 2 * math.pi * ENERGY * RADIUS, 0.0)
    assert pull[:, 0] == pytest.approx(wanted, rel=1e-12, abs=1e-300)
    assert not np.any(pull[:, 1:])
    assert np.array_equal(base.answers(at_rest(OVERLAPS)), made.answers(at_rest(OVERLAPS)))
    between = made.energies(OVERLAPS, WallAdhesion(work_of_adhesion=ENERGY))
    assert not np.any(between)


def test_it_acts_beside_a_cohesion():
    cohesion = CohesionDmt(work_of_adhesion=0.5)
    both = Bench([NormalHertz(restitution=1.0), cohesion, WallAdhesion(work_of_adhesion=ENERGY)])
    force = both.run(at_rest([1e-200]), wall=1)[0]
    assert force[0, 0] == pytest.approx(-2 * math.pi * RADIUS * (0.5 + ENERGY), rel=1e-12)


def weight(radius):
    return SOFT.density * 4 / 3 * math.pi * radius**3 * 9.81


@pytest.mark.parametrize("kind", ["plane", "mesh"])
def test_a_grain_hangs_from_a_ceiling_as_long_as_the_pull_carries_it(kind):
    """Just below the weight it falls; just above, it stays; a flat patch of many facets pulls once."""
    wall = CEILING
    if kind == "mesh":
        corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 0)], float)
        wall = Mesh(material="rigid", vertices=corners, facets=np.array([(1, 0, 4), (2, 1, 4), (3, 2, 4), (0, 3, 4)]))
    carrying = weight(0.01) / (2 * math.pi * 0.01)
    worlds = [
        scene(ball([0, 0, 1e-9 - 0.01], 0.01), walls=(wall,), law=law(share * carrying))
        for share in (0.98, 1.02, 3.98, 0.0)
    ]
    simulation = Simulation(worlds)
    simulation.run(0.1)
    fallen = [-0.01 - simulation.snapshot(k).position[0, 2] for k in range(4)]
    assert fallen[0] > 1e-4
    assert fallen[1] <= 0
    assert fallen[2] <= 0
    assert fallen[3] == pytest.approx(0.5 * 9.81 * 0.01, rel=1e-2)


def test_friction_on_a_sticky_wall_holds_a_grain_on_it():
    """The Hertz force carries the pull, so that Coulomb's cap at rest is μ 2 π w R."""
    friction = TangentialMindlin(static_friction=0.5)
    side = Plane(material="rigid", point=(0, 0, 0), normal=(1, 0, 0))
    holding = weight(0.01) / (0.5 * 2 * math.pi * 0.01)
    worlds = [
        scene(ball([0.01 - 1e-6, 0, 0], 0.01), walls=(side,), law=law(share * holding, friction))
        for share in (0.2, 4.0)
    ]
    simulation = Simulation(worlds)
    simulation.run(0.1)
    sunk = [-simulation.snapshot(k).position[0, 2] for k in range(2)]
    # Below, friction slows the fall by a fifth while sliding; above, the grain rolls down the wall: 5/7 of free fall.
    assert sunk[0] == pytest.approx(0.8 * 0.5 * 9.81 * 0.01, rel=0.05)
    assert sunk[1] == pytest.approx(5 / 7 * 0.5 * 9.81 * 0.01, rel=0.02)


def test_pressing_states_slide_at_the_raised_cap():
    states = at_rest(np.full(20, 1e-5))
    states[:, VELOCITY + 1] = 10.0
    effects = [
        NormalHertz(restitution=1.0),
        TangentialMindlin(static_friction=0.4),
        WallAdhesion(work_of_adhesion=ENERGY),
    ]
    force = Bench(effects).run(states, wall=1)[0]
    assert force[-1, 1] == pytest.approx(-0.4 * (force[-1, 0] + 2 * math.pi * ENERGY * RADIUS), rel=1e-9)


def test_undamped_impacts_keep_their_speed():
    effects = [NormalHertz(restitution=1.0), WallAdhesion(work_of_adhesion=ENERGY)]
    simulation = Simulation(scene(ball([0, 0, 0.0101], 0.01, velocity=(0, 0, -0.1)), law=effects, time_step=1e-6))
    simulation.run(0.02)
    assert simulation.snapshot().velocity[0, 2] == pytest.approx(0.1, rel=5e-4)


def test_a_wall_may_have_its_own_value():
    values = {"soft-soft": 0.0, "soft-rigid": 1.0, "rigid-rigid": 0.0}
    grain = type(SOFT)("soft", SOFT.density, SOFT.youngs_modulus, SOFT.poissons_ratio)
    model = Model([grain, RIGID], law(values))
    assert model.effects[2].kernel_coefficients(model.pairs()[1]) == {"pull_off": 2 * math.pi}
    missing = Model([grain, RIGID], law({"soft-rigid": 1.0}))
    with pytest.raises(InputError, match=r"wall_adhesion\.work_of_adhesion has no value for the pair 'soft-soft'"):
        Scene(model=missing, bodies=ball([0, 0, 0]), domain=BOX)
