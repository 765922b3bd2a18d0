"""The viscoelastic law: its force, and a restitution that falls with speed as series, Padé formula and integration say."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from taichidem.effects import NormalViscoelastic, TangentialMindlin
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, ball, effective_modulus, hertz_impact, scene
from tests.effect_bench import OVERLAP, PAIR, RADIUS, VELOCITY, Bench, at_rest, bench

TIME = 3e-5  # [s]
SPEEDS = np.array([0.01, 0.1, 1.0, 10.0])
MASS = SOFT.density * 4 / 3 * math.pi * RADIUS**3


def impacts(speeds, times, attraction, *, steps=4000, radius=RADIUS):
    """Return the realised restitution of a sphere against a wall for each speed and dissipation time."""
    worlds, durations = [], []
    for speed, time in zip(speeds, times, strict=True):
        law = [NormalViscoelastic(attraction=attraction, dissipation_time=time)]
        mass = SOFT.density * 4 / 3 * math.pi * radius**3
        duration = hertz_impact(effective_modulus(SOFT), radius, mass, speed)[2]
        bodies = ball([0, 0, radius], radius=radius, velocity=(0, 0, -speed))
        worlds.append(scene(bodies, law=law, time_step=duration / steps, force_time_step=True))
        durations.append(duration)
    simulation = Simulation(worlds)
    simulation.run([8 * d for d in durations])
    simulation.check()
    return np.array([simulation.snapshot(k).velocity[0, 2] / v for k, v in enumerate(speeds)])


def dissipation(speeds, times):
    """Return v*² = 1.5 A (k/m)^(2/5) V^(1/5)."""
    k = 4 / 3 * effective_modulus(SOFT) * math.sqrt(RADIUS)
    return 1.5 * np.asarray(times) * (k / MASS) ** 0.4 * np.asarray(speeds) ** 0.2


def pade(x):
    """Return e of a collision that ends at zero force, with x = v*²: reference formula of the verification notes."""
    v = np.sqrt(x)
    return (1 + 0.501086 * v) / (1 + 0.501086 * v + 1.15345 * v**2 + 0.577977 * v**3 + 0.532178 * v**4)


def integrated(x, attraction):
    """Return e by integrating ξ'' = −(ξ^1.5 + x √ξ ξ'), in units where k/m and the speed are 1."""

    def motion(_, state):
        root = math.sqrt(max(state[0], 0.0))
        return [state[1], -(root**3 + x * root * state[1])]

    def apart(_, state):
        return state[0] if attraction else state[0] + x * state[1]  # over √ξ, which is positive

    apart.terminal, apart.direction = True, -1
    start = 1e-7
    run = solve_ivp(motion, (0, 200), [start, 1.0], events=apart, rtol=1e-11, atol=1e-13)
    assert run.status == 1
    return -run.y[1, -1]


def test_force():
    """Hertz, plus 1.5 A k √δ times the speed of approach."""
    states = at_rest(np.linspace(1e-5, 2e-4, 20))
    k = 4 / 3 * PAIR.youngs_modulus * math.sqrt(RADIUS / 2)
    delta = states[:, OVERLAP]
    for speed in (-0.3, 0.0, 0.2):
        states[:, VELOCITY] = speed
        force = bench(NormalViscoelastic, dissipation_time=TIME).run(states)[0]
        assert force[:, 0] == pytest.approx(k * (delta**1.5 - 1.5 * TIME * np.sqrt(delta) * speed), rel=1e-12)


def test_friction_dashpot_uses_this_damping():
    """γ_t = γ_n √(k_t/S_n) with γ_n = 1.5 A k √δ; the first step of a slip feels spring and dashpot."""
    states = at_rest([1e-4])
    states[:, VELOCITY + 1] = 0.01
    made = Bench([NormalViscoelastic(dissipation_time=TIME), TangentialMindlin(static_friction=5.0)])
    force = made.run(states, dt=1e-12)[0]
    normal_damping = 1.5 * TIME * 4 / 3 * PAIR.youngs_modulus * math.sqrt(RADIUS / 2 * 1e-4)
    share = math.sqrt(4 * PAIR.shear_modulus / PAIR.youngs_modulus)
    assert force[0, 1] == pytest.approx(-normal_damping * share * 0.01, rel=1e-6)


@pytest.mark.parametrize("attraction", [True, False])
def test_restitution_against_an_independent_integration(attraction):
    times = np.array([TIME, 10 * TIME])
    cases = [(v, a) for a in times for v in SPEEDS]
    e = impacts(*zip(*cases, strict=True), attraction)
    expected = [integrated(x, attraction) for x in dissipation(*zip(*cases, strict=True))]
    assert e == pytest.approx(np.array(expected), abs=2e-3)
    for at_one_time in e.reshape(2, 4):
        assert np.all(np.diff(at_one_time) < 0)  # falls with speed


def test_pade_formula_where_the_force_is_cut():
    """1e-4 for e > 0.85; 7e-3 where e is 0.28, where the ending at zero overlap gives 0.185."""
    gentle = impacts(SPEEDS, [0.5 * TIME] * 4, attraction=False, steps=20_000)
    assert gentle == pytest.approx(pade(dissipation(SPEEDS, 0.5 * TIME)), abs=2e-4)
    assert np.all(gentle > 0.85)
    x = brentq(lambda x: integrated(x, attraction=False) - 0.281, 0.5, 3.0)
    strong = TIME * x / dissipation([1.0], [TIME])[0]
    cut, pulled = (impacts([1.0], [strong], attraction)[0] for attraction in (False, True))
    assert cut == pytest.approx(0.281, abs=1e-3)
    assert cut == pytest.approx(pade(x), abs=8e-3)
    assert pulled == pytest.approx(0.185, abs=2e-3)


@pytest.mark.parametrize("attraction", [True, False])
def test_series_for_weak_dissipation(attraction):
    """e = 1 − 1.15345 x + 0.79826 x²: the same start for both endings, of the order of the next term."""
    times = [0.1 * TIME, 0.3 * TIME]
    x = dissipation([1.0, 1.0], times)
    e = impacts([1.0, 1.0], times, attraction, steps=40_000)
    assert np.all(np.abs(e - (1 - 1.15345 * x + 0.79826 * x**2)) < 0.7 * x**2.5)
    assert np.all(np.abs(1 - e) > 3 * x**2)


def test_large_grains_bounce_alike_with_the_rule_of_coarse_graining():
    small = impacts([0.1, 3.0], [10 * TIME] * 2, attraction=True)
    effect = NormalViscoelastic(dissipation_time=10 * TIME).coarse_grained(3.0)
    time = effect.value("dissipation_time")
    assert time == pytest.approx(30 * TIME)
    assert impacts([0.1, 3.0], [time] * 2, True, radius=3 * RADIUS) == pytest.approx(small, rel=1e-6)
    assert small[0] - small[1] > 0.1
