"""Closed forms of the contact laws, evaluated in the kernel on prescribed motions."""

import math

import numpy as np
import pytest

from taichidem.effects import NormalHertz, RollingConstantTorque, RollingSpringDashpot, TangentialMindlin
from tests.effect_bench import (
    DT,
    OVERLAP,
    PAIR,
    RADIUS,
    SPIN_I,
    SPIN_J,
    VELOCITY,
    Bench,
    at_rest,
    bench,
    history,
)


def test_hertz_force():
    overlaps = np.linspace(1e-5, 2e-4, 40)
    force, _ = bench(NormalHertz, restitution=1.0).run(at_rest(overlaps))
    modulus = PAIR.youngs_modulus
    assert force[:, 0] == pytest.approx(4 / 3 * modulus * math.sqrt(RADIUS / 2) * overlaps**1.5, rel=1e-12)
    assert modulus == pytest.approx(0.5 * 1e7 / (1 - 0.3**2))


def test_history_turns_with_the_pair():
    """Sheared, then turned rigidly about any axis by a whole turn: no new force, none lost, the same direction."""
    made = bench(TangentialMindlin, static_friction=5.0)
    n = 20000
    for axis in ([0, 0, 1.0], [1.0, 0, 0], [0.6, 0, 0.8]):
        axis = np.array(axis)
        shear = at_rest(np.full(50, 1e-4))
        shear[:, VELOCITY + 1 : VELOCITY + 3] = [0.01, 0.02]
        angles = 2 * np.pi * np.arange(1, n + 1) / n
        start = np.array([1.0, 0, 0])
        along = (axis @ start) * axis
        across = start - along
        turn = np.zeros((n, 13))
        turn[:, :3] = along + np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * np.cross(axis, across)
        turn[:, OVERLAP] = 1e-4
        turn[:, SPIN_I : SPIN_I + 3] = turn[:, SPIN_J : SPIN_J + 3] = 2 * np.pi / (n * DT) * axis
        force, torque = made.run(np.vstack([shear, turn]))
        before, after = force[49], force[-1]
        assert np.linalg.norm(before[1:]) > 0
        # First order in the angle per step: a whole turn in n steps leaves 2 π²/n.
        assert after[1:] == pytest.approx(before[1:], abs=2.2 * np.pi**2 / n * np.linalg.norm(before[1:]))
        assert not np.any(torque)


@pytest.mark.parametrize("kind", [RollingConstantTorque, RollingSpringDashpot], ids=lambda k: k.name)
def test_rolling_couple_has_its_cap_and_no_part_along_the_normal(kind):
    states = history(3)
    states[:, :3] = [0, 0, 1.0]
    states[:, OVERLAP] = 1e-4
    states[:, SPIN_I : SPIN_I + 3] = [400.0, 300.0, 70.0]
    states[:, SPIN_J : SPIN_J + 3] = [0.0, 0.0, -70.0]  # together a twist of 140, which must not turn the couple
    _, torque = bench(kind, rolling_friction=0.2).run(np.vstack([states] * 20))
    elastic = 4 / 3 * PAIR.youngs_modulus * math.sqrt(RADIUS / 2) * 1e-6
    assert np.all(torque[:, 2] == 0)
    share = 500 / math.hypot(500, 140) if kind is RollingConstantTorque else 1.0  # it opposes the whole relative spin
    assert torque[-1] == pytest.approx(-share * 0.2 * RADIUS / 2 * elastic * np.array([0.8, 0.6, 0]), rel=1e-9)


@pytest.mark.parametrize("attraction", [False, True])
def test_friction_never_uses_an_attractive_normal_force(attraction):
    """Separating fast while still overlapping: Coulomb's limit is zero, not the size of a pull."""
    made = Bench([NormalHertz(restitution=0.1, attraction=attraction), TangentialMindlin(static_friction=0.5)])
    states = at_rest(np.full(50, 1e-5))
    states[:, VELOCITY] = 20.0
    states[:, VELOCITY + 1] = 1.0
    force, _ = made.run(states)
    assert (force[0, 0] < 0) == attraction
    assert np.all(force[:, 1:] == 0)
