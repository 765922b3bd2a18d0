"""Other published examples with printed answers, reproduced to the printed digits."""

from __future__ import annotations

import numpy as np
import pytest

from analysis import Anova, Canonical, MainEffects, ResponseSurface
from analysis.canonical import steepest_path
from analysis.equation import uncoded_coefficients
from designs import Factor, FactorSpace
from tests.analysis.published import chemical_reaction, filtration_rate, mercaptobenzothiazole, odour

REACTION_SPACE = FactorSpace([Factor("Time", 80, 90, "min"), Factor("Temp", 170, 180, "°F")])


@pytest.fixture(scope="module")
def odour_report():
    return ResponseSurface(selection="none").analyse(odour(), responses=["Odor"])


@pytest.fixture(scope="module")
def reaction_fit():
    return Anova().analyse(chemical_reaction(), responses=["Yield"], space=REACTION_SPACE).details["fit"]


@pytest.fixture(scope="module")
def filtration_report():
    return MainEffects(order=4).analyse(filtration_rate(), responses=["rate"])


def sums(report):
    return report.tables["anova"].set_index("Source")


class TestOdour:
    """SAS/STAT, PROC RSREG: Box–Behnken, full quadratic."""

    def test_fit_statistics(self, odour_report):
        assert odour_report.numbers["Mean"] == pytest.approx(15.2, abs=5e-7)
        assert odour_report.numbers["S"] == pytest.approx(22.478508, abs=5e-7)
        assert odour_report.numbers["R2 %"] == pytest.approx(88.20, abs=0.005)
        assert odour_report.numbers["C.V. %"] == pytest.approx(147.8849, abs=5e-5)

    def test_analysis_of_variance(self, odour_report):
        rows = sums(odour_report)
        printed = {"Linear": (3, 7143.25, 4.71, 0.0641), "Square": (3, 11445, 7.55, 0.0264)}
        printed |= {"2-Way Interaction": (3, 293.5, 0.19, 0.8965), "Model": (9, 18882, 4.15, 0.0657)}
        for source, (df, ss, f, p) in printed.items():
            assert rows.loc[source, "DF"] == df
            assert rows.loc[source, "Adj SS"] == pytest.approx(ss, abs=0.5)
            assert rows.loc[source, "F"] == pytest.approx(f, abs=0.005)
            assert rows.loc[source, "p"] == pytest.approx(p, abs=0.00005)

    def test_lack_of_fit(self, odour_report):
        rows = sums(odour_report)
        assert rows.loc["  Lack-of-Fit", "Adj SS"] == pytest.approx(2485.75, abs=5e-4)
        assert rows.loc["  Lack-of-Fit", "F"] == pytest.approx(40.75, abs=0.005)
        assert rows.loc["  Lack-of-Fit", "p"] == pytest.approx(0.0240, abs=0.00005)
        assert rows.loc["  Pure Error", "Adj SS"] == pytest.approx(40.666667, abs=5e-7)
        assert rows.loc["Error", "Adj SS"] == pytest.approx(2526.416667, abs=5e-7)
        assert "Lack of fit is significant" in odour_report.text()

    def test_estimates_in_natural_units(self, odour_report):
        fit = odour_report.details["fit"]
        found = {term.label(fit.runs.names): value for term, value in uncoded_coefficients(fit).items()}
        printed = {"Constant": 568.958333, "T": -4.102083, "R": -1345.833333, "H": -22.166667}
        printed |= {"T*T": 0.020052, "T*R": 1.031250, "R*R": 1195.833333, "T*H": 0.018750, "R*H": -4.375}
        printed["H*H"] = 1.520833
        assert set(found) == set(printed)
        for label, value in printed.items():
            assert found[label] == pytest.approx(value, abs=5e-7), label

    def test_canonical_analysis(self):
        point = Canonical(goal="minimise").analyse(odour(), responses=["Odor"]).details["point"]
        np.testing.assert_allclose(point.coded, [0.121913, 0.199575, 1.770525], atol=5e-7)
        np.testing.assert_allclose(point.natural, [84.876502, 0.539915, 7.541050], atol=5e-7)
        np.testing.assert_allclose(point.eigenvalues, [48.858807, 31.103461, 6.037732], atol=5e-7)
        assert point.predicted == pytest.approx(-52.024631, abs=5e-7)
        assert point.nature == "minimum"
        assert not point.inside
        vector = point.eigenvectors[:, 0] * np.sign(point.eigenvectors[1, 0])
        np.testing.assert_allclose(vector, [0.238091, 0.971116, -0.015690], atol=5e-7)


def test_mercaptobenzothiazole_is_a_saddle():
    """SAS/STAT, PROC RSREG, ridge analysis: fit statistics."""
    report = Canonical().analyse(mercaptobenzothiazole(), responses=["MBT"])
    fit, point = report.details["fit"], report.details["point"]
    assert fit.y.mean() == pytest.approx(79.916667, abs=5e-7)
    assert fit.s == pytest.approx(4.615964, abs=5e-7)
    assert fit.r_squared == pytest.approx(80.03, abs=0.005)
    assert point.nature == "saddle"


