"""Proposals of what to measure next: the planted best one is found, and what is said of it is right."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.missing_effect.next_measurement import (
    LEAST_GAIN,
    NEW_TEST,
    PARAMETER,
    REPEAT,
    Option,
    options,
    outlook,
    part_rivals,
    see_more,
)
from analysis.missing_effect.search import search
from tests.analysis.missing_effect.linear import Linear, linear, problem_of

TRUTH = np.array([0.2, -0.3, 0.1])


@pytest.fixture(scope="module")
def alike():
    """A simulator with two effects that look alike, and what was found of measurements with the first in."""
    simulator = linear(m=11)
    simulator.effects[:, 1] = simulator.effects[:, 0] + 0.02 * simulator.effects[:, 3]
    measured = simulator.mean(TRUTH[None], np.array([[0.6, 0, 0, 0]]))[0] + np.random.default_rng(2).normal(0, 0.3, 11)
    return simulator, search(problem_of(simulator, measured), simulator, draws=300)


def new_tests(separating: int, count: int = 4) -> Linear:
    """Return tests not made yet, of which one sees the first effect and not the second."""
    simulator = linear(20, m=count)
    simulator.effects[:, 1] = simulator.effects[:, 0]
    simulator.effects[separating, :2] = [4.0, -4.0]
    return simulator


@pytest.mark.parametrize("planted", [0, 3])
def test_the_test_that_separates_two_rivals_is_found(alike, planted):
    _, found = alike
    new = new_tests(planted)
    wanted = options(found, [f"n{i}" for i in range(4)], [0.3] * 4)
    proposal = part_rivals(found.rivals, new, wanted)
    assert proposal.option == Option(NEW_TEST, f"n{planted}", 0.3)
    assert set(proposal.between) == {0, 1}
    for k, value in proposal.predictions.items():
        fit = next(t.fit for t in found.rivals if t.effects == (k,))
        assert value == pytest.approx(new.mean(fit.x[None], fit.share[None])[0, planted])


def test_a_test_that_parts_the_best_from_all_rivals_goes_before_one_that_parts_it_from_one():
    simulator = linear(m=11)
    simulator.effects[:, 1] = simulator.effects[:, 0] + 0.02 * simulator.effects[:, 3]
    simulator.effects[:, 2] = simulator.effects[:, 0] - 0.02 * simulator.effects[:, 3]
    measured = simulator.mean(TRUTH[None], np.array([[0.6, 0, 0, 0]]))[0]
    found = search(problem_of(simulator, measured), simulator, draws=300)
    assert len(found.rivals) == 3
    new, best = linear(20, m=2), found.rivals[0].effects[0]
    others = [t.effects[0] for t in found.rivals[1:]]
    new.effects[:, best] = 4.0
    new.effects[0, others] = [4.0, -9.0]
    new.effects[1, others] = [0.0, -1.0]
    wanted = options(found, ["one", "all"], [0.3, 0.3])[:2] + tuple(
        Option(o.kind, o.label, 1e6) for o in options(found, [], [])
    )
    assert part_rivals(found.rivals, new, wanted).option.label == "all"
    new.effects[1, others] = [4.0, 3.0]  # a little from each is less than plainly from one
    assert part_rivals(found.rivals, new, wanted).option.label == "one"


def test_separation_is_the_difference_over_all_its_uncertainties(alike):
    _, found = alike
    new = new_tests(2)
    proposal = part_rivals(found.rivals, new, options(found, list("abcd"), [0.5] * 4))
    a, b = (t.fit for t in found.rivals if t.effects in ((0,), (1,)))
    spread = []
    for fit in (a, b):
        row = np.append(new.slope[2], new.effects[2, fit.effects[0]])
        spread.append(row @ fit.covariance @ row)
    apart = abs(np.diff(list(proposal.predictions.values()))[0])
    assert proposal.separation == pytest.approx(apart / np.sqrt(0.25 + sum(spread)), rel=1e-3)


def test_nothing_is_proposed_where_nothing_separates(alike):
    _, found = alike
    new = new_tests(0)
    new.effects[0, :2] = 0.0
    assert part_rivals(found.rivals, new, options(found, list("abcd"), [0.3] * 4)) is None


def test_the_measurement_that_shows_most_is_proposed_where_too_little_is_seen():
    """Every effect is imitated by the first parameter: measuring that one directly shows them all."""
    slope = np.random.default_rng(0).normal(size=(5, 2))
    effects = slope[:, :1] @ np.array([[1.5, 2.0]]) + 0.05 * np.random.default_rng(1).normal(size=(5, 2))
    simulator = Linear(slope, effects)
    found = search(problem_of(simulator, simulator.mean(np.zeros((1, 2)), np.zeros((1, 2)))[0]), simulator, draws=300)
    wanted = options(found, [], [])
    proposal = see_more(found.base.fit, simulator, None, wanted)
    assert (proposal.option.kind, proposal.option.label) == (PARAMETER, "p0")
    assert proposal.separation > LEAST_GAIN


def test_the_gain_is_that_of_the_enlarged_least_squares_problem():
    simulator = linear(4, m=7)
    found = search(problem_of(simulator, simulator.mean(TRUTH[None], np.zeros((1, 4)))[0]), simulator, draws=300)
    new = linear(6, m=1)
    wanted = [Option(NEW_TEST, "n", 0.1), *(Option(o.kind, o.label, 1e6) for o in options(found, [], []))]
    proposal = see_more(found.base.fit, simulator, new, tuple(wanted))
    rows, signs = simulator.slope / 0.3, simulator.effects / 0.3
    more, more_signs = np.vstack([rows, new.slope / 0.1]), np.vstack([signs, new.effects / 0.1])

    def shown(j, e):
        return np.diag(e.T @ (np.eye(len(j)) - j @ np.linalg.pinv(j)) @ e)

    assert proposal.separation == pytest.approx(
        np.mean(0.5 * np.log(shown(more, more_signs) / shown(rows, signs))), rel=1e-3
    )


def test_options_are_new_tests_repeats_and_parameters(alike):
    found = alike[1]
    wanted = options(found, ["new"], [0.7])
    assert [o.kind for o in wanted] == [NEW_TEST] + [REPEAT] * 11 + [PARAMETER] * 3
    assert [o.u for o in wanted[:2]] == [0.7, 0.15]
    assert len(outlook(found.base.fit, linear(20, m=1)).values) == len(wanted)
