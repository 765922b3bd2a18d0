"""The paper's numbers beside ours as one self-contained page."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, select_autoescape

from taichidem import __version__
from taichidem.heap_comparison import LABORATORY
from taichidem.paper import published
from taichidem.paper.charts import effects_chart, heaps_chart, points_chart, search_chart
from taichidem.paper.checks import time_saved
from taichidem.paper.effort import EFFORTS
from taichidem.study.report.embedded import Picture, pictures
from taichidem.whole_file import save_figure, write_whole

if TYPE_CHECKING:
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
    contours = sorted(path.relative_to(folder).as_posix() for path in (folder / "optimum").glob("*contour*.png"))
    for heaps, name in ((result.optimum.heaps, "coarse"), (result.fine, "fine")):
        files |= {f"{kind} {name}": file for kind, file in heaps.pictures.items()}
    return {
        "result": result,
        "effort": EFFORTS[result.effort],
        "checks": result.checks,
        "pictures": {name: _embedded(file, folder) for name, file in files.items()},
        "contours": [_embedded(file, folder) for file in contours],
        "coefficients": _coefficients(result),
        "anova": result.surface.report.tables["anova"].to_dict("records"),
        "published": published,
        "saved": time_saved(result.optimum.heaps, result.fine),
        "laboratory": LABORATORY,
        "now": datetime.now().astimezone(),
        "version": __version__,
    }


def _coefficients(result: Reproduction) -> list[dict[str, Any]]:
    """Return the terms of the surface in natural units, the paper's Equation 20 beside ours."""
    table = result.surface.report.tables["uncoded_coefficients"]
    ours = dict(zip(table["Term"], table["Coef"], strict=True))
    terms = [*published.EQUATION_20, *(term for term in ours if term not in published.EQUATION_20)]
    return [{"term": term, "paper": published.EQUATION_20.get(term), "ours": ours.get(term)} for term in terms]


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
    environment.filters["fixed"] = _fixed
    return environment


def _fixed(value: float | None, decimals: int = 2) -> str:
    """Return a number with so many decimals, a dash where there is none."""
    return "–" if value is None or value != value else f"{value:.{decimals}f}"
