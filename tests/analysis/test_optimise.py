"""Optima, targets, desirability and intervals."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis import AnalysisError, Goal, Optimise
from analysis.desirability import overall, parse_goals
from designs import CentralComposite, Factor, FactorSpace
from taichidem.paper.published import central_composite

SPACE = FactorSpace([Factor("a", 0, 10, "mm"), Factor("b", -5, 5)])


def table(*functions, noise=0.05):
    design = CentralComposite(kind="face_centred").generate(SPACE, seed=3)
    rng = np.random.default_rng(0)
    columns = {
        f"y{i + 1}": f(design.natural["a"], design.natural["b"]) + noise * rng.normal(size=len(design))
        for i, f in enumerate(functions)
    }
    return design.table.assign(**columns)


def bowl(a, b):
    return 20 - (a - 6) ** 2 / 4 - (b - 1) ** 2 / 4


def slope(a, b):
    return 10 + a + 0.5 * b


def test_interior_maximum():
    report = Optimise().analyse(table(bowl), responses=["y1"], space=SPACE)
    assert report.numbers["a"] == pytest.approx(6, abs=0.1)
    assert report.numbers["b"] == pytest.approx(1, abs=0.1)
    assert "bound" not in report.text()


def test_optimum_on_a_bound_is_said():
    report = Optimise().analyse(table(slope), responses=["y1"], space=SPACE)
    assert "sits on a bound of a, b" in report.text()
    assert report.numbers["a"] == 10
    assert any("Widen the range" in line for line in report.advice)
    least = Optimise(goals="y1:minimise").analyse(table(slope), responses=["y1"], space=SPACE)
    assert least.numbers["a"] == 0


def test_corners_beyond_the_star_points_are_called_an_extrapolation():
    design = CentralComposite(alpha=1.4).generate(SPACE, seed=3).table
    design["y1"] = slope(design["a"], design["b"]) + 0.01 * np.arange(len(design))
    wide = Optimise().analyse(design, responses=["y1"])  # coded by the range of the table: star points at ±1
    assert "extrapolation for y1" in wide.text()
    assert "extrapolation" not in Optimise().analyse(design, responses=["y1"], space=SPACE).text()


def test_target_is_hit_nearest_to_the_centre():
    report = Optimise(goals="y1:target=14").analyse(table(slope, noise=1e-9), responses=["y1"], space=SPACE)
    # ŷ = 15 + 5 x + 2.5 z; nearest to the centre: (x, z) = −(5, 2.5)/31.25
    setting = report.tables["setting"].set_index("Factor")["Coded"]
    np.testing.assert_allclose([setting["a"], setting["b"]], [-5 / 31.25, -2.5 / 31.25], atol=1e-5)
    assert report.numbers["y1"] == pytest.approx(14, abs=1e-6)
    assert "Other settings hit the target as well" in report.text()


def test_target_out_of_reach_is_said():
    report = Optimise(goals="y1:target=40").analyse(table(slope), responses=["y1"], space=SPACE)
    assert "out of reach" in report.text()
    assert "bound" in report.text()


def test_intervals_are_those_of_statsmodels():
    report = Optimise(terms="F,D,F*F,D*D").analyse(central_composite(), responses=["aor_deg"])
    fit, point = report.details["fits"][0], report.details["point"]
    frame = fit.results.get_prediction(fit.row(point)).summary_frame(alpha=0.05)
    row = report.tables["expected"].iloc[0]
    assert row["CI low"] == pytest.approx(frame["mean_ci_lower"].iloc[0])
    assert row["CI high"] == pytest.approx(frame["mean_ci_upper"].iloc[0])
    assert row["PI low"] == pytest.approx(frame["obs_ci_lower"].iloc[0])
    assert row["PI high"] == pytest.approx(frame["obs_ci_upper"].iloc[0])


def test_factors_in_no_model_are_held_at_the_centre():
    report = Optimise(terms="F,D,F*F,D*D").analyse(central_composite(), responses=["aor_deg"])
    assert "held at the centre" in report.tables["setting"].set_index("Factor").loc["B", "Note"]
    assert "B =" not in report.sentences[0]


@pytest.mark.parametrize("hold", ["b=-3", {"b": -3.0}])
def test_a_held_factor_of_the_model_stays_and_the_others_make_up_for_it(hold):
    analyser = Optimise(goals="y1:target=14", hold=hold)
    report = analyser.analyse(table(slope, noise=1e-9), responses=["y1"], space=SPACE)
    assert report.numbers["b"] == -3
    assert report.numbers["a"] == pytest.approx(14 - 10 + 0.5 * 3, abs=1e-5)
    assert report.tables["setting"].set_index("Factor")["Note"].to_dict() == {"a": "", "b": "held as asked"}
    assert report.sentences[:2] == ("Best setting: a = 5.5 mm.", "Held as asked: b = -3.")
    assert "The model hits the target." in report.text()  # one factor is left, so not a curve of settings
    figure = analyser.figures(report)["y1_contour_a_b"]
    (star,) = [line for line in figure.axes[0].lines if line.get_marker() == "*"]
    assert star.get_ydata()[0] == -3


def test_a_factor_held_at_its_end_is_not_called_an_optimum_on_a_bound():
    report = Optimise(hold="b=5").analyse(table(bowl), responses=["y1"], space=SPACE)
    assert report.numbers["b"] == 5
    assert report.numbers["a"] == pytest.approx(6, abs=0.1)
    assert "bound" not in report.text()


def test_a_factor_in_no_model_is_written_where_it_is_held():
    analyser = Optimise(terms="F,D,F*F,D*D", hold="B=910")
    report = analyser.analyse(central_composite(), responses=["aor_deg"])
    row = report.tables["setting"].set_index("Factor").loc["B"]
    assert row["Natural"] == 910
    assert row["Note"] == "in no model, held as asked"
    free = Optimise(terms="F,D,F*F,D*D").analyse(central_composite(), responses=["aor_deg"])
    assert report.numbers == {**free.numbers, "B": 910}


def test_the_unit_of_a_pure_number_is_not_written():
    space = FactorSpace([Factor("F", 0.1, 0.6, "1"), Factor("D", 0.3, 0.97, "1"), Factor("B", 889, 1107, "kg/m^3")])
    analyser = Optimise(terms="F,D,F*F,D*D", hold="B=910")
    report = analyser.analyse(central_composite(), responses=["aor_deg"], space=space)
    assert report.sentences[:2] == ("Best setting: F = 0.5211, D = 0.5485.", "Held as asked: B = 910 kg/m^3.")
    assert analyser.figures(report)["aor_deg_contour_F_D"].axes[0].get_xlabel() == "F"


def test_hold_values_count_for_several_responses_too():
    goals = "y1:maximise:low=10:high=20, y2:target=18:low=14:high=20"
    given = table(bowl, slope)
    report = Optimise(goals=goals, hold="a=2").analyse(given, responses=["y1", "y2"], space=SPACE)
    free = Optimise(goals=goals).analyse(given, responses=["y1", "y2"], space=SPACE)
    assert report.numbers["a"] == 2
    assert report.numbers["desirability"] < free.numbers["desirability"]


@pytest.mark.parametrize(
    ("hold", "words"),
    [
        ("c=1", "'c', which is no factor"),
        ("a", "'a', which gives no value"),
        (910, "hold is 910, which names no factor"),
        ("a=two", "a = 'two', which is no number"),
        ("a=nan", "a = 'nan', which is no number"),
        ({"a": True}, "a = True, which is no number"),
        ("a=11", r"a = 11, outside its range 0 … 10.*Give a value inside"),
        ("a=1,a=2", "'a' twice, 1 and 2"),
        ("a=1,b=1", r"Every factor of the models is held \(a, b\).*Free one"),
    ],
)
def test_bad_hold_values_are_refused(hold, words):
    with pytest.raises(AnalysisError, match=words):
        Optimise(hold=hold).analyse(table(slope), responses=["y1"], space=SPACE)


def test_two_responses_compromise_as_a_fine_grid_does():
    goals = "y1:maximise:low=10:high=20, y2:target=18:low=14:high=20:importance=2"
    report = Optimise(goals=goals, selection="none").analyse(table(bowl, slope), responses=["y1", "y2"], space=SPACE)
    fits = report.details["fits"]
    axis = np.linspace(-1, 1, 401)
    grid = np.array(np.meshgrid(axis, axis)).reshape(2, -1).T
    parsed = parse_goals(goals)
    best = overall(parsed, [goal.desirability(fit.predict(grid)) for goal, fit in zip(parsed, fits, strict=True)]).max()
    assert report.numbers["desirability"] >= best - 1e-9
    assert report.numbers["desirability"] == pytest.approx(best, abs=0.01)


def test_goals_that_exclude_each_other_are_said():
    goals = "y1:maximise:low=19:high=20, y2:minimise:low=8:high=9"
    report = Optimise(goals=goals).analyse(table(bowl, slope), responses=["y1", "y2"], space=SPACE)
    assert report.numbers["desirability"] == 0
    assert "no setting meets all goals" in report.text()


def test_desirability_by_its_definition():
    """Derringer & Suich's shapes: half way up counts 1/2, with weight 2 a quarter."""
    up = Goal("y", "maximise", low=10, high=20)
    np.testing.assert_allclose(up.desirability(np.array([5, 10, 15, 20, 25])), [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(Goal("y", "minimise", low=10, high=20).desirability(np.array([12.0])), [0.8])
    steep = Goal("y", "target", low=10, target=12, high=20, weight=2)
    np.testing.assert_allclose(steep.desirability(np.array([9, 11, 12, 16, 21])), [0, 0.25, 1, 0.25, 0])
    np.testing.assert_allclose(
        overall([up, Goal("z", importance=3)], [np.array(0.5), np.array(0.8)]), (0.5 * 0.8**3) ** 0.25
    )


@settings(deadline=None)
@given(y=st.floats(-100, 100), weight=st.floats(0.1, 10))
def test_desirability_stays_between_zero_and_one(y, weight):
    for goal in (Goal("y", low=-3, high=5, weight=weight), Goal("y", "target", -3, 5, target=1.0, weight=weight)):
        assert 0 <= float(goal.desirability(np.array(y))) <= 1


@pytest.mark.parametrize(
    ("goals", "words"),
    [
        ("y1:maximize", "Did you mean 'maximise'"),
        ("y1:target=abc", "'abc'"),
        ("y1:taget=3", "Did you mean 'target'"),
        ("y1:low=5:high=3", "low < target < high"),
        ("y9:maximise", "isn't among the responses"),
        ("y1:target", "needs a target value"),
        ("y1:weight=0", "weight > 0"),
    ],
)
def test_bad_goals_are_refused(goals, words):
    with pytest.raises(AnalysisError, match=words):
        Optimise(goals=goals).analyse(table(slope), responses=["y1"], space=SPACE)


def test_a_response_without_a_goal():
    with pytest.raises(AnalysisError, match="'y2' has no goal"):
        Optimise(goals="y1:maximise").analyse(table(bowl, slope), responses=["y1", "y2"], space=SPACE)


def test_nothing_to_optimise():
    noise = pd.DataFrame({"a": [0, 1, 0, 1, 0.5, 0.5], "y": [1, 1.1, 1.1, 1, 1.2, 0.9]})
    with pytest.raises(AnalysisError, match="No factor is in any"):
        Optimise(model="linear").analyse(noise, responses=["y"])
