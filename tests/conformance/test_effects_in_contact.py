"""What every registered contact effect must obey along a history of motion, between two grains and at a wall."""

import numpy as np
import pytest

from tests.conformance.registered import CONTACT, motion, named, with_grains_and_walls
from tests.effect_bench import (
    DT,
    HELD,
    OVERLAP,
    RADIUS,
    SPIN_I,
    SPIN_J,
    VELOCITY,
    acts_on,
    base_bench,
    bench,
    beneath,
    contribution,
    middle,
    reach_of,
    rotation,
    share,
    turned,
)


@with_grains_and_walls
@named([k for k in CONTACT if any(p.vanishing is not None for p in k.parameters)])
def test_contact_effects_do_nothing_at_their_vanishing_value(kind, wall):
    """What is left of their answer is that of the effects beneath; otherwise it isn't, at one partner at least."""
    for seed in range(3):
        states = motion(kind, seed)
        done = []
        for partner in (0, 1):
            whole, plain = bench(kind).answers(states, partner), base_bench(kind).answers(states, partner)
            done.append(share(whole - plain, whole))
            if partner == wall:
                none = bench(kind, **middle(kind).vanished().values).answers(states, wall)
                assert share(none - plain, whole) <= 1e-9
        assert max(done) > 1e-6


@with_grains_and_walls
@named(CONTACT)
def test_grains_out_of_reach_feel_nothing(kind, wall):
    """Neither grains that never met, nor those that did and parted."""
    near = motion(kind, 5)
    apart = near.copy()
    apart[:, OVERLAP] = -1.01 * reach_of(kind) - 1e-12
    assert not np.any(bench(kind).answers(apart, wall))
    assert not np.any(bench(kind).answers(np.vstack([near, apart]), wall)[len(near) :, :6])
    assert acts_on(kind, near)


@named(CONTACT)
@pytest.mark.parametrize("seed", range(4))
def test_swapping_the_sides_swaps_the_wrench(kind, seed):
    """Action = reaction, through a whole history: seen from j, force and couple are the opposite."""
    states = motion(kind, seed)
    swapped = states.copy()
    swapped[:, :3] *= -1
    swapped[:, VELOCITY : VELOCITY + 3] *= -1
    swapped[:, SPIN_I : SPIN_I + 3] = states[:, SPIN_J : SPIN_J + 3]
    swapped[:, SPIN_J : SPIN_J + 3] = states[:, SPIN_I : SPIN_I + 3]
    out, other = bench(kind).answers(states), bench(kind).answers(swapped)
    assert other[:, :3] == pytest.approx(-out[:, :3], rel=1e-12, abs=1e-12 * np.abs(out[:, :3]).max())
    assert other[:, 3:6] == pytest.approx(-out[:, 3:6], rel=1e-12, abs=1e-12 * max(np.abs(out[:, 3:6]).max(), 1e-300))
    assert other[:, [7, 6]] == pytest.approx(out[:, 6:8], rel=1e-12, abs=1e-12 * HELD)
    assert acts_on(kind, states)


@with_grains_and_walls
@named(CONTACT)
@pytest.mark.parametrize("seed", range(4))
def test_turning_the_frame_turns_the_answer(kind, seed, wall):
    states, matrix = motion(kind, seed), rotation(seed)
    force, torque = bench(kind).run(states, wall)
    turned_force, turned_torque = bench(kind).run(turned(states, matrix), wall)
    assert turned_force == pytest.approx(force @ matrix.T, abs=1e-11 * np.abs(force).max())
    assert turned_torque == pytest.approx(torque @ matrix.T, abs=1e-11 * max(np.abs(torque).max(), 1e-300))
    assert acts_on(kind, states)


@with_grains_and_walls
@named(CONTACT)
@pytest.mark.parametrize("factor", [2.0, 4.0])
def test_coarse_graining_keeps_what_it_promises(kind, factor, wall):
    """Grains s times as large under the effect's rule: its wrench is the same power of s everywhere along a history."""
    rule = kind.similarity
    # A dashpot keeps its damping ratio, whose force follows another power.
    undamped = {p.name: 0.0 for p in kind.parameters if p.name.endswith("damping")}
    effect = middle(kind, **undamped)
    states = motion(kind, 2)
    states[:, OVERLAP] *= np.where(states[:, OVERLAP] > 0, 0.4, 1.0)  # so that it is small beside R in large grains too
    large = states.copy()
    large[:, OVERLAP] *= factor**rule.overlap
    large[:, VELOCITY : VELOCITY + 3] *= factor**rule.speed
    large[:, SPIN_I:] *= factor ** (rule.speed - 1)
    time = factor ** (rule.overlap - rule.speed)
    made = bench(kind, **undamped)
    small = contribution(made, states, wall)
    made.set([*beneath(effect), effect.coarse_grained(factor)])
    big = contribution(made, large, wall, radius=factor * RADIUS, dt=DT * time, held=HELD * factor**3)
    force, torque = np.abs(small[:, :3]).max(), np.abs(small[:, 3:6]).max()
    # Not to round-off: a memory also turns with the pair, by an angle that is no length and follows no power of its own.
    assert big[:, :3] / factor**rule.force == pytest.approx(small[:, :3], abs=5e-3 * max(force, 1e-300))
    assert big[:, 3:6] / factor ** (rule.force + 1) == pytest.approx(small[:, 3:6], abs=5e-3 * max(torque, 1e-300))
    assert acts_on(kind, states)
