"""Heaps that are poured one lot at a time, kept, timed and compared with the laboratory."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichidem.errors import SimulationError
from taichidem.paper import kept_heaps
from taichidem.paper.checks import _of_heaps, _of_optimum, _of_time, time_saved
from taichidem.paper.optimum import Optimum, search
from taichidem.paper.surface import fit_surface
from tests.paper import planted_heap
from tests.paper.planted_heap import PlantedHeap, kept, model_of


def test_a_failed_heap_is_left_out(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "failing", {2010, 3001})
    surface = fit_surface(bench)
    assert surface.points["heaps"].sum() == 33
    found = search(bench, surface)[0]
    assert found.heaps.failures == {3001: "World 0 diverged"}
    assert 3001 not in found.heaps.seeds


def test_what_was_poured_before_a_stop_is_kept(bench, monkeypatch):
    monkeypatch.setattr(kept_heaps, "worlds_at_once", lambda threads: threads)
    monkeypatch.setattr(kept_heaps.runtime, "start", lambda: SimpleNamespace(threads=2))
    pour = PlantedHeap.run
    lots = []

    def stopped(self, models, seeds, **options):
        if len(lots) == 2:
            raise KeyboardInterrupt
        lots.append(list(seeds))
        return pour(self, models, seeds, **options)

    monkeypatch.setattr(PlantedHeap, "run", stopped)
    heap, model = planted_heap.coarse_heap(), model_of({})
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
            kept_heaps.pour_and_keep(bench, "heaps", planted_heap.coarse_heap(), model_of({"F": friction}), [1])
            for friction in (0.2, 0.5)
        ]
    assert shown[0].pictures["heap"] != shown[1].pictures["heap"]


def test_time_is_that_of_the_processor_over_the_pour_alone(bench, monkeypatch):
    clock = iter([10.0, 16.0, 99.0])  # at the start, when the last grain rests, and whatever comes later
    monkeypatch.setattr(kept_heaps, "process_time", lambda: next(clock))
    heaps = kept_heaps.pour_and_keep(bench, "heaps", planted_heap.coarse_heap(), model_of({}), [1, 2, 3])
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
    heaps = (bench, "heaps", planted_heap.coarse_heap(), model_of({}), [1, 2])
    with pytest.raises(KeyboardInterrupt):
        kept_heaps.pour_and_keep(*heaps)
    found = kept_heaps.pour_and_keep(*heaps)
    assert states[0][0] == states[1][0]
    assert states[1][1]
    assert np.isnan(found.pouring)
    assert not list((bench.folder / "heaps").glob("*.state"))
    (check,) = [_of_time(found, found)]
    assert check.met is None
    assert check.ours == "not known"


@pytest.mark.parametrize(
    ("diameter", "angle", "met"),
    [(0.006, 30.6, True), (0.006, 29.6, False), (0.003, 29.2, True), (0.003, 31.3, False)],
)
def test_a_confirmation_counts_within_the_paper_s_own_error(diameter, angle, met):
    check = _of_heaps(kept([angle - 0.2, angle, angle + 0.2], diameter), "Why.")
    assert check.met is met
    assert f"E = {angle - 30.18:+.2f}° with u_val = 0." in check.note
    assert ("Why." in check.note) is not met


def test_one_heap_confirms_nothing():
    check = _of_heaps(kept([30.2], 0.003), "Why.", "One before it missed.")
    assert check.met is None
    assert "nan" not in check.ours + check.note
    assert "One before it missed." in check.note
    by_surface = _of_optimum(Optimum({"F": 0.5}, 30.2, "", kept([30.2])))
    assert by_surface.met is None
    assert "nan" not in by_surface.ours + by_surface.note


def test_heaps_that_all_fail_end_it(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "failing", {1, 2})
    with pytest.raises(SimulationError, match=r"Every heap of heaps failed\. The first: World 0 diverged"):
        kept_heaps.pour_and_keep(bench, "heaps", planted_heap.coarse_heap(), model_of({}), [1, 2])


def test_a_checkpoint_that_a_kill_left_behind_is_cleared(bench):
    heaps = (bench, "heaps", planted_heap.coarse_heap(), model_of({}), [1])
    kept_heaps.pour_and_keep(*heaps)
    left = bench.folder / "heaps" / "0123.state"
    left.write_text("so far")
    kept_heaps.pour_and_keep(*heaps)
    assert not left.exists()
