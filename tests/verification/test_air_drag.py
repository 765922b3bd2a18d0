"""Drag of a sphere against Stokes, Newton, the standard drag curve, and trajectories integrated independently."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from taichidem.effects import AirDrag, BodyGravity
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, ball, scene
from tests.effect_bench import body_bench

WATER = {"fluid_density": 998.2, "viscosity": 1.002e-3}
# The standard drag curve as tabulated by Clift, Grace & Weber (1978), Bubbles, Drops, and Particles, and elsewhere.
STANDARD = [(0.1, 245.0), (1.0, 26.5), (10.0, 4.1), (100.0, 1.09), (1e3, 0.46), (1e4, 0.41), (1e5, 0.47)]


def force(velocity, radius=0.01, mass=1.0, **values):
    """Return what the drag adds to the weight of a body (3,) [N]."""
    velocity = np.asarray(velocity, float)
    return body_bench(AirDrag(**values)).push(velocity, radius, mass) - mass * np.array([0.0, 0.0, -9.81])


def coefficient(reynolds):
    """Return C_D by Brown & Lawler."""
    return 24 / reynolds * (1 + 0.15 * reynolds**0.681) + 0.407 / (1 + 8710 / reynolds)


@pytest.mark.parametrize(("reynolds", "expected"), STANDARD)
def test_standard_drag_curve(reynolds, expected):
    """Within 5 % of the curve through all measurements, from creeping flow to just before the crisis."""
    radius = 0.01
    speed = reynolds * WATER["viscosity"] / (2 * radius * WATER["fluid_density"])
    dynamic = 0.5 * WATER["fluid_density"] * math.pi * radius**2 * speed**2
    measured = -force([speed, 0, 0], radius, **WATER)[0] / dynamic
    assert measured == pytest.approx(expected, rel=0.05)
    assert measured == pytest.approx(coefficient(reynolds), rel=1e-12)


def test_without_density_it_is_stokes_alone():
    """A linear drag of 5e-4 kg/s on a grain of 6 mm, and no buoyancy."""
    velocity = np.array([3.0, -2.0, 5.0])
    linear = force(velocity, 0.003, fluid_density=0.0, viscosity=8.842e-3)
    assert linear == pytest.approx(-6 * math.pi * 8.842e-3 * 0.003 * velocity, rel=1e-12)
    assert np.linalg.norm(linear) / np.linalg.norm(velocity) == pytest.approx(5e-4, rel=1e-4)


def test_without_viscosity_it_is_newtons_plateau():
    lift = 1.2 * 4 / 3 * math.pi * 0.01**3 * 9.81
    velocity = np.array([3.0, 0.0, 4.0])
    newton = -0.5 * 1.2 * 0.407 * math.pi * 0.01**2 * 5.0 * velocity
    assert force(velocity, fluid_density=1.2, viscosity=0.0) == pytest.approx(newton + [0, 0, lift], rel=1e-12)


def test_at_rest_there_is_buoyancy_alone():
    """And nothing is divided by zero, whatever else vanishes too."""
    for density in (0.0, 1.2, 1000.0):
        for viscosity in (0.0, 1e-3):
            at_rest = force([0.0, 0.0, 0.0], fluid_density=density, viscosity=viscosity)
            assert at_rest == pytest.approx([0, 0, density * 4 / 3 * math.pi * 0.01**3 * 9.81], abs=1e-14)


def test_air_at_20_degrees_is_the_default():
    assert AirDrag().values == {"fluid_density": 1.204, "viscosity": 1.825e-5, "represented_scale": 1.0}


def test_a_coarse_grain_feels_what_its_grains_feel():
    """Eight grains of half its radius, in the range where C_D is neither Stokes' nor Newton's."""
    velocity = [0.4, -0.3, 0.2]
    one = force(velocity, 0.003, **WATER)
    assert force(velocity, 0.006, **WATER, represented_scale=2.0) == pytest.approx(8 * one, rel=1e-12)
    assert abs(force(velocity, 0.006, **WATER)[0]) < 0.6 * abs(8 * one[0])


def simulate(radius, times, velocity=(0.0, 0.0, 0.0), steps=4000, schedule="worlds", **values):
    """Return positions and velocities (n, 3) of one ball of 2500 kg/m³ at increasing times [s]."""
    law = [BodyGravity(), AirDrag(**values)]
    bodies = ball([0, 0, 0], radius=radius, velocity=velocity)
    dt = times[-1] / steps
    far = ((-1e4,) * 3, (1e4,) * 3)
    world = scene(bodies, walls=(), law=law, time_step=dt, force_time_step=True, domain=far, skin=1e3)
    simulation = Simulation(world, schedule=schedule)
    states, now = [], 0
    for time in times:
        simulation.run_steps(round(time / dt) - now)
        now = round(time / dt)
        shot = simulation.snapshot()
        states.append(np.concatenate([shot.position[0], shot.velocity[0]]))
    return np.array(states)


def test_exponential_approach_to_stokes_terminal_velocity():
    """v = v_∞ (1 − e^(−t/τ)), τ = m/(6 π μ R), v_∞ = τ g; with density 0 there is no buoyancy."""
    radius, viscosity = 1e-3, 0.5
    mass = SOFT.density * 4 / 3 * math.pi * radius**3
    tau = mass / (6 * math.pi * viscosity * radius)
    times = tau * np.array([0.25, 0.5, 1.0, 2.0, 4.0])
    fall = -simulate(radius, times, fluid_density=0.0, viscosity=viscosity)[:, 5]
    assert fall == pytest.approx(tau * 9.81 * (1 - np.exp(-times / tau)), rel=1e-3)


@pytest.mark.parametrize("density", [1.2, 998.2])
def test_newton_terminal_velocity_with_buoyancy(density):
    """½ ρ_f 0.407 π R² v² = (ρ − ρ_f) V g."""
    radius = 0.01
    terminal = math.sqrt(8 / 3 * radius * 9.81 * (SOFT.density - density) / (0.407 * density))
    time = 15 * terminal / 9.81  # more than eight times of relaxation, also where buoyancy makes it longer
    fall = simulate(radius, [time], steps=400_000, fluid_density=density, viscosity=0.0)[0]
    assert -fall[5] == pytest.approx(terminal, rel=1e-4)


def test_terminal_velocity_of_a_glass_bead_in_water():
    """Between the two ranges: Re near 200, where neither limit holds; the balance is solved independently."""
    radius = 0.5e-3

    def surplus(speed):
        reynolds = 2 * WATER["fluid_density"] * radius * speed / WATER["viscosity"]
        drag = 0.5 * WATER["fluid_density"] * coefficient(reynolds) * math.pi * radius**2 * speed**2
        return drag - (SOFT.density - WATER["fluid_density"]) * 4 / 3 * math.pi * radius**3 * 9.81

    expected = brentq(surplus, 1e-6, 10.0)
    assert 100 < 2 * WATER["fluid_density"] * radius * expected / WATER["viscosity"] < 300
    assert -simulate(radius, [0.5], **WATER)[0, 5] == pytest.approx(expected, rel=1e-6)


def test_trajectory_of_a_thrown_ball():
    """An oblique throw against an independent integration."""
    radius, times, start = 0.005, np.array([0.1, 0.5, 1.0]), (8.0, -3.0, 6.0)
    mass = SOFT.density * 4 / 3 * math.pi * radius**3

    def motion(_, state):
        speed = np.linalg.norm(state[3:])
        drag = 0.5 * 1.204 * coefficient(2 * 1.204 * radius * speed / 1.825e-5) * math.pi * radius**2 * speed
        weight = np.array([0, 0, -9.81]) * (mass - 1.204 * 4 / 3 * math.pi * radius**3)
        return np.concatenate([state[3:], (weight - drag * state[3:]) / mass])

    exact = solve_ivp(motion, (0, 1.0), [0, 0, 0, *start], t_eval=times, rtol=1e-10, atol=1e-12).y.T
    ours = simulate(radius, times, velocity=start, steps=20_000)
    assert ours == pytest.approx(exact, abs=5e-5)  # first order in the step: the drag sees half-step velocities


def test_both_schedules_give_the_same_bits():
    runs = [simulate(0.005, [0.1], (8.0, -3.0, 6.0), 1000, schedule) for schedule in ("worlds", "particles")]
    assert np.array_equal(*runs)
