"""The projected score against generalised least squares, statsmodels and simulation."""

from __future__ import annotations

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats

from analysis.missing_effect.fit import fit
from analysis.missing_effect.score import DELTAS, POWER, score_effects
from tests.analysis.missing_effect.linear import Linear, linear, problem_of

TRUTH, NOTHING = np.array([0.2, -0.3, 0.1]), np.zeros((1, 4))


def scored(simulator, measured, draws=500, seed=1, **flags):
    """Return the re-calibrated model and the scores."""
    base = fit(problem_of(simulator, measured, **flags), simulator)
    return base, score_effects(base, simulator, draws, seed)


@pytest.fixture
def simulator():
    return linear()


@pytest.fixture
def measured(simulator):
    noise = np.random.default_rng(3).normal(0, 0.3, 9)
    return simulator.mean(TRUTH[None], np.array([[0.15, 0, 0, 0]]))[0] + noise


def test_square_of_the_score_is_the_drop_of_chi2_that_a_refit_gives(simulator, measured):
    base, scores = scored(simulator, measured, two_sided=True)
    for k in range(4):
        drop = base.chi2 - fit(base.problem, simulator, (k,)).chi2
        assert scores.score[k] ** 2 == pytest.approx(drop, rel=1e-3, abs=1e-3)


def test_square_of_the_score_is_statsmodels_lagrange_multiplier(simulator, measured):
    """Its version divides by the estimated variance, n r'Pr / r'r; ours knows the variance."""
    base, scores = scored(simulator, measured, two_sided=True)
    residual = (measured - simulator.mean(base.x[None], NOTHING)[0]) / 0.3
    for k in range(4):
        full = np.column_stack([simulator.slope, simulator.effects[:, k]]) / 0.3
        found = sm.OLS((measured - simulator.constant) / 0.3, full).fit()
        restricted = sm.OLS((measured - simulator.constant) / 0.3, full[:, :3]).fit()
        multiplier, _, _ = found.compare_lm_test(restricted, use_lr=False)
        if abs(multiplier) > 0:
            assert scores.score[k] ** 2 == pytest.approx(multiplier * residual @ residual / 9, rel=1e-3, abs=1e-3)


def test_eta_and_rho_by_hand():
    """One parameter along the first axis: what of an effect lies along it can't be told from it."""
    simulator = Linear([[1.0], [0.0], [0.0]], [[3.0, 0.0, 1.0], [4.0, 2.0, 0.0], [0.0, 2.0, 0.0]])
    _, scores = scored(simulator, np.array([0.1, 0.2, -0.1]), u=0.5)
    assert scores.eta == pytest.approx([16 / 25, 1.0, 0.0], abs=1e-9)
    assert scores.rho[0, 1] == pytest.approx(1 / np.sqrt(2))
    assert scores.rho[0, 2] == 0.0
    assert scores.score[2] == 0.0


def test_a_parameter_measured_directly_imitates_less():
    simulator = Linear([[1.0], [0.0]], [[1.0], [0.0]])
    measured = np.array([0.0, 0.0])
    eta = [
        scored(simulator, measured, u=1.0, direct=(0,), u_direct=u, truth=np.zeros(1))[1].eta[0]
        for u in (1e6, 1.0, 1e-3)
    ]
    assert eta == pytest.approx([0.0, 0.5, 1.0], abs=1e-3)


def test_a_parameter_at_its_bound_imitates_nothing():
    simulator = Linear([[1.0], [0.0]], [[1.0], [0.5]])
    base, scores = scored(simulator, np.array([5.0, 0.0]))
    assert not base.free[0]
    assert scores.eta[0] == pytest.approx(1.0)


def test_one_sided_effects_are_not_found_with_the_wrong_sign(simulator):
    measured = simulator.mean(TRUTH[None], np.array([[-0.5, 0, 0, 0]]))[0]
    _, one = scored(simulator, measured)
    _, two = scored(simulator, measured, two_sided=True)
    assert one.score[0] == 0.0
    assert one.adjusted_p[0] == 1.0
    assert two.score[0] < -3
    assert two.adjusted_p[0] < 0.01


def test_an_effect_that_saturates_or_starts_late_is_seen_at_the_better_strength():
    class Saturating(Linear):
        def mean(self, x, share):
            return super().mean(x, np.column_stack([np.minimum(share[:, 0], 0.4), np.maximum(share[:, 1] - 0.6, 0)]))

    effects = np.random.default_rng(1).normal(size=(9, 2)) * 4
    simulator = Saturating(linear().slope, effects)
    for k, share in ((0, 0.4), (1, 1.0)):
        beta = np.zeros((1, 2))
        beta[0, k] = share
        base, scores = scored(simulator, simulator.mean(TRUTH[None], beta)[0])
        assert scores.adjusted_p[k] < 0.01
        assert scores.score[k] ** 2 == pytest.approx(base.chi2, rel=1e-2)
    assert DELTAS == (0.4, 1.0)


@pytest.mark.parametrize("two_sided", [False, True])
def test_the_largest_score_is_significant_by_chance_as_often_as_it_says(two_sided):
    simulator = linear(7)
    rng, count = np.random.default_rng(99), 250
    least = []
    for trial in range(count):
        measured = simulator.mean(TRUTH[None], NOTHING)[0] + rng.normal(0, 0.3, 9)
        least.append(scored(simulator, measured, draws=300, seed=trial, two_sided=two_sided)[1].adjusted_p.min())
    for level in (0.05, 0.2):
        low, high = stats.binom.interval(0.999, count, level)
        assert low <= (np.array(least) <= level).sum() <= high


def test_at_the_detection_limit_eight_in_ten_are_seen():
    simulator = linear(5)
    nothing = simulator.mean(TRUTH[None], NOTHING)[0]
    limit = scored(simulator, nothing)[1].detectable_share
    rng, count = np.random.default_rng(9), 200
    beta = np.zeros((1, 4))
    beta[0, 2] = limit[2]
    truth = simulator.mean(TRUTH[None], beta)[0]
    scores = [scored(simulator, truth + rng.normal(0, 0.3, 9), draws=300)[1] for _ in range(count)]
    seen = sum(s.score[2] >= s.threshold for s in scores)
    low, high = stats.binom.interval(0.999, count, 0.8)
    assert low <= seen <= high


def test_the_detection_limit_of_what_is_linear_is_threshold_and_power_over_what_full_strength_shows(
    simulator, measured
):
    base, scores = scored(simulator, measured)
    slope = simulator.slope / 0.3
    rest = np.eye(9) - slope @ np.linalg.pinv(slope)
    shows = np.linalg.norm(rest @ simulator.effects / 0.3, axis=0)
    assert base.free.all()
    assert scores.detectable_share == pytest.approx((scores.threshold + POWER) / shows, rel=1e-3)


def test_what_re_calibration_imitates_wholly_has_no_detection_limit():
    simulator = Linear(linear().slope, linear().slope[:, :1])
    assert scored(simulator, simulator.mean(TRUTH[None], np.zeros((1, 1)))[0])[1].detectable_share[0] > 1e5


def test_the_same_seed_gives_the_same_p(simulator, measured):
    first, again, other = (scored(simulator, measured, seed=s)[1].adjusted_p for s in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
