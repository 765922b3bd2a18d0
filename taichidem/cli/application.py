"""The command `taichidem`: a thin layer over the Python API."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from analysis.errors import AnalysisError
from designs.errors import DesignError
from taichidem import __version__
from taichidem.cli import coarse_grain, compare, demo, designs, diagnose, init, report, reproduce, simulate
from taichidem.errors import TaichidemError

app = typer.Typer(
    name="taichidem",
    help="Simulate bulk tests of granules, compare them with measurements, and find the physics that is missing.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
demo.register(app)
init.register(app)
simulate.register(app)
compare.register(app)
coarse_grain.register(app)
designs.register(app)
diagnose.register(app)
report.register(app)
reproduce.register(app)

Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")]


def _version(asked: bool) -> None:
    if asked:
        typer.echo(f"taichidem {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    arch: Annotated[
        str | None,
        typer.Option(help="On what to simulate: cpu or cuda; TAICHIDEM_ARCH, else cpu, where left out."),
    ] = None,
) -> None:
    if arch is not None:
        from taichidem import runtime

        runtime.choose(arch)


@app.command()
def repose(
    images: Annotated[list[Path], typer.Argument(help="Pictures of one heap from the side, simulated or real.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="PNG file for the picture with outline and lines drawn in.")
    ] = None,
    fit_from: Annotated[float, typer.Option(help="Start of the fitted flank, share of the base's half-width.")] = 0.4,
    fit_to: Annotated[float, typer.Option(help="End of the fitted flank.")] = 0.92,
    base_width: Annotated[
        str | None, typer.Option(help="Width of the base, such as '100 mm'; gives the scale.")
    ] = None,
    tilt: Annotated[float | None, typer.Option(help="Camera tilt [deg]; found from the base where left out.")] = None,
    region: Annotated[str | None, typer.Option(help="Region of interest in pixels: left,top,right,bottom.")] = None,
    as_json: Json = False,
) -> None:
    """Measure the angle of repose in pictures of a heap."""
    from analysis.repose_image import measure_repose_image
    from analysis.repose_image_settings import ImageSettings
    from taichidem.units import to_si

    settings = ImageSettings(
        region=simulate.parse_region(region),
        fit_from=fit_from,
        fit_to=fit_to,
        base_width_m=None if base_width is None else to_si(base_width, "m", "base_width"),
        tilt_deg=tilt,
    )
    report = measure_repose_image([str(path) for path in images], settings)
    if output is not None:
        report.save_annotated(output)
    if as_json:
        typer.echo(json.dumps(report.as_dict(), indent=2))
        return
    typer.echo(report.text)
    if output is not None:
        typer.echo(f"wrote {output}")


@app.command()
def plugins(
    kind: Annotated[
        str | None, typer.Argument(help="design, analyser, effect or experiment; all where left out.")
    ] = None,
    as_json: Json = False,
) -> None:
    """List designs, analysers, effects and experiments, built-in and installed."""
    from taichidem import plugins as registries

    found = registries.listing(kind)
    if as_json:
        rows = [{k: getattr(p, k) for k in ("kind", "name", "source", "summary", "status")} for p in found]
        typer.echo(json.dumps(rows, indent=2))
        return
    table = Table("kind")
    table.add_column("name", no_wrap=True)
    for heading in ("from", "status", "what it is"):
        table.add_column(heading)
    for p in found:
        table.add_row(p.kind, p.name, p.source, p.status, p.summary)
    Console().print(table)


@contextmanager
def _errors_as_text() -> Iterator[None]:
    """Print an expected error as one sentence and exit with 2; a program's own fault keeps its traceback."""
    try:
        yield
    except (TaichidemError, AnalysisError, DesignError) as error:
        typer.echo(f"Error: {error}", err=True)
        raise SystemExit(2) from None
    except KeyboardInterrupt:
        typer.echo("Interrupted; nothing more was written.", err=True)
        raise SystemExit(130) from None


def main(arguments: list[str] | None = None) -> Any:
    """Run the command line."""
    with _errors_as_text():
        return app(args=sys.argv[1:] if arguments is None else arguments)