class TestChemicalReaction:
    """R's rsm (Lenth 2009): central composite design in two blocks."""

    def test_coefficients(self, reaction_fit):
        found = dict(zip(reaction_fit.labels(), reaction_fit.term_coefficients.values(), strict=True))
        printed = {"Time": 0.93254, "Temp": 0.57771, "Time*Temp": 0.12500, "Time*Time": -1.30856, "Temp*Temp": -0.93344}
        for label, value in printed.items():
            assert found[label] == pytest.approx(value, abs=5e-6), label
        # rsm sets block 1 to zero; here the two blocks lie symmetrically about the constant.
        assert reaction_fit.constant + reaction_fit.coefficients[1] == pytest.approx(84.09543, abs=5e-6)
        assert -2 * reaction_fit.coefficients[1] == pytest.approx(-4.45753, abs=5e-6)
        assert reaction_fit.r_squared == pytest.approx(99.81, abs=0.005)
        assert reaction_fit.r_squared_adjusted == pytest.approx(99.64, abs=0.005)

    def test_stationary_point(self):
        report = Canonical().analyse(chemical_reaction(), responses=["Yield"], space=REACTION_SPACE)
        point = report.details["point"]
        np.testing.assert_allclose(point.coded, [0.3722954, 0.3343802], atol=5e-8)
        np.testing.assert_allclose(point.natural, [86.86148, 176.67190], atol=5e-6)
        np.testing.assert_allclose(point.eigenvalues, [-0.9233027, -1.3186949], atol=5e-8)
        assert point.nature == "maximum"
        assert point.inside

    def test_path_ends_at_the_stationary_point(self, reaction_fit):
        radius = float(np.hypot(0.3722954, 0.3343802))
        path = steepest_path(reaction_fit, radii=[radius])
        assert path["Time"].iloc[0] == pytest.approx(86.86148, abs=1e-3)
        assert path["Temp"].iloc[0] == pytest.approx(176.67190, abs=1e-3)


FILTRATION_PRINTED = {
    "A": (21.625, 32.6397),
    "B": (3.125, 0.681608),
    "C": (9.875, 6.80626),
    "D": (14.625, 14.9288),
    "A*B": (0.125, 0.00109057),
    "A*C": (-18.125, 22.9293),
    "A*D": (16.625, 19.2911),
    "B*C": (2.375, 0.393696),
    "B*D": (-0.375, 0.00981515),
    "C*D": (-1.125, 0.0883363),
    "A*B*C": (1.875, 0.245379),
    "A*B*D": (4.125, 1.18763),
    "A*C*D": (-1.625, 0.184307),
    "B*C*D": (-2.625, 0.480942),
    "A*B*C*D": (1.375, 0.131959),
}


class TestFiltrationRate:
    """Montgomery's unreplicated 2⁴ factorial: all effects, saturated."""

    def test_effects_and_contributions(self, filtration_report):
        effects = filtration_report.tables["effects"].set_index("Term")
        assert set(effects.index) == set(FILTRATION_PRINTED)
        for term, (effect, share) in FILTRATION_PRINTED.items():
            assert effects.loc[term, "Effect"] == pytest.approx(effect, abs=1e-9), term
            assert effects.loc[term, "Contribution %"] == pytest.approx(share, rel=1e-5), term

    def test_lenth(self, filtration_report):
        row = filtration_report.tables["lenth"].iloc[0]
        assert row["PSE"] == pytest.approx(2.625, abs=1e-9)
        assert row["Margin"] == pytest.approx(6.748, abs=0.0005)
        assert row["Simultaneous margin"] == pytest.approx(13.699, abs=0.0005)

    def test_saturated_design_has_no_p_values_but_names_what_stands_out(self, filtration_report):
        assert filtration_report.tables["effects"]["p"].isna().all()
        assert "Stand out by Lenth's simultaneous margin (α = 0.05): A, A*C, A*D, D." in filtration_report.text()
        assert "Between the individual and the simultaneous margin: C." in filtration_report.text()
        assert "saturated" in filtration_report.text()

    def test_reduced_model(self):
        rows = sums(Anova(terms="A,C,D,A*C,A*D").analyse(filtration_rate(), responses=["rate"]))
        assert rows.loc["Model", "Adj SS"] == pytest.approx(5535.81, abs=0.005)
        assert rows.loc["Model", "F"] == pytest.approx(56.74, abs=0.005)
        assert rows.loc["Error", "Adj SS"] == pytest.approx(195.12, abs=0.006)
        assert rows.loc["Total", "Adj SS"] == pytest.approx(5730.94, abs=0.005)
