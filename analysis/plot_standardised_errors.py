"""Pictures of a comparison: standardised errors of all measurements; simulated against measured along a condition."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D

from analysis.error_trends import Series
from analysis.plot_style import BLUE, GREY, ORANGE, RED, new_figure, tidy
from analysis.standardised_errors_text import name_and_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from analysis.report import Report

BAND = 2.0  # |z| that a right model seldom leaves
FEWEST_IN_A_PICTURE = 3
LINEAR_UP_TO = 5.0  # |z| beyond which the axis is logarithmic where errors are much larger


def chart(report: Report) -> Figure:
    """Return z of every measurement as a bar with a dot, the band |z| ≤ 2 shaded, those that fail in red."""
    rows: pd.DataFrame = report.details["rows"]
    measured = report.details["table"]
    figure, axes = new_figure(width=7.6, height=1.9 + 0.32 * len(rows))
    axes.axvspan(-BAND, BAND, color="#e4ebf2", zorder=0)
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    for place, (i, row) in enumerate(rows.iterrows()):
        if math.isnan(row["z"]):
            axes.text(0.0, place, "no run gave a value", color=GREY, fontsize=8, ha="center", va="center")
            continue
        colour = RED if row["fails"] else BLUE
        axes.plot([0.0, row["z"]], [place, place], color=colour, linewidth=2.4, solid_capstyle="butt")
        judged = not math.isnan(row["p"])
        axes.plot(row["z"], place, "D" if measured.loc[i, "kind"] == "parameter" else "o", color=colour, markersize=7,
                  markerfacecolor=colour if judged else "white")  # fmt: skip
    axes.set_yticks(range(len(rows)), rows["label"], fontsize=9)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    _scale(axes, rows["z"].abs().max())
    _explain(axes, rows, measured)
    tidy(axes, "Simulated S against measured D", "← too low in the model      z = (S − D) / u_val      too high →")
    return figure


def _scale(axes: Axes, largest: float) -> None:
    """Show all errors: linear, or beyond a few u_val logarithmic where one of them would squeeze the others."""
    largest = 1.0 if math.isnan(largest) else largest
    if largest > 6 * LINEAR_UP_TO:
        axes.set_xscale("symlog", linthresh=LINEAR_UP_TO, linscale=1.2)
        ticks = [-100, -30, -10, -5, -2, 0, 2, 5, 10, 30, 100]
        axes.set_xticks(ticks, [str(tick).replace("-", "−") for tick in ticks])
        note = f"logarithmic beyond {LINEAR_UP_TO:g}"
        axes.annotate(note, (1, 1), xycoords="axes fraction", fontsize=8, color=GREY, ha="right", va="bottom")
        largest *= 1.3  # as far from the frame as on a linear axis
    reach = 1.12 * max(largest, 2.6)
    axes.set_xlim(-reach, reach)


def _explain(axes: Axes, rows: pd.DataFrame, measured: pd.DataFrame) -> None:
    """Say what colours and symbols mean, those that occur."""
    marks = [(BLUE, "o", BLUE, "explained by the uncertainties", (~rows["fails"] & rows["p"].notna()).any())]
    marks += [(RED, "o", RED, "fails", rows["fails"].any())]
    marks += [(BLUE, "o", "white", "single seed: can't be judged", (rows["z"].notna() & rows["p"].isna()).any())]
    marks += [(GREY, "D", GREY, "parameter measured directly", (measured["kind"] == "parameter").any())]
    handles = [
        Line2D([], [], color=colour, marker=mark, markerfacecolor=face, linestyle="", label=text)
        for colour, mark, face, text, there in marks
        if there
    ]
    axes.figure.legend(handles=handles, frameon=False, fontsize=8, loc="outside lower center", ncols=len(handles))


def series_charts(report: Report) -> dict[str, Figure]:
    """Return simulated and measured values with their uncertainties for each series of three conditions or more."""
    tests: pd.DataFrame = report.details["tests"]
    figures: dict[str, Figure] = {}
    for series in report.details["series"]:
        if len(set(series.values)) >= FEWEST_IN_A_PICTURE:
            name = _free(f"series_{_plain(_called(tests, series))}", figures)
            figures[name] = _series_chart(tests, series)
    return figures


def _called(tests: pd.DataFrame, series: Series) -> str:
    """Return the one test that a series comes from, or what its tests are, with the condition where several differ."""
    names = set(tests["experiment"].iloc[list(series.rows)]) if "experiment" in tests else set()
    kind = str(tests["type"].iloc[series.rows[0]]) if "type" in tests else series.observable
    return f"{names.pop()}" if len(names) == 1 else f"{kind}_{name_and_unit(series.condition)[0]}"


def _plain(name: str) -> str:
    return re.sub(r"[^\w.+-]+", "_", name).strip("_")


def _free(name: str, taken: Any) -> str:
    number = 2
    free = name
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    return free


def _series_chart(tests: pd.DataFrame, series: Series) -> Figure:
    part = tests.iloc[list(series.rows)]
    x = np.asarray(series.values)
    figure, axes = new_figure(width=6.4, height=4.4)
    shift = 0.006 * np.ptp(x)  # side by side, so that neither hides the other
    looks = {"elinewidth": 1.5, "capsize": 4, "markersize": 7}
    axes.errorbar(
        x - shift, part["measured"], part["u_measured"], fmt="o", color=ORANGE, label="measured D ± u", **looks
    )
    u = part["u_simulated"].fillna(0.0)
    axes.errorbar(x + shift, part["simulated"], u, fmt="s-", color=BLUE, linewidth=1.0, label="simulated S ± u (seeds)",
                  markerfacecolor="white", **looks)  # fmt: skip
    axes.legend(frameon=False, fontsize=9)
    name, unit = name_and_unit(series.condition)
    own = str(part["unit"].iloc[0])
    title = f"{series.observable} over {name}: simulated against measured"
    tidy(axes, title, _labelled(name, unit), _labelled(series.observable, own))
    return figure


def _labelled(name: str, unit: str) -> str:
    return name if unit in ("", "1") else f"{name} [{unit}]"
