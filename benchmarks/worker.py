"""A process of its own for a measurement: Taichi has one runtime per process, and so many threads for its whole life."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable
from typing import Any


class Worker:
    """A spawned process that calls functions on request, one after another.

    Args:
        threads: worker threads of Taichi.
        core: the one processor it may use, or None for all.
        cache: folder of Taichi's compiled kernels, or None for the usual one.
    """

    def __init__(self, threads: int, core: int | None = None, cache: str | None = None) -> None:
        context = multiprocessing.get_context("spawn")  # a process that started Taichi must not be forked
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, threads, core, cache), daemon=True)
        self._process.start()
        theirs.close()

    def call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function of a module returns, called over there.

        Raises:
            RuntimeError: it failed there, or the process died.
        """
        self._pipe.send((function, arguments))
        try:
            good, answer = self._pipe.recv()
        except EOFError:
            self._process.join()
            raise RuntimeError(f"The measuring process ended with exit code {self._process.exitcode}.") from None
        if not good:
            raise RuntimeError(f"{function.__name__} failed: {answer}")
        return answer

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self._pipe.close()
        self._process.join(timeout=20)
        if self._process.is_alive():
            self._process.terminate()


def _serve(pipe: Any, threads: int, core: int | None, cache: str | None) -> None:
    if core is not None and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})
    if cache is not None:
        os.environ["TI_OFFLINE_CACHE_FILE_PATH"] = cache  # read by ti.init
    os.environ["TAICHIDEM_THREADS"] = str(threads)
    while True:
        try:
            function, arguments = pipe.recv()
        except (EOFError, KeyboardInterrupt):
            return
        try:
            pipe.send((True, function(*arguments)))
        except Exception as error:  # it must reach the process that asked, whatever it is
            pipe.send((False, f"{type(error).__name__}: {error}"))


def peak_memory(process: int | str = "self") -> float:
    """Return the peak resident memory of a process [MB], not counting what its parent held before; NaN if unknown.

    `getrusage` would not do: across fork and exec a child inherits its parent's peak.
    """
    return _memory("VmHWM", process)


def resident_memory(process: int | str = "self") -> float:
    """Return the resident memory of a process now [MB]; NaN if unknown."""
    return _memory("VmRSS", process)


def _memory(field: str, process: int | str) -> float:
    try:
        with open(f"/proc/{process}/status") as file:
            for line in file:
                if line.startswith(f"{field}:"):
                    return int(line.split()[1]) / 1024
    except OSError:
        pass
    return float("nan")
