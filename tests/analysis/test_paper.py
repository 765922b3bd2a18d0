"""The paper's Tables 7 and 8, Equation 20 and optimum, digit by digit."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize

from analysis import Canonical, MainEffects, Optimise, ResponseSurface
from analysis.anova import anova_table
from analysis.equation import uncoded_coefficients
from analysis.regression import FittedModel
from analysis.run_table import read_runs
from designs.terms import parse_term
from taichidem.paper.published import (
    ANOVA,
    DATA,
    EFFECTS,
    EQUATION_20,
    MODEL_SUMMARY,
    REMARKS,
    central_composite,
    plackett_burman,
)

SHARED = Path(__file__).parents[2].parent / "shared" / "paper"

TABLE_7 = [(factor, *values) for factor, values in EFFECTS.items()]


@pytest.fixture(scope="module")
def without_hierarchy():
    return ResponseSurface(hierarchy="none").analyse(central_composite(), responses=["aor_deg"])


@pytest.fixture(scope="module")
def with_hierarchy():
    return ResponseSurface().analyse(central_composite(), responses=["aor_deg"])


def anova_row(report, source):
    table = report.tables["anova"]
    return table[table["Source"] == source].iloc[0]


@pytest.mark.parametrize("name", ["table3_plackett_burman.csv", "table5_central_composite.csv"])
def test_the_copied_tables_are_the_shared_ones(name):
    if not SHARED.is_dir():
        pytest.skip(f"the shared data folder {SHARED} isn't there to compare with")
    ours, theirs = (DATA / name).read_bytes(), (SHARED / name).read_bytes()
    assert hashlib.sha256(ours).hexdigest() == hashlib.sha256(theirs).hexdigest()


def test_table_7_effects_contributions_and_order():
    effects = MainEffects().analyse(plackett_burman(), responses=["aor_deg"]).tables["effects"]
    ranked = effects.sort_values("Order")
    assert list(ranked["Term"]) == [factor for factor, _, _ in TABLE_7]
    for (factor, effect, share), (_, row) in zip(TABLE_7, ranked.iterrows(), strict=True):
        assert row["Effect"] == pytest.approx(effect, abs=0.005), factor
        assert row["Contribution %"] == pytest.approx(share, abs=0.02), factor
        assert row["Mean square"] == pytest.approx(12 * (row["Effect"] / 2) ** 2, rel=1e-12), factor


def test_backward_elimination_without_hierarchy_takes_the_papers_steps(without_hierarchy):
    path = without_hierarchy.tables["selection"]
    removed = list(path["Term"])[1:]
    assert set(removed[:3]) == {"F*D", "F*B", "D*B"}
    assert removed[3:] == ["B", "B*B"]
    assert path["p"].iloc[4] == pytest.approx(0.195, abs=0.0005)
    assert path["p"].iloc[5] == pytest.approx(0.0512, abs=0.00005)


def test_equation_20(without_hierarchy):
    fit = without_hierarchy.details["fit"]
    names = fit.runs.names
    found = {term.label(names): value for term, value in uncoded_coefficients(fit).items()}
    exact = {"Constant": 7.645, "F": 51.360, "D": 33.282, "F*F": -49.280, "D*D": -30.341}
    last_digit = {"Constant": 0.01, "F": 0.1, "D": 0.1, "F*F": 0.1, "D*D": 0.02}
    assert set(found) == set(exact)
    for label, value in exact.items():
        assert found[label] == pytest.approx(value, abs=0.0005), label
        assert found[label] == pytest.approx(EQUATION_20[label], abs=last_digit[label]), label
    assert "7.6448 + 51.36 F + 33.282 D − 49.28 F*F − 30.341 D*D" in without_hierarchy.text()


def test_table_8_sums_of_squares(without_hierarchy):
    """All within ±0.05 but Model and F: the table prints the angle to 0.01°, which moves these two by 0.14."""
    for source, (df, ss) in ANOVA.items():
        row = anova_row(without_hierarchy, source)
        assert row["DF"] == df, source
        if source not in ("Model", "  F"):
            assert row["Adj SS"] == pytest.approx(ss, abs=0.05), source
    assert anova_row(without_hierarchy, "  F")["Adj SS"] == pytest.approx(10 * 4.216**2, abs=1e-9)
    assert anova_row(without_hierarchy, "Model")["Adj SS"] == pytest.approx(377.0139, abs=5e-5)


def test_table_8_is_exact_for_angles_within_their_rounding():
    """Angles that round to the printed ones give every sum of squares of Table 8 to its last digit."""
    table = central_composite()
    runs = read_runs(table, ["aor_deg"])
    terms = tuple(parse_term(label, runs.names) for label in ("F", "D", "F*F", "D*D"))
    forms = np.array(_quadratic_forms(FittedModel(runs, "aor_deg", terms)))
    wanted = np.array([ss for _, ss in ANOVA.values()])
    printed = table["aor_deg"].to_numpy()

    def deviation(shift):
        return np.einsum("i,kij,j->k", printed + shift, forms, printed + shift) - wanted

    found = optimize.least_squares(deviation, np.zeros(len(table)), bounds=(-0.005, 0.005), xtol=1e-12)
    runs.responses["aor_deg"] = printed + found.x
    rows = anova_table(FittedModel(runs, "aor_deg", terms)).set_index("Source")["Adj SS"]
    for source, (_, ss) in ANOVA.items():
        assert rows[source] == pytest.approx(ss, abs=0.0006), source


def _quadratic_forms(fit):
    """Return the matrices Q with SS = yᵀQy for the rows of Table 8, by projection."""

    def hat(columns):
        return columns @ np.linalg.pinv(columns)

    n = len(fit.y)
    full, mean = hat(fit.matrix), np.full((n, n), 1 / n)
    groups = np.eye(fit.runs.replicate_groups().max() + 1)[fit.runs.replicate_groups()]
    terms = [full - hat(np.delete(fit.matrix, i, axis=1)) for i in range(1, 5)]
    return [full - mean, *terms, np.eye(n) - full, hat(groups) - full, np.eye(n) - hat(groups)]


def test_model_summary(without_hierarchy):
    numbers = without_hierarchy.numbers
    for name, printed in MODEL_SUMMARY.items():
        assert numbers[name] == pytest.approx(printed, abs=0.001 if name == "S" else 0.005), name
    assert numbers["R2 pred %"] == pytest.approx(82.2, abs=0.05)  # not "exceeding 88 %", as the paper's text says
    assert "The predicted R² of 82.2 %" in without_hierarchy.text()


def test_optimum(without_hierarchy):
    best = Optimise(hierarchy="none").analyse(central_composite(), responses=["aor_deg"])
    assert round(best.numbers["F"], 2) == 0.52
    assert round(best.numbers["D"], 2) == 0.55
    assert best.numbers["F"] == pytest.approx(51.36 / (2 * 49.28), abs=1e-5)
    point = Canonical(terms="F,D,F*F,D*D").analyse(central_composite(), responses=["aor_deg"]).details["point"]
    assert point.nature == "maximum"
    np.testing.assert_allclose(point.natural, [best.numbers["F"], best.numbers["D"]], atol=1e-5)
    assert "bound" not in best.text()


def test_with_hierarchy_density_stays(with_hierarchy):
    fit = with_hierarchy.details["fit"]
    assert fit.labels() == ["F", "D", "B", "F*F", "D*D", "B*B"]
    p_values = {term.label(fit.runs.names): p for term, p in fit.p_values().items()}
    assert p_values["B*B"] == pytest.approx(0.0467, abs=0.00005)
    assert p_values["B"] == pytest.approx(0.195, abs=0.0005)  # kept for B*B only


def test_the_report_says_that_density_hangs_on_a_hair(with_hierarchy, without_hierarchy):
    leaves = next(s for s in without_hierarchy.sentences if s.startswith("Close call: B*B leaves"))
    stays = next(s for s in with_hierarchy.sentences if s.startswith("Close call: B*B stays"))
    assert "p = 0.0512" in leaves
    assert "p = 0.0467" in stays
    for sentence in (leaves, stays):
        assert "within a factor two of α = 0.05" in sentence
        assert "AICc prefers the model with it" in sentence
        assert "BIC prefers the model with it" in sentence
    assert any("B*B" in line and "new seeds" in line for line in without_hierarchy.advice)


def test_close_calls_end_at_a_factor_two():
    """At α = 0.02 the p of 0.0512 is no close call; at α = 0.03 it is."""
    far = ResponseSurface(hierarchy="none", alpha=0.02).analyse(central_composite(), responses=["aor_deg"])
    near = ResponseSurface(hierarchy="none", alpha=0.03).analyse(central_composite(), responses=["aor_deg"])
    assert not any("B*B" in call.label for call in far.details["selection"].close_calls)
    assert any("B*B" in call.label for call in near.details["selection"].close_calls)


def test_the_remarks_on_the_paper_are_what_its_table_gives(with_hierarchy, without_hierarchy):
    left = without_hierarchy.tables["selection"]["p"].iloc[5]
    stays = {
        t.label(with_hierarchy.details["fit"].runs.names): p
        for t, p in with_hierarchy.details["fit"].p_values().items()
    }
    assert f"B*B goes at p = {left:.4f}; with hierarchy it stays at p = {stays['B*B']:.4f}" in REMARKS
    assert f"predicted R² is {without_hierarchy.numbers['R2 pred %']:.1f} %" in REMARKS
    table = central_composite()
    counted = table.loc[table[["F", "D", "B"]].eq([0.35, 0.635, 998]).all(axis=1), "aor_deg"].value_counts()
    assert counted.to_dict() == {30.11: 5, 27.37: 1}
    assert "five of the six centre runs gave the same 30.11° and one 27.37°" in REMARKS
    assert anova_row(without_hierarchy, "  Pure Error")["Adj SS"] == pytest.approx(
        (30.11 - 27.37) ** 2 * 5 / 6, abs=1e-9
    )
    assert f"pure error of {ANOVA['  Pure Error'][1]}" in REMARKS
