"""Campaigns on a Dask cluster: the same rows, also if a worker is killed."""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading

import pytest

from taichidem.errors import EnvironmentProblem, InputError
from taichidem.study import Run, RunStore, run_all
from taichidem.study.cluster import cluster_executor
from taichidem.study.executors import threads_of
from tests.study.campaign_script import runs as script_runs
from tests.study.campaign_script import small_pour
from tests.study.fakes import LOG
from tests.study.test_executors import here, made, rows_of, wait_until

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


@pytest.fixture
def store(tmp_path):
    with RunStore(tmp_path / "campaign.sqlite") as opened:
        yield opened


def test_a_real_heap_gives_the_same_bits_on_a_cluster(store, tmp_path, executor):
    model = script_runs(2, 0.0)[0].model
    runs = [Run(small_pour(), model, seed) for seed in (1, 2)]
    table = run_all(runs, store, worlds=2, executor=executor)
    assert set(table["status"]) == {"done"}, list(table["reason"])
    assert rows_of(store) == here(runs, tmp_path)


def test_one_of_two_workers_is_killed_and_every_row_is_right(store, tmp_path, executor, cluster, log):
    from distributed import Client

    log.unlink(missing_ok=True)
    runs = made(range(60), pause=0.03, stopping_seed=7)
    with Client(cluster) as client:
        victim = next(iter(client.run(os.getpid).values()))

    def kill():
        wait_until(lambda: log.exists() and len(log.read_text().splitlines()) >= 10)
        os.kill(victim, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    table = run_all(runs, store, executor=executor)
    killer.join()
    with pytest.raises(ProcessLookupError):
        os.kill(victim, 0)
    assert list(table["status"]) == ["done"] * 60
    assert table["attempts"].tolist() == [1] * 7 + [2] + [1] * 52
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
