"""Re-calibration against generalised least squares and SciPy, and its descents against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from analysis.missing_effect.descent import descend
from analysis.missing_effect.fit import LARGEST, at, fit, fits, refits
from tests.analysis.missing_effect.linear import linear, problem_of

TRUTH = np.array([0.2, -0.3, 0.1])


def gls(rows, values, sigma):
    """Return solution, its covariance and χ² of weighted least squares."""
    weights = np.diag(1 / np.asarray(sigma) ** 2)
    covariance = np.linalg.inv(rows.T @ weights @ rows)
    found = covariance @ rows.T @ weights @ values
    rest = values - rows @ found
    return found, covariance, rest @ weights @ rest


@pytest.fixture
def simulator():
    return linear(left=0.04)


@pytest.fixture
def measured(simulator):
    noise = np.random.default_rng(5).normal(0, 0.3, len(simulator.slope))
    return simulator.mean(TRUTH[None], np.array([[0.4, 0, 0, 0]]))[0] + noise


def test_parameters_are_those_of_generalised_least_squares(simulator, measured):
    found = fit(problem_of(simulator, measured), simulator, (0,))
    rows = np.hstack([simulator.slope, simulator.effects[:, :1]])
    solution, _, chi2 = gls(rows, measured - simulator.constant, np.sqrt(0.3**2 + 0.04) * np.ones(9))
    assert np.append(found.x, found.share[0]) == pytest.approx(solution, abs=1e-4)
    assert found.chi2 == pytest.approx(chi2, rel=1e-6)
    assert found.dof == 9 - 4


def test_direct_measurements_are_rows_like_others(simulator, measured):
    problem = problem_of(simulator, measured, direct=(0, 2), truth=np.array([0.5, 0, 0.3]))
    found = fit(problem, simulator, (0,))
    rows = np.vstack([np.hstack([simulator.slope, simulator.effects[:, :1]]), np.eye(4)[[0, 2]]])
    values = np.append(measured - simulator.constant, [0.5, 0.3])
    solution, covariance, chi2 = gls(rows, values, [*np.full(9, np.sqrt(0.13)), 0.2, 0.2])
    assert np.append(found.x, found.share[0]) == pytest.approx(solution, abs=1e-4)
    assert found.chi2 == pytest.approx(chi2, rel=1e-6)
    assert found.dof == 9 + 2 - 4
    # The ranges count as weak knowledge: uncertainties are a little below those without them.
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(np.sqrt(np.diag(covariance)), rel=0.1)
    assert np.all(np.diag(found.covariance) < np.diag(covariance))


def test_a_direct_measurement_of_a_parameter_coded_by_its_logarithm_counts_in_its_own_unit(simulator, measured):
    problem = problem_of(simulator, measured)
    wide = replace(problem.parameters[0], low=0.1, high=10.0, believed=1.0, value=2.0, u=0.05)
    found = fit(replace(problem, parameters=(wide, *problem.parameters[1:])), simulator, (0,))
    weight = np.sqrt(0.13)

    def residuals(v):
        errors = (simulator.slope @ v[:3] + simulator.effects[:, 0] * v[3] + simulator.constant - measured) / weight
        return np.append(errors, (10 ** v[0] - 2.0) / 0.05)

    expected = least_squares(residuals, np.full(4, 0.2), bounds=([-1, -1, -1, 0], [1, 1, 1, LARGEST]), xtol=1e-10)
    assert np.append(found.x, found.share[0]) == pytest.approx(expected.x, abs=1e-3)
    assert found.weighted_slope[-1, 0] == pytest.approx(10 ** found.x[0] * np.log(10) / 0.05)


def test_what_nothing_fixes_is_as_uncertain_as_its_range(simulator, measured):
    simulator.slope[:, 1] = 0.0
    found = fit(problem_of(simulator, measured), simulator)
    assert found.covariance[1, 1] == pytest.approx(1 / 3)


def test_bounds_hold_and_the_solution_there_is_scipys(simulator, measured):
    far = measured + 1.5 * simulator.slope[:, 0]
    found = fit(problem_of(simulator, far), simulator, (0,))
    rows, sigma = np.hstack([simulator.slope, simulator.effects[:, :1]]), np.sqrt(0.13)
    expected = lsq_linear(rows / sigma, (far - simulator.constant) / sigma, ([-1, -1, -1, 0], [1, 1, 1, LARGEST]))
    assert np.append(found.x, found.share[0]) == pytest.approx(expected.x, abs=1e-3)
    assert found.x[0] == pytest.approx(1.0)
    assert found.free.tolist() == [False, True, True, True]


def test_parameters_at_a_bound_take_no_degree_of_freedom(simulator, measured):
    far = measured + 1.5 * simulator.slope[:, 0]
    assert fit(problem_of(simulator, far), simulator, (0,)).dof == 9 - 3


def test_an_effect_with_one_side_stays_at_zero_and_one_with_two_goes_below(simulator):
    measured = simulator.mean(TRUTH[None], np.array([[0, -0.6, 0, 0]]))[0]
    one = fit(problem_of(simulator, measured), simulator, (1,))
    two = fit(problem_of(simulator, measured, two_sided=True), simulator, (1,))
    assert one.share[1] == pytest.approx(0.0, abs=1e-5)
    assert two.share[1] == pytest.approx(-0.6, abs=1e-4)
    assert two.chi2 == pytest.approx(0.0, abs=1e-6)


def test_strengths_end_at_the_largest_share(simulator):
    measured = simulator.mean(TRUTH[None], np.array([[0, 3.0, 0, 0]]))[0]
    assert fit(problem_of(simulator, measured), simulator, (1,)).share[1] == pytest.approx(LARGEST)


def test_fits_side_by_side_are_fits_one_by_one(simulator, measured):
    problem = problem_of(simulator, measured)
    base = fit(problem, simulator)
    both = fits(problem, simulator, [(0, 1), (2, 3)], [base, base])
    for found, effects in zip(both, [(0, 1), (2, 3)], strict=True):
        alone = fit(problem, simulator, effects)
        assert found.effects == effects
        assert found.chi2 == pytest.approx(alone.chi2, rel=1e-5)


def test_refits_leave_out_what_they_should(simulator, measured):
    whole = fit(problem_of(simulator, measured), simulator, (0,))
    rows = np.hstack([simulator.slope, simulator.effects[:, :1]])
    kept = np.ones((2, 9), bool)
    kept[0, 3], kept[1, [4, 5]] = False, False
    for part, left in zip(refits([whole, whole], simulator, kept), kept, strict=True):
        values = (measured - simulator.constant)[left]
        solution, _, chi2 = gls(rows[left], values, np.full(left.sum(), np.sqrt(0.13)))
        assert np.append(part.x, part.share[0]) == pytest.approx(solution, abs=1e-3)
        assert part.chi2 == pytest.approx(chi2, rel=1e-5)
        assert part.dof == left.sum() - 4


def test_nothing_is_fitted_at_a_point(simulator, measured):
    here = at(problem_of(simulator, measured), simulator, TRUTH, np.zeros(4))
    assert here.z == pytest.approx((simulator.mean(TRUTH[None], np.zeros((1, 4)))[0] - measured) / np.sqrt(0.13))


def test_without_parameters_only_the_strength_is_fitted():
    simulator = linear(p=0)
    measured = simulator.mean(np.zeros((1, 0)), np.array([[0, 0, 0.5, 0]]))[0]
    assert fit(problem_of(simulator, measured), simulator, (2,)).share[2] == pytest.approx(0.5, abs=1e-4)
    assert fit(problem_of(simulator, measured), simulator).dof == 9


def test_deviance_charges_for_uncertainty_as_a_likelihood_does(simulator, measured):
    found = fit(problem_of(simulator, measured), simulator)
    log_likelihood = -0.5 * (found.z**2).sum() - np.log(found.sigma / 0.3).sum()
    assert found.deviance == pytest.approx(-2 * log_likelihood)


def test_aicc_is_the_textbook_formula(simulator, measured):
    found = fit(problem_of(simulator, measured), simulator, (0,))
    assert found.aicc == pytest.approx(found.deviance + 2 * 4 + 2 * 4 * 5 / (9 - 4 - 1))


def test_descents_end_where_scipys_do():
    def rosenbrock(v):
        return np.stack([10 * (v[..., 1] - v[..., 0] ** 2), 1 - v[..., 0]], axis=-1)

    def residuals(v, running):
        slope = np.zeros((len(v), 2, 2))
        slope[:, 0, 0], slope[:, 0, 1], slope[:, 1, 0] = -20 * v[:, 0], 10.0, -1.0
        return rosenbrock(v), slope

    rng = np.random.default_rng(0)
    start, low, high = rng.uniform(-1, 1, (20, 2)), np.full((20, 2), -1.5), rng.uniform([0.3, 0.2], 2.0, (20, 2))
    found = descend(residuals, np.clip(start, low, high), low, high)
    for end, begin, a, b in zip(found, start, low, high, strict=True):
        expected = least_squares(rosenbrock, np.clip(begin, a + 1e-9, b - 1e-9), bounds=(a, b), xtol=1e-12, ftol=1e-12)
        assert (rosenbrock(end) ** 2).sum() == pytest.approx((rosenbrock(expected.x) ** 2).sum(), abs=1e-3)
