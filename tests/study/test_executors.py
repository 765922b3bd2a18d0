"""Campaigns on workers: the same rows, written as they come, whoever dies."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor

import pytest

from taichidem.errors import CompositionError, EnvironmentProblem, InputError
from taichidem.study import Run, RunStore, SpawnedProcesses, executors, run_all, worker_processes
from taichidem.study.executors import threads_of
from tests.study.campaign_script import MODEL, made, small_pour
from tests.study.fakes import LOG, Quick


@pytest.fixture(scope="module")
def pool():
    """Two processes that serve the whole module, for starting them takes seconds."""
    with SpawnedProcesses(2, threads=1) as spawned:
        yield spawned


def rows_of(store):
    """Return what every executor must agree on to the last bit."""
    return {
        run.key: (run.seed, run.status, run.responses, run.reason, run.details, run.attempts, run.model, run.settings)
        for run in store.runs()
    }


def here(runs, tmp_path):
    with RunStore(tmp_path / "here.sqlite") as other:
        run_all(runs, other)
        return rows_of(other)


class Counting(Executor):  # for runs that need no engine; whoever uses it says how many worlds are a batch
    """A thread per batch, which knows how many batches it held at most."""

    in_flight = 3

    def __init__(self):
        self.held, self.most = 0, 0

    def submit(self, fn, /, *args, **kwargs):
        future: Future = Future()
        self.held += 1
        self.most = max(self.most, self.held)

        def work():
            time.sleep(0.01)
            self.held -= 1
            if future.set_running_or_notify_cancel():
                future.set_result(fn(*args, **kwargs))

        threading.Thread(target=work).start()
        return future


def test_spawned_processes_give_the_same_rows(store, tmp_path, pool):
    runs = made(range(9), failing_seed=4, stopping_seed=6)
    shares = []
    table = run_all(runs, store, shares.append, executor=pool)
    assert rows_of(store) == here(runs, tmp_path)
    assert list(table["seed"]) == list(range(9))
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert len(shares) > 3
    assert run_all(runs, store, executor=pool)["stored"].all()
    assert 1 <= len(Quick.batches) <= 10  # those of `here`; what the pool did was done elsewhere


def test_a_real_heap_gives_the_same_bits_in_a_process_of_its_own(store, tmp_path, pool):
    model = MODEL
    runs = [Run(small_pour(), model, seed) for seed in (1, 2)]
    table = run_all(runs, store, worlds=2, executor=pool)
    assert set(table["status"]) == {"done"}, list(table["reason"])
    assert rows_of(store) == here(runs, tmp_path)


def test_threads_of_a_process_in_which_taichi_runs_are_refused(store):
    told = "Taichi was started by another thread of this process.*in processes of their own"
    for options in ({}, {"worlds": 1}):
        with ThreadPoolExecutor(2) as threads, pytest.raises(EnvironmentProblem, match=told):
            run_all([Run(small_pour(), MODEL, 1)], store, executor=threads, **options)
    assert len(store) == 0


def test_rows_are_written_as_each_batch_ends(store, tmp_path, pool, monkeypatch):
    written = []
    add = RunStore.add
    monkeypatch.setattr(RunStore, "add", lambda self, *rows: (written.append(len(rows)), add(self, *rows))[1])
    run_all(made(range(10)), store, worlds=2, executor=pool)
    assert written == [2] * 5


def test_a_bounded_number_of_batches_is_under_way(store):
    executor = Counting()
    run_all(made(range(40)), store, worlds=1, executor=executor)
    assert executor.most == 3
    assert len(store) == 40


def test_batches_are_made_when_there_is_room_for_them(monkeypatch):
    taken = []

    def parts():
        for run in made(range(100)):
            taken.append(run)
            yield [run]

    rows = executors.computed(parts(), Counting())
    next(rows)
    assert len(taken) == 3
    rows.close()


def test_a_worker_that_is_killed_is_replaced_and_its_runs_are_done_again(store, tmp_path, monkeypatch):
    log = tmp_path / "log"
    monkeypatch.setenv(LOG, str(log))
    runs = made(range(40), pause=0.01, lethal_seed=17, lethal_mark=str(tmp_path / "mark"))
    with SpawnedProcesses(2, threads=1) as executor:
        table = run_all(runs, store, executor=executor)
    lines = log.read_text().splitlines()
    monkeypatch.delenv(LOG)
    assert list(table["status"]) == ["done"] * 40
    assert rows_of(store) == here(runs, tmp_path)
    assert lines.count("0.04 17") == 2
    assert 40 < len(lines) <= 40 + 4 * 2  # no more was done twice than was under way


def test_a_run_that_ends_its_worker_twice_is_a_failed_row(store, tmp_path, pool):
    runs = made(range(12), lethal_seed=5)
    table = run_all(runs, store, executor=pool)
    assert list(table["status"]) == ["done"] * 5 + ["failed"] + ["done"] * 6
    assert "Its worker process ended while it was simulated, twice" in table["reason"][5]
    good = [run for run in runs if run.seed != 5]
    found = rows_of(store)
    assert {run.key: found[run.key] for run in good} == here(good, tmp_path)
    assert list(run_all(made([1, 2], width=0.05), store, executor=pool)["status"]) == ["done"] * 2  # it goes on


def test_a_pool_that_cannot_be_rebuilt_ends_the_campaign_with_a_sentence(store):
    told = r"can't start another: .*is in the store; the same command goes on"
    with (
        ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fixed,
        pytest.raises(EnvironmentProblem, match=told),
    ):
        run_all(made(range(200), lethal_seed=3), store, worlds=1, executor=OneByOne(fixed))
    assert {run.seed for run in store.runs()} == {0, 1, 2}


class OneByOne(Executor):
    """Another executor that is given one batch at a time."""

    in_flight = 1

    def __init__(self, other):
        self.other = other

    def submit(self, fn, /, *args, **kwargs):
        return self.other.submit(fn, *args, **kwargs)


def test_workers_that_die_at_once_are_no_run_s_fault(store, monkeypatch):
    monkeypatch.setattr(worker_processes, "_begin", die)
    with SpawnedProcesses(1) as broken, pytest.raises(EnvironmentProblem, match="A worker ended before it was given"):
        run_all(made(range(3)), store, executor=broken)
    assert len(store) == 0


def die(_threads):
    os.kill(os.getpid(), signal.SIGKILL)


def test_an_executor_that_was_shut_down(store):
    class Dropping(Counting):
        def submit(self, fn, /, *args, **kwargs):
            dropped: Future = Future()
            dropped.cancel()
            dropped.set_running_or_notify_cancel()
            return dropped

    with pytest.raises(EnvironmentProblem, match="it was shut down, or its scheduler is gone"):
        run_all(made(range(3)), store, worlds=1, executor=Dropping())


@pytest.mark.parametrize("options", [{}, {"worlds": 1}])  # with and without asking a worker for its threads first
def test_an_executor_that_takes_no_more(store, options):
    closed = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
    closed.shutdown()
    told = "The executor takes no runs: cannot schedule new futures after shutdown.*give one that is open"
    with pytest.raises(EnvironmentProblem, match=told):
        run_all(made(range(3)), store, executor=closed, **options)


def test_a_worker_that_lacks_taichidem_says_so(store):
    told = r"A worker can't be used: .*taichidem\.study\.executors.* Install the same packages there as here"
    for options in ({}, {"worlds": 1}):
        with (
            ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), lacking) as bare,
            pytest.raises(EnvironmentProblem, match=told),
        ):
            run_all(made(range(3)), store, executor=bare, **options)
    assert len(store) == 0


def lacking():
    sys.modules["taichidem.study.executors"] = None  # as if it weren't installed


@pytest.mark.parametrize("worlds", [1, 3, 8])
def test_rows_depend_neither_on_the_batch_nor_on_who_simulates(store, tmp_path, pool, worlds):
    runs = made(range(8), dividing_seed=5)
    table = run_all(runs, store, worlds=worlds, executor=pool)
    assert list(table["status"]) == ["done"] * 5 + ["failed"] + ["done"] * 2
    assert rows_of(store) == here(runs, tmp_path)


@pytest.mark.parametrize("error", [CompositionError("they exclude each other"), EnvironmentProblem("no device")])
def test_a_fault_of_all_runs_ends_the_campaign(store, monkeypatch, error):
    monkeypatch.setitem(Quick.errors, "error", error)
    with ThreadPoolExecutor(1) as threads, pytest.raises(type(error), match=str(error)):
        run_all(made([1, 2], broken="error"), store, worlds=2, executor=threads)
    assert len(store) == 0


def test_what_cannot_be_sent_is_said(store):
    class Hidden(Quick):
        pass

    with pytest.raises(InputError, match=r"A run of quick can't be sent to a worker: .*at the top of a module"):
        run_all([Run(Hidden(width=0.04), made([1])[0].model, 1)], store, worlds=1, executor=Counting())


def test_a_worker_without_the_package_says_so():
    packed = b"cno_such_package\nexperiment\n."
    with pytest.raises(EnvironmentProblem, match="A worker can't read a run: No module named 'no_such_package'"):
        executors._rows_of(packed, "")


def test_a_worker_with_another_physics_is_refused(store, monkeypatch):
    monkeypatch.setattr(executors, "PHYSICS_VERSION", "0")
    with pytest.raises(EnvironmentProblem, match=r"computes with version .* this process with 0\. Install the same"):
        run_all(made([1]), store, worlds=1, executor=Counting())


def test_threads_of_a_worker(pool):
    assert threads_of(pool) == 1
    with pytest.raises(InputError, match=r"executor is 4; give a concurrent\.futures\.Executor"):
        threads_of(4)
