"""Pictures of effects: Pareto chart, half-normal plot, main effects, interactions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from analysis.lenth import lenth
from analysis.plot_style import BLUE, GREY, ORANGE, RED, new_figure, tidy
from analysis.regression import FittedModel
from designs.space import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_BARS = 25


def pareto_of_terms(fit: FittedModel, alpha: float = 0.05) -> Figure:
    """Return the bars of |t| of each term with the line of t(1 − α/2; n − p)."""
    fit.require_error_df("standardised effects")
    size = np.abs(np.asarray(fit.results.tvalues)[fit.n_blocks :])
    critical = float(stats.t.ppf(1 - alpha / 2, fit.error_df))
    lines = {f"t({1 - alpha / 2:g}; {fit.error_df}) = {critical:.2f}": critical}
    return _bars(fit.labels(), size, lines, f"Standardised effects on {fit.response}", "|t|")


def pareto_of_effects(fit: FittedModel, alpha: float = 0.05) -> Figure:
    """Return the Pareto chart of a two-level design: |t| if there is an error, else |effect| with Lenth's margins."""
    if fit.error_df and fit.s > 0:
        return pareto_of_terms(fit, alpha)
    effects = 2 * np.array(list(fit.term_coefficients.values()))
    yardstick = lenth(effects, alpha)
    lines = {
        f"Lenth margin {yardstick.margin:.3g}": yardstick.margin,
        f"simultaneous {yardstick.simultaneous_margin:.3g}": yardstick.simultaneous_margin,
    }
    return _bars(fit.labels(), np.abs(effects), lines, f"Effects on {fit.response}", "|effect|")


def _bars(labels: list[str], size: Array, lines: dict[str, float], title: str, x: str) -> Figure:
    order = np.argsort(size)[-_MOST_BARS:]
    figure, axes = new_figure(height=1.6 + 0.27 * len(order))
    first = min(lines.values())
    colours = [BLUE if size[i] > first else GREY for i in order]
    axes.barh(range(len(order)), size[order], color=colours, height=0.72)
    axes.set_yticks(range(len(order)), [labels[i] for i in order])
    for (label, value), style in zip(lines.items(), ("--", ":"), strict=False):
        axes.axvline(value, color=RED, linestyle=style, linewidth=1.3, label=label)
    axes.legend(frameon=False, loc="lower right", fontsize=9)
    tidy(axes, title, x)
    return figure


def half_normal(fit: FittedModel, alpha: float = 0.05) -> Figure:
    """Return |effect| against half-normal quantiles; effects beyond Lenth's margin are named."""
    effects = 2 * np.array(list(fit.term_coefficients.values()))
    order = np.argsort(np.abs(effects))
    size, m = np.abs(effects)[order], len(effects)
    quantile = stats.halfnorm.ppf((np.arange(1, m + 1) - 0.5) / m)
    yardstick = lenth(effects, alpha)
    figure, axes = new_figure()
    real = size > yardstick.margin
    axes.plot(size[~real], quantile[~real], "o", color=GREY, label="within Lenth's margin")
    axes.plot(size[real], quantile[real], "s", color=BLUE, label="beyond it")
    if yardstick.pse > 0:
        top = min(float(quantile[-1]), float(size[-1]) / yardstick.pse)
        axes.plot([0, top * yardstick.pse], [0, top], color=RED, linewidth=1.2, label="noise of size PSE")
    names = fit.labels()
    for i in np.flatnonzero(real):
        axes.annotate(
            names[order[i]], (size[i], quantile[i]), xytext=(-7, 0), textcoords="offset points", ha="right", va="center"
        )
    axes.set_xlim(0, size[-1] * 1.06 if size[-1] > 0 else 1)
    axes.set_ylim(bottom=0)
    axes.legend(frameon=False, loc="lower right", fontsize=9)
    tidy(axes, f"Half-normal plot of effects on {fit.response}", "|effect|", "half-normal quantile")
    return figure


def main_effect_lines(fit: FittedModel) -> Figure:
    """Return the mean response at low and high of each factor, one panel per factor on one scale."""
    k = len(fit.runs.space)
    columns = min(k, 5)
    rows = -(-k // columns)
    figure, grid = new_figure(
        rows, columns, width=1.2 + 1.75 * columns, height=0.7 + 2.2 * rows, sharey=True, squeeze=False
    )
    for i, axes in enumerate(grid.flat):
        if i >= k:
            axes.set_visible(False)
            continue
        _one_main_effect(axes, fit, i)
        if i % columns == 0:
            axes.set_ylabel(f"mean {fit.response}")
    return figure


def _one_main_effect(axes: Axes, fit: FittedModel, i: int) -> None:
    factor, column = fit.runs.space.factors[i], fit.runs.coded[:, i]
    levels = np.unique(np.round(column, 6))
    means = [fit.y[np.round(column, 6) == level].mean() for level in levels]
    axes.plot(levels, means, "o-", color=BLUE)
    axes.axhline(fit.y.mean(), color=GREY, linewidth=0.8, linestyle=":")
    axes.set_xticks(levels, [f"{value:.4g}" for value in factor.to_natural(levels)])
    axes.margins(x=0.25)
    tidy(axes, "", f"{_wrapped(factor.name)}{_unit(factor.unit)}", axes.get_ylabel())


def interaction_grid(fit: FittedModel) -> Figure:
    """Return, for each pair of factors, the mean response against one at low and high of the other."""
    k = len(fit.runs.space)
    pairs = [(i, j) for i in range(k) for j in range(i + 1, k)]
    columns = min(len(pairs), 3)
    rows = -(-len(pairs) // columns)
    figure, grid = new_figure(
        rows, columns, width=0.8 + 2.9 * columns, height=0.5 + 2.6 * rows, sharey=True, squeeze=False
    )
    for axes in list(grid.flat)[len(pairs) :]:
        axes.set_visible(False)
    for (i, j), axes in zip(pairs, grid.flat, strict=False):
        _one_interaction(axes, fit, i, j)
    for row in grid:
        row[0].set_ylabel(f"mean {fit.response}")
    return figure


def _one_interaction(axes: Axes, fit: FittedModel, i: int, j: int) -> None:
    first, second = fit.runs.space.factors[i], fit.runs.space.factors[j]
    for side, colour, marker in ((-1.0, BLUE, "o"), (1.0, ORANGE, "s")):
        chosen = np.round(fit.runs.coded[:, j], 6) == side
        levels = np.unique(np.round(fit.runs.coded[chosen, i], 6))
        means = [fit.y[chosen & (np.round(fit.runs.coded[:, i], 6) == level)].mean() for level in levels]
        value = float(second.to_natural(np.array([side]))[0])
        axes.plot(levels, means, marker=marker, color=colour, label=f"{second.name} = {value:.4g}")
    axes.set_xticks([-1, 1], [f"{value:.4g}" for value in first.to_natural(np.array([-1.0, 1.0]))])
    axes.margins(x=0.15, y=0.2)
    axes.legend(frameon=False, fontsize=8)
    tidy(axes, "", f"{first.name}{_unit(first.unit)}")


def _unit(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def _wrapped(name: str) -> str:
    """Break a long name at an underscore near its middle, so that neighbouring panels don't overlap."""
    if len(name) <= 16 or "_" not in name:
        return name
    cuts = [i for i, character in enumerate(name) if character == "_"]
    cut = min(cuts, key=lambda i: abs(i - len(name) / 2))
    return f"{name[: cut + 1]}\n{name[cut + 1 :]}"
