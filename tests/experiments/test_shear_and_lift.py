"""Shear box and lifted tube: measurements of planted records and shapes, and what a small real run must show."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taichidem.errors import InputError
from taichidem.experiments import LiftingCylinder, Outcome, ShearBox
from tests.experiments.planted import SMALL, granules, snapshot


def record(peak, steady, *, area, weight=0.36):
    """Return a shear test whose stress is at its peak for a tenth of the way and steady afterwards."""
    displacement = np.linspace(0.009 / 500, 0.009, 500)
    stress = np.where(np.arange(500) < 100, 0.0, np.where(np.arange(500) < 150, peak, steady))
    stress[300] += 1e4  # one wild sample is no peak
    forces = (stress * area).tolist()
    return {
        "displacement": displacement.tolist(),
        "shear_force": forces,
        "lid_rise": [0.0] * 500,
        "normal_force": [3.0] * 333 + [2.5] * 167,
        "weight_above": [weight],
        "weight_below": [0.5],
    }


def test_peak_and_steady_stress_of_a_known_curve():
    box = ShearBox(normal_stresses="1 kPa", length=0.05, width=0.04)
    assert [o.name for o in box.observables] == ["peak_shear_stress", "steady_shear_stress"]
    values, details = box.measure(None, record(900.0, 600.0, area=0.002))
    assert values["steady_shear_stress"] == pytest.approx(600.0)
    assert values["peak_shear_stress"] == pytest.approx(600.0 + 1e4 / 25)  # of the running mean, here the wild sample's
    assert details["normal_stress_pa"] == pytest.approx(1000.0 + 0.36 / 0.002)
    assert details["stress_on_plane_pa"] == pytest.approx((2.5 - 0.5) / 0.002)


def test_the_steady_stress_is_that_of_the_last_third():
    box = ShearBox(normal_stresses=1000.0)
    held = record(0.0, 0.0, area=0.0036)
    held["shear_force"] = [0.0] * 332 + [0.72] * 168
    assert box.measure(None, held)[0]["steady_shear_stress"] == pytest.approx(200.0, rel=0.01)


def one(normal, steady, peak, failure=None):
    values = {} if failure else {"steady_shear_stress": steady, "peak_shear_stress": peak}
    return Outcome(values, 7, failure, None, {"normal_stress_pa": normal, "stress_on_plane_pa": normal})


def test_friction_angle_and_cohesion_of_points_on_known_lines():
    box = ShearBox(normal_stresses=[1.0, 2.0, 3.0])
    tests = [one(s, 50 + s * math.tan(math.radians(30)), 80 + s * math.tan(math.radians(40))) for s in (1e3, 2e3, 4e3)]
    outcome = box.combine(tests)
    assert outcome.observables == pytest.approx({"friction_angle": 30.0, "cohesion": 50.0, "peak_friction_angle": 40.0})
    assert set(outcome.observables) == {o.name for o in box.observables}
    assert outcome.details["tests"][0]["normal_stress_pa"] == 1e3


def test_a_load_that_fails_is_named():
    outcome = ShearBox(normal_stresses=[1.0, 2.0]).combine([one(1.0, 1.0, 1.0), one(2.0, 0, 0, "it blew up")])
    assert (outcome.failure, outcome.observables) == ("2 Pa: it blew up", {})


@pytest.fixture(scope="module")
def watched():
    """A small shear test of one load, with what its lid and its lower half felt from time to time."""
    seen = []

    class Watched(ShearBox):
        def procedure(self, world, model):
            for pause in super().procedure(world, model):
                yield pause
                lid, half, grains = world.wall("lid"), world.wall("lower half"), world.snapshot()
                top = float((grains.position[:, 2] + grains.radius).max())
                carried = half.force[2] + world.wall("upper half").force[2]
                seen.append((world.time, lid.centre[2], lid.force[2], carried, half.centre[0], top))

    box = Watched(**SMALL["shear_box"] | {"normal_stresses": "2 kPa"})
    outcome = box.run(granules(), [3])[0]
    return box, outcome, np.array(seen)


def test_the_lid_waits_without_touching_then_rests_on_the_grains(watched):
    box, _, seen = watched
    time, lid, force, _, _, top = seen.T
    load = 2000.0 * 0.036 * 0.030
    held = time < 0.29
    assert np.all(np.abs(lid[held]) < 1e-4)
    assert np.all(force[held] == 0)
    sheared = seen[:, 4] > 0
    height = box._rain_top() + 0.006 + lid
    assert np.all(np.abs(height[sheared] - top[sheared]) < 3e-4)
    assert force[sheared].mean() == pytest.approx(load, rel=0.02)


def test_the_halves_carry_load_and_weight_and_the_lower_is_held_back_by_friction(watched):
    _, outcome, seen = watched
    assert outcome.failure is None
    sheared = seen[:, 4] > 0
    load, weight = 2000.0 * 0.036 * 0.030, 9.81 * outcome.snapshot.mass.sum()
    assert -seen[sheared, 3].mean() == pytest.approx(load + weight, rel=0.02)
    assert seen[-1, 4] == pytest.approx(0.004, rel=0.01)
    assert outcome.snapshot.left == 0
    assert len(outcome.snapshot.mass) == 150
    normal = outcome.details["normal_stress_pa"]
    assert 0.2 * normal < outcome.observables["steady_shear_stress"] < 2 * normal  # a box six grains long is stiff
    assert outcome.details["displacement_m"][-1] == pytest.approx(0.004, rel=0.01)


def test_a_part_is_the_test_of_its_load_alone():
    box = ShearBox(**SMALL["shear_box"])
    outcome = box.run(granules(), [3])[0]
    alone = ShearBox(**SMALL["shear_box"] | {"normal_stresses": 3000.0}).run(granules(), [3])[0]
    assert outcome.details["tests"][1] == {
        "normal_stress_pa": alone.details["normal_stress_pa"],
        "stress_on_plane_pa": alone.details["stress_on_plane_pa"],
        **alone.observables,
    }
    assert box.particles_needed() == 2 * 150


def cone(angle_deg, base):
    grid = np.arange(-base, base, 0.0015)
    x, y = (axis.ravel() for axis in np.meshgrid(grid, grid))
    r = np.hypot(x, y)
    inside = r < base
    top = 0.003 + (base - r[inside]) * math.tan(math.radians(angle_deg))
    columns = [np.column_stack([x[inside], y[inside], z]) for z in (top - k * 0.0015 for k in range(40))]
    grains = np.concatenate(columns)
    return grains[grains[:, 2] > 0.0029]


@pytest.mark.parametrize("angle", [20.0, 35.0])
def test_a_cone_left_by_the_tube_is_measured_on_its_own_base(angle):
    grains = cone(angle, 0.05)
    far = np.column_stack([np.linspace(0.06, 0.11, 30), np.zeros(30), np.full(30, 0.003)])
    fallen = np.full((500, 3), [0.0, 0.2, -0.01])
    test = LiftingCylinder(plate_radius=0.12)
    values, details = test.measure(snapshot(np.concatenate([grains, far, fallen])), {})
    assert values["angle_of_repose"] == pytest.approx(angle, abs=1.0)
    assert values["run_out_radius"] == pytest.approx(0.05, rel=0.05)
    assert details["grains_on_plate"] == len(grains) + 30
    narrow = LiftingCylinder(plate_radius=0.045).measure(snapshot(grains), {})[0]
    assert narrow["run_out_radius"] == 0.045


def test_an_empty_plate_is_no_number():
    with pytest.raises(InputError, match="No grain is left on the plate"):
        LiftingCylinder().measure(snapshot(np.full((60, 3), -0.1)), {})


def test_the_tube_is_lifted_clear_and_stops():
    seen = []

    class Watched(LiftingCylinder):
        def procedure(self, world, model):
            for pause in super().procedure(world, model):
                yield pause
                grains = world.snapshot()
                seen.append((world.wall("tube").centre[2], float((grains.position[:, 2] + grains.radius).max())))

    outcome = Watched(**SMALL["lifting_cylinder"]).run(granules(), [1])[0]
    lifted, top = np.array(seen).T
    assert outcome.failure is None
    assert np.all(lifted[:10] == 0)
    assert lifted[-1] == pytest.approx(top[9], rel=0.01)
    assert lifted[-1] == lifted[-10]
