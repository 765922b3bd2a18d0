"""Campaigns on a Dask cluster: the same rows, also if a worker is killed."""

from __future__ import annotations

import logging
import os
import signal
import sys

import pytest

from taichidem import runtime
from taichidem.errors import EnvironmentProblem, InputError
from taichidem.study import Run, executors, run_all
from taichidem.study.cluster import cluster_executor
from taichidem.study.executors import threads_of
from tests.study.campaign_script import MODEL, made, small_pour
from tests.study.fakes import LOG
from tests.study.test_executors import here, rows_of

pytest.importorskip("distributed", reason="needs the extra 'cluster'")


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return tmp_path_factory.mktemp("dask") / "log"


@pytest.fixture(scope="module")
def cluster(log):
    """Two workers, each with a nanny that starts it again; they log what they simulate."""
    from distributed import LocalCluster

    options = {
        "dashboard_address": "127.0.0.1:0",
        "silence_logs": logging.CRITICAL,
        "scheduler_kwargs": {"allowed_failures": 0},
    }
    with LocalCluster(
        n_workers=2, threads_per_worker=1, env={"TAICHIDEM_THREADS": "1", LOG: str(log)}, **options
    ) as made:
        yield made


@pytest.fixture
def executor(cluster):
    with cluster_executor(cluster.scheduler_address) as there:
        yield there


def test_a_real_heap_gives_the_same_bits_on_a_cluster(store, tmp_path, executor):
    model = MODEL
    runs = [Run(small_pour(), model, seed) for seed in (1, 2)]
    table = run_all(runs, store, worlds=2, executor=executor)
    assert set(table["status"]) == {"done"}, list(table["reason"])
    assert rows_of(store) == here(runs, tmp_path)


def test_one_of_two_workers_is_killed_and_every_row_is_right(store, tmp_path, executor, log):
    log.unlink(missing_ok=True)
    mark = tmp_path / "mark"
    runs = made(range(60), pause=0.01, stopping_seed=7, lethal_seed=20, lethal_mark=str(mark))
    table = run_all(runs, store, executor=executor)
    with pytest.raises(ProcessLookupError):
        os.kill(int(mark.read_text()), 0)
    assert list(table["status"]) == ["done"] * 60
    assert table["attempts"].tolist() == [1] * 7 + [2] + [1] * 52
    assert log.read_text().splitlines().count("0.04 20") == 2  # in the batch that was lost, and once more
    assert rows_of(store) == here(runs, tmp_path)


def test_a_run_that_ends_its_worker_is_a_failed_row(store, executor):
    table = run_all(made(range(6), lethal_seed=4), store, executor=executor)
    assert list(table["status"]) == ["done"] * 4 + ["failed", "done"]
    assert "Its worker process ended" in table["reason"][4]


def test_a_worker_s_threads_are_those_that_dask_gives_it(monkeypatch):
    from distributed import Client

    monkeypatch.delenv("TAICHIDEM_THREADS", raising=False)
    with Client(n_workers=1, threads_per_worker=2, dashboard_address="127.0.0.1:0") as client:
        assert threads_of(client.get_executor()) == 2


def test_every_worker_keeps_to_the_threads_that_dask_gives_it(monkeypatch, store):
    """Not only the one that is asked how many it has: two of one thread each would else start four on two processors."""
    from distributed import Client

    monkeypatch.delenv("TAICHIDEM_THREADS", raising=False)
    with Client(n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0") as client:
        table = run_all(made(range(24), pause=0.05), store, worlds=1, executor=client.get_executor())
        threads = client.run(threads_there)
    assert set(table["status"]) == {"done"}
    assert list(threads.values()) == [1, 1]


def threads_there():
    return executors._lane.submit(runtime.start).result().threads


def test_a_client_that_was_closed(cluster, store):
    with cluster_executor(cluster.scheduler_address) as closed:
        pass
    with pytest.raises(EnvironmentProblem, match=r"The executor takes no runs: .*give one that is open"):
        run_all(made(range(3)), store, worlds=1, executor=closed)


def test_workers_that_die_before_they_are_given_anything(executor, monkeypatch):
    monkeypatch.setattr(executors, "_threads_here", end)
    with pytest.raises(EnvironmentProblem, match="A worker ended before it was given anything"):
        threads_of(executor)


def end():
    os.kill(os.getpid(), signal.SIGKILL)


def test_waiting_for_workers_is_told_once(cluster):
    from distributed import LocalCluster

    told = []
    with cluster_executor(cluster.scheduler_address, tell=told.append):
        pass
    assert told == []
    with (
        LocalCluster(
            n_workers=0, processes=True, dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL
        ) as empty,
        cluster_executor(empty.scheduler_address, tell=told.append),
    ):
        pass
    address = empty.scheduler_address
    assert told == [f"No worker has come to {address} yet; waiting. Start workers with: dask worker {address}"]


@pytest.mark.parametrize("address", ["", "node1:8786", "tcp://node1", "tcp://:8786", "http://node1:8786", "Local"])
def test_no_address(address):
    with (
        pytest.raises(InputError, match=r"address is .*such as tcp://node1:8786, or 'local'"),
        cluster_executor(address),
    ):
        pass


def test_nobody_answers():
    told = r"No Dask scheduler answers at tcp://127\.0\.0\.1:1 within 0\.5 s\. Start one with `dask scheduler`"
    with pytest.raises(EnvironmentProblem, match=told), cluster_executor("tcp://127.0.0.1:1", patience=0.5):
        pass


def test_dask_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(EnvironmentProblem, match=r"Install it with: pip install 'taichidem\[cluster\]'"),
        cluster_executor("local"),
    ):
        pass
