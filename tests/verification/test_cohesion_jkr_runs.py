"""JKR contacts in simulations: pulled apart over many list rebuilds, hit, and left to come to rest."""

import functools
import math

import numpy as np
import pytest

from taichidem.effects import CohesionJkr, NormalHertz
from taichidem.simulation import Simulation
from tests.apparatus import FLOOR, RIGID, SOFT, ball, effective_modulus, reference, scene

ENERGY, RADIUS = 1.0, 0.01
HEAVY = 1e6  # times the grain's density: a grain that no contact force slows down
SPEED = 2e-4
PULLS = ("pair", "wall")


def case(kind):
    """Return R* [m], E* [Pa], F_c [N], a0²/R* [m] and the work of separation [J]."""
    radius = RADIUS / 2 if kind == "pair" else RADIUS
    modulus = effective_modulus(SOFT, SOFT if kind == "pair" else RIGID)
    a0 = (9 * math.pi * ENERGY * radius**2 / (2 * modulus)) ** (1 / 3)
    work = 7.092 * (ENERGY**5 * radius**4 / modulus**2) ** (1 / 3)
    return radius, modulus, 1.5 * math.pi * ENERGY * radius, a0**2 / radius, work


def world(kind, overlap, velocity, density=SOFT.density, restitution=1.0, **options):
    """Return a pair, or a grain above a floor, with an overlap and a velocity of approach."""
    touching = 2 * RADIUS if kind == "pair" else RADIUS
    grains = [[0.0, 0.0, touching - overlap]]
    motion = [[0.0, 0.0, -velocity]]
    if kind == "pair":
        grains, motion = [[0.0, 0.0, 0.0], *grains], [[0.0, 0.0, 0.5 * velocity], [0.0, 0.0, -0.5 * velocity]]
    law = [NormalHertz(restitution=restitution), CohesionJkr(work_of_adhesion=ENERGY)]
    heavy = ball(grains, RADIUS, SOFT, velocity=motion)
    if density != SOFT.density:
        heavy = type(heavy).spheres(grains, RADIUS, density, velocity=motion)
    return scene(heavy, walls=() if kind == "pair" else (FLOOR,), law=law, **options)


def overlap_of(kind, s):
    if kind == "pair":
        return 2 * RADIUS - np.linalg.norm(s.position[1] - s.position[0])
    return RADIUS - s.position[0, 2]


