"""The options --workers and --cluster of every command that runs a campaign: where its simulations are computed."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from typing import Annotated

import typer

from taichidem.errors import InputError


def _refuse_arch(context: typer.Context, cluster: str | None) -> str | None:
    """Return the address of a cluster; what is set in this process can't reach workers that somebody else started.

    Raises:
        InputError: --arch is given too, and the workers aren't made here.
    """
    arch = context.find_root().params.get("arch")
    if cluster is not None and arch is not None:
        from taichidem.study.cluster import LOCAL

        if cluster != LOCAL:
            raise InputError(
                f"--arch {arch} can't be told to the workers of {cluster}. Leave it out here, and set the environment variable "
                f"TAICHIDEM_ARCH={arch} where they start."
            )
    return cluster


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
        callback=_refuse_arch,
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

        with cluster_executor(cluster, tell=partial(typer.echo, err=True)) as there:
            yield there
    elif workers is not None:
        from taichidem.study.worker_processes import SpawnedProcesses

        if workers < 1:
            raise InputError(f"--workers is {workers}; give a whole number from 1, or leave it out.")
        with SpawnedProcesses(workers) as here:
            yield here
    else:
        yield None
