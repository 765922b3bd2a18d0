"""The paper's flow from screening to held-out tests, on heaps whose angle is a known formula."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.report import Report
from taichidem import plugins
from taichidem.errors import InputError, SimulationError
from taichidem.heap_comparison import LABORATORY
from taichidem.paper import held_out, kept_heaps, reproduction, session
from taichidem.paper.checks import checks_of
from taichidem.paper.effort import EFFORTS, Effort
from taichidem.paper.heaps import model_at
from taichidem.paper.next_factor import _step, next_factor, search_further
from taichidem.paper.optimum import search
from taichidem.paper.published import FACTORS
from taichidem.paper.reproduction import reproduce
from taichidem.paper.screening import screen
from taichidem.paper.surface import fit_surface
from taichidem.study import RunStore, read_study, run_all
from tests.paper import planted_heap
from tests.paper.planted_heap import PlantedHeap, true_angle

SMALL = Effort("quick", softened=True, screening=1, surface=2, coarse=4, fine=2, held_out=2)


@pytest.fixture(scope="module")
def planted():
    """The flow with planted heaps, a small cup as the only held-out test, and few heaps."""
    with pytest.MonkeyPatch.context() as patch:
        planted_heap.plant(patch)
        patch.setitem(EFFORTS, "quick", SMALL)
        yield
    plugins.refresh()


@pytest.fixture(scope="module")
def result(planted, tmp_path_factory):
    PlantedHeap.poured.clear()
    return reproduce(tmp_path_factory.mktemp("paper") / "quick")


def test_every_run_of_both_designs_is_poured_once(result):
    assert len(PlantedHeap.poured) == 12 + 20 * 2 + 4 * len(result.rounds) + 2
    assert len(set(PlantedHeap.poured)) == len(PlantedHeap.poured)


def test_the_screening_finds_what_was_planted(result):
    assert result.screening.leading[:2] == ["F", "D"]
    effects = result.screening.effects.set_index("factor")
    planted = [true_angle(result_model({"F": f, "D": 0.635})) for f in (0.1, 0.6)]
    assert effects.loc["F", "effect"] == pytest.approx(
        planted[1] - planted[0], abs=4 * planted_heap.SCATTER / np.sqrt(3)
    )
    assert effects.loc["D", "effect"] < 0
    assert effects["paper_effect"].tolist()[:2] == [11.429, -6.589]
    assert list(result.screening.runs["ours"].round(6)) == list(result.screening.heaps["aor_deg"].round(6))


def result_model(levels):
    return model_at(levels, softened=True)


def test_the_surface_keeps_what_was_planted(result):
    points = result.surface.points
    assert len(points) == 15
    assert points["heaps"].sum() == 40
    assert points.loc[(points["F"] == 0.35) & (points["D"] == 0.635) & (points["B"] == 998), "heaps"].item() == 12
    for row in points.to_dict("records"):
        truth = true_angle(result_model({k: row[k] for k in "FDB"}))
        assert row["ours"] == pytest.approx(truth, abs=4 * planted_heap.SCATTER / np.sqrt(2))
    apart = points["ours"] - points["paper"]
    assert result.surface.rms == pytest.approx(float(np.sqrt((apart**2).mean())))
    assert set(result.surface.report.details["fit"].labels()) >= {"F", "D", "F*F"}


def test_the_optimum_hits_the_laboratory(result):
    assert result.optimum.hits
    assert result.optimum.why_not() == ""
    assert abs(true_angle(result_model(result.optimum.levels)) - LABORATORY[0]) < 1.0
    assert result.optimum.heaps.mean == pytest.approx(np.mean(result.optimum.heaps.angles))
    assert result.optimum.levels["B"] == 910.0  # in no model, so the measured density


def test_the_checks_are_told_by_table_page_and_file(result):
    met = {check.name: check.met for check in result.checks}
    assert met["leading factors of the screening (Table 7)"]
    assert met["heap at the optimum of F, D, B, 6 mm"]
    assert met["error at 6 mm"]
    page = (result.folder / "report.html").read_text(encoding="utf-8")
    for check in result.checks:
        assert check.name in page
    assert 'src="http' not in page
    assert len(re.findall(r'<img src="data:image/png', page)) >= 8
    held = json.loads((result.folder / "paper.json").read_text())
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
    assert "Tests the model was not fitted to" in out
    code, out, _ = command("reproduce", "paper", "-o", result.folder, "--json")
    assert json.loads(out)["effort"] == "quick"
    assert asked == [((result.folder, "quick"), None)] * 2
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


@pytest.fixture
def bench(planted, tmp_path, monkeypatch):
    """A session in a folder of its own, in which nothing is drawn."""
    monkeypatch.setattr(kept_heaps, "_draw", lambda *_: {})
    monkeypatch.setattr(Report, "save", lambda *_: [])
    with RunStore(tmp_path / "runs.sqlite") as store:
        yield session.Session(tmp_path, store, SMALL, lambda stage, share: None)


def test_an_angle_out_of_reach_is_told(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -8.0)
    rounds = search(bench, fit_surface(bench))
    assert len(rounds) == 1  # pouring more would not help
    assert not rounds[0].hits
    assert "can't bring the heap" in rounds[0].why_not()


def test_the_screening_s_next_factor_brings_a_heap_within_reach_that_the_surface_leaves_out(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -6.0)
    monkeypatch.setattr(PlantedHeap, "rolling", 25.0)
    screening, rounds = screen(bench), search(bench, fit_surface(bench))
    further = list(search_further(bench, screening, rounds[-1]))
    assert not rounds[-1].hits
    assert further[-1].hits
    levels = further[-1].levels
    assert {key: levels[key] for key in "FDB"} == rounds[-1].levels
    assert true_angle(result_model(levels)) + 25.0 * levels["H"] - 6.0 == pytest.approx(LABORATORY[0], abs=0.8)
    assert "H (rolling friction PP–PP), the screening's next factor with +" in further[0].how
    seeds = [seed for found in [*rounds, *further] for seed in found.heaps.seeds]
    assert len(set(seeds)) == len(seeds)
    names = [check.name for check in checks_of(screening, fit_surface(bench), [*rounds, *further], further[-1].heaps)]
    assert "heap at the optimum of F, D, B, 6 mm" in names
    assert "heap at the optimum of F, D, B, H, 6 mm" in names


def test_no_heap_is_poured_beyond_the_end_of_the_next_factor_s_range(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -20.0)
    monkeypatch.setattr(PlantedHeap, "rolling", 10.0)
    screening, rounds = screen(bench), search(bench, fit_surface(bench))
    further = list(search_further(bench, screening, rounds[-1]))
    assert [found.levels["H"] for found in further] == [0.44]
    assert further[0].out_of_reach


@pytest.mark.parametrize(
    ("effects", "wanted", "letter"),
    [
        ({"H": 2.0, "I": -9.0}, +1.0, "H"),  # I stands at its low end, where it can only lower the angle
        ({"H": 2.0, "I": -9.0}, -1.0, "I"),
        ({"H": -2.0}, +1.0, None),
    ],
)
def test_the_next_factor_is_the_one_with_room_on_the_wanted_side(effects, wanted, letter):
    found = next_factor(dict.fromkeys("ACEGHI", 0.0) | effects, wanted)
    assert (found and found.letter) == letter


def test_steps_follow_the_effect_until_the_target_is_bracketed():
    (rolling,) = (factor for factor in FACTORS if factor.letter == "H")
    assert _step({0.05: 28.18}, rolling, 3.9) == pytest.approx((0.25, 30.18))
    assert _step({0.05: 28.18, 0.25: 32.18}, rolling, 3.9) == pytest.approx((0.15, 30.18))
    assert _step({0.05: 20.18}, rolling, 3.9) == pytest.approx((0.44, 24.08))


def test_a_failed_heap_is_left_out(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "failing", {2010, 3001})
    surface = fit_surface(bench)
    assert surface.points["heaps"].sum() == 39
    found = search(bench, surface)[0]
    assert found.heaps.failures == {3001: "World 0 diverged"}
    assert 3001 not in found.heaps.seeds


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


def test_a_surface_that_misses_is_searched_again_with_new_seeds(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "late_offset", -1.5)
    rounds = search(bench, fit_surface(bench))
    assert len(rounds) >= 2
    assert not rounds[0].hits
    assert abs(rounds[-1].error) < abs(rounds[0].error)
    seeds = [seed for found in rounds for seed in found.heaps.seeds]
    assert len(set(seeds)) == len(seeds)


def test_a_heap_whose_grains_were_deleted_is_poured_again(result, planted, monkeypatch):
    monkeypatch.setattr(Report, "save", lambda *_: [])
    before = len(PlantedHeap.poured)
    (result.folder / "fine_heaps" / f"grains_seed_{result.fine.seeds[0]}.vtp").unlink()
    again = reproduce(result.folder)
    assert len(PlantedHeap.poured) == before + 2
    assert again.fine.angles == result.fine.angles


def test_time_is_that_of_the_pour_alone(result):
    rows = [row for row in kept_rows(result) if kept_heaps.POURING in row.details]
    assert len(rows) == len(result.optimum.heaps.seeds) * len(result.rounds) + len(result.fine.seeds)
    assert result.fine.wall_time < 5.0


def kept_rows(result):
    with RunStore(result.folder / "runs.sqlite") as store:
        return store.runs()
