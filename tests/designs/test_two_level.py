"""Full and fractional factorials and Plackett–Burman designs."""

from __future__ import annotations

import itertools

import numpy as np
import pyDOE3
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designs import DesignError, Factor, FactorSpace, FractionalFactorial, FullFactorial, PlackettBurman
from designs.generators import _TABLE, fraction, fractions, generators_for, resolution_of
from designs.hadamard import HADAMARD_ORDERS, plackett_burman_columns


def space(k):
    return FactorSpace(Factor(f"x{i}", 0, 1) for i in range(k))


def standard(design):
    """Coded points in standard order."""
    return design.coded.to_numpy()[np.argsort(design.table["std_order"])]


def test_full_factorial_in_yates_order():
    coded = standard(FullFactorial().generate(space(3)))
    yates = [(a, b, c) for c, b, a in itertools.product((-1, 1), repeat=3)]
    np.testing.assert_array_equal(coded, yates)


def test_full_factorial_uses_own_levels():
    levelled = FactorSpace([Factor("a", 0, 1), Factor("sieve", 1, 4, levels=(1, 2, 4))])
    design = FullFactorial().generate(levelled)
    assert len(design) == 6
    assert set(design.natural["sieve"]) == {1, 2, 4}


@pytest.mark.parametrize(("k", "p"), sorted(_TABLE))
def test_tabulated_fractions_are_orthogonal_and_have_no_shorter_word_than_searched(k, p):
    words = _TABLE[k, p]
    columns = fraction(k, words)
    np.testing.assert_array_equal(columns.T @ columns, 2 ** (k - p) * np.eye(k))
    # Resolution from the columns themselves: the smallest set whose product is constant.
    constant = 2 ** (k - p)
    sizes = (
        size
        for size in range(1, k + 1)
        for chosen in itertools.combinations(range(k), size)
        if abs(np.prod(columns[:, list(chosen)], axis=1).sum()) == constant
    )
    assert resolution_of(k, words) == next(sizes)


@pytest.mark.parametrize(
    ("k", "resolution", "runs"),
    [
        *[(4, 4, 8), (5, 5, 16), (5, 3, 8), (6, 6, 32), (7, 4, 16), (7, 3, 8)],
        *[(8, 4, 16), (8, 5, 64), (11, 5, 128), (15, 3, 16), (16, 4, 32)],
    ],
)
def test_smallest_fraction_of_a_resolution(k, resolution, runs):
    design = FractionalFactorial(resolution=resolution).generate(space(k))
    assert len(design) == runs
    assert np.array_equal(standard(design).T @ standard(design), runs * np.eye(k))


def test_full_resolution_half_fraction_exists():
    """The half fraction of highest resolution, which pyDOE3 reports as impossible."""
    for k in (4, 5, 6):
        assert len(FractionalFactorial(resolution=k).generate(space(k))) == 2 ** (k - 1)


def test_saturated_and_nearly_saturated_fractions_exist():
    """2^(7−4) and 2^(15−11), where pyDOE3's search raises."""
    assert generators_for(7, 4) == ("AB", "AC", "BC", "ABC")
    assert len(FractionalFactorial(runs=16).generate(space(15))) == 16


@pytest.mark.parametrize("k", range(3, 13))
def test_all_fractions_reach_the_resolution_they_claim(k):
    for runs, resolution, words in fractions(k):
        columns = fraction(k, words)
        assert columns.shape == (runs, k)
        np.testing.assert_array_equal(columns.T @ columns, runs * np.eye(k))
        if resolution >= 5:
            pairs = np.array([columns[:, i] * columns[:, j] for i, j in itertools.combinations(range(k), 2)])
            np.testing.assert_array_equal(pairs @ columns, 0)


def test_generators_with_signs():
    coded = standard(FractionalFactorial(generators="D=-ABC").generate(space(4)))
    np.testing.assert_array_equal(coded[:, 3], -np.prod(coded[:, :3], axis=1))
    bare = standard(FractionalFactorial(generators="ab, ac").generate(space(5)))
    np.testing.assert_array_equal(bare[:, 4], bare[:, 0] * bare[:, 2])


@pytest.mark.parametrize("generators", ["D=ABD", "E=ABC", "D=", "D=AXC", "D=AAB", "D=-"])
def test_bad_generators_are_refused(generators):
    with pytest.raises(DesignError, match="can't be used"):
        FractionalFactorial(generators=generators).generate(space(4))


def test_generators_that_make_factors_equal_are_refused():
    with pytest.raises(DesignError, match="make two factors equal"):
        FractionalFactorial(generators="D=A").generate(space(4))


def test_impossible_resolution_names_what_exists():
    with pytest.raises(DesignError, match=r"resolution 6 and 16 runs\. There are: III with 8 runs, V with 16 runs"):
        FractionalFactorial(resolution=6, runs=16).generate(space(5))


def test_impossible_runs_name_the_nearest():
    with pytest.raises(DesignError, match="16 or 32"):
        FractionalFactorial(runs=20).generate(space(6))


@pytest.mark.parametrize("n", HADAMARD_ORDERS)
def test_plackett_burman_columns_are_orthogonal_and_balanced(n):
    columns = plackett_burman_columns(n)
    np.testing.assert_array_equal(columns.T @ columns, n * np.eye(n - 1))
    np.testing.assert_array_equal(columns.sum(axis=0), 0)
    np.testing.assert_array_equal(columns[-1], -1)


def test_plackett_burman_12_is_the_published_one():
    row = plackett_burman_columns(12)[0]
    assert "".join("+" if v > 0 else "-" for v in row) == "++-+++---+-"
    theirs = pyDOE3.pbdesign(11)
    ours = plackett_burman_columns(12)
    assert np.linalg.matrix_rank(theirs) == np.linalg.matrix_rank(ours) == 11


@settings(deadline=None)
@given(k=st.integers(2, 60))
def test_plackett_burman_for_any_number_of_factors(k):
    """Also for 24–27, 32–35, 40–43 and 48–59 factors, where pyDOE3 has no matrix."""
    design = PlackettBurman().generate(space(k))
    assert len(design) % 4 == 0
    assert k < len(design) <= max(12, k + 8)
    coded = design.coded.to_numpy()
    np.testing.assert_array_equal(coded.T @ coded, len(design) * np.eye(k))


def test_plackett_burman_never_takes_a_regular_fraction_unasked():
    assert len(PlackettBurman().generate(space(4))) == 12
    assert len(PlackettBurman().generate(space(14))) == 20
    asked = PlackettBurman(runs=16).generate(space(14))
    assert "regular fraction" in asked.text()


def test_fold_over_clears_main_effects():
    design = PlackettBurman(fold_over=True).generate(space(9))
    assert len(design) == 24
    assert list(design.table["block"]) == [1] * 12 + [2] * 12
    table = design.alias_table()
    assert not set(table["term"]) & set(design.space.names)
    assert "Clear of two-factor interactions: x0" in design.text() or "all clear" in design.text()


def test_saturated_plackett_burman_says_so():
    design = PlackettBurman().generate(space(11))
    assert design.error_degrees_of_freedom() == 0
    assert "saturated" in design.text()
    assert "Lenth" in design.text()


def test_plackett_burman_impossible_runs_name_the_nearest():
    with pytest.raises(DesignError, match="20 or 24"):
        PlackettBurman(runs=22).generate(space(9))


def test_too_many_full_factorial_runs_are_refused():
    with pytest.raises(DesignError, match="fractional_factorial"):
        FullFactorial().generate(space(25))
