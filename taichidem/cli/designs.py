"""The sub-commands ``taichidem design`` and ``taichidem analyse``: plain CSV in, plain CSV out."""

from __future__ import annotations

import csv
import inspect
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import pandas as pd
import typer

from taichidem import plugins
from taichidem.errors import InputError, unknown_name
from taichidem.whole_file import whole_file

_SET = "A setting, name=value; --describe lists them."


def register(app: typer.Typer) -> None:
    """Add the commands ``design`` and ``analyse`` to a Typer application."""
    app.command("design")(design)
    app.command("analyse")(analyse)


def design(
    name: Annotated[str | None, typer.Argument(help="Name of the design; without one, all are listed.")] = None,
    factors: Annotated[Path | None, typer.Option("--factors", "-f", help="TOML file with the factors.")] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="CSV file to write the runs to.")] = None,
    runs: Annotated[int | None, typer.Option(help="Number of runs wanted.")] = None,
    replicates: Annotated[int, typer.Option(help="How often each run is done.")] = 1,
    seed: Annotated[int, typer.Option(help="Seed of run order and run seeds.")] = 0,
    setting: Annotated[list[str] | None, typer.Option("--set", "-s", help=_SET)] = None,
    existing: Annotated[Path | None, typer.Option(help="CSV of runs done before, to be augmented (d_optimal).")] = None,
    candidates: Annotated[Path | None, typer.Option(help="CSV of candidate runs (d_optimal).")] = None,
    coded: Annotated[bool, typer.Option("--coded", help="Add columns with the coded values.")] = False,
    effect: Annotated[float | None, typer.Option(help="Size of an effect, low to high, for the power.")] = None,
    noise: Annotated[float | None, typer.Option(help="Standard deviation of one run, for the power.")] = None,
    describe: Annotated[bool, typer.Option("--describe", help="Explain the design and its settings.")] = False,
) -> None:
    """Make a designed experiment: which runs to do, in which order, with which seeds."""
    with _clear_errors("design"):
        if name is None:
            typer.echo(_list("design"))
            return
        generator = plugins.get("design", name)
        if describe:
            typer.echo(_description(generator))
            return
        tables = {"existing": existing, "candidates": candidates}
        given: dict[str, Any] = {key: read_table(path) for key, path in tables.items() if path is not None}
        given |= {"runs": runs, "replicates": replicates}
        settings = _settings(generator, setting or [], given)
        made = generator(**settings).generate(_space(factors), seed=seed)
        typer.echo(made.text())
        if effect is not None or noise is not None:
            typer.echo(_power(made, effect, noise))
        table = made.side_by_side() if coded else made.table
        if output is None:
            typer.echo("\n" + table.to_string(index=False))
        else:
            _write(table, output)


def analyse(
    name: Annotated[str | None, typer.Argument(help="Name of the analyser; without one, all are listed.")] = None,
    table: Annotated[Path | None, typer.Argument(help="CSV file, one row per run.")] = None,
    response: Annotated[list[str] | None, typer.Option("--response", "-r", help="Response column; repeatable.")] = None,
    factors: Annotated[
        str | None,
        typer.Option("--factors", "-f", help="Factor columns A,B,…, or a TOML file with their low and high."),
    ] = None,
    design_table: Annotated[
        Path | None, typer.Option("--design", help="CSV of the design; its runs must match.")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder for CSV, JSON and pictures.")] = None,
    setting: Annotated[list[str] | None, typer.Option("--set", "-s", help=_SET)] = None,
    pictures: Annotated[bool, typer.Option(help="Draw pictures (with -o).")] = True,
    describe: Annotated[bool, typer.Option("--describe", help="Explain the analyser and its settings.")] = False,
) -> None:
    """Analyse a table of runs: text on the screen; CSV, JSON and pictures with -o."""
    with _clear_errors("analyser"):
        if name is None:
            typer.echo(_list("analyser"))
            return
        analyser_class = plugins.get("analyser", name)
        if describe:
            typer.echo(_description(analyser_class))
            return
        if table is None:
            raise InputError(f"Give the CSV table to analyse: taichidem analyse {name} TABLE.csv --response COLUMN.")
        analyser = analyser_class(**_settings(analyser_class, setting or [], {}))
        data = read_table(table)
        names, space = _factors(factors)
        if design_table is not None:
            _match(data, read_table(design_table), names)
        responses = [part.strip() for text in response or [] for part in text.split(",") if part.strip()]
        report = analyser.analyse(data, responses=responses, factors=names, space=space)
        typer.echo(report.text())
        if output is not None:
            figures = analyser.figures(report) if pictures else {}
            paths = report.save(output, figures)
            typer.echo(f"\nWrote {len(paths)} files to {output}: {', '.join(path.name for path in paths)}")


def read_table(path: Path) -> pd.DataFrame:
    """Return a CSV table; semicolons with decimal commas, as some spreadsheets write, are understood.

    Raises:
        InputError: for a file that is missing, empty or no table.
    """
    try:
        with path.open(encoding="utf-8-sig") as file:
            header = file.readline()
        european = ";" in header and "," not in header
        table = pd.read_csv(path, encoding="utf-8-sig", sep=";" if european else ",", decimal="," if european else ".")
    except FileNotFoundError:
        raise InputError(f"There is no file {path}. Give the path of a CSV file.") from None
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError, IsADirectoryError) as error:
        raise InputError(
            f"{path} is no CSV table: {error} Save it as CSV (UTF-8) with one row of column names."
        ) from None
    names = [name.strip() for name in next(csv.reader([header], delimiter=";" if european else ","), [])]
    twice = sorted({name for name in names if name and names.count(name) > 1})
    if twice:
        raise InputError(
            f"{path} has more than one column named {', '.join(twice)}. Give each column a name of its own."
        )
    table.columns = [str(column).strip() for column in table.columns]
    return table.dropna(how="all")


