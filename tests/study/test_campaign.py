"""Campaigns: every run once, whatever happens."""

from __future__ import annotations

import os
import pickle
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from taichidem.errors import CompositionError, EnvironmentProblem, InputError
from taichidem.study import Run, RunStore, campaign, execution, read_study, run_all, simulate, summarise
from taichidem.study.execution import batches, execute, second_seed
from tests.study.campaign_script import MODEL, small_pour
from tests.study.campaign_script import runs as script_runs
from tests.study.fakes import LOG, MEASUREMENTS, Quick

ROOT = Path(__file__).resolve().parents[2]


def made(study, seeds=(1, 2, 3), name="narrow", **settings):
    test = Quick(**{"width": 0.04, **settings})
    return [Run(test, study.model(), seed, name) for seed in seeds]


def test_a_study_is_simulated_into_its_own_store(study):
    table = simulate(study, seeds=[1, 2])
    assert list(table["experiment"]) == ["narrow", "narrow", "wide", "wide"]
    assert list(table["seed"]) == [1, 2, 1, 2]
    assert list(table["angle"]) == [30 * 0.4 + seed / 7 for seed in (1, 2, 1, 2)]
    assert list(table["flow"]) == pytest.approx([40, 40, 50, 50])
    assert list(table["status"]) == ["done"] * 4
    assert not table["stored"].any()
    with RunStore(study.path / "runs.sqlite") as store:
        assert list(store.table()["key"]) == list(table["key"])
        stored = store.runs()[0]
    assert stored.experiment_type == "quick"
    assert '"diameter":0.006' in stored.settings  # everything is kept, not only what the file gave
    assert '"restitution":{"granule-granule":0.6,"granule-wall":0.7}' in stored.model
    assert stored.details == {"grains": 5}  # what can't be written is left out


def test_what_is_there_is_not_run_again(study, store):
    first = simulate(study, ["narrow"], [1, 2], store)
    again = simulate(study, None, [1, 2, 3], store)
    assert sorted(map(sorted, Quick.batches)) == [[1, 2], [1, 2, 3], [3]]
    assert list(again["stored"]) == [True, True, False, False, False, False]
    assert again["angle"].tolist()[:2] == first["angle"].tolist()
    Quick.batches.clear()
    assert simulate(study, seeds=[3, 1], store=store)["stored"].all()
    assert Quick.batches == []


def test_models_in_place_of_the_study_s_own(study, store):
    models = [study.model_with({"granule-granule.static_friction": mu}) for mu in (0.1, 0.2)]
    table = simulate(study, ["wide"], [7, 8], store, models)
    assert list(table["angle"]) == [30 * mu + seed / 7 for mu in (0.1, 0.2) for seed in (7, 8)]


def test_bad_requests(study, store):
    with pytest.raises(InputError, match=r"'narow'.*Did you mean 'narrow'"):
        simulate(study, ["narow"], [1], store)
    with pytest.raises(InputError, match="No seed was given"):
        simulate(study, seeds=[], store=store)


def test_experiments_that_are_the_same_are_run_once_and_keep_their_names(study, store):
    table = run_all([*made(study, [1], "a"), *made(study, [1], "b")], store)
    assert Quick.batches == [[1]]
    assert list(table["experiment"]) == ["a", "b"]
    assert len(store) == 1


def test_a_failed_run_is_a_row_and_not_run_again_unless_asked(study, store):
    runs = made(study, failing_seed=2)
    for retry, times in ((False, 1), (False, 1), (True, 2)):
        table = run_all(runs, store, retry_failed=retry)
        assert list(table["status"]) == ["done", "failed", "done"]
        assert table["reason"].tolist() == ["", "seed 2 diverged", ""]
        assert np.isnan(table["angle"][1])
        assert sum(batch.count(2) for batch in Quick.batches) == times
    assert sum(batch.count(1) for batch in Quick.batches) == 1


