"""The command `taichidem demo`: a heap beside a laboratory's, then a study whose model lacks something."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from taichidem.cli.diagnose import print_addition
from taichidem.cli.progress import progress

if TYPE_CHECKING:
    from taichidem.heap_comparison import HeapComparison
    from taichidem.missing_effect_demo import Road
    from taichidem.study import Addition


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("demo")(demo)


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder for pictures and results.")] = Path("demo"),
    seeds: Annotated[int, typer.Option(help="Heaps to pour.", min=1)] = 4,
    heap_only: Annotated[bool, typer.Option("--heap-only", help="Pour the heap and leave it at that.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")] = False,
) -> None:
    """Compare a heap with a laboratory's, then find out what a model lacks, add it and watch the error fall.

    First the paper's polypropylene heap is poured, pictured and measured. Then a small study, from whose model something is
    hidden, goes compare, diagnose, add, report.
    """
    from taichidem.heap_comparison import compare_heap
    from taichidem.library import polypropylene

    with progress(quiet=as_json) as report:
        heap = compare_heap(polypropylene(), range(1, seeds + 1), output, report=report)
    if not as_json:
        _print_heap(heap)
    road = None if heap_only else _go(output, as_json)
    if as_json:
        more = {} if road is None else {"missing_effect": _as_dict(road)}
        typer.echo(json.dumps(heap.as_dict() | more, indent=2))


def _print_heap(result: HeapComparison) -> None:
    from taichidem.heap_comparison import NOT_COUNTED

    c = result.comparison
    table = Table("", "angle of repose [deg]", "standard uncertainty [deg]", title="Polypropylene heap")
    table.add_row("simulated S", f"{c.simulated:.2f}", f"{c.simulated_uncertainty:.2f}")
    table.add_row("measured D", f"{c.measured:.2f}", f"{c.measured_uncertainty:.2f}")
    table.add_row("error E = S − D", f"{c.error:+.2f}", f"{c.validation_uncertainty:.2f} (u_val)")
    Console().print(table)
    typer.echo(f"{c.text}\n\n{c.advice}\n\n{NOT_COUNTED}\n")
    for outcome in result.outcomes:
        if outcome.failure:
            typer.echo(f"Seed {outcome.seed} failed: {outcome.failure}")
    for path in result.files.values():
        typer.echo(f"wrote {path}")


def _go(output: Path, quiet: bool) -> Road:
    from taichidem.missing_effect_demo import EXAMPLE, go

    if not quiet:
        typer.echo(
            f"\nNow a study whose model lacks something, {EXAMPLE.name}: its measurements were simulated with an effect"
        )
        typer.echo("that this model hasn't got. Which one? compare → diagnose → add → report\n")
    with progress(quiet=quiet) as report:
        road = go(output, report=report)
    if not quiet:
        _print_road(road)
    return road


def _print_road(road: Road) -> None:
    from taichidem.missing_effect_demo import RIVALS

    found, console = road.diagnosis, Console()
    typer.echo(f"compare: {road.comparison.text}\n")
    typer.echo(f"diagnose: {found.verdict}{': ' + ', '.join(found.effects) if found.effects else ''}\n{found.text}\n")
    for line in found.advice:
        typer.echo(line)
    typer.echo(f"\nOnly {', '.join(RIVALS)} were on trial here; `taichidem diagnose` tries every effect.\n")
    if not road.additions:
        typer.echo("Nothing was added.")
    else:
        best, *others = road.additions
        console.print(_falling(best))
        for other in others:
            typer.echo(
                f"{other.effect}, which the diagnosis could not tell from it, was added too: on fresh seeds it leaves χ² = "
                f"{other.step('with_effect')['chi2']:.1f}, {best.effect} {best.step('with_effect')['chi2']:.1f}.\n"
            )
        print_addition(best)
    typer.echo(f"wrote {road.page}")


def _falling(added: Addition) -> Table:
    """Return the fall of the error as bars, the re-calibration's share apart from the effect's."""
    largest = max(step["chi2"] for step in added.waterfall)
    table = Table(title="The error falls", box=box.SIMPLE_HEAD, show_header=False, pad_edge=False)
    for step in added.waterfall:
        bar = "█" * max(1, round(40 * step["chi2"] / largest))
        table.add_row(step["label"], f"χ² {step['chi2']:.1f}", bar)
    return table


def _as_dict(road: Road) -> dict[str, object]:
    return {
        "comparison": road.comparison.as_dict(),
        "diagnosis": road.diagnosis.as_dict(),
        "additions": [added.as_dict() for added in road.additions],
        "report": str(road.page),
    }
