"""The paper's flow from screening to held-out tests, on heaps whose angle is a known formula."""

from __future__ import annotations

import html
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.report import Report
from taichidem.errors import InputError, SimulationError
from taichidem.heap_comparison import LABORATORY
from taichidem.paper import held_out, reproduction, session
from taichidem.paper.checks import _of_failures
from taichidem.paper.page import write_page
from taichidem.paper.published import REMARKS
from taichidem.paper.reproduction import reproduce
from taichidem.paper.screening import screen
from taichidem.runtime import cores
from taichidem.study import read_study, run_all
from tests.paper import planted_heap
from tests.paper.planted_heap import PlantedHeap, model_of, true_angle


@pytest.fixture(scope="module")
def result(planted, tmp_path_factory):
    PlantedHeap.poured.clear()
    return reproduce(tmp_path_factory.mktemp("paper") / "quick")


def test_every_run_of_both_designs_is_poured_once(result):
    assert len(PlantedHeap.poured) == 12 + 34 + 4 * (len(result.rounds) - 1) + 6 + 2
    assert len(set(PlantedHeap.poured)) == len(PlantedHeap.poured)


def test_the_screening_finds_what_was_planted(result):
    assert result.screening.leading[:2] == ["F", "D"]
    effects = result.screening.effects.set_index("factor")
    planted = [true_angle(model_of({"F": f, "D": 0.635})) for f in (0.1, 0.6)]
    assert effects.loc["F", "effect"] == pytest.approx(
        planted[1] - planted[0], abs=4 * planted_heap.SCATTER / np.sqrt(3)
    )
    assert effects.loc["D", "effect"] < 0
    assert effects.loc["F", "u"] == pytest.approx(result.screening.report.numbers["s"] * 2 / np.sqrt(12))
    assert effects["paper_effect"].tolist()[:2] == [11.429, -6.589]
    assert list(result.screening.runs["ours"].round(6)) == list(result.screening.heaps["aor_deg"].round(6))


def test_the_surface_keeps_what_was_planted(result):
    points = result.surface.points
    assert len(points) == 15
    assert points["heaps"].sum() == 34
    assert points.loc[(points["F"] == 0.35) & (points["D"] == 0.635) & (points["B"] == 998), "heaps"].item() == 6
    for row in points.to_dict("records"):
        truth = true_angle(model_of({k: row[k] for k in "FDB"}))
        assert row["ours"] == pytest.approx(truth, abs=4 * planted_heap.SCATTER / np.sqrt(2))
    apart = points["ours"] - points["paper"]
    assert result.surface.rms == pytest.approx(float(np.sqrt((apart**2).mean())))
    assert set(result.surface.report.details["fit"].labels()) >= {"F", "D", "F*F"}


def test_the_optimum_hits_the_laboratory(result):
    assert result.optimum.hits
    assert result.optimum.why_not() == ""
    assert abs(true_angle(model_of(result.optimum.levels)) - LABORATORY[0]) < 1.0
    assert result.optimum.heaps.mean == pytest.approx(np.mean(result.optimum.heaps.angles))
    assert result.optimum.levels["B"] == 910.0  # in no model, so the measured density


def test_the_checks_are_told_by_table_page_and_file(result):
    met = {check.name: check.met for check in result.checks}
    assert met["leading factors of the screening (Table 7)"]
    assert met["confirmation, 6 mm"]
    assert met["optimum (setting)"] is None
    page = (result.folder / "report.html").read_text(encoding="utf-8")
    for check in result.checks:
        assert check.name in page
    assert 'src="http' not in page
    assert len(re.findall(r'<img src="data:image/(?:png|webp)', page)) >= 8
    for said in ("0.40–0.92 of the cup radius", "by 1 % of itself", "n = 100", "29.25–30.86", REMARKS, "376.878"):
        assert said in html.unescape(page)
    held = json.loads((result.folder / "paper.json").read_text())
    assert held["conditions"]["heaps"]["6 mm"]["fit_from"] == 0.4
    assert len(held["checks"]) == len(result.checks)
    assert held["surface"]["rms_deg"] == pytest.approx(result.surface.rms)
    assert held["fine"]["angles"] == list(result.fine.angles)


def test_every_file_that_is_named_is_there(result):
    for heaps in (result.optimum.heaps, result.fine):
        assert all((result.folder / file).stat().st_size > 5000 for file in heaps.pictures.values())
    for name in ("screening/pareto.png", "surface/anova.csv", "optimum/report.txt", "held_out/measurements.csv"):
        assert (result.folder / name).is_file()


