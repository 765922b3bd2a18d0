"""Coulomb's force between like charges and on images in walls, cut off without a jump."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from taichidem.effects import BodyGravity, ElectrostaticCharge, NormalHertz
from taichidem.errors import InputError
from taichidem.simulation import Simulation
from taichidem.walls import Mesh, Plane
from tests.apparatus import FLOOR, SOFT, ball, scene
from tests.effect_bench import PAIR, RADIUS, at_rest, base_bench, bench

DENSITY, CUT_OFF = 1e-5, 4e-3
VACUUM = 8.8541878128e-12  # [F/m]


def charge(radius, density=DENSITY):
    return density * 4 * math.pi * radius**2


def repulsion(r, first, second, cut_off=CUT_OFF):
    """Coulomb by the book, less its value at the cut-off."""
    limit = first + second + cut_off
    strength = charge(first) * charge(second) / (4 * math.pi * VACUUM)
    return np.where(r < limit, strength / r**2 - strength / limit**2, 0.0)


def image(d, radius, cut_off=CUT_OFF):
    limit = radius + cut_off
    strength = charge(radius) ** 2 / (16 * math.pi * VACUUM)
    return np.where(d < limit, strength / d**2 - strength / limit**2, 0.0)


GAPS = np.array([-1e-4, 0.0, 1e-5, 1e-3, 0.999 * CUT_OFF, CUT_OFF, 1.001 * CUT_OFF, 3 * CUT_OFF])


@pytest.mark.parametrize("wall", [0, 1])
def test_force_at_every_gap(wall):
    made = bench(ElectrostaticCharge, surface_charge_density=DENSITY, cut_off=CUT_OFF)
    force = made.run(at_rest(-GAPS), wall)[0] - base_bench(ElectrostaticCharge).run(at_rest(-GAPS), wall)[0]
    wanted = -image(RADIUS + GAPS, RADIUS) if wall else repulsion(2 * RADIUS + GAPS, RADIUS, RADIUS)
    assert force[:, 0] == pytest.approx(wanted, rel=1e-8, abs=1e-12 * np.abs(wanted).max())
    assert not np.any(force[:, 1:])
    assert abs(force[4, 0]) < 5e-3 * abs(force[1, 0])  # no jump
    assert not np.any(force[5:])


@pytest.mark.parametrize("wall", [0, 1])
def test_energy_is_the_work_on_the_way_out(wall):
    effect = ElectrostaticCharge(surface_charge_density=DENSITY, cut_off=CUT_OFF)
    made = bench(ElectrostaticCharge, surface_charge_density=DENSITY, cut_off=CUT_OFF)
    gaps = np.linspace(0.0, CUT_OFF, 20001)
    force = -image(RADIUS + gaps, RADIUS) if wall else repulsion(2 * RADIUS + gaps, RADIUS, RADIUS)
    energy = made.energies(-np.array([0.0, CUT_OFF, 2 * CUT_OFF]), effect, wall=wall)
    assert energy[0] == pytest.approx(np.trapezoid(force, gaps), rel=1e-6)
    assert not np.any(energy[1:])


def test_grains_of_two_sizes_repel_as_their_charges():
    """The first kick of a pair, at a gap within the reach and beyond the skin of touching grains."""
    first, second, gap = 0.01, 0.004, 3e-3
    grains = ball([[0, 0, 0], [first + second + gap, 0, 0]], radius=np.array([first, second]))
    law = [NormalHertz(restitution=1.0), ElectrostaticCharge(surface_charge_density=DENSITY, cut_off=CUT_OFF)]
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=1e-9, skin=1e-5))
    simulation.run_steps(1)
    force = simulation.snapshot().force
    assert force[1, 0] == pytest.approx(repulsion(first + second + gap, first, second), rel=1e-8)
    assert force[0, 0] == -force[1, 0]


def test_two_charges_fly_apart_as_an_independent_integration_says():
    law = [NormalHertz(restitution=1.0), ElectrostaticCharge(surface_charge_density=3e-5, cut_off=5e-3)]
    grains = ball([[0, 0, 0], [0.0201, 0, 0]], 0.01)
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=2e-5, skin=2e-4))
    mass = simulation.snapshot().mass[0]
    simulation.run(0.3)
    s = simulation.snapshot()
    strength = charge(0.01, 3e-5) ** 2 / (4 * math.pi * VACUUM)

    def motion(_, state):
        r, speed = state
        force = strength * (1 / r**2 - 1 / 0.025**2) if r < 0.025 else 0.0
        return [speed, 2 * force / mass]

    end = solve_ivp(motion, (0, 0.3), [0.0201, 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert s.position[1, 0] - s.position[0, 0] == pytest.approx(end[0], rel=1e-6)
    assert s.velocity[1, 0] - s.velocity[0, 0] == pytest.approx(end[1], rel=1e-6)
    assert end[0] > 0.0225
    assert s.rebuilds > 3


def wall_force(wall, position=(0.0, 0.0, 0.012), more=()):
    law = [NormalHertz(restitution=1.0), ElectrostaticCharge(surface_charge_density=DENSITY, cut_off=CUT_OFF)]
    simulation = Simulation(scene(ball(position, 0.01), walls=(wall, *more), law=law, time_step=1e-9))
    simulation.run_steps(1)
    return simulation.snapshot().force[0]


def test_a_flat_mesh_has_one_image_and_two_walls_have_two():
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 0)], float)
    floor = Mesh(material="rigid", vertices=corners, facets=np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)]))
    wanted = [0.0, 0.0, -float(image(0.012, 0.01))]
    for place in ((0.0, 0.0, 0.012), (1e-3, 2e-4, 0.012), (0.3, 0.3, 0.012)):
        assert wall_force(floor, place) == pytest.approx(wanted, rel=1e-9, abs=1e-15)
    assert wall_force(FLOOR) == pytest.approx(wanted, rel=1e-9)
    side = Plane(material="rigid", point=(-0.013, 0, 0), normal=(1, 0, 0))
    both = wall_force(FLOOR, more=(side,))
    assert both == pytest.approx([-float(image(0.013, 0.01)), 0.0, wanted[2]], rel=1e-9)


def test_a_charged_grain_is_caught_by_a_ceiling_without_touching_it_first():
    """Lifted across a gap of 0.1 mm where the image pulls harder than the weight, let fall where it doesn't."""
    ceiling = Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, -1))
    radius, gap = 0.002, 1e-4
    weight = SOFT.density * 4 / 3 * math.pi * radius**3 * 9.81
    unit = float(image(radius + gap, radius)) / DENSITY**2
    worlds = []
    for share in (0.9, 1.1):
        effect = ElectrostaticCharge(surface_charge_density=math.sqrt(share * weight / unit), cut_off=CUT_OFF)
        law = [NormalHertz(restitution=0.2), BodyGravity(), effect]
        worlds.append(scene(ball([0, 0, -radius - gap], radius), walls=(ceiling,), law=law))
    simulation = Simulation(worlds)
    simulation.run(0.3)
    assert simulation.snapshot(0).position[0, 2] < -0.02
    assert simulation.snapshot(1).position[0, 2] > -radius


def test_reach_and_bad_numbers():
    assert ElectrostaticCharge(surface_charge_density=1e-6, cut_off=2e-3).reach(PAIR, RADIUS) == 2e-3
    assert ElectrostaticCharge(surface_charge_density=1e-6).reach(PAIR, RADIUS) == 3e-3
    assert ElectrostaticCharge(surface_charge_density=0.0).reach(PAIR, RADIUS) == 0.0
    with pytest.raises(InputError, match="one number for the whole model"):
        ElectrostaticCharge(surface_charge_density={"a-b": 1e-6})
    with pytest.raises(InputError, match=r"cut_off is 0\.0; allowed is above 0"):
        ElectrostaticCharge(surface_charge_density=1e-6, cut_off=0.0)


def test_force_over_weight_is_kept_by_coarse_graining():
    """Grains s times as large, at gaps s times as wide: force ∝ s³ with σ ∝ √s."""
    fine = ElectrostaticCharge(surface_charge_density=1e-6, cut_off=2e-3)
    coarse = fine.coarse_grained(3.0)
    assert coarse.value("surface_charge_density") == pytest.approx(1e-6 * math.sqrt(3), rel=1e-12)
    assert coarse.value("cut_off") == pytest.approx(6e-3, rel=1e-12)
