"""One rolling grain against its closed form."""

import pytest

from taichidem.effects import BodyGravity, CohesionArea, NormalHertz, RollingConstantTorque, TangentialMindlin
from taichidem.errors import InputError
from taichidem.experiments import RollingBall
from taichidem.materials import Material
from taichidem.scene import Model


def distance(*more, **settings):
    grain, wall = Material("granule", 910.0, 5e6, 0.36), Material("wall", 7800.0, 5e7, 0.3)
    effects = [NormalHertz(restitution=0.6), TangentialMindlin(static_friction=0.3), BodyGravity(), *more]
    outcome = RollingBall(**settings).run(Model([grain, wall], effects), [1])[0]
    assert outcome.failure is None
    return outcome.observables["rolling_distance"]


def test_a_grain_without_resistance_rolls_on():
    assert distance(speed="0.1 m/s", time="0.5 s") == pytest.approx(50.0, rel=2e-3)


@pytest.mark.parametrize("friction", [0.004, 0.02])
def test_a_constant_couple_slows_it_and_stops_it(friction):
    slowing = 5 / 7 * friction * 9.81
    stop = min(0.5, 0.1 / slowing)
    expected = 1e3 * (0.1 * stop - slowing * stop**2 / 2)
    found = distance(RollingConstantTorque(rolling_friction=friction), speed=0.1, time=0.5)
    assert found == pytest.approx(expected, rel=0.02)


def test_cohesion_between_grains_leaves_it_alone():
    density = {"granule-granule": 4e4, "granule-wall": 0.0, "wall-wall": 0.0}
    assert distance(CohesionArea(energy_density=density), time=0.5) == pytest.approx(50.0, rel=2e-3)


def test_its_settings_are_checked():
    with pytest.raises(InputError, match=r"rolling_ball\.speed is 0\.0 \[m/s\]: Input should be greater than 0"):
        RollingBall(speed=0)
