"""D-optimal designs and augmentation."""

from __future__ import annotations

import itertools
import time

import numpy as np
import pandas as pd
import pytest

from designs import BoxBehnken, DesignError, DOptimal, Factor, FactorSpace, LatinHypercube, PlackettBurman
from designs.terms import model_matrix, model_terms


def space(k):
    return FactorSpace(Factor(f"x{i}", 0, 2) for i in range(k))


def log_determinant(coded, model):
    matrix = model_matrix(coded, model_terms(coded.shape[1], model))
    return np.linalg.slogdet(matrix.T @ matrix)[1]


def test_finds_the_two_level_factorial():
    """For the linear model in 3 factors the best 8 runs are orthogonal: efficiency 100 %."""
    design = DOptimal(fit="linear", runs=8).generate(space(3), seed=2)
    assert design.d_efficiency() == pytest.approx(100.0)


@pytest.mark.parametrize("seed", range(3))
def test_as_good_as_trying_everything(seed):
    """6 runs for the quadratic in 2 factors out of 9 candidates: all 3,003 choices tried."""
    design = DOptimal(fit="quadratic", runs=6).generate(space(2), seed=seed)
    grid = np.array(list(itertools.product([-1.0, 0.0, 1.0], repeat=2)))
    best = max(
        log_determinant(grid[list(c)], "quadratic")
        for c in itertools.combinations(range(9), 6)
        if np.linalg.matrix_rank(model_matrix(grid[list(c)], model_terms(2, "quadratic"))) == 6
    )
    assert log_determinant(design.coded.to_numpy(), "quadratic") >= best - 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_no_single_exchange_would_be_better(seed):
    """Fedorov's exchange ends where no swap of a new run for a candidate raises the determinant."""
    five = space(5)
    old = LatinHypercube(runs=7).generate(five, seed=seed).table
    candidates = LatinHypercube(runs=40).generate(five, seed=seed + 50).natural
    generator = DOptimal(existing=old, candidates=candidates, added_runs=9, fit="interactions", starts=1)
    chosen = generator.generate(five).coded.to_numpy()
    best, rows = log_determinant(chosen, "interactions"), five.to_coded(candidates)
    for run in range(7, 16):
        for candidate in rows:
            swapped = chosen.copy()
            swapped[run] = candidate
            assert log_determinant(swapped, "interactions") <= best + 1e-4


def test_augmentation_keeps_the_runs_that_exist():
    old = PlackettBurman(centre_points=2).generate(space(4), seed=5)
    new = DOptimal(existing=old.table, fit="quadratic", added_runs=9).generate(space(4), seed=1)
    assert len(new) == len(old) + 9
    first = new.table.iloc[: len(old)]
    pd.testing.assert_frame_equal(first[list(old.space.names)], old.natural, check_exact=True)
    assert list(first["seed"]) == list(old.table["seed"])
    assert list(first["point_type"]) == list(old.table["point_type"])
    assert set(first["block"]) == {1}
    assert set(new.table["block"].iloc[len(old) :]) == {2}
    assert new.table["seed"].is_unique


def test_augmentation_makes_the_larger_model_estimable():
    old = PlackettBurman().generate(space(4))
    assert old.d_efficiency("quadratic") == 0.0
    assert DOptimal(existing=old.table).generate(space(4)).d_efficiency("quadratic") > 20


def test_augmentation_beats_chance():
    old = LatinHypercube(runs=12).generate(space(3), seed=1).table
    chosen = DOptimal(existing=old, added_runs=6).generate(space(3)).coded.to_numpy()
    rng = np.random.default_rng(0)
    start = space(3).to_coded(old)
    random = [log_determinant(np.vstack([start, rng.choice([-1.0, 0, 1], (6, 3))]), "quadratic") for _ in range(300)]
    assert log_determinant(chosen, "quadratic") > max(random)


def test_candidates_in_natural_units():
    candidates = pd.DataFrame({"x0": [0, 0, 2, 2, 1.0], "x1": [0, 2, 0, 2, 1.0]})
    design = DOptimal(fit="interactions", candidates=candidates, runs=4).generate(space(2))
    assert {tuple(row) for row in design.natural.to_numpy()} == {(0, 0), (0, 2), (2, 0), (2, 2)}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"fit": "quadratic", "runs": 5}, "can't carry the 10 terms"),
        ({"fit": "cubic"}, "cubic"),
        ({"existing": pd.DataFrame({"x0": [0.0]})}, "no column for factor 'x1'"),
        ({"existing": pd.DataFrame({"x0": ["a"], "x1": [0], "x2": [0]})}, "'a' in row 1"),
        ({"existing": pd.DataFrame({"x0": [0.0], "x1": [0.0], "x2": [0.0]}), "runs": 1}, "1 exist already"),
    ],
)
def test_what_it_refuses(settings, words):
    with pytest.raises(DesignError, match=words):
        DOptimal(**settings).generate(space(3))


def test_two_hundred_candidates_in_ten_factors_in_less_than_two_seconds():
    """The promise of the documentation; benchmarks/bench_d_optimal.py prints the real time, about a hundredth."""
    ten = space(10)
    existing = LatinHypercube(runs=60).generate(ten, seed=1).table
    candidates = LatinHypercube(runs=200).generate(ten, seed=2).natural
    start = time.perf_counter()
    DOptimal(existing=existing, candidates=candidates, added_runs=30).generate(ten)
    assert time.perf_counter() - start < 2.0


def test_box_behnken_can_be_augmented_in_a_new_block():
    old = BoxBehnken(blocks=3).generate(space(4))
    new = DOptimal(existing=old.table, added_runs=4).generate(space(4))
    assert list(new.table["block"].iloc[-4:]) == [4] * 4
