"""Send batches of runs to workers, a bounded number at once, and get their rows back, also if workers die.

Workers compute and write nothing; whoever asks for the rows keeps them.
"""

from __future__ import annotations

import os
import pickle
import sys
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from itertools import islice
from typing import Any

from taichidem import runtime
from taichidem.errors import EnvironmentProblem, InputError
from taichidem.experiments.base import Outcome
from taichidem.physics_version import PHYSICS_VERSION
from taichidem.study.execution import Run, execute, stored_run
from taichidem.study.run_store import StoredRun

IN_FLIGHT = 512  # batches that are with an executor at once, unless it says another number itself
KEPT = "What was finished is in the store; the same command goes on."
SAME = "Install the same packages there as here."

# Taichi is for the thread that started it, and workers of Dask give each call to any of several.
_lane = ThreadPoolExecutor(1, "taichidem")


class _Call:
    """A call that is made where it is unpickled.

    It travels as bytes, which also a worker without this package can take, and then says what it lacks. Dask's would end
    and leave the campaign waiting for ever.
    """

    def __init__(self, function: Callable, *arguments: Any) -> None:
        self.function, self.arguments = function, arguments

    def __reduce__(self) -> tuple[Callable, tuple]:
        return self.function, self.arguments


def _submitted(executor: Executor, call: _Call) -> Future:
    """Submit a call.

    Raises:
        EnvironmentProblem: the executor takes no more.
    """
    try:
        return executor.submit(pickle.loads, pickle.dumps(call))
    except BrokenExecutor as error:
        raise EnvironmentProblem(
            f"A worker ended and this executor can't start another: {error} {KEPT} SpawnedProcesses replaces workers."
        ) from error
    except (RuntimeError, _closed_client()) as error:
        raise EnvironmentProblem(
            f"The executor takes no runs: {error}. It was shut down or its client closed; give one that is open. {KEPT}"
        ) from error


def threads_of(executor: Executor) -> int:
    """Return how many threads Taichi has in a worker.

    Raises:
        InputError: no executor.
        EnvironmentProblem: no worker starts, it lacks packages, or the executor was shut down.
    """
    _check(executor)
    future = _submitted(executor, _Call(_threads_here))
    try:
        return future.result()
    except (ImportError, AttributeError) as error:
        raise EnvironmentProblem(f"A worker can't be used: {error}. {SAME}") from error
    except Exception as error:
        if not isinstance(error, CancelledError) and not _worker_died(error):
            raise
        raise EnvironmentProblem(f"A worker ended before it was given anything: {error} {KEPT}") from error


def _check(executor: Any) -> None:
    if not isinstance(executor, Executor):
        raise InputError(
            f"executor is {executor!r}; give a concurrent.futures.Executor, such as SpawnedProcesses(4) or the "
            "get_executor() of a Dask client, or leave it out."
        )


def _threads_here() -> int:
    _take_threads_of_dask()
    return _lane.submit(runtime.start).result().threads


def _take_threads_of_dask() -> None:
    """Let Taichi, which may start with the next run, have as many threads as Dask gives this worker, unless told otherwise."""
    distributed = sys.modules.get("distributed")
    if distributed is not None and not os.environ.get("TAICHIDEM_THREADS"):
        try:
            os.environ["TAICHIDEM_THREADS"] = str(distributed.get_worker().state.nthreads)
        except ValueError:
            pass  # not in a worker of Dask


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
    return _submitted(executor, _Call(_rows_of, packed, uuid.uuid4().hex))


def _rows_of(packed: bytes, _once: str) -> list[StoredRun]:
    """Unpack a batch in a worker and simulate it; `_once` keeps executors that remember calls from answering from memory."""
    try:
        part = pickle.loads(packed)
    except (ImportError, AttributeError) as error:
        raise EnvironmentProblem(f"A worker can't read a run: {error}. {SAME}") from error
    _take_threads_of_dask()  # here too: only one worker was asked for them
    return _lane.submit(execute, part).result()


def _rows(future: Future) -> list[StoredRun] | None:
    """Return the rows of a batch, or None if its worker died."""
    try:
        rows = future.result()
    except CancelledError:
        raise EnvironmentProblem(
            f"The executor dropped a batch: it was shut down, or its scheduler is gone. {KEPT}"
        ) from None
    except ImportError as error:
        raise EnvironmentProblem(f"A worker can't be used: {error}. {SAME} {KEPT}") from error
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


def _closed_client() -> type[Exception]:
    """Return what a Dask client raises that was closed."""
    client = getattr(sys.modules.get("distributed"), "client", None)
    return getattr(client, "ClosedClientError", RuntimeError)  # has no name of its own in old versions


def _fatal(run: Run, executor: Executor) -> StoredRun:
    """Return the failed row of a run that ended its worker, first among others and then alone."""
    threads_of(executor)  # if workers die whatever one asks of them, the run is not to blame
    reason = (
        "Its worker process ended while it was simulated, twice: the system may have run out of memory, or the engine crashed. "
        "Try it alone, with fewer grains."
    )
    return stored_run(run, Outcome({}, run.seed, reason), 0.0)
