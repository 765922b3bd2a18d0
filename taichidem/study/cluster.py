"""Workers on other machines, through Dask: an executor from the address of a scheduler, or of a cluster made here."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from taichidem import runtime
from taichidem.errors import EnvironmentProblem, InputError

LOCAL = "local"
PATIENCE = 10.0  # [s] in which a scheduler must answer
_ADDRESS = re.compile(r"(tcp|tls|ws|wss)://[^/\s:]+:\d+|(tcp|tls|ws|wss)://\[[0-9a-fA-F:]+\]:\d+")


@contextmanager
def cluster_executor(
    address: str, patience: float = PATIENCE, tell: Callable[[str], Any] = lambda sentence: None
) -> Iterator[Executor]:
    """Give the executor of a Dask cluster.

    Args:
        address: of its scheduler, such as "tcp://node1:8786"; "local" makes a cluster on this machine, a worker per processor,
            which ends with the block.
        patience: how long to wait for an answer [s].
        tell: called with a sentence if the scheduler has no worker yet, for which runs will wait however long it takes.

    Raises:
        InputError: no address.
        EnvironmentProblem: Dask isn't installed, or no scheduler answers.
    """
    if address != LOCAL and not _ADDRESS.fullmatch(address):
        raise InputError(
            f"The cluster's address is {address!r}; give that of a Dask scheduler, such as tcp://node1:8786, or {LOCAL!r} for "
            "workers on this machine."
        )
    try:
        import distributed
    except ImportError as error:
        raise EnvironmentProblem(
            f"Clusters need Dask, which can't be imported ({error}). Install it with: pip install 'taichidem[cluster]'"
        ) from error
    if address == LOCAL:
        with _local_cluster(distributed) as cluster, distributed.Client(cluster) as client:
            yield client.get_executor()
        return
    try:
        client = distributed.Client(address, timeout=patience)
    except (OSError, TimeoutError) as error:
        raise EnvironmentProblem(
            f"No Dask scheduler answers at {address} within {patience:g} s. Start one with `dask scheduler` and workers with "
            f"`dask worker {address}`, or look for a wrong name, port or a firewall between."
        ) from error
    with client:
        if not client.nthreads():
            tell(f"No worker has come to {address} yet; waiting. Start workers with: dask worker {address}")
        yield client.get_executor()


def _local_cluster(distributed: Any) -> Any:
    """Return a cluster on this machine, a worker of one thread per processor, for this user's programs only."""
    return distributed.LocalCluster(
        n_workers=runtime.cores(),
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",  # any free port, which no other machine sees
        silence_logs=logging.CRITICAL,  # what a dead worker means for the runs is told in the table
        env={"TAICHIDEM_THREADS": "1"},
        scheduler_kwargs={"allowed_failures": 0},  # we try again ourselves, each run alone
    )
