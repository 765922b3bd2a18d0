"""Pictures of residuals: four in one, predicted against actual."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import stats

from analysis.plot_style import BLUE, GREY, RED, new_figure, tidy
from analysis.regression import FittedModel
from analysis.residuals import residual_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def four_in_one(fit: FittedModel) -> Figure:
    """Return normal plot, residuals against fits, histogram and residuals in run order, all standardised."""
    rows = residual_table(fit)
    values = rows["Standardised"].to_numpy()
    figure, ((normal, against), (histogram, order)) = new_figure(2, 2, width=8.4, height=6.4)
    _normal_plot(normal, values)
    against.plot(fit.fitted, values, "o", color=BLUE)
    tidy(against, "Against fits", f"fitted {fit.response}", "standardised residual")
    histogram.hist(values[np.isfinite(values)], bins="sturges", color=BLUE, edgecolor="white")
    tidy(histogram, "Histogram", "standardised residual", "runs")
    sequence = np.argsort(fit.runs.order)
    order.plot(np.arange(1, len(values) + 1), values[sequence], "o-", color=BLUE, linewidth=0.8)
    tidy(order, "In run order", "run order", "standardised residual")
    for axes in (against, order):
        axes.axhline(0, color=GREY, linewidth=0.8)
        for limit in (-2, 2):
            axes.axhline(limit, color=RED, linewidth=0.8, linestyle=":")
    figure.suptitle(f"Residuals of {fit.response}", fontsize=12)
    return figure


def _normal_plot(axes: Axes, values: np.ndarray) -> None:
    ordered = np.sort(values[np.isfinite(values)])
    quantile = stats.norm.ppf((np.arange(1, len(ordered) + 1) - 0.375) / (len(ordered) + 0.25))
    axes.plot(ordered, quantile, "o", color=BLUE)
    span = np.array([ordered.min(), ordered.max()])
    deviation = ordered.std(ddof=1)
    if deviation > 0:
        axes.plot(span, (span - ordered.mean()) / deviation, color=RED, linewidth=1.2)
    tidy(axes, "Normal plot", "standardised residual", "normal quantile")


def predicted_against_actual(fit: FittedModel) -> Figure:
    """Return predictions against observations with the line of equality; leave-one-out predictions as crosses."""
    figure, axes = new_figure(width=5.2, height=4.8)
    spare = 1 - fit.leverage
    known = spare > 1e-9
    left_out = fit.y[known] - fit.residuals[known] / spare[known]
    axes.plot(fit.y, fit.fitted, "o", color=BLUE, label="fitted")
    axes.plot(fit.y[known], left_out, "x", color=GREY, label="predicted without the run")
    ends = [min(fit.y.min(), fit.fitted.min()), max(fit.y.max(), fit.fitted.max())]
    axes.plot(ends, ends, color=RED, linewidth=1.2)
    axes.legend(frameon=False, fontsize=9)
    tidy(
        axes,
        f"R² {fit.r_squared:.1f} %, predicted {fit.r_squared_predicted:.1f} %",
        f"observed {fit.response}",
        "predicted",
    )
    return figure
