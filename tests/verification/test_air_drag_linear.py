"""Drag in proportion to speed against its closed forms."""

import math

import numpy as np
import pytest

from taichidem.effects import AirDrag, AirDragLinear, BodyGravity, NormalHertz
from taichidem.experiments import FreeFall
from taichidem.materials import Material
from taichidem.scene import Model
from tests.effect_bench import body_bench

WEIGHT = np.array([0.0, 0.0, -9.81])


def push(effect, velocity, radius=0.003):
    """Return what a drag adds to the weight of a body of 1 kg (3,) [N]."""
    return body_bench(effect).push(np.asarray(velocity, float), radius, 1.0) - WEIGHT


def test_half_a_gram_per_second():
    """F = −c v, against the velocity, whatever its size."""
    effect = AirDragLinear(coefficient=5e-4)
    for velocity in ([3.0, -2.0, 5.0], [3e3, -2e3, 5e3], [0.0, 0.0, 0.0]):
        assert push(effect, velocity) == pytest.approx(-5e-4 * np.array(velocity), rel=1e-12, abs=1e-15)


def test_it_is_the_limit_of_the_drag_of_air_without_density():
    velocity = [3.0, -2.0, 5.0]
    stokes = push(AirDrag(fluid_density=0.0, viscosity=2e-3), velocity)
    linear = AirDragLinear(coefficient=6 * math.pi * 2e-3 * 0.003)
    assert push(linear, velocity) == pytest.approx(stokes, rel=1e-13)


def test_a_fall_with_linear_drag():
    """z = z₀ − v_∞ t + (v_∞ − v₀) τ (1 − e^(−t/τ)), τ = m/c, v_∞ = g τ."""
    mass, coefficient, height, speed = 0.028, 0.018, 47.0, 4.0
    times = np.array([0.5, 1.0, 2.0, 3.5])
    model = Model(
        [Material("ball", 1000.0, 1e7, 0.3)],
        [NormalHertz(restitution=0.5), BodyGravity(), AirDragLinear(coefficient=coefficient)],
    )
    fall = FreeFall(diameter=0.073, mass=mass, release_height=height, release_speed=speed, time=tuple(times))
    (outcome,) = fall.run(model, [1])
    tau = mass / coefficient
    terminal = 9.81 * tau
    exact = height - terminal * times + (terminal - speed) * tau * (1 - np.exp(-times / tau))
    assert list(outcome.observables.values()) == pytest.approx(exact, abs=2e-3)
    assert exact[-1] - (height - speed * 3.5 - 9.81 * 3.5**2 / 2) > 10  # the drag is no small matter here


def test_a_coarse_grain_feels_what_its_grains_feel():
    """Eight grains of half its radius and the drag per weight that they have."""
    fine = AirDragLinear(coefficient=5e-4)
    velocity = [0.4, -0.3, 0.2]
    coarse = push(fine.coarse_grained(2.0), velocity, 0.006)
    assert coarse == pytest.approx(8 * push(fine, velocity, 0.003), rel=1e-12)