def test_the_held_out_study_is_read_by_compare_and_holds_the_calibrated_numbers(result, planted):
    study = read_study(result.folder / "held_out")
    values = {effect.name: effect.values for effect in study.model().effects}
    levels = result.optimum.levels
    assert values["tangential_mindlin"]["static_friction"]["granule-granule"] == pytest.approx(levels["F"])
    assert values["normal_hertz"]["restitution"]["granule-granule"] == pytest.approx(levels["D"])
    assert values["rolling_constant_torque"]["rolling_friction"]["granule-wall"] == 0.246
    assert study.particle.diameter == 0.006
    table = result.held_out.table
    assert table["measured"].item() == pytest.approx(0.55 * 910, rel=0.01)
    assert np.isfinite(table["z"]).all()


def test_again_it_runs_nothing_and_says_the_same(result, planted):
    before = len(PlantedHeap.poured)
    again = reproduce(result.folder)
    assert len(PlantedHeap.poured) == before
    assert [vars(c) for c in again.checks] == [vars(c) for c in result.checks]
    pd.testing.assert_frame_equal(again.surface.points, result.surface.points)
    assert again.held_out.runs["new"] == 0


def test_the_command_prints_the_checks_and_json(result, command, monkeypatch):
    asked = []
    monkeypatch.setattr(
        reproduction, "reproduce", lambda *given, executor: asked.append((given[:2], executor)) or result
    )
    code, out, _ = command("reproduce", "paper", "-o", result.folder)
    assert code == 0
    for check in result.checks:
        assert check.ours.split()[0] in out
    assert "Coarse grains beside grains of 3 mm with the same constants, in other tests" in out
    code, out, _ = command("reproduce", "paper", "-o", result.folder, "--json")
    assert json.loads(out)["effort"] == "quick"
    assert [given for given, _ in asked] == [(result.folder, "quick")] * 2
    assert {executor.workers for _, executor in asked} == {cores()}  # a heap is drawn on one core while others pour
    command("reproduce", "paper", "--full")
    assert asked[-1][0] == (Path("paper_full"), "full")
    code, _, err = command("reproduce", "papers")
    assert code == 2
    assert "paper" in err


def test_a_folder_of_the_other_effort_is_refused(result):
    with pytest.raises(InputError, match="holds a quick reproduction; give another folder"):
        reproduce(result.folder, "full")
    with pytest.raises(InputError, match=r"'quik'.*Did you mean 'quick'"):
        reproduce(result.folder, "quik")


def test_a_heap_whose_grains_were_deleted_is_poured_again_and_no_other(result, planted, monkeypatch):
    monkeypatch.setattr(Report, "save", lambda *_: [])
    before = len(PlantedHeap.poured)
    next((result.folder / "fine_heaps").glob("grains_*.vtp")).unlink()
    again = reproduce(result.folder)
    assert len(PlantedHeap.poured) == before + 1
    assert again.fine.angles == result.fine.angles


def test_too_many_failed_heaps_end_it(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "failing", {1010, 1020})
    with pytest.raises(SimulationError, match=r"2 of 12 heaps of the screening failed.*World 0 diverged"):
        screen(bench)


def test_designs_and_held_out_tests_go_to_the_workers(bench, monkeypatch):
    seen = []

    def watched(runs, store, report, executor):
        seen.append(executor)
        return run_all(runs, store, report)

    def compared(*arguments, executor):
        seen.append(executor)

    monkeypatch.setattr(session, "run_all", watched)
    monkeypatch.setattr(held_out, "run_all", watched)
    monkeypatch.setattr(held_out, "compare", compared)
    busy = replace(bench, executor="workers")
    screen(busy)
    held_out.confirm(busy, {"F": 0.5})
    assert seen == ["workers"] * 3


def test_heaps_left_out_are_told(result):
    failed = result.screening.heaps.assign(reason=["World 0 diverged.", *[""] * 11])
    told = list(_of_failures(replace(result.screening, heaps=failed), result.surface, [result.fine]))
    assert [check.ours for check in told] == [f"1 of {12 + 34 + 2}"]
    assert "World 0 diverged" in told[0].note
    assert not list(_of_failures(result.screening, result.surface, [result.fine]))


@pytest.mark.parametrize(("file", "hers"), [("measurements.csv", True), ("study.toml", False)])
def test_only_own_measurements_are_called_hers(result, command, monkeypatch, tmp_path, file, hers):
    folder = tmp_path / "quick"
    shutil.copytree(result.folder, folder)
    with (folder / "held_out" / file).open("a") as changed:
        changed.write("\n")
    moved = replace(result, folder=folder)
    page = html.unescape(write_page(moved).read_text(encoding="utf-8"))
    assert ("beside your measurements" in page) is hers
    assert ("real grains (3 mm) with the same constants" in page) is not hers
    assert f"{file} there is not as this program wrote" in page
    monkeypatch.setattr(reproduction, "reproduce", lambda *given, executor: moved)
    _, out, _ = command("reproduce", "paper", "-o", folder)
    assert ("Coarse grains beside your measurements" in out) is hers
