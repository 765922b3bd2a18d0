"""What a campaign leaves to other processes that work on the same store."""

from __future__ import annotations

import pytest

from taichidem.study import campaign, run_all
from taichidem.study.execution import execute
from tests.study.campaign_script import made


@pytest.fixture
def meanwhile(monkeypatch, store):
    """Say what another process writes while each batch of this one is simulated; return the seeds that this one simulates."""
    plan, here = {}, []

    def simulate(part, report):
        here.append([run.seed for run in part])
        rows = execute(part, report)
        if part[0].seed in plan:
            store.add(*execute(plan[part[0].seed]))
        return rows

    monkeypatch.setattr(campaign, "execute", simulate)
    return plan, here


def test_what_another_process_has_made_meanwhile_is_not_made_again(store, meanwhile):
    plan, here = meanwhile
    runs, shares = made(range(8), failing_seed=3), []
    plan[0] = [runs[2], runs[3], runs[5]]
    table = run_all(runs, store, shares.append, worlds=2)
    assert here == [[0, 1], [4], [6, 7]]
    assert [seed for seed, stored in enumerate(table["stored"]) if stored] == [2, 3, 5]
    assert list(table["status"]) == ["done"] * 3 + ["failed"] + ["done"] * 4
    assert shares == sorted(shares)
    assert shares[-2:] == [1.0, 1.0]  # every run was counted, once


def test_a_failed_run_of_another_process_is_tried_again_when_asked(store, meanwhile):
    plan, here = meanwhile
    runs = made(range(4), failing_seed=3)
    plan[0] = runs[2:]
    run_all(runs, store, worlds=2, retry_failed=True)
    assert here == [[0, 1], [3]]


def test_who_finds_its_batch_written_goes_on_in_the_middle_of_what_is_left(store, meanwhile):
    plan, here = meanwhile
    runs = made(range(12))
    plan[0] = runs[:1]  # one of the two is enough to know that somebody is there
    table = run_all(runs, store, worlds=2)
    assert here == [[0, 1], [6, 7], [8, 9], [10, 11], [2, 3], [4, 5]]
    assert not table["stored"].any()
    assert list(table["status"]) == ["done"] * 12


def test_batches_are_looked_up_before_they_are_sent_to_workers(store, monkeypatch):
    runs, sent = made(range(12)), []

    def computed(parts, executor):
        for part in parts:
            sent.append([run.seed for run in part])
            store.add(*execute(runs[6:10]))
            yield execute(part)

    monkeypatch.setattr(campaign, "computed", computed)
    table = run_all(runs, store, worlds=2, executor=object())
    assert sent == [[0, 1], [2, 3], [4, 5], [10, 11]]
    assert [seed for seed, stored in enumerate(table["stored"]) if stored] == [6, 7, 8, 9]
