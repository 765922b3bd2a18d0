"""Multispheres: the mass properties of a union of spheres against closed forms, integrals and reference data."""

import dataclasses
import itertools
import math
import pickle
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from taichidem.errors import InputError
from taichidem.shapes import Multisphere
from taichidem.shapes.spheroid_spheres import prolate_spheres, shape_error
from taichidem.shapes.union_properties import union_moments
from tests.apparatus import reference
from tests.shapes.quadrature import gauss, inertia, on_a_line, star

BALL = 4 / 3 * math.pi


def on_z(z, radii=1.0):
    return Multisphere([(0.0, 0.0, at) for at in z], radii)


def lattice(count, step):
    return np.array(list(itertools.product(range(count), repeat=3)), float) * step


def test_one_sphere_is_a_sphere():
    shape = Multisphere([(1.0, 2.0, 3.0)], 0.5)
    assert shape.volume == pytest.approx(BALL / 8, rel=1e-15)
    np.testing.assert_allclose(shape.inertia, 0.1, rtol=1e-15)
    np.testing.assert_array_equal(shape.centre, [1, 2, 3])
    assert shape.bodies([(0, 0, 0)], 1000.0).kind == "sphere"


def test_two_spheres_at_a_radius_have_their_closed_form():
    shape = on_z([0.0, 1.0])
    assert shape.volume == pytest.approx(9 / 4 * math.pi, rel=1e-14)
    np.testing.assert_allclose(shape.inertia, [0.7375, 0.7375, 0.425], rtol=1e-14)
    np.testing.assert_allclose(shape.elements.offset[:, 2], [-0.5, 0.5], rtol=1e-14)


def test_two_unequal_spheres_have_the_volume_of_a_lens_less():
    big, small, d = 1.3, 0.7, 1.1
    lens = math.pi * (big + small - d) ** 2 * (d**2 + 2 * d * (big + small) - 3 * (big - small) ** 2) / (12 * d)
    shape = Multisphere([(0, 0, 0), (d, 0, 0)], [big, small])
    assert shape.volume == pytest.approx(BALL * (big**3 + small**3) - lens, rel=1e-14)


def test_the_reference_table_of_chains_is_met():
    for row in reference("multisphere_linear_union.csv"):
        shape = on_z(float(row["spacing_over_R_1"]) * np.arange(int(row["n_spheres_1"])))
        across, along = (float(row[f"I_{name}_over_mR2_union_1"]) for name in ("transverse", "axial"))
        assert shape.volume == pytest.approx(float(row["union_volume_over_R3_1"]), rel=5e-6)
        np.testing.assert_allclose(shape.inertia, [across, across, along], rtol=5e-6)


@pytest.mark.parametrize(
    ("z", "radii"),
    [
        ([0, 0.3, 0.5, 1.7], [1.0, 0.8, 1.1, 0.4]),  # with triple overlaps
        ([0, 2.0, 3.5, 4.5], [1.0, 1.0, 0.5, 0.5]),  # that only touch
        ([0, 0.1, 5e-10, 1.0], [1.0, 0.3, 1.0, 0.9]),  # one inside, one nearly coincident
        (np.linspace(-1, 1, 7), np.sqrt(1 + np.linspace(-1, 1, 7) ** 2)),  # all through one circle
    ],
)
def test_spheres_on_a_line_are_integrated_along_it(z, radii):
    shape = on_z(z, radii)
    volume, centre, across, along = on_a_line(z, radii)
    assert shape.volume == pytest.approx(volume, rel=1e-12)
    assert shape.centre[2] == pytest.approx(centre, rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(shape.inertia, [across, across, along], rtol=1e-12)


def three_about_an_axis(seed):
    """Return three spheres which all hold 0, where the planes of their overlaps meet, and where those planes lie about z."""
    rng = np.random.default_rng(seed)
    angle = np.array([0.0, 2.0, 4.1]) + rng.uniform(-0.2, 0.2, 3)
    centres = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) * rng.uniform(0.4, 0.9, (3, 1))
    radii = np.sqrt(0.5 + np.sum(centres**2, axis=1))  # so that 0 has the same power with respect to each
    sides = np.roll(centres, -1, axis=0) - centres
    return centres, radii, np.arctan2(-sides[:, 0], sides[:, 1]) % (2 * math.pi)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_triple_overlap_off_a_line_is_the_integral(seed):
    centres, radii, _ = three_about_an_axis(seed)
    planes = three_about_an_axis(seed)[2]

    def reach(direction):
        along = direction @ centres.T
        return (along + np.sqrt(along**2 + 0.5)).max(axis=1)

    edges = np.unique(np.concatenate([planes, planes + math.pi]) % (2 * math.pi))
    edges = [*edges, edges[0] + 2 * math.pi]
    pieces = [star(reach, gauss(0, math.pi), gauss(low, high)) for low, high in itertools.pairwise(edges)]
    volume, first, second = (sum(parts) for parts in zip(*pieces, strict=True))
    union = union_moments(centres, radii)
    assert union.volume == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(union.centre, first / volume, atol=1e-12)
    np.testing.assert_allclose(union.tensor, inertia(volume, first, second), atol=1e-12)


