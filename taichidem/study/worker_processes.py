"""Processes of this machine that simulate: begun with a Taichi of their own, replaced when they die, ended with the caller."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import wait as wait_for_end
from typing import Any

from taichidem import runtime
from taichidem.errors import InputError


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
