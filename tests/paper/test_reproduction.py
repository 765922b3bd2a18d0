"""The paper's flow from screening to held-out tests, on heaps whose angle is a known formula."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from analysis.report import Report
from taichidem import plugins
from taichidem.errors import InputError, SimulationError
from taichidem.heap_comparison import LABORATORY
from taichidem.paper import held_out, kept_heaps, reproduction, session
from taichidem.paper.checks import _of_failures, _of_heaps, _of_time, checks_of, time_saved
from taichidem.paper.effort import EFFORTS, Effort
from taichidem.paper.heaps import model_at
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.paper.next_factor import next_factor, search_further, steadier, where_to_pour
from taichidem.paper.optimum import search
from taichidem.paper.published import FACTORS, REMARKS
from taichidem.paper.reproduction import reproduce
from taichidem.paper.screening import screen
from taichidem.paper.surface import fit_surface
from taichidem.runtime import cores
from taichidem.study import RunStore, read_study, run_all
from tests.paper import planted_heap
from tests.paper.planted_heap import PlantedHeap, true_angle

SMALL = Effort("quick", softened=True, screening=1, surface=2, search=4, confirmation=6, fine=2, held_out=2)


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
    assert len(PlantedHeap.poured) == 12 + 34 + 4 * (len(result.rounds) - 1) + 6 + 2
    assert len(set(PlantedHeap.poured)) == len(PlantedHeap.poured)


def test_the_screening_finds_what_was_planted(result):
    assert result.screening.leading[:2] == ["F", "D"]
    effects = result.screening.effects.set_index("factor")
    planted = [true_angle(result_model({"F": f, "D": 0.635})) for f in (0.1, 0.6)]
    assert effects.loc["F", "effect"] == pytest.approx(
        planted[1] - planted[0], abs=4 * planted_heap.SCATTER / np.sqrt(3)
    )
    assert effects.loc["D", "effect"] < 0
    assert effects.loc["F", "u"] == pytest.approx(result.screening.report.numbers["s"] * 2 / np.sqrt(12))
    assert effects["paper_effect"].tolist()[:2] == [11.429, -6.589]
    assert list(result.screening.runs["ours"].round(6)) == list(result.screening.heaps["aor_deg"].round(6))


def result_model(levels):
    return model_at(levels, softened=True)


def test_the_surface_keeps_what_was_planted(result):
    points = result.surface.points
    assert len(points) == 15
    assert points["heaps"].sum() == 34
    assert points.loc[(points["F"] == 0.35) & (points["D"] == 0.635) & (points["B"] == 998), "heaps"].item() == 6
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
    assert met["confirmation, 6 mm"]
    assert met["optimum (setting)"] is None
    page = (result.folder / "report.html").read_text(encoding="utf-8")
    for check in result.checks:
        assert check.name in page
    assert 'src="http' not in page
    assert len(re.findall(r'<img src="data:image/png', page)) >= 8
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
    assert "can't be brought to the laboratory's angle" in rounds[0].why_not()


def test_the_screening_s_next_factor_brings_a_heap_within_reach_that_the_surface_leaves_out(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -6.0)
    monkeypatch.setattr(PlantedHeap, "rolling", 25.0)
    screening, surface = screen(bench), fit_surface(bench)
    rounds = search(bench, surface)
    further = search_further(bench, screening, rounds[-1])
    assert not rounds[-1].hits
    alone, step, *missed, confirmed = further
    assert alone.levels == rounds[-1].levels
    assert alone.heaps.mean == pytest.approx(rounds[-1].heaps.mean + PlantedHeap.raised, abs=0.6)
    assert len(missed) <= 1
    levels = confirmed.levels
    assert {key: levels[key] for key in "FDB"} == rounds[-1].levels
    truth = true_angle(result_model(levels)) + 25.0 * levels["H"] - 6.0 + PlantedHeap.raised
    assert truth == pytest.approx(LABORATORY[0], abs=0.5)
    assert "H (rolling friction PP–PP), the screening's next factor with +" in step.how
    seeds = [seed for found in [*rounds, *further] for seed in found.heaps.seeds]
    assert len(set(seeds)) == len(seeds)  # the confirmation's own among them
    assert len(confirmed.heaps.seeds) == SMALL.confirmation
    checks = {c.name: c for c in checks_of(screening, surface, [*rounds, *further], confirmed.heaps)}
    assert checks["heap at the surface's optimum of F, D, B, 6 mm"].met is False
    assert "H = 0." in checks["optimum (setting)"].ours


def test_a_confirmation_that_misses_joins_the_search_and_the_last_one_counts(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -6.0)
    monkeypatch.setattr(PlantedHeap, "bent", 60.0)  # the line through two sets misses, the quadratic doesn't
    screening, surface = screen(bench), fit_surface(bench)
    alone, step, missed, confirmed = search_further(bench, screening, search(bench, surface)[-1])
    assert not missed.hits
    assert abs(confirmed.error) < abs(missed.error)
    assert "the heaps of the confirmation before" in confirmed.how
    seeds = [found.heaps.seeds for found in (alone, step, missed, confirmed)]
    assert len({seed for each in seeds for seed in each}) == sum(map(len, seeds))


def test_no_heap_is_poured_beyond_the_end_of_the_next_factor_s_range(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -20.0)
    monkeypatch.setattr(PlantedHeap, "rolling", 10.0)
    screening, rounds = screen(bench), search(bench, fit_surface(bench))
    further = search_further(bench, screening, rounds[-1])
    assert [found.levels.get("H") for found in further] == [None, 0.44, 0.44]
    assert further[-1].out_of_reach
    assert not further[-1].hits
    assert "can't be brought to the laboratory's angle" in further[-1].why_not()


def test_a_surface_that_is_enough_is_not_searched_further(bench):
    screening, rounds = screen(bench), search(bench, fit_surface(bench))
    assert rounds[-1].hits
    assert search_further(bench, screening, rounds[-1]) == []


def test_what_no_factor_can_move_is_confirmed_as_it_is(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -8.0)
    screening, rounds = screen(bench), search(bench, fit_surface(bench))
    effects = screening.effects.assign(effect=0.0)
    further = search_further(bench, replace(screening, effects=effects), rounds[-1])
    assert [found.levels for found in further] == [rounds[-1].levels] * 2


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


def test_steps_follow_the_effect_then_a_line_then_a_quadratic():
    (rolling,) = (factor for factor in FACTORS if factor.letter == "H")
    near = lambda *pair: pytest.approx(pair, abs=2e-3)  # noqa: E731  # places along the range
    assert where_to_pour({0.05: [28.08, 28.28]}, rolling, 3.9) == near(0.25, 30.18)
    assert where_to_pour({0.05: [28.18], 0.25: [32.18]}, rolling, 3.9) == near(0.15, 30.18)
    assert where_to_pour({0.05: [20.18]}, rolling, 3.9) == near(0.44, 24.08)
    bent = {h: [25.0 + 50.0 * h - 60.0 * h * h] for h in (0.05, 0.1, 0.3)}
    value, expected = where_to_pour(bent, rolling, 3.9)
    assert 25.0 + 50.0 * value - 60.0 * value**2 == pytest.approx(LABORATORY[0], abs=0.02)
    assert expected == pytest.approx(LABORATORY[0], abs=0.02)


def test_the_search_goes_by_positions_shifted_to_what_pictures_give():
    first = replace(kept([29.0, 30.0]), profile_angles=(30.2, 30.8))
    other = replace(kept([34.0, 33.0]), profile_angles=(35.1, 33.9))
    found = steadier({0.05: first, 0.2: other})
    assert found[0.05] == pytest.approx([29.2, 29.8])
    assert found[0.2] == pytest.approx([34.1, 32.9])


def test_a_failed_heap_is_left_out(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "failing", {2010, 3001})
    surface = fit_surface(bench)
    assert surface.points["heaps"].sum() == 33
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


def test_a_heap_whose_grains_were_deleted_is_poured_again_and_no_other(result, planted, monkeypatch):
    monkeypatch.setattr(Report, "save", lambda *_: [])
    before = len(PlantedHeap.poured)
    next((result.folder / "fine_heaps").glob("grains_*.vtp")).unlink()
    again = reproduce(result.folder)
    assert len(PlantedHeap.poured) == before + 1
    assert again.fine.angles == result.fine.angles


def test_what_was_poured_before_a_stop_is_kept(bench, monkeypatch):
    monkeypatch.setattr(kept_heaps, "WORLDS_PER_THREAD", 1)
    monkeypatch.setattr(kept_heaps.runtime, "start", lambda: SimpleNamespace(threads=2))
    pour = PlantedHeap.run
    lots = []

    def stopped(self, models, seeds, **options):
        if len(lots) == 2:
            raise KeyboardInterrupt
        lots.append(list(seeds))
        return pour(self, models, seeds, **options)

    monkeypatch.setattr(PlantedHeap, "run", stopped)
    heap, model = planted_heap.coarse_heap(), result_model({})
    with pytest.raises(KeyboardInterrupt):
        kept_heaps.pour_and_keep(bench, "heaps", heap, model, [1, 2, 3, 4, 5])
    monkeypatch.setattr(PlantedHeap, "run", pour)
    PlantedHeap.poured.clear()
    assert kept_heaps.pour_and_keep(bench, "heaps", heap, model, [1, 2, 3, 4, 5]).seeds == (1, 2, 3, 4, 5)
    assert lots == [[1, 2], [3, 4]]
    assert PlantedHeap.poured == [5]


def test_a_changed_heap_gets_a_picture_of_its_own(bench, monkeypatch):
    monkeypatch.undo()
    with pytest.MonkeyPatch.context() as patch:
        planted_heap.plant(patch)
        shown = [
            kept_heaps.pour_and_keep(bench, "heaps", planted_heap.coarse_heap(), result_model({"F": friction}), [1])
            for friction in (0.2, 0.5)
        ]
    assert shown[0].pictures["heap"] != shown[1].pictures["heap"]


def test_time_is_that_of_the_processor_over_the_pour_alone(bench, monkeypatch):
    clock = iter([10.0, 16.0, 99.0])  # at the start, when the last grain rests, and whatever comes later
    monkeypatch.setattr(kept_heaps, "process_time", lambda: next(clock))
    heaps = kept_heaps.pour_and_keep(bench, "heaps", planted_heap.coarse_heap(), result_model({}), [1, 2, 3])
    assert heaps.pouring == 2.0
    slower = replace(heaps, pouring=40.0)
    assert time_saved(heaps, slower) == 95.0


def test_a_pour_that_is_stopped_goes_on_from_its_checkpoint_and_is_not_timed(bench, monkeypatch):
    pour, states = PlantedHeap.run, []

    def noted(self, models, seeds, *, checkpoint, **options):
        states.append((checkpoint, checkpoint.exists()))
        if len(states) == 1:
            checkpoint.write_text("so far")
            raise KeyboardInterrupt
        return pour(self, models, seeds, **options)

    monkeypatch.setattr(PlantedHeap, "run", noted)
    heaps = (bench, "heaps", planted_heap.coarse_heap(), result_model({}), [1, 2])
    with pytest.raises(KeyboardInterrupt):
        kept_heaps.pour_and_keep(*heaps)
    found = kept_heaps.pour_and_keep(*heaps)
    assert states[0][0] == states[1][0]
    assert states[1][1]
    assert np.isnan(found.pouring)
    assert not list((bench.folder / "heaps").glob("*.state"))
    (check,) = [_of_time(found, found)]
    assert check.met is False
    assert "Not known" in check.note


def kept(angles, diameter=0.006):
    """Return heaps of these angles that were never poured."""
    angles = tuple(angles)
    return KeptHeaps(diameter, tuple(range(len(angles))), angles, angles, {"window": 0.3}, 1.0, 0, {}, {})


@pytest.mark.parametrize(
    ("diameter", "angle", "met"),
    [(0.006, 30.6, True), (0.006, 29.6, False), (0.003, 29.2, True), (0.003, 31.3, False)],
)
def test_a_confirmation_counts_within_the_paper_s_own_error(diameter, angle, met):
    check = _of_heaps(kept([angle - 0.2, angle, angle + 0.2], diameter), "Why.")
    assert check.met is met
    assert f"E = {angle - 30.18:+.2f}° with u_val = 0." in check.note
    assert ("Why." in check.note) is not met


def test_heaps_left_out_are_told(result):
    failed = result.screening.heaps.assign(reason=["World 0 diverged.", *[""] * 11])
    told = list(_of_failures(replace(result.screening, heaps=failed), result.surface, [result.fine]))
    assert [check.ours for check in told] == [f"1 of {12 + 34 + 2}"]
    assert "World 0 diverged" in told[0].note
    assert not list(_of_failures(result.screening, result.surface, [result.fine]))