def test_a_run_whose_world_stopped_is_repeated_once_with_another_stream(study, store):
    runs = made(study, stopping_seed=2)
    table = run_all(runs, store)
    assert Quick.batches == [[1, 2, 3], [second_seed(2)]]
    assert list(table["status"]) == ["done"] * 3
    assert list(table["attempts"]) == [1, 2, 1]
    assert list(table["seed"]) == [1, 2, 3]  # the row is still that of seed 2
    assert table["angle"][1] == pytest.approx(30 * 0.4 + second_seed(2) / 7)
    assert [run.details.get("first_failure") for run in store.runs()] == [None, "It diverged (2)", None]
    assert run_all(runs, store)["stored"].all()


def test_the_second_stream_follows_from_the_seed(study):
    assert second_seed(2) == second_seed(2) == int(np.random.SeedSequence([2, 1]).generate_state(1, np.uint64)[0])
    assert len({second_seed(seed) for seed in range(1000)}) == 1000
    alone, among = execute(made(study, [2], stopping_seed=2))[0], execute(made(study, stopping_seed=2))[1]
    assert (alone.key, alone.responses, alone.details) == (among.key, among.responses, among.details)


def test_a_run_that_stops_twice_is_a_failed_row_with_both_reasons(study, store):
    table = run_all(made(study, stopping_seed=2, stopping_always=True), store)
    assert list(table["status"]) == ["done", "failed", "done"]
    assert (table["attempts"][1], table["reason"][1]) == (2, f"It diverged ({second_seed(2)})")
    assert store.runs()[1].details == {"first_failure": "It diverged (2)"}
    assert Quick.batches == [[1, 2, 3], [second_seed(2)]]  # twice and no more


def test_what_has_no_random_numbers_is_not_repeated(study, store, monkeypatch):
    monkeypatch.setattr(Quick, "random", False)
    table = run_all(made(study, stopping_seed=2), store)
    assert (table["status"][1], table["attempts"][1], table["reason"][1]) == ("failed", 1, "It diverged (2)")
    assert Quick.batches == [[1, 2, 3]]


def test_a_real_world_that_diverges_says_that_it_stopped(store):
    """A ball thrown so fast that it passes more than its radius in a step; its reason holds no number of a world."""
    model = MODEL
    rows = execute([Run(small_pour(drop_velocity=speed), model, 1) for speed in (0.5, 3000.0)])
    assert [row.status for row in rows] == ["done", "failed"]
    assert [row.attempts for row in rows] == [1, 2]
    assert rows[1].reason.startswith("It diverged: a grain moved more than its radius")
    assert rows[1].details["first_failure"].startswith("It diverged: ")


def test_a_run_that_measures_no_number_failed(study, store):
    table = run_all(made(study, nan_seed=3), store)
    assert list(table["status"]) == ["done", "done", "failed"]
    assert table["reason"][2] == "The measurement gave no number: angle = nan."
    assert store.runs()[2].responses == {}


@pytest.mark.parametrize(
    ("broken", "reason"), [("error", "the stream is full"), ("fault", "ZeroDivisionError: divided")]
)
def test_a_batch_that_breaks_is_rows_and_the_others_go_on(study, store, broken, reason):
    table = run_all([*made(study, broken=broken), *made(study, [5], width=0.07)], store)
    assert list(table["status"]) == ["failed"] * 3 + ["done"]
    assert list(table["reason"]) == [reason] * 3 + [""]


@pytest.mark.parametrize("error", [CompositionError("they exclude each other"), EnvironmentProblem("no device")])
def test_a_fault_of_all_runs_ends_the_campaign(study, store, monkeypatch, error):
    monkeypatch.setitem(Quick.errors, "error", error)
    with pytest.raises(type(error)):
        run_all(made(study, broken="error"), store)
    assert len(store) == 0


def test_a_model_that_cannot_be_set_up_costs_only_itself(study, store):
    bad = study.model_with({"normal_hertz.restitution": 0.001})
    runs = made(study)
    runs[1] = Run(runs[1].experiment, bad, 2, "narrow")
    table = run_all(runs, store)
    assert list(table["status"]) == ["done", "failed", "done"]
    assert "can't be simulated" in table["reason"][1]
    with pytest.raises(InputError, match=r"No run can be set up\. this restitution"):
        run_all([Run(runs[0].experiment, bad, 9)], store)
    assert len(store) == 3


