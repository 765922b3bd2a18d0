"""The paper's numbers beside ours as one self-contained page."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, select_autoescape

from taichidem import __version__
from taichidem.heap_comparison import LABORATORY
from taichidem.paper import held_out, page_tables, published
from taichidem.paper.charts import effects_chart, heaps_chart, points_chart, search_chart
from taichidem.paper.checks import time_saved
from taichidem.paper.effort import EFFORTS
from taichidem.paper.optimum import STAGE as OPTIMUM
from taichidem.paper.setting_up import conditions, heaps, settings_rows, window_text
from taichidem.study.report.embedded import Picture, pictures
from taichidem.whole_file import save_figure, write_whole

if TYPE_CHECKING:
    from taichidem.paper.optimum import Optimum
    from taichidem.paper.reproduction import Reproduction

FILE = "report.html"
DOTS_PER_INCH = 130


def write_page(result: Reproduction) -> Path:
    """Write the report into the result's folder and return its path."""
    drawn = {
        "effects": effects_chart(result.screening),
        "points": points_chart(result.surface),
        "search": search_chart(result.rounds, LABORATORY),
        "heaps": heaps_chart(result.optimum, result.fine, LABORATORY),
    }
    for name, figure in drawn.items():
        save_figure(figure, result.folder / f"{name}.png", dpi=DOTS_PER_INCH)
    page = _environment().get_template("paper.html.jinja").render(**_content(result, drawn))
    file = result.folder / FILE
    write_whole(file, page)
    return file


def _content(result: Reproduction, drawn: Mapping[str, Any]) -> dict[str, Any]:
    folder = result.folder
    files = {name: f"{name}.png" for name in drawn}
    for kept, name in ((result.optimum.heaps, "coarse"), (result.fine, "fine")):
        files |= {f"{kind} {name}": file for kind, file in kept.pictures.items()}
    return {
        "result": result,
        "effort": EFFORTS[result.effort],
        "checks": result.checks,
        "rounds": _named(result.rounds),
        "pictures": {name: _embedded(file, folder) for name, file in files.items()},
        "contours": [_embedded(file, folder) for file in _contours(folder)],
        **_tables(result),
        "window": window_text(),
        "conditions": conditions(result),
        "own_files": held_out.own_files(folder),
        "instrument": held_out.INSTRUMENT,
        "published": published,
        "saved": time_saved(result.optimum.heaps, result.fine),
        "laboratory": LABORATORY,
        "now": datetime.now().astimezone(),
        "version": __version__,
    }


def _named(rounds: Sequence[Optimum]) -> dict[str, Optimum]:
    """Return the rounds of the search and the confirmations, each kind numbered from 1."""
    named: dict[str, Optimum] = {}
    for found in rounds:
        kind = "Confirmation" if found.confirmation else "Round"
        named[f"{kind} {1 + sum(name.startswith(kind) for name in named)}"] = found
    return named


def _tables(result: Reproduction) -> dict[str, Any]:
    surface = result.surface.report
    return {
        "coefficients": page_tables.coefficients(surface),
        "variance": page_tables.variance(surface),
        "summary": page_tables.summary(surface),
        "angles": page_tables.angles({"heaps of 6 mm": result.optimum.heaps, "heaps of 3 mm": result.fine}),
        "heap_kinds": list(heaps(result.rounds)),
        "heap_settings": settings_rows(result.rounds),
    }


def _contours(folder: Path) -> list[str]:
    """Return the contours of the last optimum; an earlier run's may lie beside them."""
    report = json.loads((folder / OPTIMUM / "report.json").read_text(encoding="utf-8"))
    return [f"{OPTIMUM}/{file}" for file in report["files"] if "contour" in file and file.endswith(".png")]


def _embedded(file: str, folder: Path) -> Picture:
    (picture,) = pictures({"picture": file}, folder)
    return picture


def _environment() -> Environment:
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("taichidem.paper"), PackageLoader("taichidem.study.report")]),
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"fixed": _fixed, "significant": _significant, "chance": _chance}
    return environment


def _fixed(value: float | None, decimals: int = 2) -> str:
    """Return a number with so many decimals, a dash where there is none."""
    return "–" if value is None or value != value else f"{value:.{decimals}f}"


def _significant(value: float | None, digits: int = 4) -> str:
    """Return a number with so many significant digits, a dash where there is none."""
    return "–" if value is None or value != value else f"{value:#.{digits}g}".rstrip(".")


def _chance(value: float | None) -> str:
    """Return a p-value with four decimals, a dash where there is none."""
    return "<0.0001" if value is not None and value < 5e-5 else _fixed(value, 4)