def parse_value(text: str, default: Any = None) -> Any:
    """Return a setting's value from text: true/false, none, a number, whole numbers with commas, or the text itself.

    Where the default is a word, ``none`` and the like are words too (``hierarchy=none``).
    """
    word = text.strip()
    known = {"true": True, "yes": True, "false": False, "no": False, "none": None}
    if word.lower() in known and not isinstance(default, str):
        return known[word.lower()]
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            continue
    parts = word.split(",")
    if len(parts) > 1 and all(part.strip().isdigit() for part in parts):
        return tuple(int(part) for part in parts)
    return word


def _settings(plugin: Any, texts: list[str], given: Mapping[str, Any]) -> dict[str, Any]:
    """Return keyword arguments for a plugin: those of ``--set`` over those of options that it knows."""
    allowed = plugin.settings()
    settings: dict[str, Any] = {}
    for key, value in given.items():
        if key in allowed:
            settings[key] = value
        elif value is not None:
            raise InputError(f"{plugin.name} takes no --{key}. Drop it; --describe shows what it takes.")
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--set {text!r} has no '='. Write --set name=value.")
        if key.strip() not in allowed:
            raise unknown_name(f"setting of {plugin.name}", key.strip(), allowed)
        settings[key.strip()] = parse_value(value, allowed[key.strip()])
    return settings


def _space(path: Path | None) -> Any:
    if path is None:
        raise InputError(
            "Give the factors: --factors factors.toml, a file with one table per factor, for example\n"
            '[factors.static_friction]\nlow = 0.1\nhigh = 0.6\nunit = ""'
        )
    from designs import FactorSpace

    return FactorSpace.from_toml(path)


def _factors(text: str | None) -> tuple[list[str] | None, Any]:
    """Return factor names and space from ``--factors``: a list of columns, or a TOML file."""
    if text is None:
        return None, None
    if text.lower().endswith(".toml"):
        space = _space(Path(text))
        return list(space.names), space
    return [part.strip() for part in text.split(",") if part.strip()], None


def _match(table: pd.DataFrame, planned: pd.DataFrame, names: list[str] | None) -> None:
    from analysis.run_table import NEVER_FACTORS, match_design
    from designs.space import CODED_PREFIX

    own = [c for c in planned.columns if c not in NEVER_FACTORS and not c.startswith(CODED_PREFIX)]
    match_design(table, planned, [c for c in own if names is None or c in names])


def _power(made: Any, effect: float | None, noise: float | None) -> str:
    if effect is None or noise is None:
        raise InputError("The power needs both --effect and --noise.")
    table = made.power(effect=effect, noise=noise)
    if table["power"].isna().any():
        return "The design is saturated: its power can't be computed without an error estimate."
    low, high = 100 * table["power"].min(), 100 * table["power"].max()
    share = f"{low:.0f} %" if high - low < 0.5 else f"{low:.0f} to {high:.0f} %, depending on the term"
    return f"Power for an effect of {effect:g} with noise {noise:g} at α = 0.05: {share}."


def _write(table: pd.DataFrame, path: Path) -> None:
    try:
        with whole_file(path) as fresh:
            table.to_csv(fresh, index=False)
    except OSError as error:
        raise InputError(
            f"{path} can't be written: {error.strerror or error}. Give a file in an existing folder."
        ) from None
    typer.echo(f"\nWrote {len(table)} runs to {path}")


def _list(kind: str) -> str:
    rows = [plugin for plugin in plugins.listing(kind) if plugin.usable]
    width = max(len(plugin.name) for plugin in rows)
    lines = [f"{p.name:<{width}}  {p.summary}" + (f"  [{p.source}]" if p.source != plugins.OURS else "") for p in rows]
    command = {"design": "design", "analyser": "analyse"}[kind]
    return "\n".join([*lines, f"\ntaichidem {command} NAME --describe explains one."])


def _description(plugin: Any) -> str:
    settings = "\n".join(f"  {key} = {value!r}" for key, value in plugin.settings().items())
    inherited = [inspect.getdoc(base) for base in plugin.__mro__[1:] if base.__module__.partition(".")[0] in _OWNERS]
    arguments = [text.partition("Args:")[2] for text in inherited if text and "Args:" in text]
    shared = "\n\nShared settings:" + "".join(arguments).rstrip() if arguments else ""
    return f"{plugin.name}\n\n{inspect.getdoc(plugin)}{shared}\n\nDefaults:\n{settings}"


_OWNERS = ("designs", "analysis")


@contextmanager
def _clear_errors(kind: str) -> Iterator[None]:
    """Print problems with plugins first; turn errors about the user's input into one message and exit code 2."""
    from analysis.errors import AnalysisError
    from designs.errors import DesignError

    try:
        for problem in plugins.problems(kind):
            typer.echo(f"Note: {problem}", err=True)
        yield
    except (InputError, DesignError, AnalysisError) as error:
        typer.echo(f"Error: {error}", err=True)
        raise typer.Exit(2) from None
