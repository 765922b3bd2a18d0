"""The surrogate against plain Gaussian-process regression, pair by pair and point by point."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from analysis.errors import AnalysisError
from analysis.missing_effect.kernel import REACH, ROUGH, ROUGH_REACH, SHARE_REACH, VAGUE, Points, likeness
from analysis.missing_effect.surrogate import LEAST, Surrogate, minus_log_posterior

P, K = 3, 2
SCALE = {"linear": 0.6, "quadratic": 0.2, "smooth": 0.15, "curve": 0.5, "interaction": 0.3, "effect_smooth": 0.2}


def points(count: int, seed: int = 0) -> Points:
    """Return points of which a third are without effects, the others with one each."""
    rng = np.random.default_rng(seed)
    share = np.zeros((count, K))
    for i in range(count):
        if i % 3:
            share[i, i % 3 - 1] = rng.uniform(0.25, 1.0)
    return Points(rng.uniform(-1, 1, (count, P)), share)


def covariance(x, s, y, t, scale, size) -> float:
    """Return the prior covariance of two points, written out."""
    apart = sum((a - b) ** 2 for a, b in zip(x, y, strict=True))
    near = (np.exp(-apart / (2 * REACH**2)) + ROUGH * np.exp(-apart / (2 * ROUGH_REACH**2))) / (1 + ROUGH)
    dot = sum(a * b for a, b in zip(x, y, strict=True))
    bent = dot**2 + sum(a**3 * b**3 for a, b in zip(x, y, strict=True))
    total = VAGUE**2 + scale["linear"] ** 2 * dot + scale["quadratic"] ** 2 * bent + scale["smooth"] ** 2 * near
    for k in range(K):
        a, b = s[k], t[k]
        bend = (1 - abs(a)) * (1 - abs(b)) + a * b
        own = scale["curve"] ** 2 * bend + scale["interaction"] ** 2 * dot
        own += scale["effect_smooth"] ** 2 * near * np.exp(-((a - b) ** 2) / (2 * SHARE_REACH**2))
        total += a * b * (VAGUE**2 + size[k] ** 2 * own)
    return total


def matrix(a: Points, b: Points, scale, size) -> np.ndarray:
    """Return the prior covariance between two sets of points, a pair at a time."""
    return np.array(
        [
            [covariance(x, s, y, t, scale, size) for y, t in zip(b.x, b.share, strict=True)]
            for x, s in zip(a.x, a.share, strict=True)
        ]
    )


def curved(at: Points) -> np.ndarray:
    """Return three responses, curved and with interactions."""
    x, s = at.x, at.share
    first = 30 + 4 * x[:, 0] - 2 * x[:, 1] ** 2 + 3 * s[:, 0] * (1 + 0.3 * x[:, 2])
    second = 0.5 + 0.02 * np.sin(2 * x[:, 2]) + 0.03 * s[:, 1] / (0.5 + s[:, 1])
    return np.stack([first, second, first * second], axis=1)


@pytest.fixture(scope="module")
def noisy() -> tuple[Points, np.ndarray, Surrogate]:
    known = points(45)
    values = curved(known)
    values = values + np.random.default_rng(1).normal(0, 0.1 * values.std(axis=0), values.shape)
    return known, values, Surrogate(known, values, ["a", "b", "c"])


def test_kernel_is_the_sum_that_is_written_down():
    a, b, size = points(8), points(5, 3), np.array([0.7, 1.6])
    assert likeness(a, b).combined(SCALE, size) == pytest.approx(matrix(a, b, SCALE, size), rel=1e-12)


def test_kernel_of_two_effects_at_once_is_the_sum_of_theirs_and_negative_shares_count():
    a = Points(np.zeros((1, P)), np.array([[0.5, -0.8]]))
    b = Points(np.zeros((1, P)), np.array([[-0.3, 0.6]]))
    size = np.ones(K)
    assert likeness(a, b).combined(SCALE, size) == pytest.approx(matrix(a, b, SCALE, size), rel=1e-12)


def test_kernel_is_a_covariance():
    for shares in (1.0, -1.0):
        at = Points(points(30).x, shares * points(30).share)
        assert np.linalg.eigvalsh(likeness(at, at).combined(SCALE, np.ones(K))).min() > -1e-9


def test_mean_and_variance_are_those_of_plain_gaussian_process_regression(noisy):
    known, values, surrogate = noisy
    at, doubt = points(7, 9), 45 / (45 - 7 - K)
    for i, r in enumerate(surrogate.responses):
        runs = matrix(known, known, r.scale, r.size) + (r.scale["noise"] ** 2 + LEAST**2) * np.eye(len(known))
        scaled = (values[:, i] - values[:, i].mean()) / values[:, i].std()
        for j in range(len(at)):
            one = at.rows(np.array([j]))
            near = matrix(one, known, r.scale, r.size)[0]
            mean = values[:, i].mean() + values[:, i].std() * near @ np.linalg.solve(runs, scaled)
            left = matrix(one, one, r.scale, r.size)[0, 0] - near @ np.linalg.solve(runs, near)
            assert surrogate.mean(one.x, one.share)[0, i] == pytest.approx(mean, rel=1e-8)
            assert surrogate.variance(one.x, one.share)[0, i] == pytest.approx(
                doubt * values[:, i].var() * left, rel=1e-5
            )


def test_many_points_at_once_are_points_one_by_one(noisy):
    at = points(12, 4)
    whole = noisy[2].mean(at.x, at.share), noisy[2].variance(at.x, at.share)
    for j in range(len(at)):
        one = at.rows(np.array([j]))
        assert noisy[2].mean(one.x, one.share)[0] == pytest.approx(whole[0][j], rel=1e-7)
        assert noisy[2].variance(one.x, one.share)[0] == pytest.approx(whole[1][j], rel=1e-4)


def test_slope_of_the_posterior_is_its_derivative():
    known = points(20)
    near, size = likeness(known, known), np.ones(K)
    kernels = np.stack([np.eye(20), *near.terms(size).values()])
    rng = np.random.default_rng(2)
    logs, middle, spread = rng.normal(-1, 0.5, 7), rng.normal(-1, 0.5, 7), rng.uniform(0.5, 2, 7)
    rest = rng.normal(size=20), 100 * (1 + near.plain), kernels, middle, spread
    numeric = approx_fprime(logs, lambda v: minus_log_posterior(v, *rest)[0], 1e-6)
    assert minus_log_posterior(logs, *rest)[1] == pytest.approx(numeric, rel=1e-3, abs=1e-3)


def test_straight_and_quadratic_responses_are_recovered():
    known, at = points(60), points(20, 5)

    def plain(q: Points) -> np.ndarray:
        return (7 + q.x @ [1.0, -2.0, 0.5] + 0.8 * q.x[:, 0] * q.x[:, 1] + q.share @ [2.0, -1.0])[:, None]

    surrogate = Surrogate(known, plain(known), ["plain"])
    assert surrogate.mean(at.x, at.share) == pytest.approx(plain(at), abs=0.02)


def test_predictions_are_off_by_as_much_as_they_say():
    z = []
    for seed in range(6):
        known = points(45, seed)
        values = curved(known)
        rng = np.random.default_rng(seed)
        surrogate = Surrogate(known, values + rng.normal(0, 0.1 * values.std(axis=0), values.shape), ["a", "b", "c"])
        at = points(60, 100 + seed)
        z.append((surrogate.mean(at.x, at.share) - curved(at)) / np.sqrt(surrogate.variance(at.x, at.share)))
    assert 0.7 < np.sqrt(np.mean(np.array(z) ** 2)) < 1.3


def test_scatter_from_seed_to_seed_is_found(noisy):
    known = points(90, 8)
    clean = curved(known)
    scatter = 0.2 * clean.std(axis=0)
    values = clean + np.random.default_rng(6).normal(0, scatter, clean.shape)
    assert Surrogate(known, values, ["a", "b", "c"]).noise == pytest.approx(scatter, rel=0.3)


def test_a_failed_run_is_left_out_of_that_response_alone(noisy):
    known, values, _ = noisy
    holed = values.copy()
    holed[[3, 17], 1] = np.nan
    found, at = Surrogate(known, holed, ["a", "b", "c"]), points(6, 2)
    kept = np.isfinite(holed[:, 1])
    alone = Surrogate(known.rows(kept), holed[kept], ["a", "b", "c"])
    assert found.mean(at.x, at.share)[:, 1] == pytest.approx(alone.mean(at.x, at.share)[:, 1], rel=1e-9)
    assert found.mean(at.x, at.share)[:, 0] == pytest.approx(noisy[2].mean(at.x, at.share)[:, 0], rel=1e-9)


def test_a_response_that_never_changes_stays_what_it_is():
    known = points(20)
    surrogate = Surrogate(known, np.full((20, 1), 4.2), ["still"])
    assert surrogate.mean(points(5, 1).x, points(5, 1).share) == pytest.approx(4.2)


def test_units_shift_and_scale_predictions_and_nothing_else(noisy):
    known, values, surrogate = noisy
    at = points(6, 3)
    other = Surrogate(known, 1000 * values - 5, ["a", "b", "c"])
    assert other.mean(at.x, at.share) == pytest.approx(1000 * surrogate.mean(at.x, at.share) - 5, rel=1e-5)
    assert other.variance(at.x, at.share) == pytest.approx(1e6 * surrogate.variance(at.x, at.share), rel=1e-3)


def test_too_few_runs_are_told_with_the_name_of_the_response():
    known, values = points(10), np.full((10, 2), np.nan)
    values[:, 0] = np.arange(10.0)
    values[:2, 1] = 1.0
    with pytest.raises(AnalysisError, match=r"heap\.angle: 2 of 10 runs"):
        Surrogate(known, values, ["drum.angle", "heap.angle"])