@functools.cache
def cycle(schedule="worlds", every=3):
    """Return, for pair and wall, the curve of a slow approach and that of a slow pull, and the rebuilds of each."""
    turn = 3e-5
    worlds = []
    for kind in PULLS:
        for start, speed in ((-2e-5, SPEED), (turn, -SPEED)):
            worlds.append(world(kind, start, speed, HEAVY * SOFT.density, skin=5e-7))
    simulation = Simulation(worlds, schedule=schedule)
    curves = [[] for _ in worlds]
    for _ in range(1500 // every):
        simulation.run_steps(every)
        for k, points in enumerate(curves):
            s = simulation.snapshot(k)
            points.append((overlap_of(PULLS[k // 2], s), s.force[-1, 2]))
    rebuilds = [simulation.snapshot(k).rebuilds for k in range(len(worlds))]
    simulation.check()
    return {kind: (np.array(curves[2 * k]), np.array(curves[2 * k + 1]), rebuilds[2 * k : 2 * k + 2])
            for k, kind in enumerate(PULLS)}  # fmt: skip


@pytest.mark.parametrize("kind", PULLS)
def test_a_slow_pull_over_many_rebuilds_follows_the_curve_to_its_end(kind):
    radius, modulus, pull_off, length, _ = case(kind)
    _, pulled, rebuilds = cycle()[kind]
    held = pulled[pulled[:, 1] != 0]
    assert rebuilds[1] > 50
    assert np.sum(held[:, 0] < 0) > 50
    assert held[:, 0].min() == pytest.approx(-0.27516 * length, rel=0.02)
    assert held[:, 0].min() > -0.27517 * length
    assert np.all(pulled[pulled[:, 0] < -0.2752 * length, 1] == 0)
    assert np.sum(pulled[:, 0] < -0.2752 * length) > 20
    assert held[:, 1].min() == pytest.approx(-pull_off, rel=1e-4)
    # Every point of it: the force gives a by bisection of the first equation's rising branch, and a gives the overlap.
    a = np.linspace(0.30285, 3, 400001) * math.sqrt(length * radius)
    overlap = a**2 / radius - np.sqrt(2 * math.pi * ENERGY * a / modulus)
    force = 4 * modulus * a**3 / (3 * radius) - np.sqrt(8 * math.pi * ENERGY * modulus * a**3)
    safe = held[held[:, 0] > -0.27 * length]
    assert safe[:, 1] == pytest.approx(np.interp(safe[:, 0], overlap, force), abs=1e-5 * pull_off)


@pytest.mark.parametrize("kind", PULLS)
def test_an_approach_feels_nothing_before_touch(kind):
    _, _, pull_off, _, _ = case(kind)
    near, _, rebuilds = cycle()[kind]
    assert rebuilds[0] > 50
    assert not np.any(near[near[:, 0] < 0, 1])
    assert np.sum(near[:, 0] < 0) > 30
    touched = near[near[:, 0] >= 0]
    assert touched[0, 1] == pytest.approx(-8 / 9 * pull_off, rel=0.02)


@pytest.mark.parametrize("kind", PULLS)
def test_a_cycle_loses_the_work_of_separation(kind):
    _, _, pull_off, _, work = case(kind)
    near, pulled, _ = cycle()[kind]
    top = min(near[:, 0].max(), pulled[:, 0].max())
    grid = np.linspace(-2e-5, top, 200001)
    loop = np.interp(grid, near[:, 0], near[:, 1]) - np.interp(grid, pulled[::-1, 0], pulled[::-1, 1])
    # Either jump, of 8/9 and 5/9 of the pull-off force, lies anywhere between two points of its curve.
    spacing = np.abs(np.diff(pulled[:, 0])).max()
    assert spacing * pull_off < 0.02 * work
    assert np.trapezoid(loop, grid) == pytest.approx(work, abs=0.5 * spacing * 13 / 9 * pull_off)


def test_both_schedules_pull_alike():
    for kind in PULLS:
        near, pulled, rebuilds = cycle()[kind]
        other_near, other_pulled, other_rebuilds = cycle("particles", 30)[kind]
        assert np.array_equal(near[9::10], other_near)
        assert np.array_equal(pulled[9::10], other_pulled)
        assert rebuilds == other_rebuilds


def sticking(kind):
    """Return the sticking speed of a pair or of a grain on a wall [m/s]."""
    mass = SOFT.density * 4 / 3 * math.pi * RADIUS**3 * (0.5 if kind == "pair" else 1.0)
    return math.sqrt(2 * case(kind)[-1] / mass)


def impacts(kind, speeds, restitution=1.0, duration=0.03, step=2e-6):
    """Return rebound over approach speed; a stuck grain moves on at a speed that oscillates."""
    worlds = [world(kind, -1e-9, v, restitution=restitution, time_step=step) for v in speeds]
    simulation = Simulation(worlds)
    simulation.run(duration)
    simulation.check()
    states = [simulation.snapshot(k) for k in range(len(worlds))]
    gaps = np.array([-overlap_of(kind, s) for s in states])
    velocity = np.array([s.velocity[-1, 2] - (s.velocity[0, 2] if kind == "pair" else 0.0) for s in states])
    return gaps, velocity / np.array(speeds)


@pytest.mark.parametrize("kind", PULLS)
def test_restitution_above_the_sticking_speed(kind):
    """e = √(1 − (V_s/V)²)."""
    over = np.array([1.1, 1.25, 1.5, 2.0, 3.0, 5.0, 10.0])
    gaps, ratio = impacts(kind, over * sticking(kind))
    assert np.all(gaps > case(kind)[3])
    assert ratio == pytest.approx(np.sqrt(1 - 1 / over**2), abs=1.5e-3)
    table = {
        float(r["v_impact_over_v_stick_1"]): float(r["e_expected_1"]) for r in reference("jkr_restitution_elastic.csv")
    }
    assert ratio == pytest.approx([table[v] for v in over], abs=1.5e-3)


@pytest.mark.parametrize("kind", PULLS)
def test_slow_impacts_stick(kind):
    speeds = np.array([0.1, 0.5, 0.9, 0.98]) * sticking(kind)
    gaps, _ = impacts(kind, speeds, duration=0.2)
    assert np.all(gaps < 0.2752 * case(kind)[3])


def test_a_damped_contact_comes_to_rest_where_no_force_is_left():
    """δ0 = a0²/(3 R*)."""
    for kind in PULLS:
        gaps, ratio = impacts(kind, [0.5 * sticking(kind)], restitution=0.2, duration=0.3, step=1e-5)
        assert -gaps == pytest.approx([case(kind)[3] / 3], rel=1e-6)
        assert abs(ratio[0]) < 1e-6


def test_damping_and_adhesion_take_their_shares():
    """A fast impact's restitution is a little less than the dashpot's alone, and never more."""
    fast = 20 * sticking("pair")
    _, ratio = impacts("pair", [fast], restitution=0.7)
    assert 0.68 < ratio[0] < 0.7