def test_touching_spheres_are_the_exact_sums():
    rod, tee = reference("mercurydpm_clump_inertia.csv")
    shape = Multisphere([(-1, 0, 0), (0, 0, 0), (1, 0, 0)], 0.5)
    assert shape.volume == pytest.approx(math.pi / 2, rel=1e-14)
    expected = [float(rod[name]) for name in ("Ixx_kg_m2", "Iyy_kg_m2", "Izz_kg_m2")]
    np.testing.assert_allclose(shape.volume * shape.inertia, expected, rtol=5e-6)

    # The moments fit seven spheres across and three down about the middle of the bar, to the error of their voxels.
    centres = np.array([(x, 0, 0) for x in range(-3, 4)] + [(0, -y, 0) for y in (1, 2, 3)], float)
    shape = Multisphere(centres, 0.5)
    assert shape.volume == pytest.approx(10 * math.pi / 6, rel=1e-14)
    np.testing.assert_allclose(shape.centre, [0, -0.6, 0], atol=1e-14)
    squares = np.array([28, 14 - 10 * 0.6**2, 0]) / 10
    np.testing.assert_allclose(shape.inertia, 0.1 + squares.sum() - squares, rtol=1e-13)
    about_bar = shape.volume * (shape.inertia + np.array([0.36, 0, 0.36]))
    assert shape.volume == pytest.approx(float(tee["mass_kg_at_density_1"]), rel=2e-3)
    expected = [float(tee[name]) for name in ("Ixx_kg_m2", "Iyy_kg_m2", "Izz_kg_m2")]
    np.testing.assert_allclose(about_bar, expected, rtol=5e-3)


clouds = st.lists(
    st.tuples(*[st.floats(-0.5, 0.5)] * 3, st.floats(0.3, 1.2)), min_size=1, max_size=7
)  # any two of them are less than their radii apart, or nearly so


@settings(max_examples=60, deadline=None)
@given(rows=clouds, seed=st.integers(0, 2**31))
def test_turning_moving_reordering_and_repeating_change_nothing(rows, seed):
    rng = np.random.default_rng(seed)
    table = np.array(rows)
    centres, radii = table[:, :3], table[:, 3]
    turn, move = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3)
    order = rng.permutation([*range(len(radii)), rng.integers(len(radii))])
    one, other = union_moments(centres, radii), union_moments((centres @ turn.T + move)[order], radii[order])
    assert other.volume == pytest.approx(one.volume, rel=1e-10)
    np.testing.assert_allclose(other.centre, turn @ one.centre + move, atol=1e-10)
    np.testing.assert_allclose(other.tensor, turn @ one.tensor @ turn.T, atol=1e-10)


@settings(max_examples=40, deadline=None)
@given(rows=clouds)
def test_a_union_is_larger_than_its_largest_sphere_and_smaller_than_the_sum(rows):
    table = np.array(rows)
    volume = union_moments(table[:, :3], table[:, 3]).volume
    each = BALL * table[:, 3] ** 3
    assert each.max() * (1 - 1e-12) <= volume <= each.sum() * (1 + 1e-12)


