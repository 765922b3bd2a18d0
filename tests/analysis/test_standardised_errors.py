"""Standardised errors, χ², familywise failures and trends, against SciPy by hand and against planted errors."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis import AnalysisError, load
from analysis.error_trends import series_of, weighted_line
from analysis.familywise import holm
from analysis.known_and_estimated import normal_deviate, two_sided

ANALYSER = load("standardised_errors")


def table(errors, u_measured=1.0, u_simulated=0.0, seeds=4, **columns):
    errors = np.asarray(errors, float)
    rows = pd.DataFrame({"measured": 10.0, "u_measured": u_measured, "simulated": 10.0 + errors})
    return rows.assign(u_simulated=u_simulated, n_seeds=seeds, **columns)


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03, math.nan]) == pytest.approx([0.03, 0.06, 0.06, math.nan], nan_ok=True)
    assert holm([0.9, 0.8]).tolist() == [1.0, 1.0]
    assert len(holm([])) == 0


def test_known_uncertainties_give_the_textbook_chi_square():
    report = ANALYSER().analyse(table([1.0, -2.0, 0.5]))
    assert report.numbers["chi2"] == pytest.approx(5.25)
    assert report.numbers["dof"] == 3
    assert report.numbers["p_value"] == pytest.approx(stats.chi2.sf(5.25, 3))
    assert report.tables["errors"]["p"].tolist() == pytest.approx((2 * stats.norm.sf([1, 2, 0.5])).tolist())
    assert not report.tables["errors"]["fails"].any()
    assert "agrees with the measurements" in report.sentences[0]


def test_few_seeds_get_students_t():
    report = ANALYSER().analyse(table([5.0], u_measured=3.0, u_simulated=4.0, seeds=3))
    row = report.tables["errors"].iloc[0]
    assert (row["u_val"], row["z"]) == pytest.approx((5.0, 1.0))
    drawn = np.random.default_rng(0).normal(0, 3, 10**6) + 4 * np.random.default_rng(1).standard_t(2, 10**6)
    assert row["p"] == pytest.approx(np.mean(np.abs(drawn) >= 5.0), abs=0.002)
    assert report.numbers["chi2"] == pytest.approx(1.0)
    assert report.numbers["p_value"] == pytest.approx(row["p"])  # one row: its own p


@pytest.mark.parametrize("degrees", [1, 2, 3, 7, 99])
@pytest.mark.parametrize("error", [0.0, 0.5, 3.0, 12.0])
def test_the_ends_of_known_and_estimated(error, degrees):
    assert two_sided(error, 1e-9, 1.0, degrees) == pytest.approx(2 * stats.t.sf(error, degrees), rel=1e-4)
    assert two_sided(error, 2.0, 0.0, degrees) == pytest.approx(2 * stats.norm.sf(error / 2), rel=1e-12)
    assert two_sided(error, 2.0, 1e-9, degrees) == pytest.approx(2 * stats.norm.sf(error / 2), rel=1e-4, abs=1e-9)


def test_the_p_of_chi_square_is_honest_with_three_seeds():
    """A right model: measured and seeds scatter alike. Normal p-values would be far too small."""
    rng = np.random.default_rng(5)
    small = []
    for _ in range(200):
        seeds = rng.normal(0.0, 2.0, (6, 3))
        data = table(seeds.mean(axis=1) + rng.normal(0.0, 0.5, 6), 0.5, seeds.std(axis=1, ddof=1) / math.sqrt(3), 3)
        report = ANALYSER().analyse(data)
        naive = stats.chi2.sf(report.numbers["chi2"], 6)
        small.append((report.numbers["p_value"] < 0.05, report.tables["errors"]["fails"].any(), naive < 0.05))
    whole, any_row, naive = np.mean(small, axis=0)
    assert whole < 0.06
    assert any_row < 0.06
    assert naive > 0.2


def test_errors_too_improbable_to_compute_stay_numbers():
    report = ANALYSER().analyse(table([500.0, 500.0], u_simulated=[0.0, 1e-3]))
    assert report.numbers["chi2"] == pytest.approx(2 * 500.0**2, rel=1e-3)
    assert report.numbers["p_value"] == 0.0
    assert normal_deviate(3.0, 2 * stats.norm.sf(3.0)) == pytest.approx(3.0)


def test_single_seeds_are_not_judged_and_missing_ones_not_compared():
    data = table([9.0, 9.0, 0.0, 1.0], u_simulated=[math.nan, 0.0, 1.0, 0.0], seeds=[1, 1, 0, 4])
    data = data.assign(exact=[False, True, False, False], label=list("abcd"))
    data.loc[2, "simulated"] = math.nan
    report = ANALYSER().analyse(data)
    errors = report.tables["errors"].set_index("label")
    assert errors["fails"].tolist() == [False, True, False, False]
    assert math.isnan(errors.loc["a", "p"])
    assert math.isnan(errors.loc["c", "z"])
    assert (report.numbers["dof"], report.numbers["chi2"]) == (3, pytest.approx(163.0))
    assert math.isnan(report.numbers["p_value"])
    text = " ".join(report.sentences)
    assert "no run gave a value: c" in text
    assert "single seed" in text
    assert "can't be judged: a." in text
    assert "at least three seeds" in report.advice[0]


def test_a_planted_error_is_found_with_its_direction():
    data = table([0.3, -8.0, 0.5, 1.9], label=["ok", "bad", "fine", "near"], unit="deg")
    report = ANALYSER().analyse(data)
    assert report.tables["errors"]["fails"].tolist() == [False, True, False, False]
    assert "bad is simulated 8 deg too low (|E|/u_val = 8.0)" in " ".join(report.sentences)


def test_parameters_count_in_chi_square_and_are_told_apart():
    data = table([0.0, 0.0, 4.0], kind=["test", "test", "parameter"], label=["a", "b", "friction"])
    report = ANALYSER().analyse(data)
    assert (report.numbers["chi2"], report.numbers["dof"]) == (16.0, 3)
    assert "The model holds friction = 14, but it was measured as 10 ± 1." in report.sentences


def test_a_weighted_line_by_hand():
    x, error, u = np.array([1.0, 2.0, 4.0, 5.0]), np.array([0.1, 0.9, 3.2, 3.9]), np.array([0.5, 0.2, 0.4, 0.3])
    line = weighted_line(x, error, u, np.zeros(4), np.full(4, 4))
    (slope, _), covariance = np.polyfit(x, error, 1, w=1 / u, cov="unscaled")
    assert (line.slope, line.u_slope) == pytest.approx((slope, math.sqrt(covariance[0, 0])))
    assert line.p == pytest.approx(2 * stats.norm.sf(line.slope / line.u_slope))
    assert (line.low, line.high) == (0.1, 3.9)


def test_a_line_that_rests_on_seeds_alone_has_few_degrees_of_freedom():
    line = weighted_line([0, 1], [0, 5], [1, 1], [1, 1], [3, 3])
    assert line.p == pytest.approx(2 * stats.t.sf(5 / math.sqrt(2), 4), rel=1e-6)


CONDITIONS = {"type": "hopper", "observable": "flow", "unit": "g/s", "outlet [m]": [0.03, 0.04, 0.05, 0.06]}


def test_a_planted_trend_is_claimed_and_a_constant_error_is_not():
    report = ANALYSER().analyse(table([0.0, 3.0, 6.0, 9.0], **CONDITIONS))
    (trend,) = report.details["trends"].to_dict("records")
    assert trend["claimed"]
    assert trend["slope"] == pytest.approx(300.0)
    assert trend["z"] == pytest.approx([0, 3, 6, 9])
    assert "The error of flow grows with outlet: from 0 g/s at 0.03 m to 9 g/s at 0.06 m" in " ".join(report.sentences)
    constant = ANALYSER().analyse(table([6.0, 6.1, 5.9, 6.0], **CONDITIONS))
    (trend,) = constant.details["trends"].to_dict("records")
    assert not trend["claimed"]
    assert constant.tables["errors"]["fails"].all()
    assert "grows" not in " ".join(constant.sentences)


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        ([9, 6, 3, 0], "shrinks with outlet"),
        ([-9, -3, 3, 9], "changes sign along"),
        ([0, -3, -6, -9], "grows with outlet"),
    ],
)
def test_how_a_trend_is_told(errors, words):
    assert words in " ".join(ANALYSER().analyse(table(errors, **CONDITIONS)).sentences)


def test_series_differ_in_one_condition_alone():
    data = pd.DataFrame(
        {
            "type": ["drum"] * 5 + ["hopper"] * 2,
            "observable": "angle",
            "speed": [1.0, 2.0, 3.0, 1.0, 2.0, math.nan, math.nan],
            "fill": [0.3, 0.3, 0.3, 0.5, 0.4, math.nan, math.nan],
            "lining": ["'a'", "'a'", "'a'", "'a'", "'a'", None, None],
            "outlet": [math.nan] * 5 + [2.0, 1.0],
        }
    )
    found = {(s.condition, s.rows) for s in series_of(data, ["speed", "fill", "lining", "outlet"])}
    assert found == {("speed", (0, 1, 2)), ("fill", (0, 3)), ("fill", (1, 4)), ("outlet", (6, 5))}


def test_trends_are_corrected_for_their_number():
    rng = np.random.default_rng(1)
    claimed = 0
    for _ in range(100):
        data = table(
            rng.normal(size=16), type=np.repeat(list("abcd"), 4), observable="x", speed=np.tile([1.0, 2, 3, 4], 4)
        )
        claimed += ANALYSER().analyse(data).details["trends"]["claimed"].any()
    assert claimed / 100 < 0.11


def test_pictures_show_the_numbers():
    data = table([0.0, 3.0, 60.0, -9.0], label=list("abcd"), u_simulated=0.5, **CONDITIONS)
    analyser = ANALYSER()
    report = analyser.analyse(data)
    figures = analyser.figures(report)
    assert set(figures) == {"standardised_errors", "series_hopper_outlet"}
    (axes,) = figures["standardised_errors"].axes
    dots = [line for line in axes.lines if line.get_marker() == "o" and len(line.get_xdata()) == 1]
    assert [float(dot.get_xdata()[0]) for dot in dots] == pytest.approx(report.tables["errors"]["z"].tolist())
    assert [text.get_text() for text in axes.get_yticklabels()] == list("abcd")
    assert axes.get_xscale() == "symlog"
    low, high = axes.get_xlim()
    assert low < -60 < 60 < high
    (axes,) = figures["series_hopper_outlet"].axes
    measured, simulated = axes.containers
    assert measured.lines[0].get_ydata().tolist() == [10.0] * 4
    assert simulated.lines[0].get_ydata().tolist() == [10.0, 13.0, 70.0, 1.0]
    assert axes.get_xlabel() == "outlet [m]"


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"u_measured": 0.0}, "Measured uncertainty given: 0"),
        ({"u_measured": -1.0}, "Measured uncertainty given: -1"),
        ({"measured": math.inf}, "Measured value given: inf"),
    ],
)
def test_numbers_that_cannot_be_compared(change, part):
    with pytest.raises(AnalysisError, match=part):
        ANALYSER().analyse(table([1.0]).assign(**change))


def test_tables_that_cannot_be_read():
    with pytest.raises(AnalysisError, match="lacks the column u_measured"):
        ANALYSER().analyse(table([1.0]).drop(columns="u_measured"))
    with pytest.raises(AnalysisError, match="holds no row"):
        ANALYSER().analyse(table([]))
    with pytest.raises(AnalysisError, match="lacks the column speed"):
        ANALYSER().analyse(table([1.0]), factors=["speed"])
