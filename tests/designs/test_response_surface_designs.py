"""Central composite, Box–Behnken and definitive screening designs."""

from __future__ import annotations

import itertools

import numpy as np
import pyDOE3
import pytest

from designs import BoxBehnken, CentralComposite, DefinitiveScreening, DesignError, Factor, FactorSpace
from designs.hadamard import conference_matrix, has_conference_matrix
from designs.terms import model_matrix, model_terms


def space(k, **settings):
    return FactorSpace(Factor(f"x{i}", 0, 1, **settings) for i in range(k))


def points(design, kind):
    return design.coded[(design.table["point_type"] == kind).to_numpy()].to_numpy()


def same_points(ours, theirs):
    key = lambda rows: sorted(map(tuple, np.round(rows, 6) + 0.0))  # noqa: E731
    assert key(ours) == key(theirs)


@pytest.mark.parametrize(("k", "runs"), [(3, 15), (4, 27), (5, 46), (6, 54), (7, 62)])
def test_box_behnken_run_counts(k, runs):
    design = BoxBehnken().generate(space(k))
    assert len(design) == runs
    matrix = model_matrix(design.coded.to_numpy(), model_terms(k, "quadratic"))
    assert np.linalg.matrix_rank(matrix) == matrix.shape[1]
    edges = points(design, "edge")
    assert set(np.abs(edges).sum(axis=1)) == ({2.0} if k < 6 else {3.0})
    counts = np.abs(edges).sum(axis=0)
    assert len(set(counts)) == 1  # each factor is moved equally often
    for i, j in itertools.combinations(range(k), 2):
        assert edges[:, i] @ edges[:, j] == 0


@pytest.mark.parametrize(("k", "centre"), [(3, 3), (4, 3), (5, 6)])
def test_box_behnken_equals_pydoe3_where_that_is_right(k, centre):
    same_points(BoxBehnken().generate(space(k)).coded.to_numpy(), pyDOE3.bbdesign(k, center=centre))


@pytest.mark.parametrize(("k", "blocks"), [(4, 3), (5, 2)])
def test_box_behnken_blocks_are_orthogonal(k, blocks):
    design = BoxBehnken(blocks=blocks).generate(space(k))
    check_orthogonal_blocks(design, k)


def check_orthogonal_blocks(design, k):
    """Σ over each block of every quadratic-model column is in proportion to the block's size."""
    block = design.table["block"].to_numpy()
    columns = model_matrix(design.coded.to_numpy(), model_terms(k, "quadratic"), constant=False)
    for number in np.unique(block):
        np.testing.assert_allclose(columns[block == number].mean(axis=0), columns.mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("k", [2, 8])
def test_box_behnken_refuses_other_numbers_of_factors(k):
    with pytest.raises(DesignError, match="3 to 7 factors"):
        BoxBehnken().generate(space(k))


def test_box_behnken_impossible_runs_name_the_nearest():
    with pytest.raises(DesignError, match="nearest it can have: 12"):
        BoxBehnken(runs=11).generate(space(3))


@pytest.mark.parametrize(("k", "runs", "alpha"), [(2, 13, 2**0.5), (3, 20, 8**0.25), (4, 30, 2.0), (5, 48, 32**0.25)])
def test_central_composite_defaults_are_rotatable_with_the_usual_counts(k, runs, alpha):
    design = CentralComposite().generate(space(k))
    assert len(design) == runs
    assert np.abs(points(design, "axial")).max() == pytest.approx(alpha)
    matrix = model_matrix(design.coded.to_numpy(), model_terms(k, "quadratic"))
    covariance = np.linalg.inv(matrix.T @ matrix)
    # Rotatable: the prediction variance depends on the distance only.
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(20, k))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    rows = model_matrix(directions, model_terms(k, "quadratic"))
    np.testing.assert_allclose(np.ptp(np.einsum("ij,jk,ik->i", rows, covariance, rows)), 0, atol=1e-10)


def test_central_composite_of_the_paper():
    """Face-centred, three factors, six centre runs: the twenty runs of the paper's Table 5."""
    design = CentralComposite(kind="face_centred").generate(space(3))
    ours = design.coded.to_numpy()
    same_points(ours, pyDOE3.ccdesign(3, center=(0, 6), face="ccf", alpha="o"))
    assert len(design) == 20