@pytest.mark.parametrize("step", [0.5, 1.0, 1.2, math.sqrt(2), 2 / math.sqrt(3), 1.9])
def test_many_edges_through_one_point_make_no_difference(step):
    """In a cubic lattice four and eight spheres meet in points; turned, rounding takes those points apart."""
    centres, radii = lattice(3, step), np.ones(27)
    turn = Rotation.from_rotvec([0.3, 0.5, -0.7]).as_matrix()
    one, other = union_moments(centres, radii), union_moments(centres @ turn.T, radii)
    assert other.volume == pytest.approx(one.volume, rel=1e-13)
    np.testing.assert_allclose(other.tensor, turn @ one.tensor @ turn.T, atol=1e-13)


@pytest.mark.parametrize("apart", [1e-4, 1e-8, 1e-11, 1e-13])
def test_nearly_coincident_spheres_add_next_to_nothing(apart):
    centres = lattice(2, 1.2)
    shifted = centres + apart * np.random.default_rng(5).normal(size=centres.shape)
    one, other = union_moments(centres, np.ones(8)), union_moments(np.vstack([shifted, centres]), np.ones(16))
    assert 0 <= other.volume / one.volume - 1 + 1e-11 < 4 * apart + 2e-11


def test_a_frame_that_is_principal_is_kept():
    shape = Multisphere([(5.0, 1.0, 0.0), (6.0, 1.0, 0.0), (4.0, 1.0, 0.0)], [0.6, 0.6, 0.6])
    np.testing.assert_array_equal(shape.principal_rotation, np.eye(3))
    np.testing.assert_allclose(shape.elements.offset[:, 0], [0, 1, -1], atol=1e-14)
    np.testing.assert_array_equal(Multisphere(lattice(2, 1.0), 0.8).principal_rotation, np.eye(3))


def test_a_turned_frame_is_turned_back():
    own = Multisphere([(0, 0, 0), (1, 0, 0), (0, 0.4, 0), (0, 0, 0.9), (0, 0, -0.9)], [0.6, 0.5, 0.4, 0.3, 0.3])
    turn = Rotation.from_rotvec([0.2, -0.3, 0.4]).as_matrix()
    shape = Multisphere(np.array(own.centres) @ turn.T + [1, 2, 3], own.radii)
    axes = shape.principal_rotation
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    np.testing.assert_allclose(sorted(shape.inertia), sorted(own.inertia), rtol=1e-12)
    np.testing.assert_allclose(shape.elements.offset @ axes + shape.centre, shape.centres, atol=1e-14)
    again = Multisphere(shape.elements.offset, shape.radii)
    np.testing.assert_allclose(again.inertia, shape.inertia, rtol=1e-12)
    assert np.abs(again.centre).max() < 1e-14


def test_shapes_are_equal_by_value_before_and_after_use():
    one, other = on_z([0.0, 1.0]), Multisphere(np.array([[0, 0, 0], [0, 0, 1]]), np.ones(2))
    assert one.volume > 0
    assert len(one.inertia) == len(one.elements.offset) + 1
    assert one == other
    assert hash(one) == hash(other)
    assert pickle.loads(pickle.dumps(one)) == one
    assert dataclasses.replace(one, radii=[0.9, 0.9]) != one
    with pytest.raises(ValueError, match="read-only"):
        one.inertia[0] = 1.0


def test_a_hundred_spheres_take_less_than_a_second():
    rng = np.random.default_rng(6)
    centres, radii = rng.normal(size=(100, 3)), rng.uniform(0.3, 0.9, 100)
    start = time.perf_counter()
    union_moments(centres, radii)
    assert time.perf_counter() - start < 1.0


def test_the_reference_table_of_prolate_spheroids_is_met():
    for row in reference("prolate_spheroid_multisphere_error.csv"):
        ratio = float(row["aspect_ratio_1"])
        error = shape_error(*prolate_spheres(ratio, int(row["n_spheres_1"])), ratio, 1.0)
        found = [error.volume, error.inertia, error.largest_gap, error.rms_gap]
        columns = (
            "volume_rel_error_1",
            "I_transverse_rel_error_1",
            "max_radial_gap_over_a_1",
            "rms_radial_gap_over_a_1",
        )
        np.testing.assert_allclose(found, [float(row[name]) for name in columns], rtol=1e-5, atol=2e-7)


