"""Send batches of runs to workers, a bounded number at once, and get their rows back, also if workers die.

Workers compute and write nothing; whoever asks for the rows keeps them.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import uuid
from collections.abc import Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from multiprocessing.connection import wait as wait_for_end
from typing import Any

from taichidem import runtime
from taichidem.errors import EnvironmentProblem, InputError
from taichidem.experiments.base import Outcome
from taichidem.physics_version import PHYSICS_VERSION
from taichidem.study.execution import Run, execute, stored_run
from taichidem.study.run_store import StoredRun

IN_FLIGHT = 512  # batches that are with an executor at once, unless it says another number itself
KEPT = "What was finished is in the store; the same command goes on."

# Taichi is for the thread that started it, and workers of Dask give each call to any of several.
_lane = ThreadPoolExecutor(1, "taichidem")


class SpawnedProcesses(Executor):
    """Processes on this machine, each with a Taichi runtime of its own; those that die are replaced.

    Args:
        workers: how many; one per processor that this process may use, where left out.
        threads: of Taichi in each; processors over workers, at least one, where left out.

    Raises:
        InputError: a number below one.
    """

    def __init__(self, workers: int | None = None, threads: int | None = None) -> None:
        self.workers = runtime.cores() if workers is None else workers
        self.threads = max(1, runtime.cores() // max(1, self.workers)) if threads is None else threads
        for name, number in (("workers", self.workers), ("threads", self.threads)):
            if not isinstance(number, int) or number < 1:
                raise InputError(f"{name} is {number!r}; give a whole number from 1, or leave it out.")
        self.in_flight = 2 * self.workers  # few, since one death fails all that is with the pool
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future:
        """Send a call to a worker, if need be to a new pool in the place of a broken one."""
        with _interrupts_held_back():
            try:
                return self._started().submit(fn, *args, **kwargs)
            except BrokenExecutor:
                self.kill()
                return self._started().submit(fn, *args, **kwargs)

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            resource_tracker.ensure_running()  # else the first start of a process would do it, and let interrupts through
            # A process that has started Taichi must not be forked.
            spawn = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(self.workers, spawn, _begin, (self.threads,))
        return self._pool

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers once they have done what was sent to them."""
        if self._pool is not None:
            self._pool.shutdown(wait, cancel_futures=cancel_futures)
            self._pool = None

    def kill(self) -> None:
        """End the workers now; what is under way is lost."""
        if self._pool is not None:
            processes = list((self._pool._processes or {}).values())  # type: ignore[attr-defined]  # no public way before 3.14
            for process in processes:
                process.kill()
            self.shutdown(wait=True, cancel_futures=True)

    def __exit__(self, kind: Any, *_: Any) -> None:
        if kind is None:
            self.shutdown()
        else:
            self.kill()  # Ctrl-C shall not wait for minutes


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Keep Ctrl-C from processes that are started meanwhile, for good, and from this one until the end of the block."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(threads: int) -> None:
    """Prepare a worker: its number of threads; Ctrl-C is for the coordinator; no worker outlives that one."""
    os.environ["TAICHIDEM_THREADS"] = str(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for_end([parent.sentinel])
        os._exit(1)  # the coordinator was killed, and nobody would ever fetch what this worker computes


def threads_of(executor: Executor) -> int:
    """Return how many threads Taichi has in a worker.

    Raises:
        InputError: no executor.
        EnvironmentProblem: no worker starts.
    """
    _check(executor)
    try:
        return executor.submit(_threads_here).result()
    except (BrokenExecutor, CancelledError) as error:
        raise EnvironmentProblem(f"A worker ended before it was given anything: {error} {KEPT}") from error


def _check(executor: Any) -> None:
    if not isinstance(executor, Executor):
        raise InputError(
            f"executor is {executor!r}; give a concurrent.futures.Executor, such as SpawnedProcesses(4) or the "
            "get_executor() of a Dask client, or leave it out."
        )


def _threads_here() -> int:
    distributed = sys.modules.get("distributed")
    if distributed is not None and "TAICHIDEM_THREADS" not in os.environ:
        try:
            os.environ["TAICHIDEM_THREADS"] = str(distributed.get_worker().state.nthreads)
        except ValueError:
            pass  # not in a worker of Dask
    return _lane.submit(runtime.start).result().threads


def computed(parts: Iterable[list[Run]], executor: Executor) -> Iterator[list[StoredRun]]:
    """Yield the rows of each batch as it ends; a bounded number of batches is with the executor.

    The runs of batches whose worker died are done again once the others are through, each alone and one at a time, so that
    it's certain which of them ends its worker: that one becomes a failed row.

    Raises:
        InputError: a run can't be sent to another process.
        EnvironmentProblem: the executor takes no more, or a worker has other packages.
    """
    _check(executor)
    lost: list[Run] = []
    yield from _several(iter(parts), executor, lost)
    for run in lost:
        rows = _rows(_sent([run], executor))
        yield [_fatal(run, executor)] if rows is None else rows


def _several(parts: Iterator[list[Run]], executor: Executor, lost: list[Run]) -> Iterator[list[StoredRun]]:
    """Yield the rows of batches as they end; put the runs of those whose worker died into `lost`."""
    most = getattr(executor, "in_flight", IN_FLIGHT)
    under_way: dict[Future, list[Run]] = {}
    try:
        while True:
            for part in islice(parts, most - len(under_way)):
                under_way[_sent(part, executor)] = part
            if not under_way:
                return
            for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                part = under_way.pop(future)
                rows = _rows(future)
                if rows is None:
                    lost += part
                else:
                    yield rows
    finally:
        for future in under_way:
            future.cancel()


def _sent(part: list[Run], executor: Executor) -> Future:
    """Submit a batch; it travels as bytes, so that what can't be packed or unpacked is told apart from a worker that died."""
    try:
        packed = pickle.dumps(part)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InputError(
            f"A run of {part[0].experiment.name} can't be sent to a worker: {error}. Define its experiment, effects and shape "
            "at the top of a module that can be imported, or run without an executor."
        ) from error
    try:
        return executor.submit(_rows_of, packed, uuid.uuid4().hex)
    except BrokenExecutor as error:
        raise EnvironmentProblem(
            f"A worker ended and this executor can't start another: {error} {KEPT} SpawnedProcesses replaces workers."
        ) from error


def _rows_of(packed: bytes, _once: str) -> list[StoredRun]:
    """Unpack a batch in a worker and simulate it; `_once` keeps executors that remember calls from answering from memory."""
    try:
        part = pickle.loads(packed)
    except (ImportError, AttributeError) as error:
        raise EnvironmentProblem(
            f"A worker can't read a run: {error}. Install the same packages there as here."
        ) from error
    return _lane.submit(execute, part).result()


def _rows(future: Future) -> list[StoredRun] | None:
    """Return the rows of a batch, or None if its worker died."""
    try:
        rows = future.result()
    except CancelledError:
        raise EnvironmentProblem(
            f"The executor dropped a batch: it was shut down, or its scheduler is gone. {KEPT}"
        ) from None
    except Exception as error:
        if _worker_died(error):
            return None
        raise
    other = next((row.physics for row in rows if row.physics != PHYSICS_VERSION), None)
    if other is not None:
        raise EnvironmentProblem(
            f"A worker computes with version {other} of the physics, this process with {PHYSICS_VERSION}. Install the same "
            "taichidem there as here."
        )
    return rows


def _worker_died(error: Exception) -> bool:
    distributed = sys.modules.get("distributed")  # is there if somebody uses it
    return isinstance(error, BrokenExecutor) or (
        distributed is not None and isinstance(error, distributed.KilledWorker)
    )


def _fatal(run: Run, executor: Executor) -> StoredRun:
    """Return the failed row of a run that ended its worker, first among others and then alone."""
    threads_of(executor)  # if workers die whatever one asks of them, the run is not to blame
    reason = (
        "Its worker process ended while it was simulated, twice: the system may have run out of memory, or the engine crashed. "
        "Try it alone, with fewer grains."
    )
    return stored_run(run, Outcome({}, run.seed, reason), 0.0)
