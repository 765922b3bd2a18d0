"""The command `taichidem reproduce paper`: the study that this software grew from, run again."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from taichidem.cli.progress import progress
from taichidem.cli.workers import Cluster, Workers, executor_of

if TYPE_CHECKING:
    from taichidem.paper.reproduction import Reproduction


MET = {True: "yes", False: "no", None: "–"}


class Published(str, Enum):
    """What can be reproduced."""

    PAPER = "paper"


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("reproduce")(reproduce)


def reproduce(
    what: Annotated[Published, typer.Argument(help="The published study.")],
    full: Annotated[
        bool, typer.Option("--full/--quick", help="Real stiffness (a day), or softened grains (within an hour).")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder; by default paper_quick or paper_full.")
    ] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")] = False,
) -> None:
    """Run the paper's screening, response surface, optimum and confirmation heaps, and put its numbers beside ours.

    Then go on where the paper stops: the calibrated model in tests it was not fitted to. Stopped at any moment, the same command
    goes on; nothing is run twice.
    """
    from taichidem.paper.reproduction import reproduce as run
    from taichidem.runtime import cores

    effort = "full" if full else "quick"
    if workers is None and cluster is None:
        workers = cores()  # a process draws and measures one heap on its core while others pour: a fifth faster
    with executor_of(workers, cluster) as executor, progress(quiet=as_json) as report:
        result = run(output or Path(f"paper_{effort}"), effort, report, executor=executor)
    typer.echo(result.to_json()) if as_json else _print(result)


def _print(result: Reproduction) -> None:
    from taichidem.paper.held_out import MEASUREMENTS, own_files

    table = Table("", "paper", "ours", "wanted", "met", title="Sudsawat et al. (2023), reproduced")
    for check in result.checks:
        table.add_row(check.name, check.paper, check.ours, check.wanted, MET[check.met])
    Console().print(table)
    for check in result.checks:
        if check.note:
            typer.echo(f"{check.name}: {check.note}")
    other = (
        "your measurements" if MEASUREMENTS in own_files(result.folder) else "grains of 3 mm with the same constants"
    )
    typer.echo(f"\nCoarse grains beside {other}, in other tests: {result.held_out.text}\n")
    typer.echo(f"{result.wall_s:.0f} s. wrote {result.folder / 'report.html'}")