@pytest.mark.parametrize(
    ("ratio", "count"),
    [
        (1.0, 1),
        (1.0, 3),
        (1.5, 2),
        (2.0, 2),
        (1.5, 4),
        (2.5, 5),
        (3.0, 7),
        (3.0, 8),
        (0.8, 3),
        (0.5, 6),
        (0.5, 9),
        (0.5, 37),
    ],
)
def test_a_spheroid_of_spheres_has_the_asked_volume_and_ratio(ratio, count):
    shape = Multisphere.spheroid(ratio, count, 0.004)
    offset, radii = shape.elements.offset, shape.elements.radius
    length = (offset[:, 2] + radii).max() - (offset[:, 2] - radii).min()
    width = 2 * (np.linalg.norm(offset[:, :2], axis=1) + radii).max()
    assert len(radii) == count
    assert shape.equal_volume_radius == pytest.approx(0.004, rel=1e-12)
    assert length / width == pytest.approx(
        ratio, rel=1e-4 if count > 9 else 1e-12
    )  # the centre of mass may be off the axis
    np.testing.assert_array_equal(shape.principal_rotation, np.eye(3))


def test_more_spheres_make_a_better_spheroid():
    errors = [Multisphere.spheroid(2.0, count).shape_error(2.0) for count in (3, 5, 9, 17)]
    assert [round(error.volume, 6) for error in errors] == [-0.375, -0.09375, -0.023438, -0.005859]
    assert all(after.rms_gap < before.rms_gap for before, after in itertools.pairwise(errors))
    flat = [Multisphere.spheroid(0.5, count).shape_error(0.5).rms_gap for count in (3, 7, 37)]
    assert flat == sorted(flat, reverse=True)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Multisphere([], []), ["no sphere"]),
        (lambda: Multisphere([(0, 0)], 1), ["shape (1, 2)", "(m, 3)"]),
        (lambda: Multisphere([(0, 0, 0)], [1, 2]), ["(2,)", "1 centres"]),
        (lambda: Multisphere([(0, 0, "a")], 1), ["aren't numbers"]),
        (lambda: Multisphere([(0, 0, math.nan)], 1), ["centres", "NaN"]),
        (lambda: Multisphere([(0, 0, 0), (1, 0, 0)], [1, 0]), ["radii[1] is 0", "above 0"]),
        (lambda: Multisphere([(0, 0, 0)], math.inf), ["radii[0] is inf"]),
        (lambda: on_z([0, 1, 3.25, 4]), ["Spheres 1 and 2", "0.25 m apart", "hang together"]),
        (lambda: on_z([0, 2 + 1e-7]), ["1e-07 m apart"]),
        (lambda: Multisphere.spheroid(0, 3), ["aspect_ratio is 0"]),
        (lambda: Multisphere.spheroid(2, 3, -1), ["radius is -1"]),
        (lambda: Multisphere.spheroid(2, 0), ["spheres is 0", "whole number"]),
        (lambda: Multisphere.spheroid(2, 2.5), ["spheres is 2.5"]),
        (lambda: Multisphere.spheroid(2, 1), ["of 1 sphere:", "aspect ratio of 1 only"]),
        (lambda: Multisphere.spheroid(2.1, 2), ["2.1", "of 2 spheres", "next number that does is 4"]),
        (lambda: Multisphere.spheroid(0.5, 2), ["next number that does is 3"]),
        (lambda: Multisphere.spheroid(0.01, 3), ["No number up to 100", "Superquadric"]),
        (lambda: on_z([0, 1]).shape_error(-2), ["aspect_ratio is -2"]),
    ],
)
def test_bad_input_is_refused(call, words):
    with pytest.raises(InputError) as caught:
        call()
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_spheres_that_touch_by_rounding_hang_together():
    assert on_z([0, 2 + 1e-10]).volume == pytest.approx(2 * BALL, rel=1e-12)
