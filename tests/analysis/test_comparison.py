"""E = S − D against the validation uncertainty, and what is said about it."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy import stats

from analysis.comparison import SimulatedMean, compare
from analysis.errors import AnalysisError

LABORATORY = (30.18, 0.51)


def test_the_terms_by_hand():
    report = compare([27.0, 28.0, 29.0, 30.0], *LABORATORY, other_uncertainties={"time step": 0.2, "window": 0.6})
    seed_mean = np.std([27, 28, 29, 30], ddof=1) / 2.0
    assert report.simulated == 28.5
    assert report.simulated_uncertainty == pytest.approx(seed_mean)
    assert report.error == pytest.approx(28.5 - 30.18)
    u_val = math.sqrt(seed_mean**2 + 0.51**2 + 0.2**2 + 0.6**2)
    assert report.validation_uncertainty == pytest.approx(u_val)
    assert report.ratio == pytest.approx(1.68 / u_val)
    assert report.relative_error == pytest.approx(-1.68 / 30.18)
    freedom = 3 * (u_val / seed_mean) ** 4
    assert report.degrees_of_freedom == pytest.approx(freedom)
    assert report.coverage_factor == pytest.approx(stats.t.ppf(0.975, freedom))


@pytest.mark.parametrize(
    ("shift", "verdict", "said"),
    [
        (0.3, "within_uncertainty", "is explained by"),
        (-0.9, "not_established", "not enough to be called an error"),
        (-4.0, "model_differs", "isn't explained by"),
        (4.0, "model_differs", "4.00° steeper"),
        (-4.0, "model_differs", "4.00° flatter"),
        (0.0, "within_uncertainty", "equals the laboratory's"),
    ],
)
def test_the_verdict_and_its_sentence(shift, verdict, said):
    report = compare(SimulatedMean(30.18 + shift, 0.2, 5), *LABORATORY)
    assert report.verdict == verdict
    assert said in report.text
    assert f"{report.ratio:.1f} times the validation uncertainty" in report.text
    assert "scatter of the mean of 5 seeds" in report.text


def test_few_seeds_need_a_larger_difference():
    two = compare([28.0, 29.0], 25.5, 0.01)
    assert two.ratio > 2.0
    assert two.coverage_factor > 12.0
    assert two.verdict == "not_established"
    assert compare(SimulatedMean(28.5, 0.5, 40), 25.5, 0.01).verdict == "model_differs"


def test_one_seed_is_said_and_never_convicts_the_model():
    alone = compare([20.0], *LABORATORY)
    assert alone.simulated_uncertainty == 0.0
    assert not alone.seed_scatter_known
    assert alone.verdict == "not_established"
    assert "Only one seed" in alone.text
    assert "(one seed)" in alone.text
    assert "three seeds" in alone.advice
    stated = compare([20.0], *LABORATORY, seed_scatter=1.5)
    assert stated.simulated_uncertainty == 1.5
    assert stated.verdict == "model_differs"
    assert "Only one seed" not in stated.text


def test_the_advice_names_the_largest_part():
    assert "run more seeds" in compare(SimulatedMean(29.0, 1.5, 3), *LABORATORY).advice
    assert "repeat the measurement" in compare(SimulatedMean(30.0, 0.1, 3), *LABORATORY).advice
    assert "'window'" in compare(SimulatedMean(30.0, 0.1, 3), *LABORATORY, other_uncertainties={"window": 2.0}).advice
    assert "physical effect" in compare(SimulatedMean(20.0, 0.1, 3), *LABORATORY).advice


def test_other_quantities_are_larger_or_smaller():
    report = compare([505.0, 509.0, 512.0], 480.0, 2.0, quantity="bulk density", unit="kg/m³")
    assert "bulk density is 28.7 kg/m³ larger" in report.text


def test_the_report_is_json():
    numbers = json.loads(json.dumps(compare([30.0], *LABORATORY).as_dict(), allow_nan=False))
    assert numbers["degrees_of_freedom"] is None
    assert numbers["error"] == pytest.approx(-0.18)
    assert set(numbers) >= {
        "simulated",
        "simulated_uncertainty",
        "measured",
        "validation_uncertainty",
        "verdict",
        "text",
    }


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (([30.0, 31.0], 30.0, 0.0), "Measured uncertainty"),
        (([30.0, 31.0], 30.0, -1.0), "Measured uncertainty"),
        (([30.0, 31.0], 30.0, math.nan), "Measured uncertainty"),
        (([30.0, 31.0], math.inf, 1.0), "Measured value"),
        (([30.0, math.nan], 30.0, 1.0), "Simulated values"),
        (([], 30.0, 1.0), "Simulated values"),
    ],
)
def test_bad_numbers_are_refused(given, said):
    with pytest.raises(AnalysisError, match=said):
        compare(*given)


def test_bad_uncertainties_are_refused_by_name():
    with pytest.raises(AnalysisError, match="'window'"):
        compare([30.0, 31.0], 30.0, 1.0, other_uncertainties={"window": -1.0})
    with pytest.raises(AnalysisError, match="seed_scatter"):
        compare([30.0], 30.0, 1.0, seed_scatter=math.nan)
    with pytest.raises(AnalysisError, match="Simulated mean"):
        SimulatedMean(30.0, -0.1, 3)
