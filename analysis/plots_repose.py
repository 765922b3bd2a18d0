"""Plot the radial profile of a heap, the line through its flank, and what the laboratory measured."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.repose_profile import ReposeProfileReport

PARTS = ("#9fb6cd", "#b7cdb0", "#d9c3a5", "#cfb3c6", "#a9cfd0", "#d0b0a8", "#bdb7d9", "#c9cfa0")
MEAN, LINE, LABORATORY, INK = "#1d4e7e", "#c8402b", "#3f7d3a", "#27313c"


def plot_profile(
    report: ReposeProfileReport,
    path: str | os.PathLike[str],
    laboratory: tuple[float, float] | None = None,
    title: str = "Heap profile",
) -> Path:
    """Plot height against radius: parts of the heap, their mean, the fitted line, the window, the laboratory's angle.

    Parameters
    ----------
    report : angle of repose from positions.
    path : picture to write; the ending (.png, .pdf, .svg) chooses the format.
    laboratory : measured angle and its standard uncertainty [deg], or None.
    title : heading.

    Raises
    ------
    AnalysisError : the file can't be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 5.6), dpi=160, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    _draw_window(axes, report)
    _draw_profile(axes, report)
    _draw_line(axes, report)
    if laboratory is not None:
        _draw_laboratory(axes, report, laboratory)
    _dress(axes, report, title)
    target = Path(path)
    try:
        figure.savefig(target)
    except (OSError, ValueError) as problem:
        raise AnalysisError(
            f"The plot can't be written to {target} ({problem}). Allowed: a path ending in .png, .pdf or .svg in a "
            "folder that exists and may be written to."
        ) from problem
    return target


def _draw_window(axes: Any, report: ReposeProfileReport) -> None:
    low, high = report.window.limits(report.cup_radius_m)
    axes.axvspan(
        low * 1e3, high * 1e3, color="#e4ebf2", zorder=0, label=f"fit window {low * 1e3:.0f}–{high * 1e3:.0f} mm"
    )
    axes.axvline(report.cup_radius_m * 1e3, color=INK, linewidth=0.8, linestyle=":", zorder=1)
    axes.annotate(
        "cup wall",
        (report.cup_radius_m * 1e3, 0.0),
        xycoords=("data", "axes fraction"),
        xytext=(4, 8),
        textcoords="offset points",
        color=INK,
        fontsize=8,
        rotation=90,
        va="bottom",
    )


def _draw_profile(axes: Any, report: ReposeProfileReport) -> None:
    table = report.profile
    radius = table["radius_m"] * 1e3
    names = [name for name in table.columns if name.startswith("height_") and name != "height_m"]
    kind = "quadrant" if report.method == "rings" else "sector"
    for number, name in enumerate(names):
        label = f"{kind}s 1–{len(names)}: {min(report.part_angles_deg):.1f}° to {max(report.part_angles_deg):.1f}°"
        axes.plot(
            radius,
            table[name] * 1e3,
            color=PARTS[number % len(PARTS)],
            linewidth=1.2,
            label=label if number == 0 else None,
        )
    what = "upper surface" if report.method == "rings" else "highest centres"
    axes.plot(radius, table["height_m"] * 1e3, "o-", color=MEAN, markersize=4, linewidth=1.8, label=f"{what}, mean")


def _draw_line(axes: Any, report: ReposeProfileReport) -> None:
    low, high = report.window.limits(report.cup_radius_m)
    label = f"line: {report.angle_deg:.1f}° ± {report.standard_uncertainty_deg:.1f}°"
    ends = np.array([low, high])
    axes.plot(ends * 1e3, [report.line.height(end) * 1e3 for end in ends], color=LINE, linewidth=3.0, label=label)
    whole = np.array([0.0, 1.1 * report.cup_radius_m])
    axes.plot(whole * 1e3, [report.line.height(end) * 1e3 for end in whole], color=LINE, linewidth=1.0, linestyle="--")


def _draw_laboratory(axes: Any, report: ReposeProfileReport, laboratory: tuple[float, float]) -> None:
    """Draw the laboratory's angle through the middle of the fitted line, with a band of ± u."""
    angle, uncertainty = laboratory
    middle = sum(report.window.limits(report.cup_radius_m)) / 2.0
    radius = np.linspace(0.0, 1.1 * report.cup_radius_m, 60)
    level = report.line.height(middle)

    def height(degrees: float) -> Any:
        return (level - np.tan(math.radians(degrees)) * (radius - middle)) * 1e3

    axes.fill_between(
        radius * 1e3,
        height(angle - uncertainty),
        height(angle + uncertainty),
        color=LABORATORY,
        alpha=0.22,
        linewidth=0,
        label=f"laboratory: {angle:.1f}° ± {uncertainty:.1f}°",
    )
    axes.plot(radius * 1e3, height(angle), color=LABORATORY, linewidth=1.0)


def _dress(axes: Any, report: ReposeProfileReport, title: str) -> None:
    table = report.profile
    top = float(np.nanmax(table.filter(like="height").to_numpy())) * 1e3
    foot = float(np.nanmin(table["height_m"].to_numpy())) * 1e3
    span = max(top - foot, 1.0)
    axes.set_xlim(0.0, 1.12 * report.cup_radius_m * 1e3)
    axes.set_ylim(foot - 0.3 * span, top + 0.3 * span)
    axes.set_aspect("equal")
    axes.set_xlabel("distance from the axis [mm]")
    axes.set_ylabel("height above the floor [mm]")
    axes.set_title(title, loc="left", color=INK, fontweight="bold")
    axes.legend(frameon=False, fontsize=8.5, loc="lower left")
    axes.spines[["top", "right"]].set_visible(False)
