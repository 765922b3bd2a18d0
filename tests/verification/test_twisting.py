"""Spin about the normal: Marshall's decay, a couple that lasts through lists and swaps, no energy from unloading."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from taichidem.effects import (
    BodyGravity,
    CohesionArea,
    NormalHertz,
    RollingSpringDashpot,
    TangentialMindlin,
    TwistingResistance,
)
from taichidem.errors import InputError
from taichidem.simulation import Simulation
from tests import effect_bench
from tests.apparatus import RIGID, SOFT, ball, effective_modulus, effective_shear_modulus, scene
from tests.effect_bench import DT, OVERLAP, SPIN_I, at_rest, bench

G, RADIUS = 9.81, 0.01
PRESSING, TUMBLE = 4e5, 15.0  # [J/m³] and [rad/s] of a pair that flies through the lists
MASS = SOFT.density * 4 / 3 * math.pi * RADIUS**3
INERTIA = 0.4 * MASS * RADIUS**2
SUNK = (MASS * G / (4 / 3 * effective_modulus(SOFT) * math.sqrt(RADIUS))) ** (2 / 3)


def spinning(friction, spin, tangential=0.5, **values):
    """Return a world with a ball that spins like a top at rest depth on a plane."""
    law = [
        NormalHertz(restitution=0.3),
        TangentialMindlin(static_friction=tangential),
        TwistingResistance(twisting_friction=friction, **values),
        BodyGravity(),
    ]
    one = ball([[0, 0, RADIUS - SUNK]], RADIUS, spin=(0, 0, spin))
    return scene(one, law=law, time_step=1e-5)


@pytest.mark.parametrize("tangential", [0.5, 0.0])
def test_a_spinning_ball_stops_as_marshall_says(tangential):
    """I dω/dt = −2/3 μ a N until it stops, whether or not there is sliding friction; then it rests."""
    cases = [(0.5, 50.0), (0.5, -30.0), (0.1, 5.0), (0.0, 1.0)]
    simulation = Simulation([spinning(mu, spin, tangential) for mu, spin in cases])
    rates = [2 / 3 * mu * math.sqrt(RADIUS * SUNK) * MASS * G / INERTIA for mu, _ in cases]
    stops = np.array([abs(spin) / rate if rate else 0.5 for (_, spin), rate in zip(cases, rates, strict=True)])
    simulation.run(0.5 * stops)
    for k, (_, spin) in enumerate(cases):
        now = simulation.snapshot(k)
        expected = math.copysign(abs(spin) - rates[k] * now.time, spin)
        assert now.spin[0, 2] == pytest.approx(expected, rel=3e-3)
    simulation.run(0.48 * stops)
    for k, (_, spin) in enumerate(cases[:3]):
        assert abs(simulation.snapshot(k).spin[0, 2]) == pytest.approx(0.02 * abs(spin), rel=0.2)
    simulation.run(0.02 * stops + 2.5)
    for k in range(3):
        now = simulation.snapshot(k)
        assert abs(now.spin[0, 2]) < 1e-9
        assert abs(now.velocity[0]).max() < 1e-9
    assert simulation.snapshot(3).spin[0, 2] == 1.0


def test_the_spring_is_half_of_mindlins_times_a_squared():
    """M = ½ 8 G* a³ φ below the cap; 2/3 μ a N at the cap, either way round."""
    made = bench(TwistingResistance, twisting_friction=0.7, twisting_damping=0.0)
    overlap, reduced = 1e-4, RADIUS / 2
    a = math.sqrt(reduced * overlap)
    shear = effective_shear_modulus(effect_bench.SOFT, effect_bench.SOFT)
    turn = np.concatenate([np.full(40, 1.0), np.full(80, -4000.0)])
    states = at_rest(np.full(120, overlap))
    states[:, SPIN_I] = turn
    force, torque = made.run(states)
    load = force[0, 0]
    angle = np.cumsum(turn)[:40] * DT
    assert torque[:40, 0] == pytest.approx(-4 * shear * a**3 * angle, rel=1e-9)
    cap = 2 / 3 * 0.7 * a * load
    assert 4 * shear * a**3 * 4000 * 79 * DT > cap
    assert torque[-1, 0] == pytest.approx(cap, rel=1e-12)
    assert not np.any(torque[:, 1:])


def test_the_dashpot_is_a_share_of_critical():
    """A ball wound up below the cap swings with exp(−η ω t): the logarithmic decrement of its spin."""
    damping = 0.05
    stiffness = 4 * effective_shear_modulus(SOFT, RIGID) * math.sqrt(RADIUS * SUNK) ** 3
    rate = math.sqrt(stiffness / INERTIA)
    simulation = Simulation(spinning(50.0, 1e-4, twisting_damping=damping))
    period = 2 * math.pi / (rate * math.sqrt(1 - damping**2))
    simulation.run(period)
    first = simulation.snapshot()
    expected = math.exp(-damping * rate * first.time)
    assert first.spin[0, 2] / 1e-4 == pytest.approx(expected, rel=0.01)


def test_unloading_takes_the_couple_along():
    """M falls with a³, so that a spring wound up under load gives back less than it took."""
    made = bench(TwistingResistance, twisting_friction=5.0, twisting_damping=0.0)
    high, low = 1e-4, 0.5e-4
    states = at_rest(np.concatenate([np.full(50, high), np.full(5, low), np.full(5, high)]))
    states[:50, SPIN_I] = 1.0
    torque = made.run(states)[1][:, 0]
    assert torque[52] == pytest.approx(torque[49] * 0.5**1.5, rel=1e-12)
    assert torque[-1] == pytest.approx(torque[52], rel=1e-12)  # nothing comes back with the load
    states[50:55, OVERLAP] = -1e-6
    assert not np.any(made.run(states)[1][50:])


@pytest.mark.parametrize(("spin", "power"), [(1e5, 4), (1.0, 4 + 2 / 3)], ids=["slider", "spring"])
def test_what_coarse_graining_keeps_under_a_weight(spin, power):
    """With μ s^(−1/3) the largest couple goes with weight times radius, ∝ s⁴; the spring is s^(2/3) times too stiff."""
    factor, states = 3.0, at_rest(np.full(50, 1e-5))
    states[:, SPIN_I] = spin
    large = states * np.where(np.arange(13) == OVERLAP, factor ** (5 / 3), 1.0)
    large[:, SPIN_I] /= factor
    small = bench(TwistingResistance, twisting_friction=0.5, twisting_damping=0.0).run(states)[1][-1, 0]
    softer = bench(TwistingResistance, twisting_friction=0.5 * factor ** (-1 / 3), twisting_damping=0.0)
    big = softer.run(large, dt=DT * factor ** (5 / 3), radius=factor * RADIUS)[1][-1, 0]
    assert big / small == pytest.approx(factor**power, rel=1e-9)


def tumbling_pair():
    """Return overlap and centres of a pair that cohesion presses together while it tumbles, at steady overlap."""
    reduced, modulus = RADIUS / 2, effective_modulus(SOFT, SOFT)

    def surplus(overlap):
        hertz = 4 / 3 * modulus * math.sqrt(reduced) * overlap**1.5
        pull = PRESSING * math.pi * (RADIUS * overlap - overlap**2 / 4)
        return hertz - pull + MASS * TUMBLE**2 * (RADIUS - overlap / 2)

    overlap = brentq(surplus, 4e-4, 8e-4, xtol=1e-15)
    half = RADIUS - overlap / 2
    return overlap, np.array([[-half, 0, 1.0], [half, 0, 1.0]])


def twisting_alone(overlap, wind, times):
    """Return the couple along n, from dM/dt = −k_tw Δω·n and I/2 dΔω/dt = M n while n turns at the tumbling rate."""
    stiffness = 4 * effective_shear_modulus(SOFT, SOFT) * math.sqrt(RADIUS / 2 * overlap) ** 3

    def rates(t, y):
        n = np.array([-math.cos(TUMBLE * t), -math.sin(TUMBLE * t)])
        return [-stiffness * (y[1:] @ n), *(2 / INERTIA * y[0] * n)]

    return solve_ivp(rates, (0, times[-1]), [0.0, wind, 0.0], t_eval=times, rtol=1e-10, atol=1e-14).y[0]


def test_a_couple_survives_rebuilds_and_the_change_of_sides():
    """A pair that flies and tumbles through many lists twists as an equation without lists says."""
    overlap, x = tumbling_pair()
    wind, flight, turn = 0.02, np.array([0.3, 0.15, 0.1]), np.array([0, 0, TUMBLE])
    law = [
        NormalHertz(restitution=0.5),
        TangentialMindlin(static_friction=1.0),
        TwistingResistance(twisting_friction=50.0, twisting_damping=0.0),
        CohesionArea(energy_density=PRESSING),
    ]
    grains = ball(x, velocity=np.cross(turn, x - [0, 0, 1.0]) + flight, spin=[turn + [wind, 0, 0], turn])
    near = (
        (-0.1, -0.1, 0.9),
        (0.2, 0.2, 1.2),
    )  # a small domain has small cells, so that the two change places in the lists
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=5e-6, skin=2e-4, domain=near))
    found, times, owners = [], [], set()
    for _ in range(160):
        simulation.run_steps(500)
        now = simulation.snapshot()
        between = now.position[0] - now.position[1]
        times.append(now.time)
        found.append(now.torque[0] @ between / np.linalg.norm(between))
        engine = simulation._engine
        base = int(engine.access["worlds"].read(0)["body_base"])
        owners.add(int(engine.state.labels.identity.to_numpy()[base]))
    expected = twisting_alone(overlap, wind, np.array(times))
    assert now.rebuilds > 500
    assert owners == {0, 1}  # either grain has been side i
    assert np.array(found) == pytest.approx(expected, abs=0.03 * np.abs(expected).max())


def test_a_pile_with_twisting_resistance_comes_to_rest_in_both_schedules():
    """Four balls and one on top, spun up: the same bits both ways, and in the end all stand still."""
    side = 2.02 * RADIUS
    x = [[0, 0, RADIUS], [side, 0, RADIUS], [0, side, RADIUS], [side, side, RADIUS], [side / 2, side / 2, 2.5 * RADIUS]]
    law = [
        NormalHertz(restitution=0.4),
        TangentialMindlin(static_friction=0.6),
        RollingSpringDashpot(rolling_friction=0.2),
        TwistingResistance(twisting_friction=0.6),
        BodyGravity(),
    ]
    grains = ball(x, RADIUS, spin=np.array([[0, 0, 5.0], [0, 0, -3.0], [0, 0, 0], [0, 0, 2.0], [0, 0, 8.0]]))
    pile = scene(grains, law=law, time_step=2e-5)
    early = []
    for schedule in ("particles", "worlds"):
        simulation = Simulation(pile, schedule=schedule)
        simulation.run(0.05)
        early.append(simulation.snapshot())
    for column in ("position", "velocity", "spin", "torque"):
        assert np.array_equal(getattr(early[0], column), getattr(early[1], column))
    simulation.run(3.0)
    assert simulation.kinetic_energy() < 1e-22


def test_settings_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match=r"twisting_friction is -0\.1; allowed is from 0"):
        TwistingResistance(twisting_friction=-0.1)
