"""The command `taichidem simulate`: a study folder, or one experiment with several seeds."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from taichidem.cli import simulate_study
from taichidem.cli.drawn import Drawn
from taichidem.cli.kept import Kept
from taichidem.cli.progress import progress
from taichidem.cli.shape import parse_shape
from taichidem.cli.workers import Cluster, Workers, executor_of
from taichidem.errors import InputError
from taichidem.whole_file import write_whole

MOST_SEEDS = 100_000  # a larger count is a seed that lacks its comma
LARGEST_SEED = 2**63 - 1  # that a run store holds; asking it would import the whole study, which a single test needn't


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("simulate")(simulate)


def simulate(
    what: Annotated[
        str,
        typer.Argument(
            metavar="STUDY|EXPERIMENT",
            help="A study folder or its study.toml; or the name of an experiment, see `taichidem plugins experiment`.",
        ),
    ],
    seeds: Annotated[
        str | None,
        typer.Option(
            help="How many seeds, such as 4 (which are 1,2,3,4), or which, such as 1,2,3 ('7,' is seed 7 alone)."
        ),
    ] = None,
    experiments: Annotated[
        str | None, typer.Option(help="Study: experiments to run, such as heap,ledge; all where left out.")
    ] = None,
    store: Annotated[
        Path | None, typer.Option(help="Study: file that keeps the runs; runs.sqlite in its folder where left out.")
    ] = None,
    retry_failed: Annotated[bool, typer.Option("--retry-failed", help="Study: run again what failed before.")] = False,
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", "-s", help="Experiment: a setting, such as cup_radius='50 mm'. May be repeated."),
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter",
            "-p",
            help="Experiment: a parameter of the model, such as tangential_mindlin.static_friction=0.4.",
        ),
    ] = None,
    shape: Annotated[
        str | None,
        typer.Option(
            help="Experiment: form of the grains, of equal volume: spheroid:1.5, superquadric:1,1,1.5,2,2 or "
            "multisphere:grain.csv; spheres where left out."
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Experiment: folder for result.json and grains as VTK.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(help="Single experiment, not a study: draw the first run that went well to this PNG."),
    ] = None,
    movie: Annotated[
        Path | None,
        typer.Option(help="Single experiment, not a study: write that run as a movie to this animated GIF."),
    ] = None,
    frame_interval: Annotated[
        str | None,
        typer.Option(
            "--frame-interval",
            help="Experiment: simulated time between frames, such as '1 ms'; the experiment's own where left out.",
        ),
    ] = None,
    colour_by: Annotated[
        str | None,
        typer.Option(
            "--colour-by",
            help="Experiment: what colours the grains of picture and movie, such as speed, spin or height; "
            "speed, or height at rest, where left out.",
        ),
    ] = None,
    checkpoint: Annotated[
        Path | None,
        typer.Option(
            help="Single experiment: file that keeps its state on the way; the same command goes on from there. Deleted when "
            "all results are written."
        ),
    ] = None,
    checkpoint_every: Annotated[
        str | None,
        typer.Option(
            "--checkpoint-every",
            help="Time on the clock between two checkpoints, such as '5 min'; that where left out.",
        ),
    ] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")] = False,
) -> None:
    """Run the experiments of a study into its run store (4 seeds unless told otherwise) and print what they measure.

    With the name of an experiment in place of a study: run that alone on the polypropylene model (1 seed unless told
    otherwise). A parameter changes the value between grains; that between grain and wall stays unless the pair is named, as
    in normal_hertz.restitution:polypropylene-steel=0.6.
    """
    from taichidem import plugins

    drawn, kept = Drawn(picture, movie, frame_interval, colour_by), Kept(checkpoint, checkpoint_every)
    if simulate_study.is_study(what):
        _refuse(
            "a study, whose file says it",
            {"--set": setting, "--parameter": parameter, "--shape": shape, "--output": output},
        )
        _refuse("a study; they show a single experiment, given by its name", drawn.options())
        _refuse("a study, whose store keeps every run; it is for a single experiment", kept.options())
        numbers = parse_seeds(seeds or "4")
        with executor_of(workers, cluster) as executor:
            simulate_study.simulate_study(what, experiments, numbers, store, retry_failed, as_json, executor)
    elif what in plugins.names("experiment"):
        options = {"--experiments": experiments, "--store": store, "--retry-failed": retry_failed}
        options |= {"--workers": workers is not None, "--cluster": cluster is not None}
        _refuse("a single experiment; they belong to a study", options)
        numbers = parse_seeds(seeds or "1")
        _simulate_experiment(what, setting or [], parameter or [], shape, numbers, output, drawn, kept, as_json)
    else:
        raise simulate_study.neither(what)


def _refuse(case: str, options: dict[str, Any]) -> None:
    given = [name for name, value in options.items() if value]
    if given:
        raise InputError(
            f"{', '.join(given)} can't be used with {case}. Leave {'them' if len(given) > 1 else 'it'} out."
        )


def _simulate_experiment(
    name: str,
    settings: list[str],
    parameters: list[str],
    shape: str | None,
    seeds: list[int],
    output: Path | None,
    drawn: Drawn,
    kept: Kept,
    as_json: bool,
) -> None:
    from taichidem import plugins
    from taichidem.heap_comparison import writable_folder
    from taichidem.library import polypropylene

    drawn.check()
    folder = None if output is None else writable_folder(output)
    model = replace(polypropylene(), shape=parse_shape(shape))
    for text in parameters:
        model = with_parameter(model, text)
    test = plugins.get("experiment", name)(**dict(_split(text) for text in settings))
    frames = drawn.interval(test)
    keeping = kept.arguments() | {"frames": frames}
    with kept.told_when_stopped():
        with progress(quiet=as_json) as report:
            report("simulating", 0.0)
            outcomes = test.run(model, seeds, report=lambda share: report("simulating", share), **keeping)
        _write_and_show(test, outcomes, folder, as_json)
        good = [o for o in outcomes if not o.failure]
        if not good:
            raise typer.Exit(1)
        drawn.draw(test, model, good[0])
        kept.discard(test, model, seeds, frames)


def _write_and_show(test: Any, outcomes: list, folder: Path | None, as_json: bool) -> None:
    result = {
        "experiment": test.name,
        "units": {o.name: o.unit for o in test.observables},
        "runs": [{"seed": o.seed, "observables": dict(o.observables), "failure": o.failure} for o in outcomes],
    }
    if folder is not None:
        from taichidem.heap_comparison import write_seeds

        write_seeds(folder, outcomes)
        write_whole(folder / "result.json", json.dumps(result, indent=2) + "\n")
    if as_json:
        typer.echo(json.dumps(result, indent=2))
    else:
        Console().print(_table(test, outcomes))
        if folder is not None:
            typer.echo(f"wrote {folder}")


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
    """Return seeds from a text: "4" is how many (1, 2, 3, 4), "1,2,3" is which, "7," is seed 7 alone."""
    parts = [part.strip() for part in text.split(",")]
    if len(parts) > 1 and not parts[-1]:
        parts.pop()
    numbers = [int(part) for part in parts if part.isdecimal()]
    how_many = "," not in text
    if (
        len(numbers) < len(parts)
        or len(set(numbers)) != len(numbers)
        or max(numbers) > LARGEST_SEED
        or (how_many and not 0 < numbers[0] <= MOST_SEEDS)
    ):
        raise InputError(
            f"seeds is {text!r}; give how many, from 1 to {MOST_SEEDS}, or different whole numbers from 0 to "
            f"{LARGEST_SEED}, separated by commas, such as 1,2,3."
        )
    return list(range(1, numbers[0] + 1)) if how_many else numbers


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
