"""Predictions of tests that were left out against refits written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.missing_effect.fit import fit
from analysis.missing_effect.held_out import held_out_errors, left_out, root_mean_square
from tests.analysis.missing_effect.linear import linear, problem_of

TRUTH = np.array([0.2, -0.3, 0.1])


@pytest.fixture
def simulator():
    return linear(left=0.02)


@pytest.fixture
def measured(simulator):
    return simulator.mean(TRUTH[None], np.zeros((1, 4)))[0] + np.random.default_rng(1).normal(0, 0.3, 9)


@pytest.mark.parametrize("effects", [(), (0,)])
def test_errors_are_those_of_refits_without_the_test(simulator, measured, effects):
    tests = ["a", "a", "b", "c", "c", "d", "e", "f", "g"]
    problem = problem_of(simulator, measured + 0.3 * len(effects) * simulator.effects[:, 0], tests=tests)
    errors = held_out_errors([fit(problem, simulator, effects)], simulator)[0]
    rows = np.hstack([simulator.slope, simulator.effects[:, list(effects)]])
    known = np.diag([3.0, 3.0, 3.0, 12 / 1.3**2][: rows.shape[1]])  # what the ranges say
    for test in set(tests):
        out = np.array([t == test for t in tests])
        values = problem.measured - simulator.constant
        information = rows[~out].T @ rows[~out] / 0.11
        found = np.linalg.solve(information, rows[~out].T @ values[~out] / 0.11)
        spread = np.diag(rows[out] @ np.linalg.inv(information + known) @ rows[out].T)
        assert errors[out] == pytest.approx((rows[out] @ found - values[out]) / np.sqrt(0.11 + spread), abs=2e-3)


def test_several_models_at_once_are_models_one_by_one(simulator, measured):
    problem = problem_of(simulator, measured)
    models = [fit(problem, simulator, (k,)) for k in range(4)]
    for model, errors in zip(models, held_out_errors(models, simulator), strict=True):
        assert errors == pytest.approx(held_out_errors([model], simulator)[0], abs=1e-4)
    assert held_out_errors([], simulator) == []


def test_a_test_with_a_parameter_of_its_own_keeps_its_first_half(simulator, measured):
    problem = problem_of(simulator, measured, tests=["a", "a", "a", "b", "b", "c", "d", "e", "f"])
    own = (replace(problem.parameters[0], test="a"), *problem.parameters[1:])
    problem = replace(problem, parameters=own)
    assert left_out(problem, "a").tolist() == [False, False, True] + [False] * 6
    assert left_out(problem, "b").tolist() == [False] * 3 + [True, True] + [False] * 4


def test_what_would_leave_fewer_measurements_than_unknowns_is_not_predicted(simulator, measured):
    problem = problem_of(simulator, measured, tests=["big"] * 7 + ["x", "y"])
    errors = held_out_errors([fit(problem, simulator)], simulator)[0]
    assert np.isnan(errors[:7]).all()
    assert np.isfinite(errors[7:]).all()


def test_nothing_predicted_is_no_error():
    assert np.isnan(root_mean_square(np.array([np.nan])))
    assert root_mean_square(np.array([3.0, np.nan, 4.0])) == pytest.approx(np.sqrt(12.5))


def test_predictions_of_a_complete_model_are_off_by_one_standard_uncertainty(simulator):
    rng = np.random.default_rng(4)
    z = []
    for _ in range(60):
        values = simulator.mean(TRUTH[None], np.zeros((1, 4)))[0] + rng.normal(0, np.sqrt(0.11), 9)
        z.append(held_out_errors([fit(problem_of(simulator, values), simulator)], simulator)[0])
    assert root_mean_square(np.array(z)) == pytest.approx(1.0, abs=0.15)
