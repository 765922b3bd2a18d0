"""The options --workers and --cluster of every command that runs a campaign: where its simulations are computed."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Annotated

import typer

from taichidem.errors import InputError

Workers = Annotated[
    int | None,
    typer.Option(
        metavar="N", help="Simulate in N processes of this machine instead of this one; they are replaced if they die."
    ),
]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Simulate on a Dask cluster: its scheduler, such as tcp://node1:8786, or 'local' for one on this machine.",
    ),
]


@contextmanager
def executor_of(workers: int | None, cluster: str | None) -> Iterator[Executor | None]:
    """Give the executor that the options ask for, None where neither is given; its workers end with the block.

    Raises:
        InputError: both are given, fewer than one worker, or a malformed address.
        EnvironmentProblem: Dask isn't installed, or no scheduler answers.
    """
    if workers is not None and cluster is not None:
        raise InputError(
            "--workers and --cluster were both given; give one of them, or neither to simulate in this process."
        )
    if cluster is not None:
        from taichidem.study.cluster import cluster_executor

        with cluster_executor(cluster) as there:
            yield there
    elif workers is not None:
        from taichidem.study.worker_processes import SpawnedProcesses

        if workers < 1:
            raise InputError(f"--workers is {workers}; give a whole number from 1, or leave it out.")
        with SpawnedProcesses(workers) as here:
            yield here
    else:
        yield None
