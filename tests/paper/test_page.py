"""The page's tables: the paper's numbers beside ours, and only pictures that belong to the result."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from analysis import Optimise, ResponseSurface
from analysis.report import Report
from taichidem import runtime
from taichidem.paper import page, page_tables, published, setting_up
from taichidem.paper.surface import SETTINGS
from tests.paper.planted_heap import kept


@pytest.fixture(scope="module")
def surface():
    """Our fit, as if our heaps had the paper's angles but for a little density."""
    table = published.central_composite()
    table["aor_deg"] += 0.02 * (table["B"] - 998)
    return ResponseSurface(**SETTINGS).analyse(table, responses=["aor_deg"])


def test_equation_20_stands_beside_ours_with_standard_errors(surface):
    rows = {row["term"]: row for row in page_tables.coefficients(surface)}
    assert list(rows)[:5] == ["Constant", "F", "D", "F*F", "D*D"]
    assert rows["F*F"]["paper"] == -49.3
    coded = surface.details["fit"].coefficient_table().set_index("Term").loc["F*F"]
    assert rows["F*F"]["ours"] == pytest.approx(coded["Coef"] / 0.25**2)
    assert rows["F*F"]["u"] == pytest.approx(coded["SE Coef"] / 0.25**2)
    assert rows["B"]["paper"] is None
    assert rows["B"]["ours"] > 0


def test_table_8_stands_beside_our_analysis_of_variance_term_by_term(surface):
    rows = page_tables.variance(surface)
    order = [row["source"] for row in rows]
    assert order.index("  D") < order.index("  B") < order.index("  F*F")
    ours = {row["source"]: row["ours"] for row in rows}
    assert {row["source"]: row["paper"] for row in rows if row["paper"][0]} == published.ANOVA
    assert ours["Error"]["DF"] == surface.details["fit"].error_df
    assert [row["paper"] for row in rows if row["source"] == "  B"] == [(None, None)]


def test_a_term_of_the_paper_that_we_lack_is_listed_too():
    few = ResponseSurface(terms="F,F*F", selection="none").analyse(published.central_composite(), responses=["aor_deg"])
    (restitution,) = [row for row in page_tables.variance(few) if row["source"] == "  D"]
    assert restitution["ours"] == {}
    assert {row["term"]: row["ours"] for row in page_tables.coefficients(few)}["D"] is None


def test_the_model_summary_shows_what_is_printed_what_its_table_gives_and_ours(surface):
    rows = {row["name"]: row for row in page_tables.summary(surface)}
    predicted = rows["predicted R² [%]"]
    assert predicted["paper"] is None
    assert predicted["recomputed"] == pytest.approx(82.2, abs=0.05)
    assert predicted["ours"] == surface.numbers["R2 pred %"]
    assert rows["R² [%]"]["paper"] == 88.66


def test_angles_of_our_heaps_are_told_with_the_registered_statistics():
    coarse, fine = page_tables.angles({"coarse": kept([29.0, 30.0, 31.0]), "fine": kept([28.0, 29.0])})
    assert (coarse["N"], coarse["Mean"], coarse["SD"], coarse["Min"], coarse["Max"]) == (3, 30.0, 1.0, 29.0, 31.0)
    assert (fine["N"], fine["Mean"]) == (2, 28.5)
    assert fine["SD"] == pytest.approx(np.sqrt(0.5))


def test_contours_of_an_earlier_optimum_are_not_shown(tmp_path):
    for terms in ("F,D,B,F*F,D*D", "F,D,F*F,D*D"):
        analyser = Optimise(terms=terms, selection="none")
        report: Report = analyser.analyse(published.central_composite(), responses=["aor_deg"])
        report.save(tmp_path / "optimum", analyser.figures(report))
    assert len(list((tmp_path / "optimum").glob("*contour*.png"))) == 3
    assert page._contours(tmp_path) == ["optimum/aor_deg_contour_F_D.png"]


def rounds(*raised):
    return [SimpleNamespace(raised=each) for each in raised]


def poured(*raised):
    return SimpleNamespace(rounds=rounds(*raised), effort="quick")


def test_conditions_hold_every_kind_of_heap_that_was_poured_and_what_computed_it():
    plain = setting_up.conditions(poured(False))
    assert list(plain["heaps"]) == ["6 mm", "3 mm"]
    assert plain["heaps"]["3 mm"]["particles"] == 20000
    assert plain["heaps"]["6 mm"]["diameter"] == 0.006
    assert (plain["arch"], plain["threads"]) == (runtime.in_use().arch, runtime.in_use().threads)
    assert {"version", "physics"} <= set(plain)
    assert plain["youngs_modulus_Pa"] == pytest.approx(1e7)
    assert plain["effort"]["confirmation"] == 16
    further = setting_up.conditions(poured(False, True))
    assert [heap["stream_bottom"] for heap in further["heaps"].values()] == [0.065, 0.065, 0.1]


def test_the_window_is_named_and_every_setting_has_its_value_per_heap():
    assert setting_up.window_text() == "straight line over 0.40–0.92 of the cup radius in pictures from 9 sides"
    rows = {row["name"]: row for row in setting_up.settings_rows(rounds(False))}
    assert rows["stream_rate"]["values"] == [600.0, 4800.0]
    assert rows["drop_velocity"]["unit"] == "m/s"
    assert "grain_material" not in rows


@pytest.mark.parametrize(("value", "shown"), [(7.6448, "7.645"), (-49.28, "-49.28"), (1234.5, "1234"), (None, "–")])
def test_significant_digits(value, shown):
    assert page._significant(value) == shown


def test_a_chance_of_nothing_is_not_shown_as_none():
    assert [page._chance(p) for p in (1e-9, 0.0512, float("nan"), None)] == ["<0.0001", "0.0512", "–", "–"]
