"""The command `taichidem simulate`: one experiment, several seeds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from taichidem.cli_progress import progress
from taichidem.errors import InputError


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("simulate")(simulate)


def simulate(
    experiment: Annotated[str, typer.Argument(help="Name of an experiment; see `taichidem plugins experiment`.")],
    setting: Annotated[
        list[str] | None, typer.Option("--set", "-s", help="A setting, such as cup_radius='50 mm'. May be repeated.")
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter", "-p", help="A parameter of the model, such as tangential_mindlin.static_friction=0.4."
        ),
    ] = None,
    seeds: Annotated[str, typer.Option(help="Seeds, such as 1,2,3.")] = "1",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder for result.json and grains as VTK.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the first seed's run to this PNG.")] = None,
    movie: Annotated[Path | None, typer.Option(help="Write the first seed's run to this animated GIF.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")] = False,
) -> None:
    """Run an experiment on the polypropylene model and print what it measures.

    A parameter changes the value between grains; that between grain and wall stays unless the pair is named, as in
    normal_hertz.restitution:polypropylene-steel=0.6.
    """
    from taichidem import plugins
    from taichidem.heap_comparison import writable_folder, write_seeds
    from taichidem.library import polypropylene

    numbers = parse_seeds(seeds)
    folder = None if output is None else writable_folder(output)
    model = polypropylene()
    for text in parameter or []:
        model = with_parameter(model, text)
    test = plugins.get("experiment", experiment)(**dict(_split(text) for text in setting or []))
    with progress(quiet=as_json) as report:
        report("simulating", 0.0)
        frames = 0.05 if picture or movie else None
        outcomes = test.run(model, numbers, report=lambda share: report("simulating", share), frames=frames)
    _draw(test, model, outcomes[0], picture, movie)
    result = {
        "experiment": test.name,
        "units": {o.name: o.unit for o in test.observables},
        "runs": [{"seed": o.seed, "observables": dict(o.observables), "failure": o.failure} for o in outcomes],
    }
    if folder is not None:
        write_seeds(folder, outcomes)
        (folder / "result.json").write_text(json.dumps(result, indent=2) + "\n")
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    else:
        Console().print(_table(test, outcomes))
        if folder is not None:
            typer.echo(f"wrote {folder}")
    if all(o.failure for o in outcomes):
        raise typer.Exit(1)


def _draw(test: Any, model: Any, outcome: Any, picture: Path | None, movie: Path | None) -> None:
    if picture is None and movie is None:
        return
    from taichidem import render_experiment

    if picture is not None:
        render_experiment.picture(test, model, outcome, picture)
    if movie is not None:
        render_experiment.movie(test, model, outcome, movie)


def _table(test: Any, outcomes: list) -> Table:
    table = Table("observable", *[f"seed {o.seed}" for o in outcomes], "mean", "u (seeds)", "unit", title=test.title)
    for observable in test.observables:
        values = [o.observables.get(observable.name, np.nan) for o in outcomes]
        good = np.array([v for v in values if np.isfinite(v)])
        mean = f"{good.mean():.3f}" if len(good) else "failed"
        scatter = f"{good.std(ddof=1) / np.sqrt(len(good)):.3f}" if len(good) > 1 else "–"
        table.add_row(observable.name, *[f"{v:.3f}" for v in values], mean, scatter, observable.unit)
    table.caption = "\n".join(f"seed {o.seed}: {o.failure}" for o in outcomes if o.failure) or None
    return table


def parse_seeds(text: str) -> list[int]:
    """Return seeds from a text such as "1,2,3"."""
    parts = [part.strip() for part in text.split(",")]
    numbers = [int(part) for part in parts if part.isdigit()]
    if len(numbers) < len(parts) or len(set(numbers)) != len(numbers):
        raise InputError(f"seeds is {text!r}; give different whole numbers from 0, separated by commas, such as 1,2,3.")
    return numbers


def parse_region(text: str | None) -> tuple[int, int, int, int] | None:
    """Return a region of interest from a text "left,top,right,bottom"."""
    if text is None:
        return None
    try:
        left, top, right, bottom = (int(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"region is {text!r}; give four whole numbers: left,top,right,bottom [px].") from None
    return left, top, right, bottom


def with_parameter(model: Any, text: str) -> Any:
    """Return a model with one parameter changed, given as effect.parameter[:pair]=value."""
    name, value = _split(text)
    name, _, pair = name.partition(":")
    try:
        number = float(value)
    except ValueError:
        raise InputError(f"{text!r}: {value!r} is no number; write effect.parameter=value.") from None
    return model.with_value(name, number, pair or None)


def _split(text: str) -> tuple[str, str]:
    name, sign, value = text.partition("=")
    if not sign or not name:
        raise InputError(f"{text!r} can't be read; write name=value.")
    return name.strip(), value.strip()