def test_a_number_as_alpha():
    design = CentralComposite(alpha=1.5).generate(space(3))
    assert np.abs(points(design, "axial")).max() == 1.5


def test_inscribed_stays_inside():
    design = CentralComposite(kind="inscribed").generate(space(3))
    assert np.abs(design.coded.to_numpy()).max() == 1.0
    assert np.abs(points(design, "factorial")).max() == pytest.approx(1 / 8**0.25)


def test_face_centred_refuses_an_alpha_instead_of_ignoring_it():
    with pytest.raises(DesignError, match="face_centred"):
        CentralComposite(kind="face_centred", alpha="rotatable")


def test_orthogonal_names_both_meanings():
    with pytest.raises(DesignError, match="orthogonal_blocks, orthogonal_quadratic"):
        CentralComposite(alpha="orthogonal")


@pytest.mark.parametrize(("k", "blocks"), [(2, 2), (3, 2), (3, 3), (4, 2), (4, 3)])
def test_central_composite_blocks_are_orthogonal(k, blocks):
    design = CentralComposite(blocks=blocks).generate(space(k))
    assert design.table["block"].nunique() == blocks
    if blocks == 2 or k > 2:
        check_orthogonal_blocks(design, k)


def test_orthogonal_quadratic_makes_squares_uncorrelated():
    design = CentralComposite(alpha="orthogonal_quadratic").generate(space(3))
    squares = design.coded.to_numpy() ** 2
    np.testing.assert_allclose(np.corrcoef(squares, rowvar=False), np.eye(3), atol=1e-12)


def test_halved_cube_keeps_resolution_five():
    design = CentralComposite(halvings=1).generate(space(5))
    assert len(design) == 16 + 10 + 6
    with pytest.raises(DesignError, match="resolution V"):
        CentralComposite(halvings=1).generate(space(4))


def test_star_point_outside_a_bound_proposes_face_centred():
    restitution = FactorSpace([Factor("friction", 0.1, 0.6, lowest=0), Factor("restitution", 0.3, 0.97, highest=1)])
    with pytest.raises(DesignError) as caught:
        CentralComposite().generate(restitution)
    for word in ("axial point", "physical bounds", "face_centred", "inscribed"):
        assert word in str(caught.value)
    assert len(CentralComposite(kind="face_centred").generate(restitution)) == 13


def test_numpy_integers_are_whole_numbers():
    assert len(CentralComposite(centre_points=np.int64(3)).generate(space(2))) == 11


def test_factor_with_levels_needs_the_centre():
    sieve = FactorSpace([Factor("a", 0, 1), Factor("b", 0, 1), Factor("sieve", 1, 4, levels=(1, 2, 4))])
    with pytest.raises(DesignError, match=r"sieve = 2\.5.*full_factorial"):
        BoxBehnken().generate(sieve)


@pytest.mark.parametrize("order", [m for m in range(4, 60, 2) if has_conference_matrix(m)])
def test_conference_matrices(order):
    matrix = conference_matrix(order)
    np.testing.assert_array_equal(matrix.T @ matrix, (order - 1) * np.eye(order))
    np.testing.assert_array_equal(np.diag(matrix), 0)


@pytest.mark.parametrize("k", range(3, 31))
def test_definitive_screening_is_orthogonal_for_every_number_of_factors(k):
    """Also for 9, 10, 15, 16, 21, 22 and 25–28 factors, where published code was not."""
    design = DefinitiveScreening().generate(space(k))
    coded = design.coded.to_numpy()
    gram = coded.T @ coded
    np.testing.assert_array_equal(gram, np.diag(np.diag(gram)))
    assert len(design) <= 2 * k + 9
    for order_two in [coded**2, *(coded[:, [i]] * coded for i in range(k))]:
        np.testing.assert_array_equal(coded.T @ order_two, 0)


@pytest.mark.parametrize(("k", "runs"), [(4, 9), (5, 13), (6, 13), (8, 17), (10, 21), (12, 25)])
def test_definitive_screening_run_counts(k, runs):
    assert len(DefinitiveScreening().generate(space(k))) == runs