class Interrupted(Quick):
    """Ctrl-C in the second batch."""

    def run(self, models, seeds, **rest):
        if 3 in seeds:
            raise KeyboardInterrupt
        return super().run(models, seeds, **rest)


def test_ctrl_c_leaves_what_was_finished(study, store):
    test = Interrupted(width=0.04)
    runs = [Run(test, study.model(), seed) for seed in range(6)]
    with pytest.raises(KeyboardInterrupt):
        run_all(runs, store, worlds=2)
    assert sorted(run.seed for run in store.runs()) == [0, 1]


def test_runs_of_one_experiment_and_composition_share_a_batch(study):
    other = study.model_with({"granule-granule.static_friction": 0.2})
    fewer = type(other)(other.materials, [e for e in other.effects if e.name != "rolling_constant_torque"])
    narrow, wide = Quick(width=0.04), Quick(width=0.05)
    runs = [
        Run(test, model, seed) for seed in (1, 2) for model in (study.model(), other, fewer) for test in (narrow, wide)
    ]
    made = list(batches(runs, 3))
    assert sorted(len(batch) for batch in made) == [1, 1, 2, 2, 3, 3]
    assert sorted(map(id, (run for batch in made for run in batch))) == sorted(map(id, runs))
    for batch in made:
        assert len({(id(run.experiment), run.model is fewer) for run in batch}) == 1


@pytest.mark.parametrize(("threads", "worlds"), [(1, 1), (2, 4), (3, 6)])
def test_a_batch_holds_two_worlds_per_thread_and_one_on_a_single_thread(study, store, monkeypatch, threads, worlds):
    monkeypatch.setattr(campaign.runtime, "start", lambda: SimpleNamespace(threads=threads))
    run_all(made(study, range(20)), store)
    assert max(len(batch) for batch in Quick.batches) == worlds


def test_one_thread_that_drives_a_gpu_has_two_worlds_all_the_same(monkeypatch):
    assert campaign.worlds_at_once(1) == 1
    monkeypatch.setattr(campaign.runtime, "in_use", lambda: SimpleNamespace(arch="cuda"))
    assert campaign.worlds_at_once(1) == 2


def test_progress_rises_to_one(study, store):
    shares = []
    runs = [*made(study, range(6)), *made(study, range(6), width=0.06)]
    run_all(runs, store, shares.append, worlds=4)
    assert shares == sorted(shares)
    assert shares[0] == pytest.approx(1 / 12)
    assert shares[-1] == 1.0
    shares.clear()
    run_all(runs, store, shares.append)
    assert shares == [1.0]


def test_the_wall_time_of_a_batch_is_divided_among_its_runs(study):
    rows = execute(made(study, pause=0.1))
    assert len({row.wall_time for row in rows}) == 1
    assert 0.1 <= rows[0].wall_time < 0.25  # the batch took 0.3 s or more


def test_runs_and_rows_travel_to_other_processes(study):
    run = made(study)[0]
    copy = pickle.loads(pickle.dumps(run))
    assert copy.key == run.key
    assert pickle.loads(pickle.dumps(execute([copy])[0])).responses == execute([run])[0].responses


def test_long_details_are_left_out(study, monkeypatch):
    monkeypatch.setattr(execution, "LONGEST_DETAIL", 2)
    assert execute(made(study, [1]))[0].details == {}


def test_the_summary(study, store):
    from taichidem.study import read_measurements

    table = simulate(study, None, [1, 2, 3], store)
    (study.path / "measurements.csv").write_text(MEASUREMENTS)
    summary = summarise(study, table, read_measurements(study))
    assert list(summary["experiment"]) == ["narrow", "narrow", "wide", "wide"]
    assert list(summary["observable"]) == ["angle", "flow", "angle", "flow"]
    assert list(summary["unit"]) == ["deg", "g/s"] * 2
    assert summary["mean"][0] == pytest.approx(12 + 2 / 7)
    assert summary["u"][0] == pytest.approx(1 / 7 / np.sqrt(3))
    assert list(summary["n"]) == [3] * 4
    assert summary["measured"].tolist()[:2] == pytest.approx([12.5, 40.0])
    assert summary["measured_u"].tolist()[:2] == pytest.approx([0.5, 2.0])
    assert np.isnan(summary["measured"][3])
    one = summarise(study, simulate(study, ["wide"], [1], store))
    assert one["u"].isna().all()
    assert one["measured"].isna().all()


