"""The circle in which two undeformed surfaces intersect, by brute force and in a settled contact."""

import math

import numpy as np
import pytest

from taichidem.effects import CohesionArea, NormalHertz
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, ball, effective_modulus, scene
from tests.effect_bench import PAIR, RADIUS, at_rest, base_bench, bench

DENSITY = 4e4


def attraction(overlaps, wall=0):
    both = bench(CohesionArea, energy_density=DENSITY).run(at_rest(overlaps), wall=wall)[0]
    return base_bench(CohesionArea).run(at_rest(overlaps), wall=wall)[0][:, 0] - both[:, 0]


def test_area_between_equal_spheres():
    """Half chord² of the lens: a² = R² − (d/2)²."""
    overlaps = np.geomspace(1e-6, 4e-3, 30)
    square = RADIUS**2 - (RADIUS - overlaps / 2) ** 2
    assert attraction(overlaps) == pytest.approx(DENSITY * math.pi * square, rel=1e-6)
    assert attraction(overlaps[:1]) == pytest.approx(DENSITY * math.pi * RADIUS * overlaps[:1], rel=1e-3)


def test_area_at_a_wall():
    overlaps = np.geomspace(1e-6, 4e-3, 30)
    assert attraction(overlaps, wall=1) == pytest.approx(
        DENSITY * math.pi * (RADIUS**2 - (RADIUS - overlaps) ** 2), rel=1e-6
    )


def test_unlike_spheres_pull_as_the_circle_where_their_surfaces_meet():
    """Two spheres of 10 and 6 mm, released at a small overlap: the first kick is that of Hertz less k A."""
    first, second, overlap, dt = 0.010, 0.006, 1.5e-3, 1e-9
    d = first + second - overlap
    grains = ball([[0, 0, 1.0], [d, 0, 1.0]], radius=np.array([first, second]))
    law = [NormalHertz(restitution=1.0), CohesionArea(energy_density=DENSITY)]
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=dt))
    simulation.run_steps(1)
    x = (d**2 + first**2 - second**2) / (2 * d)
    area = math.pi * (first**2 - x**2)
    reduced = first * second / (first + second)
    hertz = 4 / 3 * effective_modulus(SOFT, SOFT) * math.sqrt(reduced) * overlap**1.5
    assert simulation.snapshot().force[1, 0] == pytest.approx(hertz - DENSITY * area, rel=1e-6)
    assert area == pytest.approx(math.pi * (second**2 - (d - x) ** 2))  # one circle, seen from either side


@pytest.mark.parametrize(("wall", "free_depth"), [(0, lambda q: 2 * (q / 2) ** 2), (1, lambda q: q**2)])
def test_without_a_load_a_contact_settles_at_a_small_depth(wall, free_depth):
    """Hertz carries the pull at δ = 2R (3πk/(4E*))² between grains and at R (3πk/(2E*))² at a wall, up to some δ/R."""
    share = 3 * math.pi * DENSITY / (2 * PAIR.youngs_modulus)
    depth = free_depth(share) * RADIUS
    made = bench(CohesionArea, energy_density=DENSITY)
    nearer, farther = made.run(at_rest(np.array([0.98, 1.02]) * depth), wall=wall)[0][:, 0]
    assert nearer < 0 < farther


def test_a_pair_at_rest_presses_until_hertz_carries_the_pull():
    """k A(δ) = 4/3 E* √R* δ^1.5, found by letting a damped pair come to rest."""
    density = 4e5
    grains = ball([[0, 0, 1.0], [0.01995, 0, 1.0]])
    law = [NormalHertz(restitution=0.1), CohesionArea(energy_density=density)]
    simulation = Simulation(scene(grains, walls=(), law=law))
    simulation.run(0.5)
    x = simulation.snapshot().position
    overlap = 0.02 - np.linalg.norm(x[1] - x[0])
    # A = π (R δ − δ²/4), so √δ 4/3 E* √R* = k π (R − δ/4).
    stiffness = 4 / 3 * effective_modulus(SOFT, SOFT) * math.sqrt(0.005)
    assert stiffness * math.sqrt(overlap) == pytest.approx(density * math.pi * (0.01 - overlap / 4), rel=1e-5)
