"""Grains appear inside their region, overlap nothing, and as many and as fast as was asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.distance import pdist

from taichidem.effects import BodyGravity, NormalHertz, SizeSpread
from taichidem.effects.base import SetupEffect
from taichidem.errors import InputError
from taichidem.grain import Grain
from taichidem.insertion import BoxRegion, CylinderRegion, fill_at_random, place_at_random
from taichidem.materials import Material
from taichidem.procedure import World, play, pour, rain
from taichidem.scene import Model, Scene
from taichidem.shapes.outlines import Outlines
from taichidem.simulation import Simulation

NONE = np.empty((0, 3))
RADII = st.floats(0.05, 0.3)
SEEDS = st.integers(0, 2**32 - 1)
COUNTS = st.integers(0, 60)


def found(centres: np.ndarray) -> np.ndarray:
    """Return the centres of the grains that found a place."""
    return centres[np.isfinite(centres[:, 0])]


def gaps_between(centres: np.ndarray) -> np.ndarray:
    return pdist(centres) if len(centres) > 1 else np.array([np.inf])


@settings(max_examples=40, deadline=None)
@given(SEEDS, RADII, COUNTS)
def test_grains_in_a_cylinder_lie_inside_and_apart(seed, radius, count):
    region = CylinderRegion(1.0, 0.5, 2.5, centre=(3.0, -1.0))
    x = place_at_random(np.random.default_rng(seed), region, np.full(count, radius), NONE, np.empty(0))
    assert len(x) == count
    x = found(x)
    assert np.all(np.hypot(x[:, 0] - 3.0, x[:, 1] + 1.0) <= 1.0 - radius + 1e-12)
    assert np.all((x[:, 2] >= 0.5 + radius - 1e-12) & (x[:, 2] <= 2.5 - radius + 1e-12))
    assert gaps_between(x).min() >= 2 * radius


@settings(max_examples=40, deadline=None)
@given(SEEDS, RADII, COUNTS, st.integers(0, 20), st.floats(0.02, 0.5))
def test_grains_in_a_box_touch_nothing_that_is_there(seed, radius, count, present, present_radius):
    rng = np.random.default_rng(seed)
    region = BoxRegion((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0))
    there = rng.uniform((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0), (present, 3))
    radii = np.linspace(0.5, 1.0, present) * present_radius
    x = place_at_random(rng, region, np.full(count, radius), there, radii)
    x = found(x)
    assert np.all((x >= np.add(region.lower, radius) - 1e-12) & (x <= np.subtract(region.upper, radius) + 1e-12))
    assert gaps_between(x).min() >= 2 * radius
    if len(x) and present:
        away = np.linalg.norm(x[:, None] - there[None], axis=2)
        assert np.all(away >= radius + radii - 1e-12)


@settings(max_examples=20, deadline=None)
@given(SEEDS)
def test_the_same_seed_gives_the_same_places_and_another_one_others(seed):
    region = CylinderRegion(1.0, 0.0, 2.0)
    first, again, other = (
        fill_at_random(np.random.default_rng(s), region, np.full(30, 0.1), NONE, np.empty(0))
        for s in (seed, seed, seed + 1)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


@settings(max_examples=30, deadline=None)
@given(SEEDS, st.lists(st.floats(0.05, 0.3), min_size=1, max_size=40))
def test_grains_of_several_sizes_touch_neither_each_other_nor_the_border(seed, sizes):
    region, radii = CylinderRegion(1.0, 0.0, 2.0), np.array(sizes)
    x = place_at_random(np.random.default_rng(seed), region, radii, NONE, np.empty(0))
    placed = np.isfinite(x[:, 0])
    assert placed.any()
    x, radii = x[placed], radii[placed]
    assert np.all(np.hypot(x[:, 0], x[:, 1]) <= 1.0 - radii + 1e-12)
    touching = np.add.outer(radii, radii)[np.triu_indices(len(radii), 1)]
    assert np.all(pdist(x) >= touching) if len(x) > 1 else True


@pytest.mark.parametrize("half_width", [0.0, 0.15, 0.35])
def test_a_full_cup_takes_grains_of_one_size_and_of_several_alike(half_width):
    """28 % of the region, as the bench's bulk density asks for; large grains look for their places first."""
    sizes = SizeSpread(half_width=half_width).relative_sizes() if half_width else (1.0,)
    radii = 0.003 * np.random.default_rng(1).permutation(np.resize(sizes, 1184))
    x = fill_at_random(np.random.default_rng(1), CylinderRegion(0.03, 0.006, 0.174), radii, NONE, np.empty(0))
    assert np.all(np.hypot(x[:, 0], x[:, 1]) <= 0.03 - radii + 1e-12)
    touching = np.add.outer(radii, radii)[np.triu_indices(len(radii), 1)]
    assert np.all(pdist(x) >= touching)


