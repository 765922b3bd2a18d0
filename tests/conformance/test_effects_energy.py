"""No registered contact effect makes energy, between two grains or at a wall."""

import numpy as np
import pytest

from taichidem.effects.base import Stage
from tests.conformance.registered import CONTACT, named, with_grains_and_walls
from tests.effect_bench import (
    DT,
    SPIN_I,
    VELOCITY,
    acts_on,
    at_rest,
    base_bench,
    bench,
    contribution,
    reach_of,
    work,
)

STEPS = 400  # of a leg of a path
LOW, HIGH = 0.3e-4, 1.5e-4  # overlaps [m] between which a path loads
GAIN = 2e-3  # of the turnover, which the steps of a path leave unresolved
LOSSLESS = {"restitution": 1.0, "dissipation_time": 0.0, "viscosity": 0.0}  # and every "…damping" 0


def lossless(kind):
    """Return the values without viscous losses, behind which a gain could hide; slip and plastic flow stay."""
    names = [p.name for p in kind.parameters]
    none = {name: 0.0 for name in names if name.endswith("damping")}
    return none | {name: value for name, value in LOSSLESS.items() if name in names}


def leg(start, end, slip=0.0, roll=0.0, twist=0.0):
    """Return states from one overlap to another, with a way [m] and turns [rad] beside it."""
    ends = np.linspace(start, end, STEPS + 1)
    states = at_rest(0.5 * (ends[1:] + ends[:-1]))
    duration = STEPS * DT
    states[:, VELOCITY] = -(end - start) / duration
    states[:, VELOCITY + 1] = slip / duration
    states[:, SPIN_I] = twist / duration
    states[:, SPIN_I + 2] = roll / duration
    return states


def closed_path(kind, seed, stroke):
    """Return a path that ends where it began: from out of reach to touch, press, shear, roll and twist, and back.

    The load changes while shear and rolling are held, so that a memory that stores the wrong thing gains energy.
    """
    slip, roll, twist = stroke * np.random.default_rng(seed).uniform(0.1, 1.0, 3) * [1e-6, 2e-4, 2e-4]
    far = -1.5 * reach_of(kind) - 1e-6
    forth, back = (slip, roll, twist), (-slip, -roll, -twist)
    to_and_fro = [leg(LOW, LOW, *way) for way in (back, forth)]  # at low load, to take out what a spring may still hold
    press = [leg(far, LOW), leg(LOW, HIGH), leg(HIGH, HIGH, *forth), leg(HIGH, LOW), leg(LOW, LOW, *back)]
    return np.vstack([*press, *(3 * to_and_fro), leg(LOW, far)])


def own_work(kind, states, wall, **values):
    """Return the work [J] of each step that an effect does on top of what it stands on; of a normal law, all of it.

    An effect that needs a tangential one takes away from its work, which is no gain: there the work is that of both.
    """
    done = work(states, *bench(kind, **values).run(states, wall))
    if kind.family == "normal" or "tangential" in kind.needs:
        return done
    return done - work(states, *base_bench(kind).run(states, wall))


def gain(done):
    turnover = np.abs(done).sum()
    return done.sum() / turnover if turnover else 0.0


STICKS, SLIDES = 1.0, 1000.0
strokes = pytest.mark.parametrize("stroke", [STICKS, SLIDES], ids=["sticks", "slides"])


@with_grains_and_walls
@strokes
@named(CONTACT)
@pytest.mark.parametrize("seed", range(3))
def test_never_creates_energy(kind, seed, stroke, wall):
    """Along a closed path of gap, load, slip, rolling and twist the work on the pair is not positive at its end."""
    states = closed_path(kind, seed, stroke)
    for values in (lossless(kind), {}):
        gained = gain(own_work(kind, states, wall, **values))
        assert gained <= GAIN, f"{gained:.2%} of the turnover was gained with {values or 'losses'}"


@named(CONTACT)
def test_every_effect_shows_itself_along_the_closed_path(kind):
    assert acts_on(kind, closed_path(kind, 0, SLIDES))


@with_grains_and_walls
@named([k for k in CONTACT if k.stage <= Stage.ADHESION])
def test_pressing_again_creates_no_energy(kind, wall):
    """A normal force that loses energy while it is loaded the first time could hide a gain; it can't the second time."""
    press = np.vstack([leg(LOW, HIGH), leg(HIGH, LOW)])
    done = own_work(kind, np.vstack([press, press]), wall, **lossless(kind))[len(press) :]
    assert gain(done) <= GAIN, f"{gain(done):.2%} of the turnover was gained"
    assert acts_on(kind, press)


@with_grains_and_walls
@named([k for k in CONTACT if k.conservative])
def test_conservative_force_is_the_slope_of_its_energy(kind, wall):
    """F = −dE/d(distance) = dE/dδ along the normal, at rest, from touch to compression and over the gap that it reaches."""
    overlaps = np.linspace(1e-5, 2e-4, 40)
    if reach_of(kind):
        overlaps = np.concatenate([np.linspace(-0.9 * reach_of(kind), -1e-7, 40), overlaps])
    made = bench(kind, **lossless(kind))
    force = contribution(made, at_rest(overlaps), wall)[:, 0]
    step = 1e-9
    slope = made.energies(overlaps + step, kind, wall=wall) - made.energies(overlaps - step, kind, wall=wall)
    slope /= 2 * step
    assert slope == pytest.approx(force, rel=1e-4, abs=1e-6 * np.abs(force).max())
    assert acts_on(kind, at_rest(overlaps))
