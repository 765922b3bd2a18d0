"""The search for the laboratory's angle, over the surface and beyond it, on heaps whose angle is a known formula."""

from __future__ import annotations

from dataclasses import replace

import pytest

from taichidem.heap_comparison import LABORATORY
from taichidem.paper.checks import checks_of
from taichidem.paper.next_factor import next_factor, search_further, steadier, where_to_pour
from taichidem.paper.optimum import search
from taichidem.paper.published import FACTORS
from taichidem.paper.reproduction import find_setting
from taichidem.paper.screening import screen
from taichidem.paper.surface import fit_surface
from tests.paper.planted_heap import SMALL, PlantedHeap, kept, model_of, true_angle


def test_an_angle_out_of_reach_is_told(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -8.0)
    rounds = search(bench, fit_surface(bench))
    assert len(rounds) == 1  # pouring more would not help
    assert not rounds[0].hits
    assert "can't be brought to the laboratory's angle" in rounds[0].why_not()


def test_a_surface_that_misses_is_searched_again_with_new_seeds(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "late_offset", -1.5)
    rounds = search(bench, fit_surface(bench))
    assert len(rounds) >= 2
    assert not rounds[0].hits
    assert abs(rounds[-1].error) < abs(rounds[0].error)
    seeds = [seed for found in rounds for seed in found.heaps.seeds]
    assert len(set(seeds)) == len(seeds)


def test_a_setting_that_its_confirmation_bears_out_is_not_searched_further(bench):
    rounds = find_setting(bench, screen(bench), fit_surface(bench))
    assert rounds[-1].settled
    assert not any(found.raised for found in rounds)
    assert len(rounds[-1].heaps.seeds) == SMALL.confirmation
    assert "seeds that no search has seen" in rounds[-1].how


def test_a_setting_that_its_confirmation_refutes_is_searched_further(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "late_offset", -1.5)
    monkeypatch.setattr(PlantedHeap, "late", 7000)  # the confirmation's seeds
    monkeypatch.setattr(PlantedHeap, "rolling", 25.0)
    screening, surface = screen(bench), fit_surface(bench)
    rounds = find_setting(bench, screening, surface)
    raised = [found.raised for found in rounds]
    refuted = rounds[raised.index(True) - 1]
    assert rounds[0].hits
    assert refuted.heaps.seeds == tuple(range(7001, 7001 + SMALL.confirmation))
    assert not refuted.hits
    assert all(raised[raised.index(True) :])
    seeds = [seed for found in rounds for seed in found.heaps.seeds]
    assert len(set(seeds)) == len(seeds)
    numbers = [found.confirmation for found in rounds if found.confirmation]
    assert numbers == list(range(1, 1 + len(numbers)))
    assert rounds[-1].confirmation == numbers[-1] >= 2
    assert len(rounds[-1].heaps.seeds) == SMALL.confirmation
    fine = replace(rounds[-1].heaps, diameter=0.003)
    checks = {c.name: c for c in checks_of(screening, surface, rounds, fine)}
    assert checks["heap at the surface's optimum of F, D, B, 6 mm"].met is False
    told = f"Confirmations before it missed with {refuted.heaps.mean:.2f}° ± "
    assert told in checks["confirmation, 6 mm"].note


def test_heaps_that_hit_where_they_were_not_expected_to_settle_nothing(bench, monkeypatch):
    monkeypatch.setattr(PlantedHeap, "offset", -4.5 - 25.0 * 0.05)
    monkeypatch.setattr(PlantedHeap, "late_offset", 2.0)  # at the optimum: 30.5° where 28.5° is expected
    monkeypatch.setattr(PlantedHeap, "rolling", 25.0)
    screening, surface = screen(bench), fit_surface(bench)
    rounds = find_setting(bench, screening, surface)
    assert rounds[0].hits
    assert rounds[0].out_of_reach
    assert not rounds[0].settled
    assert rounds[1].raised
    checks = {c.name: c for c in checks_of(screening, surface, rounds, kept([30.0, 30.2], 0.003))}
    by_surface = checks["heap at the surface's optimum of F, D, B, 6 mm"]
    assert by_surface.met is False
    assert "hit by chance" in by_surface.note


