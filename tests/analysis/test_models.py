"""Fits, analysis of variance, selection, residuals: against naive computations and known properties."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.api import OLS
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from analysis import AnalysisError, Anova, Canonical, ModelSummary, Residuals, ResponseSurface
from analysis.anova import anova_table
from analysis.equation import equation, uncoded_coefficients, uncoded_standard_errors
from analysis.lack_of_fit import lack_of_fit
from analysis.regression import FittedModel
from analysis.residuals import box_cox, residual_table
from analysis.run_table import read_runs
from analysis.selection import is_hierarchical, select
from designs import BoxBehnken, CentralComposite, Factor, FactorSpace
from designs.terms import model_terms
from taichidem.paper.published import central_composite
from tests.analysis.published import chemical_reaction, filtration_rate, odour


def fitted(table, response, model="quadratic", **reading):
    runs = read_runs(table, [response], **reading)
    return FittedModel(runs, response, tuple(model_terms(len(runs.space), model)))


def random_table(seed, noise=1.0):
    space = FactorSpace([Factor("a", 2, 6), Factor("b", 1e3, 1e6, log=True), Factor("c", -1, 0)])
    design = CentralComposite(kind="face_centred").generate(space, seed=seed)
    rng = np.random.default_rng(seed)
    coded = design.coded.to_numpy()
    y = (
        50
        + coded @ [3, -2, 1]
        - 4 * coded[:, 0] ** 2
        + coded[:, 0] * coded[:, 1]
        + noise * rng.normal(size=len(design))
    )
    return design.table.assign(y=y), space


def test_press_is_the_sum_of_left_out_errors():
    table = odour()
    fit = fitted(table, "Odor")
    errors = []
    for i in range(len(table)):
        others = np.arange(len(table)) != i
        coefficients = np.linalg.lstsq(fit.matrix[others], fit.y[others], rcond=None)[0]
        errors.append(fit.y[i] - fit.matrix[i] @ coefficients)
    assert fit.press == pytest.approx(np.sum(np.square(errors)), rel=1e-9)


def test_type_two_and_three_agree_with_statsmodels():
    table, _ = random_table(1)
    table = table.drop(index=[0, 5, 7])  # unbalanced, so that the two types differ
    fit = fitted(table, "y", factors=["a", "b", "c"])
    coded = pd.DataFrame(fit.runs.coded, columns=["a", "b", "c"]).assign(y=fit.y)
    model = ols("y ~ a + b + c + I(a**2) + I(b**2) + I(c**2) + a:b + a:c + b:c", coded).fit()
    labels = {"a": "a", "b": "b", "c": "c", "a*b": "a:b", "a*c": "a:c", "b*c": "b:c"}
    third = anova_lm(model, typ=3)
    ours = anova_table(fit, "III").set_index("Source")
    for mine, theirs in labels.items():
        assert ours.loc["  " + mine, "Adj SS"] == pytest.approx(third.loc[theirs, "sum_sq"], rel=1e-8)
        assert ours.loc["  " + mine, "p"] == pytest.approx(third.loc[theirs, "PR(>F)"], rel=1e-6)
    # patsy doesn't see that I(a**2) contains a, so type II is compared without squares.
    flat = fitted(table, "y", "interactions", factors=["a", "b", "c"])
    second = anova_lm(ols("y ~ (a + b + c)**2", coded).fit(), typ=2)
    ours = anova_table(flat, "II").set_index("Source")
    for mine, theirs in labels.items():
        assert ours.loc["  " + mine, "Adj SS"] == pytest.approx(second.loc[theirs, "sum_sq"], rel=1e-8)
    assert not np.isclose(ours.loc["  a", "Adj SS"], anova_table(flat, "III").set_index("Source").loc["  a", "Adj SS"])


def test_blocks_have_their_row():
    table = Anova().analyse(chemical_reaction(), responses=["Yield"]).tables["anova"].set_index("Source")
    assert table.loc["Blocks", "DF"] == 1
    assert table.loc["Error", "DF"] == 14 - 7
    assert table.loc["Total", "DF"] == 13


def test_rows_of_the_table_add_up():
    rows = anova_table(fitted(odour(), "Odor")).set_index("Source")
    assert rows.loc["Model", "Adj SS"] + rows.loc["Error", "Adj SS"] == pytest.approx(rows.loc["Total", "Adj SS"])
    parts = rows.loc["  Lack-of-Fit", "Adj SS"] + rows.loc["  Pure Error", "Adj SS"]
    assert parts == pytest.approx(rows.loc["Error", "Adj SS"])
    assert rows.loc["  Lack-of-Fit", "DF"] + rows.loc["  Pure Error", "DF"] == rows.loc["Error", "DF"]


def test_lack_of_fit_survives_the_last_bits():
    """Natural values that differ in the last bit, after coding and decoding, are still replicates."""
    table = central_composite()
    table["F"] = table["F"] * (1 + np.linspace(-1, 1, 20) * 4e-16)
    assert lack_of_fit(fitted(table, "aor_deg")).pure_df == 5


def test_lack_of_fit_without_replicates_and_with_equal_ones():
    single = central_composite().drop_duplicates(["F", "D", "B"])
    assert "No run is replicated" in Anova(model="linear").analyse(single, responses=["aor_deg"]).text()
    equal = central_composite()
    equal.loc[(equal["F"] == 0.35) & (equal["D"] == 0.635) & (equal["B"] == 998), "aor_deg"] = 30.11
    text = Anova().analyse(equal, responses=["aor_deg"]).text()
    assert "pure error is zero" in text
    assert "seed of their own" in text


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_uncoded_equation_predicts_what_the_coded_model_does(seed):
    table, space = random_table(seed)
    fit = fitted(table, "y", space=space)
    natural = space.to_natural(fit.runs.coded)
    logged = natural.assign(b=np.log(natural["b"])).to_numpy()
    values = [c * np.prod(logged ** np.array(t.powers), axis=1) for t, c in uncoded_coefficients(fit).items()]
    np.testing.assert_allclose(np.sum(values, axis=0), fit.fitted, rtol=1e-7)
    assert "ln(b)" in equation(fit)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_hierarchy_at_each_step_ends_hierarchical(seed):
    table, space = random_table(seed, noise=3.0)
    runs = read_runs(table, ["y"], space=space)
    terms = model_terms(3, "quadratic")
    for hierarchy in ("each_step", "at_end"):
        assert is_hierarchical(select(runs, "y", terms, hierarchy=hierarchy).fit.terms)
    for method in ("forward_aicc", "forward_bic"):
        assert is_hierarchical(select(runs, "y", terms, method=method).fit.terms)


def test_forward_selection_minimises_its_criterion_along_its_path():
    table, space = random_table(3)
    runs = read_runs(table, ["y"], space=space)
    for criterion in ("AICc", "BIC"):
        chosen = select(runs, "y", model_terms(3, "quadratic"), method=f"forward_{criterion.lower()}")
        assert chosen.fit.information(criterion.lower()) == pytest.approx(chosen.path[criterion].min())
        assert {"a", "a*a"} <= set(chosen.fit.labels())


def test_information_criteria_by_their_definition():
    fit = fitted(odour(), "Odor", "linear")
    n, m = 15, 5  # four coefficients and the variance
    deviance = n * np.log(fit.error_ss / n)
    assert fit.information("aicc") == pytest.approx(deviance + 2 * m + 2 * m * (m + 1) / (n - m - 1))
    assert fit.information("bic") == pytest.approx(deviance + m * np.log(n))


def test_vif_and_adequate_precision_by_their_definition():
    table, space = random_table(2)
    fit = fitted(table.drop(index=[1, 2]), "y", space=space)
    columns = fit.matrix[:, 1:]
    for j, vif in enumerate(fit.vif().values()):
        others = np.delete(fit.matrix, j + 1, axis=1)
        rest = columns[:, j] - others @ np.linalg.lstsq(others, columns[:, j], rcond=None)[0]
        spread = columns[:, j] - columns[:, j].mean()
        assert vif == pytest.approx((spread @ spread) / (rest @ rest), rel=1e-8)
    n, p = fit.matrix.shape
    expected = (fit.fitted.max() - fit.fitted.min()) / np.sqrt(p * fit.s**2 / n)
    assert fit.adequate_precision == pytest.approx(expected)


def test_residuals_agree_with_statsmodels():
    fit = fitted(central_composite(), "aor_deg")
    influence = fit.results.get_influence()
    rows = residual_table(fit)
    np.testing.assert_allclose(rows["Standardised"], influence.resid_studentized_internal)
    np.testing.assert_allclose(rows["Deleted"], influence.resid_studentized_external)
    np.testing.assert_allclose(rows["Cook"], influence.cooks_distance[0])
    np.testing.assert_allclose(rows["Leverage"], influence.hat_matrix_diag)


def test_large_residuals_are_flagged():
    table = central_composite()
    table.loc[7, "aor_deg"] += 9
    report = Residuals().analyse(table, responses=["aor_deg"])
    assert "R" in report.tables["residuals"]["Flag"].iloc[7]
    assert "8 (R" in report.text()


@pytest.mark.parametrize(("power", "low", "high"), [(0.0, -0.5, 0.5), (0.5, 0.2, 0.8), (1.0, 0.6, 1.4)])
def test_box_cox_finds_the_scale_on_which_the_model_is_linear(power, low, high):
    rng = np.random.default_rng(0)
    x = np.linspace(-1, 1, 60)
    straight = 10 + 4 * x + 0.1 * rng.normal(size=60)
    y = np.exp(straight) if power == 0 else straight ** (1 / power)
    best, lower, upper = box_cox(fitted(pd.DataFrame({"x": x, "y": y}), "y", "linear"))
    assert low < best < high
    assert lower <= best <= upper


def test_model_summary_sentences():
    good = ModelSummary().analyse(odour(), responses=["Odor"]).text()
    assert "negative: the mean predicts new runs better" in good
    fine = ModelSummary(terms="F,D,F*F,D*D").analyse(central_composite(), responses=["aor_deg"]).text()
    assert "reasonable agreement" in fine
    assert "above 4 the signal is large enough" in fine


def test_sequential_models():
    rows = ResponseSurface().analyse(odour(), responses=["Odor"]).tables["sequential_models"].set_index("Source")
    assert rows.loc["Linear", "Seq SS"] == pytest.approx(7143.25)
    assert rows.loc["2-way interactions", "Seq SS"] == pytest.approx(293.5)
    assert rows.loc["Quadratic", "Seq SS"] == pytest.approx(11445.233, abs=5e-4)
    assert rows.loc["Quadratic", "Note"] == "Suggested"
    assert rows.loc["Cubic", "Note"] == "Aliased"


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000), maximise=st.booleans())
def test_steepest_path_beats_every_other_point_of_its_sphere(seed, maximise):
    from analysis.canonical import steepest_path

    table, space = random_table(seed)
    fit = fitted(table, "y", space=space)
    path = steepest_path(fit, maximise=maximise, radii=[0.3, 0.9])
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    for radius, predicted in zip(path["Radius"], path["Predicted"], strict=True):
        others = fit.predict(radius * directions)
        assert predicted >= others.max() - 1e-6 if maximise else predicted <= others.min() + 1e-6
    coded = path[[f"coded {n}" for n in "abc"]].to_numpy()
    np.testing.assert_allclose(np.linalg.norm(coded, axis=1), path["Radius"], atol=1e-6)


def test_steepest_path_of_a_symmetric_surface_still_reaches_its_sphere():
    """Without a pull along the strongest axis the gradient alone would never leave the centre."""
    grid = np.array(np.meshgrid([-1.0, 0, 1], [-1.0, 0, 1])).reshape(2, -1).T
    table = pd.DataFrame(grid, columns=["a", "b"]).assign(y=3 * grid[:, 0] ** 2 - grid[:, 1] ** 2 + 0.5 * grid[:, 1])
    from analysis.canonical import steepest_path

    path = steepest_path(fitted(table, "y"), radii=[0.5])
    assert abs(path["coded a"].iloc[0]) > 0.45
    assert np.hypot(path["coded a"], path["coded b"]).iloc[0] == pytest.approx(0.5)
    angles = np.linspace(0, 2 * np.pi, 2000)
    best = (3 * (0.5 * np.cos(angles)) ** 2 - (0.5 * np.sin(angles)) ** 2 + 0.25 * np.sin(angles)).max()
    assert path["Predicted"].iloc[0] == pytest.approx(best, abs=1e-5)


def test_a_response_that_depends_on_nothing():
    table = central_composite()
    table["noise"] = np.random.default_rng(4).normal(10, 1, len(table))
    analyser = ResponseSurface(alpha=1e-4)
    report = analyser.analyse(table.drop(columns="aor_deg"), responses=["noise"])
    assert "Kept: the constant only" in report.text()
    assert "residuals" in analyser.figures(report)


def test_stationary_point_has_no_gradient():
    point = Canonical().analyse(odour(), responses=["Odor"]).details["point"]
    step = 1e-5 * np.eye(3)
    slope = [(point.fit.predict(point.full + h) - point.fit.predict(point.full - h))[0] for h in step]
    np.testing.assert_allclose(slope, 0, atol=1e-9)


def test_a_plane_has_no_stationary_point_but_a_path():
    report = Canonical(model="linear").analyse(filtration_rate(), responses=["rate"])
    assert "no single stationary point" in report.text()
    path = report.tables["steepest_path"]
    steps = path[["A", "B", "C", "D"]].iloc[-1].to_numpy()
    np.testing.assert_allclose(
        steps, np.array([21.625, 3.125, 9.875, 14.625]) / np.linalg.norm([21.625, 3.125, 9.875, 14.625])
    )


def test_box_behnken_of_a_known_surface_is_recovered_exactly():
    space = FactorSpace(Factor(n, 10, 20) for n in "pqr")
    table = BoxBehnken().generate(space).table
    table["y"] = 3 + 2 * table["p"] - 0.5 * table["q"] * table["r"] + 0.25 * table["r"] ** 2
    fit = fitted(table, "y", space=space)
    found = {t.label(fit.runs.names): c for t, c in uncoded_coefficients(fit).items() if abs(c) > 1e-9}
    assert found == pytest.approx({"Constant": 3, "p": 2, "q*r": -0.5, "r*r": 0.25})


def test_standard_errors_in_natural_units_are_those_of_a_fit_in_natural_units():
    table = central_composite()
    fit = fitted(table, "aor_deg")
    found = {t: (c, uncoded_standard_errors(fit)[t]) for t, c in uncoded_coefficients(fit).items()}
    natural = table[list(fit.runs.names)].to_numpy()
    matrix = np.column_stack([np.prod(natural ** np.array(t.powers), axis=1) for t in found])
    direct = OLS(table["aor_deg"].to_numpy(), matrix).fit()
    np.testing.assert_allclose([c for c, _ in found.values()], direct.params, rtol=1e-6)
    np.testing.assert_allclose([u for _, u in found.values()], direct.bse, rtol=1e-6)


def test_standard_errors_in_natural_units_with_blocks_and_of_a_saturated_model():
    table = central_composite()
    table["block"] = 1 + (table["run"] > 12)
    fit = fitted(table, "aor_deg", model="linear")
    (half,) = {(f.high - f.low) / 2 for f in fit.runs.space if f.name == "F"}
    coded = fit.coefficient_table().set_index("Term")["SE Coef"]["F"]
    errors = {t.label(fit.runs.names): u for t, u in uncoded_standard_errors(fit).items()}
    assert errors["F"] == pytest.approx(coded / half)
    few = fitted(table.drop(columns="block").iloc[[0, 1, 8, 12]], "aor_deg", model="linear")
    assert all(np.isnan(u) for u in uncoded_standard_errors(few).values())


def test_settings_are_checked():
    for settings_, words in (
        ({"model": "quadrtic"}, "Did you mean 'quadratic'"),
        ({"selection": "stepwise"}, "selection"),
        ({"alpha": 5}, "between 0 and 1"),
        ({"hierarchy": "no"}, "hierarchy"),
        ({"ss_type": "IV"}, "ss_type"),
    ):
        with pytest.raises(AnalysisError, match=words):
            ResponseSurface(**settings_)
