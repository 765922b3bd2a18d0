"""Property statistics, bulk density, Lenth, effects, reports."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from analysis import AnalysisError, BulkDensity, MainEffects, PropertyStatistics
from analysis.lenth import lenth
from designs import Factor, FactorSpace, FullFactorial
from taichidem.paper.published import plackett_burman
from tests.analysis.published import filtration_rate


def test_statistics_as_in_the_papers_table_6():
    lengths = [3.03, 2.97, 3.00, 3.01, 2.99]
    row = PropertyStatistics().analyse(pd.DataFrame({"length_mm": lengths})).tables["property_statistics"].iloc[0]
    assert row["Mean"] == pytest.approx(3.0)
    assert row["SD"] == pytest.approx(np.sqrt(0.0020 / 4))
    assert row["COV %"] == pytest.approx(100 * row["SD"] / 3.0)
    assert (row["Min"], row["Max"], row["N"]) == (2.97, 3.03, 5)


def test_gaps_are_counted_and_text_is_refused():
    table = pd.DataFrame({"x": [1.0, None, 3.0], "seed": [1, 2, 3]})
    report = PropertyStatistics().analyse(table)
    assert list(report.tables["property_statistics"]["Property"]) == ["x"]
    assert report.tables["property_statistics"]["Missing"].iloc[0] == 1
    with pytest.raises(AnalysisError, match="'wet' in row 2"):
        PropertyStatistics().analyse(pd.DataFrame({"x": [1, "wet"]}), responses=["x"])
    with pytest.raises(AnalysisError, match="is empty"):
        PropertyStatistics().analyse(pd.DataFrame({"x": [None, None]}), responses=["x"])
    with pytest.raises(AnalysisError, match="Did you mean 'length'"):
        PropertyStatistics().analyse(pd.DataFrame({"length": [1.0]}), responses=["lenght"])


def test_bulk_density_and_its_uncertainty():
    table = pd.DataFrame({"mass_full_kg": [0.66, 0.67, 0.65], "mass_empty_kg": 0.1, "volume_m3": 1e-3})
    report = BulkDensity(u_mass=1e-4, u_volume=2e-6).analyse(table)
    assert report.numbers["bulk_density"] == pytest.approx(560)
    expected = np.sqrt((10 / np.sqrt(3)) ** 2 + 2 * 0.1**2 + (560 * 2e-3) ** 2)
    assert report.numbers["u"] == pytest.approx(expected)
    same = BulkDensity(volume=1e-3).analyse(table.drop(columns="volume_m3"))
    assert same.numbers["bulk_density"] == pytest.approx(560)


def test_bulk_density_refuses_swapped_columns():
    table = pd.DataFrame({"mass_full_kg": [0.1], "mass_empty_kg": [0.6], "volume_m3": [1e-3]})
    with pytest.raises(AnalysisError, match=r"Row 1.*must weigh more"):
        BulkDensity().analyse(table)


def test_lenth_by_hand():
    """Median |c| = 3, s₀ = 4.5; 30 is beyond 11.25; median of the rest 2.5, PSE = 3.75."""
    yardstick = lenth(np.array([1.0, -2.0, 3.0, 4.0, 30.0]))
    assert yardstick.pse == pytest.approx(3.75)


def test_lenth_margins_hold_their_level_roughly():
    """In pure noise Lenth's individual margin is passed by 3 to 6 % of 15 contrasts (nominal 5 %)."""
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(2000, 15))
    share = np.mean([np.mean(np.abs(c) > lenth(c).margin) for c in noise])
    assert 0.03 < share < 0.06


def test_effects_are_differences_of_means():
    table = filtration_rate()
    effects = MainEffects().analyse(table, responses=["rate"]).tables["effects"].set_index("Term")
    for name in "ABCD":
        difference = table.loc[table[name] == 1, "rate"].mean() - table.loc[table[name] == -1, "rate"].mean()
        assert effects.loc[name, "Effect"] == pytest.approx(difference)


def test_centre_runs_show_curvature_and_stay_out_of_the_effects():
    space = FactorSpace([Factor("a", 0, 2), Factor("b", 0, 2)])
    table = FullFactorial(centre_points=3, replicates=2).generate(space).table
    table["y"] = 10 + table["a"] - 5 * (table["a"] - 1) ** 2
    report = MainEffects().analyse(table, responses=["y"])
    assert report.tables["effects"].set_index("Term").loc["a", "Effect"] == pytest.approx(2)
    assert "the 6 centre runs lie +5 from the mean" in report.text()


def test_report_is_frozen_and_writes_text_json_and_csv(tmp_path):
    analyser = MainEffects()
    report = analyser.analyse(plackett_burman(), responses=["aor_deg"])
    with pytest.raises(TypeError):
        report.numbers["pse"] = 1.0
    with pytest.raises(AttributeError):
        report.analyser = "x"
    paths = report.save(tmp_path / "out", analyser.figures(report))
    names = {path.name for path in paths}
    assert {"report.txt", "report.json", "effects.csv", "lenth.csv", "pareto.png", "half_normal.png"} <= names
    assert all(path.stat().st_size > 100 for path in paths if path.suffix in (".png", ".txt", ".json"))
    data = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert data["tables"]["effects"][5]["Term"] == "F"
    assert sorted(data["files"]) == sorted(names - {"report.txt", "report.json"})
    report.save(tmp_path / "out")  # without figures: those of before stay, and don't belong to the report
    data = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert data["files"] == ["effects.csv", "lenth.csv"]
    again = pd.read_csv(tmp_path / "out" / "effects.csv")
    np.testing.assert_allclose(again["Effect"], report.tables["effects"]["Effect"])


def test_missing_numbers_are_null_in_json():
    report = MainEffects(order=4).analyse(filtration_rate(), responses=["rate"])
    assert json.loads(report.to_json())["tables"]["effects"][0]["p"] is None
