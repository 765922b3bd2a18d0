"""The command `taichidem init`: a study folder to fill in."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command()(init)


def init(
    name: Annotated[Path, typer.Argument(help="Folder of the new study.")],
    experiments: Annotated[
        str,
        typer.Option("--experiments", "-e", help="Types of the tests, joined by commas, such as ledge,rotating_drum."),
    ],
    material: Annotated[str, typer.Option(help="Starting material of the grains.")] = "polypropylene",
    wall: Annotated[str, typer.Option(help="Starting material of the walls.")] = "steel",
    diameter: Annotated[str, typer.Option(help="Diameter of the grains.")] = "6 mm",
) -> None:
    """Write a commented study to fill in: starting values with their sources, your tests, a table for measurements."""
    from taichidem.study import init_study

    wanted = [part.strip() for part in experiments.split(",") if part.strip()]
    study = init_study(name, wanted, material, wall, diameter)
    typer.echo(f"wrote {study.file}: check what you believe and how your tests are built.")
    typer.echo(f"wrote {study.path / 'measurements.csv'}: fill in value, u and n of every row, or remove the row.")
    typer.echo(f"Then: taichidem simulate {study.path}")