def test_places_are_uniform_over_the_cross_section():
    region = CylinderRegion(1.0, 0.0, 1.0)
    x = region.sample(np.random.default_rng(1), Outlines.of(np.zeros(20000)))
    inner = np.mean(np.hypot(x[:, 0], x[:, 1]) < 0.5)
    assert inner == pytest.approx(0.25, abs=4 * np.sqrt(0.25 * 0.75 / 20000))
    assert x[:, 2].mean() == pytest.approx(0.5, abs=4 / np.sqrt(12 * 20000))


@pytest.mark.parametrize("region", [CylinderRegion(0.05, 0.0, 1.0), CylinderRegion(1.0, 0.0, 0.15)])
def test_a_region_smaller_than_one_grain_is_refused(region):
    with pytest.raises(InputError, match=r"smaller than one grain of radius 0\.1 m\. Widen it\."):
        fill_at_random(np.random.default_rng(1), region, np.array([0.1]), NONE, np.empty(0))
    box = BoxRegion((0.0, 0.0, 0.0), (1.0, 1.0, 0.15))
    with pytest.raises(InputError, match="smaller than one grain"):
        fill_at_random(np.random.default_rng(1), box, np.array([0.1]), NONE, np.empty(0))


def test_a_region_too_small_for_the_number_is_refused():
    region = BoxRegion((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    with pytest.raises(
        InputError, match=r"Only \d+ of 200 grains .* \d+ % of the region.*Enlarge the region or ask for"
    ):
        fill_at_random(np.random.default_rng(1), region, np.full(200, 0.1), NONE, np.empty(0))


GRAIN = Grain(0.003, Material("grain", 1000.0, 1e7, 0.3), 0)
FALL = (0.0, 0.0, -1.0)


def empty_world() -> World:
    scene = Scene(
        model=Model([GRAIN.material], [NormalHertz(restitution=0.5), BodyGravity()]),
        room=512,
        domain=((-0.1, -0.1, -2.0), (0.1, 0.1, 0.2)),
        largest_radius=GRAIN.radius,
    )
    return World(Simulation(scene), 0, np.random.default_rng(1))


def test_a_stream_keeps_its_rate():
    world = empty_world()
    region = CylinderRegion(0.03, 0.0, 0.1)
    for batch, duration in enumerate(pour(world, GRAIN, region, 200, 1000.0, 0.02, FALL), start=1):
        # A batch of 20 from the first moment on; one grain may wait, as time advances in whole steps.
        assert len(world.snapshot().mass) in (20 * batch - 1, min(20 * batch, 200))
        assert world.time == pytest.approx((batch - 1) * 0.02, abs=batch * world.simulation.scenes[0].dt)
        world.simulation.run(duration)
    assert world.progress == 1.0
    assert len(world.snapshot().mass) == 200
    assert batch in (10, 11)


def test_a_stream_that_cannot_keep_its_rate_says_so():
    world = empty_world()
    narrow = CylinderRegion(0.008, 0.0, 0.012)
    stream = pour(world, GRAIN, narrow, 500, 5000.0, 0.001, (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=r"can't keep 5000 grains per second: \d+ of them wait.*lower the rate"):
        play(world.simulation, [stream], [world])


def test_rain_comes_at_once_and_with_its_velocity():
    world = empty_world()
    rain(world, GRAIN, BoxRegion((-0.05, -0.05, 0.0), (0.05, 0.05, 0.1)), 40, FALL)
    snapshot = world.snapshot()
    assert len(snapshot.mass) == 40
    assert np.array_equal(snapshot.velocity, np.tile(FALL, (40, 1)))
    assert snapshot.mass == pytest.approx(GRAIN.mass)
    assert gaps_between(snapshot.position).min() >= 2 * GRAIN.radius


def test_rain_into_a_region_too_small_is_refused():
    world = empty_world()
    with pytest.raises(InputError, match=r"Only .* of 500 grains"):
        rain(world, GRAIN, BoxRegion((0.0, 0.0, 0.0), (0.03, 0.03, 0.03)), 500)


def test_a_set_up_effect_may_change_the_bodies():
    """The door by which grains of another mass come."""

    class Heavy(SetupEffect):
        name = "heavy"

        def grains(self, bodies):
            return replace(bodies, mass=2 * bodies.mass, inertia=2 * bodies.inertia)

    world = empty_world()
    rain(world, replace(GRAIN, changes=(Heavy(),)), BoxRegion((-0.05, -0.05, 0.0), (0.05, 0.05, 0.1)), 5, FALL)
    assert world.snapshot().mass == pytest.approx(2 * GRAIN.mass)
