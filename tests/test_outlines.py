"""How far grains reach, and whether they meet, beside points on their surfaces."""

from dataclasses import replace

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.grain import random_rotations
from taichidem.shapes import Superquadric
from taichidem.shapes.outlines import Outlines
from tests.clump import Row

N = 40
SPACING = 1e-2  # of points on the surface
FORMS = [Superquadric.spheroid(1.7), Superquadric(1.0, 0.7, 1.4, 6.0, 3.0), Row(3), Row(2)]


def turned(q, v):
    """Return vectors (k, 3) turned by one quaternion, by its matrix."""
    w, x, y, z = q
    matrix = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return v @ np.array(matrix).T


def directions(n):
    drawn = np.random.default_rng(5).normal(size=(n, 3))
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)


def surface(shape, n=3000):
    """Return points of the surface in the shape's own frame, (m, 3)."""
    u = directions(n)
    if isinstance(shape, Superquadric):
        return shape.support(u)
    parts = shape.elements
    return np.concatenate([o + r * u for o, r in zip(parts.offset, parts.radius, strict=True)])


def bodies(shape, scale=1.0, seed=2):
    rng = np.random.default_rng(seed)
    return shape.bodies(np.zeros((N, 3)), 1.0, radius=scale, orientation=random_rotations(rng, N))


@pytest.mark.parametrize("shape", FORMS, ids=str)
def test_the_farthest_point_is_that_of_the_surface(shape):
    made = bodies(shape)
    outlines, u = Outlines.of(made), directions(N)
    reach = outlines.reach(np.arange(N), u)
    own = surface(shape) / shape.equal_volume_radius
    for k in range(N):
        there = (turned(made.orientation[k], own) @ u[k]).max()
        assert there <= reach[k] + 1e-12
        assert there == pytest.approx(reach[k], rel=SPACING)
    below, above = outlines.both_ways(2)
    points = np.array([turned(q, own)[:, 2] for q in made.orientation])
    assert above == pytest.approx(points.max(axis=1), rel=SPACING)
    assert -below == pytest.approx(points.min(axis=1), rel=SPACING)
    assert outlines.radius == pytest.approx(made.bounding_radius)


@pytest.mark.parametrize("shape", FORMS[:2], ids=str)
def test_they_meet_where_points_of_one_lie_in_the_other(shape):
    """Convex forms: a point of one inside the other is a meeting; hulls that are told to be clear hold none."""
    one, two = bodies(shape, seed=2), bodies(shape, seed=3)
    every, u = np.arange(N), directions(N)
    own = surface(shape) / shape.equal_volume_radius
    axes, (n1, n2) = one.element_axes[0], one.element_exponents[0]
    found = {}
    for distance in (1.6, 1.9, 2.1, 2.4):
        way = distance * u
        meeting = Outlines.of(one).meets(every, way, Outlines.of(two), every)
        for k in every:
            points = turned(two.orientation[k], own) + way[k]
            x, y, z = np.abs(turned(one.orientation[k] * (1, -1, -1, -1), points) / axes).T
            inside = (x**n2 + y**n2) ** (n1 / n2) + z**n1
            assert meeting[k] or inside.min() > 1.0
            found.setdefault(distance, []).append((meeting[k], inside.min() < 1.0))
        assert found[distance].count((True, False)) <= 0.15 * N  # not told in time, or between the points
    assert all(m for m, _ in found[1.6])
    assert sum(m for m, _ in found[2.4]) < N / 2


def test_pairs_at_a_distance_that_only_another_plane_tells_are_clear():
    """Side by side but shifted along their axes: a plane across the way between centres cuts both."""
    long = Superquadric.spheroid(3.0).bodies(np.zeros((1, 3)), 1.0)
    half, width = long.element_axes[0, 2], long.element_axes[0, 0]
    way = np.array([[2.02 * width, 0.0, 0.9 * half]])
    first = np.array([0])
    assert not Outlines.of(long).meets(first, way, Outlines.of(long), first)[0]
    assert np.linalg.norm(way) < 2 * Outlines.of(long).reach(first, way / np.linalg.norm(way))[0]
    assert Outlines.of(long).meets(first, 0.9 * way, Outlines.of(long), first)[0]


def test_spheres_join_forms():
    balls = Bodies.spheres(np.zeros((2, 3)), np.array([1.0, 2.0]), 1.0)
    for shape in (Row(3), Superquadric.spheroid(1.5)):
        mixed = Outlines.of(balls).joined(Outlines.of(bodies(shape)))
        u = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0]])
        assert mixed.reach(np.array([0, 1]), u) == pytest.approx([1.0, 2.0])
        assert mixed.rows(np.array([1, 3])).radius == pytest.approx([2.0, bodies(shape).bounding_radius[1]])
        back = Outlines.of(bodies(shape)).joined(Outlines.of(balls))
        assert back.reach(np.array([N, N + 1]), u) == pytest.approx([1.0, 2.0])
    two, three = Outlines.of(bodies(Row(2))), Outlines.of(bodies(Row(3)))
    up = np.broadcast_to([0.0, 0.0, 1.0], (N, 3))
    assert two.joined(three).reach(np.arange(N), up) == pytest.approx(two.reach(np.arange(N), up))


def test_spheres_are_exact_and_alike():
    balls = Bodies.spheres(np.zeros((2, 3)), np.array([0.1, 0.3]), 1.0)
    outlines = Outlines.of(balls)
    assert np.array_equal(outlines.radius, balls.radius)
    assert np.array_equal(outlines.reach(np.array([1]), np.array([[0.6, 0.8, 0.0]])), [0.3])
    assert np.array_equal(Outlines.of(replace(balls)).size, balls.radius)
