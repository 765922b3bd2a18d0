"""Every registered effect on every shape of grain: right, conserving and acting there, or refused by name."""

from __future__ import annotations

import re

import numpy as np
import pytest

from taichidem.errors import CompositionError
from taichidem.scene import Model
from tests.apparatus import SOFT, scene
from tests.conformance.shape_trials import (
    CLUMP,
    ELLIPSOID,
    PACKED,
    REFUSED,
    SHAPES,
    TRIALS,
    Trial,
    World,
    fits,
    grains,
    outcomes,
    simulated,
)
from tests.effect_bench import RADIUS, beneath, middle
from tests.verification.test_superquadrics import momenta

ALIKE = 1e-11  # of the largest of a column
GAIN = 1e-4  # of the energy of motion, which the time step leaves unresolved


def on_shapes(trials):
    return pytest.mark.parametrize("trial", trials, ids=lambda t: f"{t.kind.name}-{t.shape}")


IN_CONTACT = [t for t in TRIALS if not t.is_body_effect]


@pytest.mark.parametrize("shape", SHAPES)
def test_every_effect_is_tried_or_refused(shape):
    packed = {kind for chosen in PACKED[shape] for kind in chosen}
    assert packed == {t.kind for t in TRIALS if t.shape == shape}
    assert all(fits(chosen) for chosen in PACKED[shape])


@on_shapes(TRIALS)
def test_spheres_described_as_a_shape_move_as_spheres(trial):
    """Through collisions with each other and with a floor, at any orientation."""
    expected, found = trial.outcome("round", shape="sphere"), trial.outcome("round")
    assert expected.end.rebuilds > 1
    assert np.abs(expected.end.velocity - expected.start.velocity).max() > (1e-4 if trial.is_body_effect else 0.3)
    for name in ("position", "velocity", "spin", "force", "torque", "carried"):
        one, two = getattr(expected.end, name), getattr(found.end, name)
        size = np.abs(one).max(initial=0.0)
        if name == "torque":  # without friction it is none, and round-off of the force at its lever
            size = max(size, RADIUS * np.abs(expected.end.force).max())
        assert two == pytest.approx(one, rel=0, abs=ALIKE * size), name


@on_shapes(TRIALS)
def test_it_acts_on_the_shape(trial):
    for place in ("free", "floor"):
        end = trial.outcome(place).end
        assert all(np.all(np.isfinite(getattr(end, name))) for name in ("position", "velocity", "spin", "orientation"))
    if trial.kind.family == "normal":
        assert all(
            np.any(trial.outcome(place).end.velocity - trial.outcome(place).start.velocity)
            for place in ("free", "floor")
        )
    else:
        assert any(trial.outcome(place).differs(trial.outcome(place, acting=False)) for place in ("free", "floor"))


@on_shapes(IN_CONTACT)
def test_momenta_are_conserved(trial):
    """Linear and angular, of grains that meet in empty space; as is the amount that they carry, when they have parted."""
    world = trial.outcome("free")
    before, after = momenta(world.start, world.bodies.inertia), momenta(world.end, world.bodies.inertia)
    speed, way = np.linalg.norm(world.start.velocity, axis=1), np.linalg.norm(world.start.position, axis=1)
    scales = (world.start.mass @ speed, world.start.mass @ (way * speed))
    assert np.abs(world.end.velocity - world.start.velocity).max() > 0.3
    for one, two, scale in zip(before, after, scales, strict=True):
        assert two == pytest.approx(one, rel=0, abs=1e-10 * scale)
    if trial.carries:
        assert not np.any(world.end.force)
        if trial.shape != "superquadric":  # equal films may come back as they were given
            assert np.any(world.end.carried != world.start.carried)
        assert world.end.carried.sum() == pytest.approx(world.start.carried.sum(), rel=1e-10)


@on_shapes([t for t in IN_CONTACT if not t.attracts])
@pytest.mark.parametrize("place", ["free", "floor"])
def test_the_energy_of_motion_does_not_grow(trial, place):
    """Of grains without weight that don't attract each other, on top of a normal law without losses.

    Of superquadrics R* follows the curvature, so that this law alone returns somewhat more or less than it took.
    """
    world, lossless = trial.outcome(place), outcomes(trial.chosen, trial.shape)[World(frozenset(), place)]
    start = world.start.kinetic_energy
    assert lossless.end.kinetic_energy <= (1 + (0.05 if trial.shape == "superquadric" else GAIN)) * start
    assert world.end.kinetic_energy <= (1 + GAIN) * max(start, lossless.end.kinetic_energy)


@pytest.mark.parametrize("shape", SHAPES)
def test_both_schedules_give_the_same_bits(shape):
    """With the richest composition, all of whose effects act."""
    chosen = max(PACKED[shape], key=len)
    world = World(frozenset(chosen), "together")
    expected = outcomes(chosen, shape)[world]
    found = simulated(chosen, shape, [world], "particles")[world]
    assert np.any(expected.end.force)
    for name in ("position", "velocity", "spin", "orientation", "force", "torque", "carried"):
        assert np.array_equal(getattr(found.end, name), getattr(expected.end, name)), name


@on_shapes(REFUSED)
def test_an_effect_that_can_not_act_on_a_shape_is_refused_by_name(trial: Trial):
    effect, form = middle(trial.kind), CLUMP if trial.shape == "multisphere" else ELLIPSOID
    law = [*beneath(effect), effect]
    words = f"{trial.kind.name!r} can't act on grains of kind {trial.shape!r}, since {trial.kind.shapes_reason}"
    assert trial.kind.shapes_reason
    with pytest.raises(CompositionError, match=re.escape(words)):
        Model([SOFT], law, form)
    with pytest.raises(CompositionError, match=re.escape(words)):
        scene(grains(trial.shape, "free"), law=law)
