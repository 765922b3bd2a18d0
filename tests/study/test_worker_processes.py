"""Processes that simulate: how many, with how many threads, and that none outlives its caller."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from taichidem import runtime
from taichidem.errors import InputError
from taichidem.study import RunStore, SpawnedProcesses
from tests.study.fakes import LOG

ROOT = Path(__file__).resolve().parents[2]
PATIENCE = 120.0  # [s] for processes to begin and end, also on a busy machine


def test_processors_are_divided_among_the_processes():
    assert SpawnedProcesses(1).threads == runtime.cores()
    assert SpawnedProcesses().workers == runtime.cores()
    assert SpawnedProcesses(10 * runtime.cores()).threads == 1


@pytest.mark.parametrize("numbers", [(0, None), (-1, None), (2, 0), (1.5, None)])
def test_numbers_of_workers_and_threads(numbers):
    with pytest.raises(InputError, match="give a whole number from 1, or leave it out"):
        SpawnedProcesses(*numbers)


STOPPED = """
import operator, os, sys
from taichidem.study import RunStore, SpawnedProcesses, run_all
from tests.study.campaign_script import runs
from tests.study import fakes

if __name__ == "__main__":
    fakes.register(operator.setitem)
    with SpawnedProcesses(2, threads=1) as pool, RunStore(sys.argv[1]) as store:
        print(*[pool.submit(os.getpid).result() for _ in range(8)], flush=True)
        try:
            run_all(runs(1000, 0.05), store, executor=pool)
        except KeyboardInterrupt:
            print("stopped", flush=True)
            raise
"""


# Ctrl-C is slow: that a busy machine lets every process end without a traceback is not certain.
@pytest.mark.parametrize("blow", [pytest.param(signal.SIGINT, marks=pytest.mark.slow), signal.SIGKILL])
def test_workers_end_with_whoever_started_them(tmp_path, begun, blow):
    process, pids = begun
    if blow == signal.SIGINT:
        os.killpg(process.pid, blow)  # as a terminal does: every process of the group gets it
    else:
        process.send_signal(blow)
    out, errors = process.communicate(timeout=PATIENCE)  # until the last of them has closed the pipes
    assert ("stopped" in out) == (blow == signal.SIGINT)
    if blow == signal.SIGINT:
        assert errors.count("Traceback") <= 1  # the coordinator's own; workers keep still
    wait_until(lambda: not any(alive(pid) for pid in pids))
    with RunStore(tmp_path / "runs.sqlite") as store:
        rows = store.runs()
    assert 4 <= len(rows) < 1000  # no sixth batch of two is begun before two have been written
    assert {run.status for run in rows} == {"done"}


@pytest.fixture
def begun(tmp_path):
    """Begin a campaign on two workers; return its process and the numbers of the workers once they simulate."""
    log, script = tmp_path / "log", tmp_path / "stopped.py"
    script.write_text(STOPPED)
    process = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path / "runs.sqlite")],
        cwd=ROOT,
        env={**os.environ, LOG: str(log), "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        pids = {int(word) for word in process.stdout.readline().split()}
        wait_until(lambda: log.exists() and len(log.read_text().splitlines()) >= 12)
        yield process, pids
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)  # a test that fails must not leave them either


def wait_until(condition, seconds=PATIENCE):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it never came"
        time.sleep(0.005)


def alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return "zombie" not in Path(f"/proc/{pid}/status").read_text() if Path(f"/proc/{pid}").exists() else False
