"""Superquadrics: volume, moments, bounding sphere and support points against integrals, closed forms and reference data."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from taichidem.errors import InputError
from taichidem.shapes import Superquadric
from tests.apparatus import reference
from tests.shapes.quadrature import double_exponential, star

FORMS = [(1, 2, 3, 2, 2), (1, 1, 2, 8, 2), (2, 1.5, 1, 5, 3), (0.5, 0.5, 0.5, 4, 20 / 9), (1, 0.4, 0.7, 2.5, 6)]
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1)


def form(shape, points):
    x, y, z = np.abs(points).T
    return ((x / shape.a) ** shape.n2 + (y / shape.b) ** shape.n2) ** (shape.n1 / shape.n2) + (z / shape.c) ** shape.n1


def gradient(shape, points):
    """Return ∂(form)/∂x, the outward normal at some length."""
    x, y, z = (points / (shape.a, shape.b, shape.c)).T
    inner = np.abs(x) ** shape.n2 + np.abs(y) ** shape.n2
    outer = shape.n1 * inner ** (shape.n1 / shape.n2 - 1)
    powers = [outer * np.abs(x) ** (shape.n2 - 1) / shape.a, outer * np.abs(y) ** (shape.n2 - 1) / shape.b]
    return np.sign(points) * np.column_stack([*powers, shape.n1 * np.abs(z) ** (shape.n1 - 1) / shape.c])


@pytest.mark.parametrize("numbers", FORMS)
def test_volume_and_moments_are_the_integrals(numbers):
    shape = Superquadric(*numbers)
    quarter = double_exponential(0, math.pi / 2, 401)
    volume, _, second = star(lambda d: form(shape, d) ** (-1 / shape.n1), quarter, quarter)
    squares = second.diagonal() / volume  # of one octant, as of the whole
    assert shape.volume == pytest.approx(8 * volume, rel=1e-10)
    np.testing.assert_allclose(shape.inertia, squares.sum() - squares, rtol=1e-10)


def test_the_reference_table_is_met():
    for row in reference("superquadric_volume_inertia.csv"):
        shape = Superquadric(*(float(row[name]) for name in ("a_m", "b_m", "c_m", "n1_1", "n2_1")))
        moments = [float(row[f"I{axis}_over_mass_m2"]) for axis in ("xx", "yy", "zz")]
        assert shape.volume == pytest.approx(float(row["volume_m3"]), rel=5e-6)
        np.testing.assert_allclose(shape.inertia, moments, rtol=5e-6)
        assert shape.bounding_radius == pytest.approx(float(row["bounding_radius_m"]), rel=5e-6)


def test_an_ellipsoid_has_its_closed_forms():
    shape = Superquadric(1.0, 2.0, 3.0)
    assert shape.volume == pytest.approx(4 / 3 * math.pi * 6, rel=1e-14)
    np.testing.assert_allclose(shape.inertia, [13 / 5, 10 / 5, 5 / 5], rtol=1e-14)
    assert shape.bounding_radius == pytest.approx(3.0, rel=1e-12)


@settings(deadline=None)
@given(direction=directions)
def test_an_ellipsoid_is_touched_where_its_closed_form_says(direction):
    shape, d = Superquadric(1.0, 2.0, 3.0), np.array(direction)
    squares = np.array([1.0, 4.0, 9.0])
    np.testing.assert_allclose(shape.support(d)[0], squares * d / math.sqrt(d @ (squares * d)), atol=1e-12)


@pytest.mark.parametrize("numbers", FORMS)
def test_a_support_point_is_on_the_surface_with_the_direction_as_its_normal(numbers):
    shape = Superquadric(*numbers)
    d = np.random.default_rng(3).normal(size=(300, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    points = shape.support(d)
    np.testing.assert_allclose(form(shape, points), 1.0, rtol=1e-12)
    normal = gradient(shape, points)
    np.testing.assert_allclose(normal / np.linalg.norm(normal, axis=1)[:, None], d, atol=1e-9)
    # No other point of the surface lies farther along the direction.
    assert np.all(points @ d.T <= np.sum(points * d, axis=1) + 1e-12)


@pytest.mark.parametrize("numbers", FORMS)
def test_the_bounding_sphere_touches_the_surface_and_holds_it(numbers):
    shape = Superquadric(*numbers)
    d = np.random.default_rng(4).normal(size=(200_000, 3))
    d /= np.linalg.norm(d, axis=1)[:, None]
    farthest = (form(shape, d) ** (-1 / shape.n1)).max()
    assert farthest <= shape.bounding_radius * (1 + 1e-12)
    assert farthest == pytest.approx(shape.bounding_radius, rel=2e-4)


@pytest.mark.parametrize("ratio", [0.4, 1.0, 2.5])
def test_a_spheroid_has_the_asked_volume_and_ratio(ratio):
    shape = Superquadric.spheroid(ratio, 0.003)
    assert shape.equal_volume_radius == pytest.approx(0.003, rel=1e-14)
    assert shape.c / shape.a == pytest.approx(ratio, rel=1e-14)


def test_shapes_are_equal_by_value():
    assert Superquadric(1, 1, 2) == Superquadric(1.0, 1.0, 2.0)
    assert hash(Superquadric(1, 1, 2)) == hash(Superquadric(1.0, 1.0, 2.0))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Superquadric(0, 1, 1), ["Superquadric.a is 0", "above 0"]),
        (lambda: Superquadric(1, math.nan, 1), ["Superquadric.b is nan"]),
        (lambda: Superquadric(1, 1, "2"), ["Superquadric.c is '2'"]),
        (lambda: Superquadric(1, 1, 1, n1=1.5), ["n1 is 1.5", "2 (round)"]),
        (lambda: Superquadric(1, 1, 1, n2=41), ["n2 is 41", "40"]),
        (lambda: Superquadric.spheroid(-1), ["aspect_ratio is -1"]),
    ],
)
def test_bad_input_is_refused(call, words):
    with pytest.raises(InputError) as caught:
        call()
    assert all(word in str(caught.value) for word in words)
