"""Friction that falls with slip: a sliding block by its closed form, and slopes on which rest and motion are both steady."""

import math
from dataclasses import replace

import numpy as np
import pytest

from taichidem.effects import BodyGravity, KineticFriction, NormalHertz, RollingConstantTorque, TangentialMindlin
from taichidem.errors import CompositionError, InputError
from taichidem.scene import Model
from taichidem.simulation import Simulation
from tests.apparatus import FLOOR, SOFT, ball, effective_modulus, scene

G, RADIUS, STATIC = 9.81, 0.01, 0.5


def block(speed, ratio, slow, slope=0.0, static=STATIC):
    """Return a world with a ball that can't turn (its inertia is huge), at rest depth on a slope along x."""
    weight = SOFT.density * 4 / 3 * math.pi * RADIUS**3 * G * math.cos(slope)
    sunk = (weight / (4 / 3 * effective_modulus(SOFT) * math.sqrt(RADIUS))) ** (2 / 3)
    one = ball([[0, 0, RADIUS - sunk]], RADIUS, velocity=(speed, 0, 0))
    law = [
        NormalHertz(restitution=0.3),
        TangentialMindlin(static_friction=static),
        KineticFriction(kinetic_ratio=ratio, stribeck_velocity=slow),
        BodyGravity(x=G * math.sin(slope), y=0.0, z=-G * math.cos(slope)),
    ]
    plate = replace(FLOOR, name="plate")
    return scene(replace(one, inertia=1e6 * one.inertia), walls=[plate], law=law, time_step=1e-5)


def stribeck_speed(speed, ratio, slow, time):
    """Solve dv/dt = −μ_s g (r + (1 − r) exp(−v/v_s)); u = exp(v/v_s) obeys a linear equation."""
    rest = (1 - ratio) / ratio
    decay = np.exp(-ratio * STATIC * G * time / slow)
    return slow * np.log((np.exp(speed / slow) + rest) * decay - rest)


def test_a_sliding_block_slows_by_the_closed_form():
    cases = [(0.3, 0.6, 0.05), (0.3, 0.6, 1e-3), (0.1, 0.8, 0.1), (0.3, 1.0, 0.05)]
    simulation = Simulation([block(*case) for case in cases])
    times = np.array([0.02, 0.06, 0.01, 0.05])
    for _ in range(2):
        simulation.run(times / 2)
        for k, (speed, ratio, slow) in enumerate(cases):
            now = simulation.snapshot(k)
            expected = speed - STATIC * G * (ratio if slow < 0.01 else 1.0) * now.time
            if ratio < 1 and slow > 0.01:
                expected = stribeck_speed(speed, ratio, slow, now.time)
            assert 0.02 < expected < speed
            assert now.velocity[0, 0] == pytest.approx(expected, rel=3e-3)


def test_a_slope_on_which_rest_and_motion_are_both_possible():
    """Between tan⁻¹ rμ and tan⁻¹ μ: it stays at rest, stops below the speed at which μ(v) = tan, runs away above it."""
    ratio, slow, slope = 0.5, 0.05, math.atan(0.35)
    turning = -slow * math.log((0.35 / STATIC - ratio) / (1 - ratio))
    assert turning == pytest.approx(0.0458, abs=1e-4)
    speeds = (0.0, 0.8 * turning, 1.2 * turning)
    simulation = Simulation([block(speed, ratio, slow, slope) for speed in speeds])
    simulation.run(1.0)
    ends = [simulation.snapshot(k).velocity[0, 0] for k in range(3)]
    assert abs(ends[0]) < 1e-4  # what a sticking spring still swings
    assert abs(ends[1]) < 1e-4
    assert abs(simulation.snapshot(0).position[0, 0]) < 1e-4
    assert ends[2] == pytest.approx(G * math.cos(slope) * (0.35 - ratio * STATIC), rel=0.15)
    simulation.run(0.5)  # by now exp(−v/v_s) is nothing
    gained = simulation.snapshot(2).velocity[0, 0] - ends[2]
    assert gained / 0.5 == pytest.approx(G * math.cos(slope) * (0.35 - ratio * STATIC), rel=1e-3)


def test_a_block_sticks_and_slips_on_a_plate_that_shakes():
    """Below μ_s g it goes along with the plate; far above it is left behind, and the more so the lower r is."""
    shaking = 2 * math.pi / 0.1
    cases = [(0.9, 0.4), (3.0, 0.4), (3.0, 1.0)]  # peak acceleration over μ_s g, and r
    simulation = Simulation([block(0.0, ratio, 0.01) for _, ratio in cases])
    top, bottom, behind = np.zeros(3), np.zeros(3), np.zeros(3)
    for step in range(2000):
        middle = (step + 0.5) * 1e-4
        plate = [share * STATIC * G / shaking * math.sin(shaking * middle) for share, _ in cases]
        for k, speed in enumerate(plate):
            simulation.move_wall("plate", velocity=(speed, 0, 0), world=k)
        simulation.run(1e-4)
        if step % 10 == 0 and step > 1000:
            speeds = np.array([simulation.snapshot(k).velocity[0, 0] for k in range(3)])
            top, bottom = np.maximum(top, speeds), np.minimum(bottom, speeds)
            behind = np.maximum(behind, np.abs(speeds - plate))
    assert behind[0] < 2e-3
    assert np.all(behind[1:] > 0.1)
    swing = (top - bottom) / 2
    assert swing[2] == pytest.approx(STATIC * G * 0.1 / 4, rel=0.1)  # a triangle wave
    assert swing[1] == pytest.approx(0.4 * swing[2], rel=0.15)


def test_it_needs_friction_to_act_on():
    with pytest.raises(CompositionError, match="'kinetic_friction' needs one of family 'tangential'"):
        Model([SOFT], [NormalHertz(restitution=0.5), KineticFriction(kinetic_ratio=0.5)])
    with pytest.raises(InputError, match=r"kinetic_ratio is 0\.0; allowed is above 0 to 1"):
        KineticFriction(kinetic_ratio=0.0)
    with pytest.raises(InputError, match=r"stribeck_velocity is 0; allowed is above 0"):
        KineticFriction(kinetic_ratio=0.5, stribeck_velocity=0)


def test_it_composes_with_rolling_resistance_in_any_order():
    law = [
        KineticFriction(kinetic_ratio=0.6),
        RollingConstantTorque(rolling_friction=0.1),
        TangentialMindlin(static_friction=0.5),
        NormalHertz(restitution=0.5),
    ]
    ends = []
    for order in (law, law[::-1]):
        simulation = Simulation(scene(ball([[0, 0, 0.0101]], velocity=(0.5, 0, -0.1)), law=order))
        simulation.run(0.02)
        ends.append(simulation.snapshot().velocity)
    assert np.array_equal(*ends)
    assert ends[0][0, 0] < 0.49
