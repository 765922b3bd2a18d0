"""Pictures of a fitted surface: contours and a view in three dimensions."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from analysis.plot_style import new_figure, tidy
from analysis.regression import FittedModel
from designs.space import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_GRID = 61
_MOST_PAIRS = 6


def contours(fit: FittedModel, *, mark: Array | None = None) -> dict[str, Figure]:
    """Return a contour picture for each pair of factors in the model (the first six), the others at a stated value.

    Args:
        fit: the model.
        mark: coded point, shape (k,), to mark, and where the other factors are held; default the centre.
    """
    from matplotlib import colormaps, patheffects

    hold = np.zeros(len(fit.runs.space)) if mark is None else np.asarray(mark)
    figures = {}
    for i, j in _pairs(fit):
        x, y, z = _surface(fit, i, j, hold)
        figure, axes = new_figure(width=5.8, height=4.8)
        filled = axes.contourf(x, y, z, levels=12, cmap=colormaps["viridis"])
        lines = axes.contour(x, y, z, levels=filled.levels, colors="white", linewidths=0.6)
        halo = [patheffects.withStroke(linewidth=2, foreground="white")]
        for label in axes.clabel(lines, fontsize=8, fmt="%.4g", colors="black"):
            label.set_path_effects(halo)
        figure.colorbar(filled, ax=axes, label=fit.response)
        first, second = fit.runs.space.factors[i], fit.runs.space.factors[j]
        runs_x, runs_y = first.to_natural(fit.runs.coded[:, i]), second.to_natural(fit.runs.coded[:, j])
        axes.plot(runs_x, runs_y, "o", color="white", markeredgecolor="black", markersize=5, clip_on=False, zorder=5)
        if mark is not None:
            spot = (first.to_natural(hold[i : i + 1]), second.to_natural(hold[j : j + 1]))
            axes.plot(*spot, "*", color="#d9822b", markeredgecolor="black", markersize=15, clip_on=False, zorder=6)
        _scales(axes, fit, i, j)
        tidy(axes, _held(fit, i, j, hold), _label(fit, i), _label(fit, j))
        figures[f"contour_{first.name}_{second.name}"] = figure
    return figures


def surfaces(fit: FittedModel) -> dict[str, Figure]:
    """Return the surface over the first pair of factors in the model, seen in three dimensions."""
    from matplotlib import colormaps

    figures = {}
    for i, j in _pairs(fit)[:1]:
        hold = np.zeros(len(fit.runs.space))
        x, y, z = _surface(fit, i, j, hold)
        figure, axes = new_figure(width=6.4, height=5.4, subplot_kw={"projection": "3d"})
        axes.plot_surface(x, y, z, cmap=colormaps["viridis"], linewidth=0, antialiased=True, alpha=0.95)
        axes.set_xlabel(_label(fit, i), labelpad=8)
        axes.set_ylabel(_label(fit, j), labelpad=8)
        axes.set_zlabel(fit.response, labelpad=6)
        axes.set_title(_held(fit, i, j, hold), fontsize=11, loc="left")
        axes.set_box_aspect(None, zoom=0.88)
        axes.view_init(elev=28, azim=-125)
        figures[f"surface_{fit.runs.names[i]}_{fit.runs.names[j]}"] = figure
    return figures


def _pairs(fit: FittedModel) -> list[tuple[int, int]]:
    active = [i for i in range(len(fit.runs.space)) if any(term.powers[i] for term in fit.terms)]
    return list(itertools.combinations(active, 2))[:_MOST_PAIRS]


def _surface(fit: FittedModel, i: int, j: int, hold: Array) -> tuple[Array, Array, Array]:
    """Return natural x, y and the prediction on a grid over the range of the runs."""
    low, high = fit.runs.coded.min(axis=0), fit.runs.coded.max(axis=0)
    across, up = np.meshgrid(np.linspace(low[i], high[i], _GRID), np.linspace(low[j], high[j], _GRID))
    points = np.tile(hold, (across.size, 1))
    points[:, i], points[:, j] = across.ravel(), up.ravel()
    z = fit.predict(points).reshape(across.shape)
    return fit.runs.space.factors[i].to_natural(across), fit.runs.space.factors[j].to_natural(up), z


def _scales(axes: Axes, fit: FittedModel, i: int, j: int) -> None:
    if fit.runs.space.factors[i].log:
        axes.set_xscale("log")
    if fit.runs.space.factors[j].log:
        axes.set_yscale("log")


def _held(fit: FittedModel, i: int, j: int, hold: Array) -> str:
    natural = fit.runs.space.to_natural(hold[None, :]).iloc[0]
    others = [n for n in range(len(fit.runs.space)) if n not in (i, j) and any(term.powers[n] for term in fit.terms)]
    if not others:
        return fit.response
    return f"{fit.response} at " + ", ".join(f"{fit.runs.names[n]} = {natural.iloc[n]:.4g}" for n in others)


def _label(fit: FittedModel, i: int) -> str:
    factor = fit.runs.space.factors[i]
    return f"{factor.name} [{factor.unit}]" if factor.unit not in ("", "1") else factor.name
