"""The five verdicts: each is reached, by what it should be, and for the reason that is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.missing_effect.problem import Problem
from analysis.missing_effect.search import RIVAL, Search, search
from analysis.missing_effect.tables import candidate_table, error_table, parameter_table
from analysis.missing_effect.verdict import Levels, decide
from analysis.missing_effect.wording import sentences, what_to_do
from tests.analysis.missing_effect.linear import Linear, linear, problem_of

TRUTH = np.array([0.2, -0.3, 0.1])


def beta(count=4, **shares) -> np.ndarray:
    """Return shares (1, count) with some named as k0=0.5."""
    found = np.zeros((1, count))
    for name, share in shares.items():
        found[0, int(name[1:])] = share
    return found


def searched(simulator, truth, noise=True, more=0.0, seed=2, **asked) -> Search:
    """Return the search for what makes measurements at `truth`."""
    rng, m = np.random.default_rng(seed), len(simulator.slope)
    measured = simulator.mean(TRUTH[None], truth)[0] + noise * rng.normal(0, 0.3, m) + more
    return search(problem_of(simulator, measured, **asked), simulator, draws=500)


@pytest.fixture
def simulator() -> Linear:
    return linear(m=11)


def test_a_complete_model_misses_nothing(simulator):
    found = searched(simulator, beta())
    verdict = decide(found)
    assert (verdict.word, verdict.named, verdict.why) == ("nothing_missing", (), "fits")
    assert "Nothing is missing that these data could show." in sentences(found, verdict)


def test_an_effect_that_stands_alone_is_named_with_its_strength(simulator):
    found = searched(simulator, beta(k2=0.6))
    verdict = decide(found)
    assert verdict.word == "effect"
    assert verdict.named[0].effects == (2,)
    row = candidate_table(found).iloc[0]
    assert row["effect"] == "e2"
    assert abs(row["strength"] - 0.6) < 3 * row["u_strength"]
    assert row["in_class"]
    assert verdict.named[0].held_out_error < found.base.held_out_error


def test_effects_that_look_alike_are_named_together(simulator):
    simulator.effects[:, 1] = simulator.effects[:, 0] + 0.05 * simulator.effects[:, 3]
    found = searched(simulator, beta(k0=0.6))
    verdict = decide(found)
    assert verdict.word == "one_of"
    assert {t.effects for t in verdict.named} == {(0,), (1,)}
    assert found.scores.rho[0, 1] > 0.95


def test_what_no_effect_explains_is_something_else(simulator):
    outside = 3 * np.random.default_rng(7).normal(size=11)
    found = searched(simulator, beta(), more=outside)
    verdict = decide(found)
    assert (verdict.word, verdict.why) == ("something_else", "none_fits")
    assert verdict.named == ()
    assert "no effect of the library explains" in " ".join(sentences(found, verdict))


def test_two_effects_at_once_are_suggested(simulator):
    found = searched(simulator, beta(k0=0.6, k2=0.8))
    verdict = decide(found)
    assert (verdict.word, verdict.why) == ("something_else", "pair")
    assert set(verdict.named[0].effects) == {0, 2}
    assert "a suggestion, not a finding" in " ".join(sentences(found, verdict))


def test_data_that_could_show_nothing_cannot_tell():
    slope = np.random.default_rng(0).normal(size=(4, 3))
    imitated = slope @ np.random.default_rng(1).normal(size=(3, 4)) * 0.3
    found = searched(Linear(slope, imitated), beta(), noise=False)
    verdict = decide(found)
    assert (verdict.word, verdict.why) == ("cannot_tell", "blind")
    assert "can't tell whether something is missing" in " ".join(sentences(found, verdict))


def test_with_nothing_left_to_check_an_explanation_by_none_is_named():
    simulator = linear(m=4)
    found = searched(simulator, beta(k0=1.0), noise=False)
    verdict = decide(found)
    assert (verdict.word, verdict.why, verdict.named) == ("cannot_tell", "unchecked", ())
    assert "nothing is left to check it by" in " ".join(sentences(found, verdict))


def test_an_addition_that_predicts_no_better_is_not_named(simulator):
    found = searched(simulator, beta(k2=0.6))
    worse = tuple(replace(t, held_out=np.full(11, 99.0)) for t in found.trials)
    verdict = decide(replace(found, trials=worse))
    assert (verdict.word, verdict.why) == ("cannot_tell", "no_better_prediction")


def test_without_candidates_a_misfit_is_something_else():
    simulator = Linear(linear(m=11).slope, np.zeros((11, 0)))
    found = searched(simulator, np.zeros((1, 0)), more=3 * np.random.default_rng(7).normal(size=11))
    assert (decide(found).word, decide(found).why) == ("something_else", "no_candidates")


def test_rivals_are_those_within_odds_of_a_hundred(simulator):
    found = searched(simulator, beta(k2=0.6))
    for trial, row in zip(found.trials, candidate_table(found).to_dict("records"), strict=True):
        assert row["in_class"] == (trial.fit.deviance - found.trials[0].fit.deviance <= RIVAL)
        assert row["in_class"] == (trial in found.rivals)


def test_levels_can_be_moved(simulator):
    found = searched(simulator, beta(k2=0.6))
    assert decide(found, Levels(score=0.0, misfit=0.0)).word == "nothing_missing"
    assert decide(found, Levels(fit=1.0)).word == "something_else"


def _reordered(simulator: Linear, problem: Problem, rows, columns, effects) -> tuple[Linear, Problem]:
    changed = Linear(
        simulator.slope[np.ix_(rows, columns)], simulator.effects[np.ix_(rows, effects)], simulator.constant[rows]
    )
    return changed, replace(
        problem,
        labels=tuple(problem.labels[i] for i in rows),
        tests=tuple(problem.tests[i] for i in rows),
        measured=problem.measured[rows],
        u=problem.u[rows],
        parameters=tuple(problem.parameters[j] for j in columns),
        candidates=tuple(problem.candidates[k] for k in effects),
    )


def _told(found: Search) -> dict[str, tuple[float, ...]]:
    table = candidate_table(found)
    columns = ["strength", "u_strength", "chi2_drop", "score", "eta", "held_out_error", "detection_limit"]
    return {row["effect"]: tuple(row[c] for c in columns) for row in table.to_dict("records")}


def test_the_order_of_responses_parameters_and_candidates_does_not_matter(simulator):
    measured = simulator.mean(TRUTH[None], beta(k2=0.3))[0] + np.random.default_rng(2).normal(0, 0.3, 11)
    problem = problem_of(simulator, measured, direct=(1,), truth=TRUTH)
    first = search(problem, simulator, draws=4000)
    turned = _reordered(simulator, problem, np.arange(11)[::-1], [2, 0, 1], [3, 1, 0, 2])
    second = search(turned[1], turned[0], draws=4000)
    assert decide(first).word == decide(second).word
    assert first.scores.threshold == pytest.approx(second.scores.threshold, rel=0.05)
    for effect, numbers in _told(first).items():
        assert _told(second)[effect][:-1] == pytest.approx(numbers[:-1], rel=5e-3, abs=5e-3)


def test_units_and_zero_of_a_response_do_not_matter(simulator):
    measured = simulator.mean(TRUTH[None], beta(k2=0.3))[0] + np.random.default_rng(2).normal(0, 0.3, 11)
    problem = problem_of(simulator, measured)
    scale, shift = np.geomspace(1e-3, 1e3, 11), np.linspace(-50, 50, 11)
    other = Linear(
        simulator.slope * scale[:, None], simulator.effects * scale[:, None], simulator.constant * scale + shift
    )
    first = search(problem, simulator, draws=300)
    second = search(replace(problem, measured=measured * scale + shift, u=problem.u * scale), other, draws=300)
    for effect, numbers in _told(first).items():
        assert _told(second)[effect] == pytest.approx(numbers, rel=2e-3, abs=2e-3)


def test_effects_put_in_wholly_are_told_in_shares_of_the_whole(simulator):
    found = searched(simulator, beta(k2=1.0), all_or_nothing=True)
    verdict = decide(found)
    assert verdict.word == "effect"
    assert "of its whole difference" in sentences(found, verdict)[1]


def test_parameters_at_an_edge_are_told(simulator):
    found = searched(simulator, beta(), more=1.5 * simulator.slope[:, 0])
    table = parameter_table(found, None).set_index("key")
    assert table.loc["p0", "at_bound"] == "high"
    assert table.loc["p1", "at_bound"] == ""
    assert any("p0 ended at the edge" in s for s in sentences(found, decide(found)))


def test_tables_hold_errors_before_and_after(simulator):
    found = searched(simulator, beta(k2=0.6))
    named = decide(found).named[0]
    errors = error_table(found, named)
    assert (errors["with_effect"] ** 2).sum() == pytest.approx(named.fit.chi2)
    assert np.sqrt((errors["held_out_after"] ** 2).mean()) == pytest.approx(named.held_out_error)
    assert error_table(found, None)["with_effect"].isna().all()
    assert what_to_do(decide(found), found.problem, None)[0].startswith("Add e2 to the model")