def test_a_real_heap_gives_the_same_bits_alone_and_in_a_batch(store):
    heap = small_pour()
    model = MODEL
    runs = [Run(heap, model, seed) for seed in (1, 2, 3)]
    table = run_all(runs, store)
    assert set(table["status"]) == {"done"}, list(table["reason"])
    alone = heap.run(model, [2])[0]
    assert table["angle_of_repose"][1] == alone.observables["angle_of_repose"]
    assert store.runs([runs[1].key])[0].details["profile"]["angle_deg"] == alone.observables["angle_of_repose"]


SCRIPT = [sys.executable, "-m", "tests.study.campaign_script"]


def simulated(log):
    return log.read_text().splitlines() if log.exists() else []


class Server:
    """Begins campaigns, one after another, in processes forked from one that has imported everything."""

    def __init__(self, path, log):
        self.path, pipes = path, {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(SCRIPT, cwd=ROOT, env={**os.environ, LOG: str(log)}, **pipes)

    def begin(self, count, pause):
        """Begin a campaign; return the number of its process."""
        self.process.stdin.write(f"{self.path} {count} {pause}\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def end(self):
        """Wait for the campaign's exit code."""
        return int(self.process.stdout.readline())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        assert self.process.wait(timeout=30) == 0


def test_a_campaign_that_is_killed_at_ten_random_moments_loses_only_what_was_under_way(tmp_path):
    path, log = tmp_path / "runs.sqlite", tmp_path / "log"
    chance = random.Random(20261122)
    finished: dict[str, object] = {}
    with Server(path, log) as server:
        for _ in range(10):
            process = server.begin(240, 0.01)
            while not finished and len(simulated(log)) < 5:
                time.sleep(0.005)  # on a busy machine too the first has written a batch, and begun another
            time.sleep(chance.uniform(0.0, 0.2))
            os.kill(process, signal.SIGKILL)
            assert server.end() == -signal.SIGKILL
            with RunStore(path) as store:
                rows = {run.key: run for run in store.runs()}
            assert all(rows[key] == run for key, run in finished.items())  # none lost, none changed
            finished = rows
        assert 0 < len(finished) < 240
        server.begin(240, 0.01)
        assert server.end() == 0
    lines = simulated(log)
    assert len(set(lines)) == 240
    assert len(lines) - 240 <= 10 * 4  # each kill costs at most the batch that was under way
    with RunStore(path) as store, RunStore(tmp_path / "undisturbed.sqlite") as other:
        table = run_all(script_runs(240, 0.01), store, worlds=4)
        whole = run_all(script_runs(240, 0.01), other, worlds=4)
        assert all(row == finished.get(row.key, row) for row in store.runs())
        assert len(store) == 240
    assert table["stored"].all()
    assert not whole["stored"].any()
    timing = ["stored", "wall_time", "finished_at"]
    pd.testing.assert_frame_equal(table.drop(columns=timing), whole.drop(columns=timing), check_exact=True)


def test_two_processes_work_on_one_store(tmp_path):
    path, log = tmp_path / "runs.sqlite", tmp_path / "log"
    with Server(path, log) as one, Server(path, log) as other:
        for server in (one, other):
            server.begin(0, 0.0)
        assert [one.end(), other.end()] == [0, 0]  # both have imported everything
        for server in (one, other):
            server.begin(80, 0.03)
        assert [one.end(), other.end()] == [0, 0]
    lines = simulated(log)
    assert len(set(lines)) == 80
    assert len(lines) <= 80 + 6 * 4  # the first batch of four is made twice, and perhaps some where they meet again
    with RunStore(path) as store:
        assert {run.key for run in store.runs()} == {run.key for run in script_runs(80, 0.03)}
        assert len(store) == 80


def test_a_study_s_key_does_not_depend_on_where_it_lies(write, study):
    first = [run.key for run in campaign.study_runs(study, None, [1])]
    renamed = read_study(write(("A study", "Another"), ("experiments.narrow", "experiments.slim")))
    assert [run.key for run in campaign.study_runs(renamed, None, [1])] == first
