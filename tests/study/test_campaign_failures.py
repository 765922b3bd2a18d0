"""Campaigns in which something fails: each run costs only itself, whichever others share its batch."""

from __future__ import annotations

import pytest

from taichidem import runtime
from taichidem.errors import CompositionError, EnvironmentProblem, InputError
from taichidem.experiments import FixedFunnel
from taichidem.study import Run, RunStore, campaign, run_all
from taichidem.study.run_store import LARGEST_SEED
from tests.study.campaign_script import MODEL, made, small_pour
from tests.study.fakes import Quick


@pytest.mark.parametrize("worlds", [1, 3, 8])
def test_a_run_that_breaks_its_batch_costs_only_itself(store, worlds):
    table = run_all(made(range(8), dividing_seed=5, stopping_seed=6), store, worlds=worlds)
    assert list(table["status"]) == ["done"] * 5 + ["failed"] + ["done"] * 2
    assert table["reason"][5] == "ZeroDivisionError: divided by 5"
    assert list(table["attempts"]) == [1] * 6 + [2, 1]
    assert table["angle"].tolist()[:5] == [30 * 0.4 + seed / 7 for seed in range(5)]  # each with its own seed


class Refusing(FixedFunnel):
    """Grains that never come, for a reason with a number of its own."""

    def procedure(self, world, model):
        raise InputError(f"drew {world.rng.random()}")
        yield


def test_where_every_world_fails_each_row_has_its_own_reason(tmp_path):
    found = {}
    for worlds in (1, 3):
        test = Refusing(**small_pour().settings.model_dump())
        with RunStore(tmp_path / f"{worlds}.sqlite") as store:
            table = run_all([Run(test, MODEL, seed) for seed in (1, 2, 3)], store, worlds=worlds)
        assert set(table["status"]) == {"failed"}
        found[worlds] = list(table["reason"])
    assert found[1] == found[3]
    assert len(set(found[3])) == 3


class Sceneless(Quick):
    """A test whose scene can't be built at one of its widths."""

    error: Exception = KeyError("no such grain")

    def scene(self, model):
        if self.settings.width == 0.05:
            raise self.error
        return super().scene(model)


def sceneless(width, seeds=(1, 2)):
    return [Run(Sceneless(width=width), MODEL, seed) for seed in seeds]


def test_a_scene_that_breaks_is_a_failed_row_whatever_the_error(store):
    table = run_all([*sceneless(0.05), *sceneless(0.06)], store)
    assert list(table["status"]) == ["failed"] * 2 + ["done"] * 2
    assert table["reason"][0] == "KeyError: 'no such grain'"


@pytest.mark.parametrize("error", [CompositionError("they exclude each other"), EnvironmentProblem("no device")])
def test_a_scene_with_a_fault_of_all_runs_ends_the_campaign(store, monkeypatch, error):
    monkeypatch.setattr(Sceneless, "error", error)
    with pytest.raises(type(error), match=str(error)):
        run_all([*sceneless(0.05), *sceneless(0.06)], store)
    assert len(store) == 0


def test_what_is_left_of_a_campaign_may_fail_as_a_whole(store, monkeypatch):
    """Whether the same runs are made in one go or in two must not matter."""
    good, bad = sceneless(0.06), sceneless(0.05)
    with pytest.raises(InputError, match=r"No run can be set up\. KeyError: 'no such grain'"):
        run_all(bad, store)
    assert len(store) == 0
    run_all(good, store)
    monkeypatch.setattr(runtime, "start", None)  # nothing is simulated, so nothing is begun for it
    shares = []
    table = run_all([*good, *bad], store, shares.append)
    assert list(table["status"]) == ["done"] * 2 + ["failed"] * 2
    assert list(table["stored"]) == [True] * 2 + [False] * 2
    assert shares == [1.0]
    assert run_all(bad, store, retry_failed=True)["status"].tolist() == ["failed"] * 2  # begun: they are in the store


def test_runs_without_a_grain_count_too(store, monkeypatch):
    monkeypatch.setattr(campaign, "_room", lambda run: 0.0)
    shares = []
    run_all(made([1, 2]), store, shares.append)
    assert shares[-1] == 1.0


@pytest.mark.parametrize("seed", [-1, LARGEST_SEED + 1])
def test_a_seed_that_no_row_can_hold_is_refused_before_anything_is_run(store, seed):
    with pytest.raises(InputError, match=rf"A seed of quick is {seed}; give whole numbers from 0 to {LARGEST_SEED}"):
        run_all(made([1, seed]), store)
    assert Quick.batches == []
    table = run_all(made([LARGEST_SEED]), store)
    assert (table["seed"][0], table["status"][0]) == (LARGEST_SEED, "done")