def test_a_deeper_fall_that_alone_brings_the_angle_is_confirmed_at_once(bench, monkeypatch):
    screening, surface = screen(bench), fit_surface(bench)
    last = search(bench, surface)[-1]
    monkeypatch.setattr(PlantedHeap, "raised", 0.0)
    alone, confirmed = search_further(bench, screening, last)
    assert alone.hits
    assert confirmed.hits
    assert (confirmed.levels, confirmed.confirmation) == (alone.levels, 2)


def hit_only_by_the_search(bench, monkeypatch):
    """Return the screening and a setting that the deeper fall leaves at the laboratory's angle, but for confirmations."""
    screening = screen(bench)
    last = search(bench, fit_surface(bench))[-1]
    monkeypatch.setattr(PlantedHeap, "raised", 0.0)
    monkeypatch.setattr(PlantedHeap, "late_offset", -1.0)
    monkeypatch.setattr(PlantedHeap, "late", 7000)
    return screening, last


def test_where_that_is_refuted_and_no_factor_is_left_it_ends_there(bench, monkeypatch):
    screening, last = hit_only_by_the_search(bench, monkeypatch)
    unmoved = replace(screening, effects=screening.effects.assign(effect=0.0))
    found = search_further(bench, unmoved, last)
    assert [each.confirmation for each in found] == [None, 2]
    assert not found[-1].hits


def test_where_that_is_refuted_the_next_factor_is_freed_from_all_heaps_so_far(bench, monkeypatch):
    screening, last = hit_only_by_the_search(bench, monkeypatch)
    monkeypatch.setattr(PlantedHeap, "rolling", 25.0)
    monkeypatch.setattr(PlantedHeap, "offset", -25.0 * 0.05)  # as it was at H = 0.05
    alone, refuted, step, *confirmations = search_further(bench, screening, last)
    assert alone.hits
    assert not refuted.hits
    assert "the screening's next factor" in step.how
    assert [found.confirmation for found in confirmations] == list(range(3, 3 + len(confirmations)))
    seeds = [seed for found in (alone, refuted, step, *confirmations) for seed in found.heaps.seeds]
    assert len(set(seeds)) == len(seeds)


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
    truth = true_angle(model_of(levels)) + 25.0 * levels["H"] - 6.0 + PlantedHeap.raised
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
    assert "the curve through the heaps at 3 values of H" in confirmed.how
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
    assert where_to_pour([(0.05, [28.08, 28.28])], rolling, 3.9) == near(0.25, 30.18)
    assert where_to_pour([(0.05, [28.18]), (0.25, [32.18])], rolling, 3.9) == near(0.15, 30.18)
    assert where_to_pour([(0.05, [20.18])], rolling, 3.9) == near(0.44, 24.08)
    assert where_to_pour([(0.05, [29.98])], rolling, 3.9) == near(0.128, 30.76)  # a fifth of the range at least
    back = where_to_pour([(0.05, [32.18]), (0.25, [31.18])], rolling, 3.9)  # it falls where it should rise
    assert back == near(0.05, 30.68)
    bent = [(h, [25.0 + 50.0 * h - 60.0 * h * h]) for h in (0.05, 0.1, 0.3)]
    value, expected = where_to_pour(bent, rolling, 3.9)
    assert 25.0 + 50.0 * value - 60.0 * value**2 == pytest.approx(LABORATORY[0], abs=0.02)
    assert expected == pytest.approx(LABORATORY[0], abs=0.02)


def test_the_search_goes_by_positions_shifted_to_what_pictures_give():
    first = replace(kept([29.0, 30.0]), profile_angles=(30.2, 30.8))
    other = replace(kept([34.0, 33.0]), profile_angles=(35.1, 33.9))
    (low, at_low), (high, at_high) = steadier([(0.05, first), (0.2, other)])
    assert (low, high) == (0.05, 0.2)
    assert at_low == pytest.approx([29.2, 29.8])
    assert at_high == pytest.approx([34.1, 32.9])
