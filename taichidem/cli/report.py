"""The command `taichidem report`: what is known of a study as one page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("report")(report)


def report(
    study: Annotated[Path, typer.Argument(help="A study folder, or its study.toml.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="HTML file to write; report.html among the results where left out."),
    ] = None,
    results: Annotated[
        Path | None,
        typer.Option(help="Folder of results; results in the study's folder where left out."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")] = False,
) -> None:
    """Write the verdict, the pictures and how they were computed as one HTML page that needs no network.

    It shows what `compare`, `diagnose`, `add` and `discover` left among the study's results, and says how to make the rest.
    """
    from taichidem.study import write_report

    file = write_report(study, output, results=results)
    typer.echo(json.dumps({"report": str(file)}, indent=2) if as_json else f"wrote {file}")
