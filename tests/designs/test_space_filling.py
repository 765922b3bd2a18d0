"""Latin hypercube, Sobol' and Halton designs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc

from designs import DesignError, Factor, FactorSpace, Halton, LatinHypercube, Sobol


def space(k):
    return FactorSpace(Factor(f"x{i}", 0, 1) for i in range(k))


def unit(design):
    return (design.coded.to_numpy() + 1) / 2


@settings(deadline=None)
@given(n=st.integers(2, 60), k=st.integers(1, 8), seed=st.integers(0, 1000))
def test_latin_hypercube_has_one_run_in_each_slice(n, k, seed):
    points = unit(LatinHypercube(runs=n).generate(space(k), seed=seed))
    for column in points.T:
        assert sorted((column * n).astype(int)) == list(range(n))


def test_latin_hypercube_optimised_is_more_even():
    plain = qmc.discrepancy(unit(LatinHypercube(runs=20).generate(space(4), seed=3)))
    better = qmc.discrepancy(unit(LatinHypercube(runs=20, optimise="discrepancy").generate(space(4), seed=3)))
    assert better < plain


def test_centred_latin_hypercube_uses_middles():
    points = unit(LatinHypercube(runs=10, centred=True).generate(space(2)))
    np.testing.assert_allclose(np.sort(points[:, 0]), (np.arange(10) + 0.5) / 10)


@pytest.mark.parametrize(("runs", "nearest"), [(3, "2 or 4"), (100, "64 or 128")])
def test_sobol_refuses_counts_that_lose_balance(runs, nearest):
    with pytest.raises(DesignError, match=nearest):
        Sobol(runs=runs).generate(space(3))
    assert len(Sobol(runs=runs, unbalanced=True).generate(space(3))) == runs


def test_sobol_is_balanced_and_the_published_sequence():
    points = unit(Sobol(runs=32).generate(space(5)))
    for column in points.T:
        assert sorted((column * 32).astype(int)) == list(range(32))
    plain = Sobol(runs=4, scramble=False).generate(space(2))
    first = unit(plain)[np.argsort(plain.table["std_order"])]
    np.testing.assert_allclose(first, [[0, 0], [0.5, 0.5], [0.75, 0.25], [0.25, 0.75]])


def test_halton_is_the_radical_inverse():
    plain = Halton(runs=5, scramble=False).generate(space(2))
    first = unit(plain)[np.argsort(plain.table["std_order"])]
    np.testing.assert_allclose(first[:, 0], [0, 1 / 2, 1 / 4, 3 / 4, 1 / 8], atol=1e-12)
    np.testing.assert_allclose(first[:, 1], [0, 1 / 3, 2 / 3, 1 / 9, 4 / 9], atol=1e-12)


def test_levels_and_log_factors():
    mixed = FactorSpace([Factor("sieve", 1, 4, levels=(1, 2, 4)), Factor("modulus", 1e5, 1e9, log=True)])
    design = LatinHypercube(runs=30).generate(mixed)
    assert set(design.natural["sieve"]) == {1, 2, 4}
    decades = np.log10(design.natural["modulus"])
    assert ((decades >= 5) & (decades <= 9)).all()
    assert abs(np.median(decades) - 7) < 0.3
