"""Pictures that put the paper's numbers beside ours."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from analysis.plot_style import BLUE, GREY, ORANGE, new_figure, tidy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from taichidem.paper.kept_heaps import KeptHeaps
    from taichidem.paper.optimum import Optimum
    from taichidem.paper.screening import Screening
    from taichidem.paper.surface import Surface


def effects_chart(screening: Screening) -> Figure:
    """Return the effect of every factor, the paper's and ours."""
    figure, axes = new_figure(height=4.6, width=7.2)
    table = screening.effects.iloc[::-1]
    place = np.arange(len(table))
    axes.barh(place + 0.2, table["paper_effect"], 0.38, color=GREY, label="paper (EDEM)")
    axes.barh(place - 0.2, table["effect"], 0.38, color=BLUE, label="ours")
    axes.set_yticks(place, [f"{r.factor}  {r.meaning}" for r in table.itertuples()])
    axes.axvline(0, color="black", linewidth=0.8)
    axes.legend(frameon=False, loc="lower right")
    tidy(axes, "What each factor does to the angle of repose, low to high", "effect [deg]")
    return figure


def points_chart(surface: Surface) -> Figure:
    """Return our mean angle over the paper's at every point of the composite design."""
    figure, axes = new_figure(height=4.6, width=5.4)
    points = surface.points
    low = float(points[["ours", "paper"]].min().min()) - 1
    high = float(points[["ours", "paper"]].max().max()) + 1
    axes.plot([low, high], [low, high], color=GREY, linewidth=1)
    u = points["u"].fillna(0.0)
    for friction, colour, marker in zip(sorted(points["F"].unique()), (ORANGE, GREY, BLUE), "sDo", strict=True):
        here = points["F"] == friction
        axes.errorbar(
            points["paper"][here],
            points["ours"][here],
            u[here],
            fmt=marker,
            color=colour,
            capsize=2,
            label=f"F = {friction:g}",
        )
    axes.legend(frameon=False, title="static friction")
    title = f"RMS difference {surface.rms:.2f}°, rank correlation {surface.rank_correlation:.2f}"
    tidy(axes, title, "paper's EDEM [deg]", "ours, ± u of the mean [deg]")
    return figure


def search_chart(rounds: Sequence[Optimum], laboratory: tuple[float, float]) -> Figure:
    """Return the heaps of every round of the search beside what was expected and the laboratory's angle."""
    figure, axes = new_figure(height=3.4, width=5.4)
    _laboratory_band(axes, laboratory)
    places = range(1, len(rounds) + 1)
    expected = [np.nan if found.predicted is None else found.predicted for found in rounds]
    axes.plot(places, expected, "_", color=ORANGE, markersize=18, label="expected")
    means, uncertainties = [found.heaps.mean for found in rounds], [found.heaps.u for found in rounds]
    axes.errorbar(places, means, uncertainties, fmt="D", color=BLUE, capsize=3, label="heaps, mean ± u")
    axes.set_xticks(places, [_setting_text(found) for found in rounds])
    axes.set_xlim(0.5, len(rounds) + 0.5)
    axes.legend(frameon=False, loc="best")
    tidy(axes, "The search, round by round", "", "angle of repose [deg]")
    return figure


def _setting_text(found: Optimum) -> str:
    lines = [f"{letter} = {value:.3g}" for letter, value in found.levels.items()]
    return "\n".join([*lines, "twice the fall"] if found.raised else lines)


def _laboratory_band(axes: Axes, laboratory: tuple[float, float]) -> None:
    value, u = laboratory
    axes.axhspan(value - u, value + u, color=GREY, alpha=0.25, label=f"laboratory {value:g}° ± {u:g}°")
    axes.axhline(value, color=GREY, linewidth=1)


def heaps_chart(optimum: Optimum, fine: KeptHeaps, laboratory: tuple[float, float]) -> Figure:
    """Return every confirmation heap beside the laboratory's angle."""
    figure, axes = new_figure(height=3.4, width=5.4)
    _laboratory_band(axes, laboratory)
    for place, (heaps, colour) in enumerate(((optimum.heaps, BLUE), (fine, ORANGE))):
        axes.plot(np.full(len(heaps.angles), place), heaps.angles, "o", color=colour, alpha=0.5)
        axes.errorbar([place + 0.12], [heaps.mean], [heaps.u], fmt="D", color=colour, capsize=3)
    axes.set_xticks([0, 1], [f"{1000 * heaps.diameter:g} mm" for heaps in (optimum.heaps, fine)])
    axes.set_xlim(-0.5, 1.5)
    axes.legend(frameon=False, loc="best")
    tidy(axes, "Heaps at the optimum: single ones, mean ± u", "", "angle of repose [deg]")
    return figure
