"""The analyser from tables to report, and what it says to tables that it can't use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import approx_fprime

from analysis.errors import AnalysisError
from analysis.missing_effect.analyser import MissingEffect
from analysis.missing_effect.problem import Candidate, Parameter, Problem
from benchmarks.effect_toy import K, P, Toy
from tests.analysis.missing_effect.linear import linear, problem_of


@pytest.fixture(scope="module")
def toy() -> Toy:
    return Toy(3)


def tables(toy: Toy, truth=(2,), strength=0.8, seed=5) -> dict[str, pd.DataFrame]:
    """Return what the analyser wants beside the runs."""
    asked = toy.problem(truth, strength, seed)
    given = {"label": asked.labels, "test": asked.tests, "value": asked.measured, "u": asked.u}
    parameters = pd.DataFrame([vars(p) for p in asked.parameters])
    return {
        "measurements": pd.DataFrame(given),
        "parameters": parameters,
        "candidates": pd.DataFrame(
            [{"name": c.name, "at_full": 0.4, "parameter": "coefficient"} for c in asked.candidates]
        ),
    }


def analysed(toy: Toy, table: pd.DataFrame | None = None, **changed):
    return MissingEffect(**{**tables(toy), "draws": 500, **changed}).analyse(toy.table() if table is None else table)


def test_a_hidden_effect_is_found_from_tables(toy):
    report = analysed(toy)
    assert report.details["verdict"] == "effect"
    assert report.details["effects"] == ["e2"]
    row = report.tables["candidates"].iloc[0]
    assert row["strength"] == pytest.approx(0.4 * row["share"])
    assert abs(row["share"] - 0.8) < 0.2
    assert set(row["rho"]) == {f"e{k}" for k in range(K)} - {"e2"}
    numbers = report.numbers
    assert numbers["chi2_with_effect"] < numbers["chi2_recalibrated"] <= numbers["chi2_believed"]
    assert numbers["held_out_after"] < numbers["held_out_before"]
    assert report.details["next"] is None  # nothing is left to tell it from


def test_it_is_the_search_on_the_same_numbers(toy):
    found = toy.search((2,), 0.8, 5)
    table = analysed(toy).tables["candidates"].set_index("effect")
    for trial in found.trials:
        assert table.loc[f"e{trial.effects[0]}", "chi2"] == pytest.approx(trial.fit.chi2, rel=1e-3)


def test_the_order_of_runs_and_units_of_responses_do_not_matter(toy):
    first = analysed(toy).tables["candidates"].set_index("effect")
    given, runs = tables(toy)["measurements"], toy.table().sample(frac=1.0, random_state=1).reset_index(drop=True)
    given = given.assign(value=1000 * given["value"], u=1000 * given["u"])
    runs[list(given["label"])] *= 1000
    second = analysed(toy, runs, measurements=given).tables["candidates"].set_index("effect")
    for column in ("strength", "chi2", "eta", "held_out_error"):
        assert second.loc[first.index, column].to_numpy() == pytest.approx(first[column].to_numpy(), rel=0.02, abs=0.02)


def test_other_units_of_a_parameter_only_change_its_own_numbers(toy):
    parameters = tables(toy)["parameters"]
    for column in ("low", "high", "believed", "value"):
        parameters[column] = 50 + 7 * parameters[column]
    parameters["u"] *= 7
    runs = toy.table()
    runs[[f"p{j}" for j in range(P)]] = 50 + 7 * runs[[f"p{j}" for j in range(P)]]
    one, two = analysed(toy), analysed(toy, runs, parameters=parameters)
    assert two.numbers["chi2_recalibrated"] == pytest.approx(one.numbers["chi2_recalibrated"], rel=1e-3)
    values = one.tables["parameters"]["recalibrated"].to_numpy()
    assert two.tables["parameters"]["recalibrated"].to_numpy() == pytest.approx(50 + 7 * values, abs=0.01)


def test_new_tests_are_considered_for_what_to_measure_next(toy):
    runs, labels = toy.table(), [f"r{i}" for i in range(11)]
    runs["new.angle"] = 100 * (runs["effect"] == "e0") * runs["share"] + np.random.default_rng(0).normal(
        0, 0.1, len(runs)
    )
    asked = tables(toy, (0,))["measurements"]
    report = analysed(toy, runs, measurements=asked, new_tests=pd.DataFrame({"label": ["new.angle"], "u": [1.0]}))
    assert report.details["verdict"] == "one_of"
    told = report.details["next"]
    assert (told["what"], told["label"], told["is_new"]) == ("new_test", "new.angle", True)
    assert told["label"] not in labels
    assert "make the test new.angle" in report.details["next_text"]


def test_an_effect_whose_runs_failed_is_not_tested_and_that_is_told(toy):
    runs = toy.table()
    runs.loc[(runs["effect"] == "e4") & (runs["share"] < 0.9), "r3"] = np.nan
    report = analysed(toy, runs)
    assert report.details["not_tested"] == {"e4": "1 of its runs gave r3; 2 are needed to tell what it does there."}
    assert "e4" not in set(report.tables["candidates"]["effect"])


def test_a_few_failed_runs_change_little(toy):
    runs = toy.table()
    runs.loc[[7, 20], ["r1", "r2"]] = np.nan
    assert analysed(toy, runs).details["verdict"] == "effect"


def test_runs_of_effects_that_are_no_candidates_are_left_out(toy):
    fewer = tables(toy)["candidates"].iloc[:3]
    assert set(analysed(toy, candidates=fewer).tables["candidates"]["effect"]) == {"e0", "e1", "e2"}


def test_without_candidates_only_the_fit_is_judged(toy):
    report = analysed(toy, candidates=pd.DataFrame())
    assert report.details["verdict"] == "something_else"
    assert report.tables["candidates"].empty


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"measurements": pd.DataFrame()}, r"needs measurements: a table with the columns label, test, value and u"),
        ({"measurements": pd.DataFrame({"label": ["r0"], "value": [1.0]})}, r"lacks test, u\. It needs label, test"),
        (
            {"parameters": pd.DataFrame({"key": ["p0"]})},
            r"parameters has the columns key and lacks low, high, believed",
        ),
        ({"candidates": pd.DataFrame({"title": ["x"]})}, r"candidates has the columns title and lacks name"),
        ({"new_tests": pd.DataFrame({"label": ["n"]})}, r"new_tests has the columns label and lacks u"),
    ],
)
def test_tables_without_a_column_are_refused_by_name(toy, change, words):
    with pytest.raises(AnalysisError, match=words):
        analysed(toy, **change)


def test_runs_that_say_nothing_certain_are_refused(toy):
    runs = toy.table()
    with pytest.raises(AnalysisError, match=r"lacks the columns r4, p1, share"):
        analysed(toy, runs.drop(columns=["r4", "p1", "share"]))
    runs.loc[2, "share"] = 0.5
    with pytest.raises(
        AnalysisError, match=r"Run 2 of the table has the effect '' at the share 0\.5\. A run has either"
    ):
        analysed(toy, runs)
    runs = toy.table()
    runs.loc[40, "share"] = 0.0
    with pytest.raises(AnalysisError, match=r"Run 40 of the table has the effect 'e\d' at the share 0\.0"):
        analysed(toy, runs)
    runs = toy.table()
    runs.loc[3, "p2"] = np.nan
    with pytest.raises(AnalysisError, match=r"Run 3 of the table lacks a finite value of the parameter p2"):
        analysed(toy, runs)


@pytest.fixture
def good() -> Problem:
    return problem_of(linear(), np.ones(9), direct=(0,))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"u": np.zeros(9)},
            r"r0: measured 1 with u = 0\. A value must be finite and its standard uncertainty above 0",
        ),
        ({"measured": np.full(9, np.inf)}, r"r0: measured inf"),
        ({"tests": ("a",)}, r"9 responses with 1 tests"),
        ({"labels": (), "tests": (), "measured": np.ones(0), "u": np.ones(0)}, r"At least one response is needed"),
        ({"labels": ("a", "a", *"cdefghi")}, r"Responses need different names; given more than once: a"),
        ({"candidates": (Candidate("e"), Candidate("e"))}, r"Candidates need different names"),
        ({"parameters": (Parameter("p", 1, 1, 1),)}, r"p: range from 1 to 1\. It must be finite and rise"),
        ({"parameters": (Parameter("p", 0, 1, float("nan")),)}, r"p: believed nan\. Give the number"),
        ({"parameters": (Parameter("p", 0, 1, 0.5, 0.4),)}, r"p: measured directly as 0\.4 with u = None"),
        ({"parameters": (Parameter("p", 0, 1, 0.5, 0.4, -1.0),)}, r"p: measured directly as 0\.4 with u = -1\.0"),
        (
            {"parameters": tuple(Parameter(f"p{j}", 0, 1, 0.5) for j in range(9))},
            r"9 measurements for 9 parameters .* measure more, or fix parameters",
        ),
    ],
)
def test_a_problem_that_can_not_be_posed_is_refused_with_what_was_given(good, changes, words):
    with pytest.raises(AnalysisError, match=words):
        replace(good, **changes)


def test_direct_measurements_count(good):
    assert good.count == 10
    nine = tuple(Parameter(f"p{j}", 0, 1, 0.5, *((0.5, 0.1) if j == 0 else ())) for j in range(9))
    assert replace(good, parameters=nine).count == 10


def test_coding_goes_there_and_back(good):
    ranges = (Parameter("a", 2.0, 6.0, 3.0, 5.0, 0.5), Parameter("b", -1.0, 0.0, 0.0), Parameter("c", 0.1, 10.0, 1.0))
    wide = replace(good, parameters=ranges)
    assert wide.logarithmic.tolist() == [False, False, True]
    assert wide.coded(np.array([3.0, 0.0, 1.0])) == pytest.approx([-0.5, 1.0, 0.0])
    values = np.array([3.3, -0.2, 0.4])
    assert wide.natural(wide.coded(values)) == pytest.approx(values)
    step = approx_fprime(wide.coded(values), lambda v: wide.natural(v).sum(), 1e-6)
    assert wide.natural_slope(wide.coded(values)) == pytest.approx(step, rel=1e-4)


def test_what_is_believed_to_be_zero_is_not_coded_by_its_logarithm(good):
    wide = replace(good, parameters=(Parameter("a", 0.01, 1.0, 0.0), Parameter("b", 0.01, 1.0, 0.5)))
    assert wide.logarithmic.tolist() == [False, True]
    assert np.isfinite(wide.coded(np.array([0.0, 0.5]))).all()
