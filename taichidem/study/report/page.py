"""The report as one self-contained HTML page."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from taichidem import __version__
from taichidem.errors import InputError
from taichidem.study.report import wording
from taichidem.study.report.chart_errors import ROWS_PER_PAGE, describe_errors, errors_figure, largest
from taichidem.study.report.chart_look_alikes import cell_colour, cell_text, light_ink
from taichidem.study.report.chart_style import as_svg
from taichidem.study.report.chart_waterfall import describe_waterfall, waterfall_figure
from taichidem.study.report.embedded import pictures
from taichidem.study.report.headline import headline
from taichidem.study.report.results_folder import COMMANDS, Results, read_results
from taichidem.study.report.series import label_of, look_alikes, test_errors, waterfall_steps
from taichidem.study.result_file import RESULTS
from taichidem.study.study_file import study_file
from taichidem.whole_file import write_whole

FILE = "report.html"
_PARTS = re.compile(r"[^._]*[._]?")
MOST_FAILURES = 30  # listed in the page; the result files hold all


def write_report(path: str | Path, output: str | Path | None = None, *, results: str | Path | None = None) -> Path:
    """Write what is known of a study as one HTML page that needs no network, and return its path.

    The page shows whatever of comparison.json, verdict.json, addition.json and discovery.json lies in the folder of results,
    and says which command makes what is missing.

    Args:
        path: the study's folder, or its study.toml.
        output: the file, or a folder for report.html; report.html in the folder of results where left out.
        results: the folder of results; `results` in the study's folder where left out.

    Raises:
        InputError: there is no study or no result, a result file is broken, or the page can't be written.
    """
    study = study_file(path).parent
    folder = study / RESULTS if results is None else Path(results)
    name = study.resolve().name
    page = render(read_results(folder, shlex.quote(name)), name, datetime.now().astimezone())
    file = folder / FILE if output is None else Path(output)
    file = file / FILE if file.is_dir() else file
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, page)
    except OSError as error:
        raise InputError(f"{file} can't be written ({error.strerror}). Give another file with -o.") from error
    return file


def render(results: Results, name: str, now: datetime) -> str:
    """Return the page.

    Args:
        results: as read.
        name: of the study's folder, for commands, and for the title where the results hold none.
        now: date and time on the page.
    """
    documents = {kind: results.get(kind) for kind in COMMANDS}
    title = next((d["study"] for d in documents.values() if d and d["study"]), name)
    return (
        _environment()
        .get_template("page.html.jinja")
        .render(
            **documents,
            title=title,
            command=shlex.quote(name),
            commands=COMMANDS,
            written=results.written,
            now=now,
            version=__version__,
            headline=headline(results),
            charts={kind: _charts(kind, documents[kind]) for kind in ("addition", "verdict", "comparison")},
            matrix=_matrix(documents["verdict"]),
            pictures=_pictures(documents, results.folder),
            failures=_failures(documents),
            most_failures=MOST_FAILURES,
        )
    )


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("taichidem.study.report"),
        autoescape=select_autoescape(default=True, default_for_string=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    names = (
        "number",
        "plus_minus",
        "standardised",
        "size",
        "probability",
        "unit",
        "with_unit",
        "duration",
        "spoken",
        "plain",
    )
    environment.filters.update({name: getattr(wording, name) for name in names})
    environment.filters["label"] = label_of
    environment.filters["breakable"] = _breakable
    environment.filters["listed"] = wording.listed
    return environment


def _breakable(name: str) -> Markup:
    """Let a long name of the program break after its dots and underscores, and nowhere within a word."""
    return Markup("").join(
        Markup("{}<wbr>").format(part) if part[-1:] in "._" else part for part in _PARTS.findall(name)
    )


def _charts(kind: str, document: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the waterfall and the charts of errors as SVG; a chart without data is left out."""
    charts: dict[str, Any] = {"waterfall": None, "errors": []}
    if document is None:
        return charts
    steps = [] if kind == "comparison" else waterfall_steps(document)
    if steps:
        charts["waterfall"] = Markup(as_svg(waterfall_figure(steps), f"waterfall-{kind}", describe_waterfall(steps)))
    tests = [test for test in test_errors(document) if test.by_step]
    reach = largest(tests)
    for first in range(0, len(tests), ROWS_PER_PAGE):
        part = tests[first : first + ROWS_PER_PAGE]
        svg = as_svg(errors_figure(part, reach), f"errors-{kind}-{first}", describe_errors(part))
        charts["errors"].append(Markup(svg))
    return charts


def _matrix(verdict: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    if verdict is None:
        return []
    matrix = look_alikes(verdict)
    cells = [
        [{"text": cell_text(rho), "colour": cell_colour(rho), "light": light_ink(rho)} for rho in row]
        for row in matrix.rho
    ]
    return [
        {"effect": effect, "title": title, "cells": row}
        for effect, title, row in zip(matrix.effects, matrix.titles, cells, strict=True)
    ]


def _pictures(documents: Mapping[str, Mapping[str, Any] | None], folder: Path) -> list:
    return [picture for d in documents.values() if d for picture in pictures(d["pictures"], folder)]


def _failures(documents: Mapping[str, Mapping[str, Any] | None]) -> list[Mapping[str, Any]]:
    """Return the failed runs of all results, each once."""
    failures = [failure for d in documents.values() if d for failure in d["failures"]]
    return list({(f["experiment"], f["seed"], f["reason"]): f for f in failures}.values())
