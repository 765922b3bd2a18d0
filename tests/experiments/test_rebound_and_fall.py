"""One grain: rebound against the bench's reference, free fall against closed forms."""

import math

import numpy as np
import pytest
import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects import BodyGravity
from taichidem.effects.base import BodyEffect, Parameter
from taichidem.experiments import FreeFall, Rebound
from taichidem.scene import Model
from tests.experiments.planted import GRANULE, granules


@pytest.mark.parametrize(("speed", "expected"), [(0.25, 0.5912), (0.5, 0.5885), (1.0, 0.5931), (2.0, 0.5793)])
def test_rebound_is_that_of_the_independent_codes(speed, expected):
    outcome = Rebound(speed=speed).run(granules(), [1])[0]
    assert outcome.observables["coefficient_of_restitution"] == pytest.approx(expected, abs=6e-5)


def test_nothing_falls_while_a_grain_rebounds():
    heavy = granules().with_value("body_gravity.z", -50.0)
    assert Rebound(speed=0.05).run(heavy, [1])[0].observables == Rebound(speed=0.05).run(granules(), [1])[0].observables


def test_a_grain_that_does_not_come_back_in_time_has_no_rebound():
    creeping = Rebound(speed=0.5).run(granules(restitution=0.004), [1])[0]
    assert creeping.observables == {"coefficient_of_restitution": 0.0}
    slow = Rebound(speed=0.5).run(granules(restitution=0.05), [1])[0]
    assert 0.01 < slow.observables["coefficient_of_restitution"] < 0.1


def test_free_fall_is_exact_at_times_that_are_no_steps():
    times = (0.123456, 0.5, 1.0 / 3)
    fall = FreeFall(time=times, release_height=10.0, release_speed=2.0)
    assert [o.name for o in fall.observables] == ["height_at_0.123456_s", "height_at_0.5_s", "height_at_0.333333_s"]
    got = fall.run(granules(), [1])[0].observables
    assert list(got.values()) == pytest.approx([10.0 - 2.0 * t - 4.905 * t * t for t in times], abs=1e-9)
    assert [o.name for o in FreeFall(time="500 ms").observables] == ["height"]


def test_height_at_release_and_under_gravity_of_another_direction():
    model = Model([GRANULE], [BodyGravity(x=5.0, z=3.0)])
    got = FreeFall(time="0 s, 1 s", release_height="1 m", release_speed="1 m/s").run(model, [1])[0].observables
    assert got == pytest.approx({"height_at_0_s": 1.0, "height_at_1_s": 1.0 - 1.0 + 1.5}, abs=1e-9)


class LinearDrag(BodyEffect):
    """F = −k v."""

    name = "linear_drag"
    title = "Drag for a test"
    family = "linear_drag"
    parameters = (
        Parameter(
            name="k", unit="kg/s", low=0.0, high=1.0, plausible=(0.0, 1.0), vanishing=0.0, per_pair=False, meaning="k."
        ),
    )

    @ti.func
    def wrench(self, p, b: ti.template()):
        return Wrench(force=-p.k * b.velocity, torque=vec3(0.0))


def test_a_light_ball_under_drag_falls_as_its_mass_says():
    """z = h − v∞ (t − τ (1 − exp(−t/τ))) with τ = m/k, v∞ = g τ."""
    mass, k, time = 0.0567, 0.05, 3.0
    model = Model([GRANULE], [BodyGravity(), LinearDrag(k=k)])
    got = FreeFall(mass="56.7 g", diameter="66.05 mm", release_height=47.0, time=time).run(model, [1])[0]
    tau = mass / k
    expected = 47.0 - 9.81 * tau * (time - tau * (1 - math.exp(-time / tau)))
    assert got.observables["height"] == pytest.approx(expected, abs=1e-3)
    assert got.snapshot.mass[0] == pytest.approx(mass)
    assert expected > 47.0 - 4.905 * time**2 + 15  # the drag matters


def test_a_ball_bounces_off_the_floor_if_there_is_one():
    impact = math.sqrt(2 * 9.81 * 0.3)
    apex = impact / 9.81 * (1 + 0.6)
    held = FreeFall(floor=True, release_height=0.3, time=apex).run(granules(), [1])[0].observables["height"]
    assert held == pytest.approx(0.36 * 0.3, rel=0.1)
    through = FreeFall(release_height=0.3, time=apex).run(granules(), [1])[0].observables["height"]
    assert through == pytest.approx(0.3 - 4.905 * apex**2, abs=1e-9)


def test_the_step_of_a_fall_never_carries_the_ball_far():
    scene = FreeFall(time=2.0).scene(granules())
    assert scene.dt * 2.0 * 9.81 <= 0.1 * 0.003 * (1 + 1e-12)
    assert np.ptp(scene.domain, axis=0).min() > 40.0
