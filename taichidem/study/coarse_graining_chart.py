"""Draw what coarse graining moves: every observable over s, beside its value at the smallest s."""

from __future__ import annotations

import math
import textwrap
from typing import TYPE_CHECKING, Any

import pandas as pd

from taichidem.study.report.chart_style import FAINT, INK, RED, tidy, wrapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from taichidem.study.coarse_graining_result import CoarseGrainingCheck

COLUMNS = 3
PANEL = (3.3, 2.6)  # [in]
BAND = "#d9dee3"


def chart(result: CoarseGrainingCheck) -> Figure:
    """Return a figure with a panel per observable; bars and band are ± coverage times the standard uncertainty."""
    from matplotlib.figure import Figure

    groups = [(key, rows) for key, rows in result.table.groupby(["experiment", "observable"], sort=False)]
    columns = max(1, min(COLUMNS, len(groups)))
    lines = max(1, math.ceil(len(groups) / columns))
    figure = Figure(figsize=(columns * PANEL[0], lines * PANEL[1] + 0.4), layout="constrained", facecolor="white")
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, ((experiment, observable), rows) in zip(panels, groups, strict=False):
        _panel(axes, rows, result.factors, result.coverage)
        axes.set_title(wrapped(f"{experiment}: {observable}", 38, 2), fontsize=9.5, loc="left", color=INK)
    for axes in panels[len(groups) :]:
        axes.set_axis_off()
    colours = "red diamonds: moved, blue: not, grey: can't be told"
    key = f"factor s of coarse graining; bars and band: {result.coverage:g} u; {colours}"
    figure.supxlabel(textwrap.fill(key, 45 * columns), fontsize=9, color=FAINT)
    return figure


def _panel(axes: Axes, rows: pd.DataFrame, factors: tuple[float, ...], coverage: float) -> None:
    base = rows[rows["factor"] == factors[0]]
    value = float(base["mean"].iloc[0]) if len(base) else math.nan
    scale = abs(value) if value else 1.0
    relative = math.isfinite(value) and value != 0
    if not math.isfinite(scale):
        scale = 1.0
    if len(base) and math.isfinite(value):
        u = float(base["u"].fillna(0.0).iloc[0]) * coverage / scale
        axes.axhspan(value / scale - u, value / scale + u, color=BAND, zorder=0)
        axes.axhline(value / scale, color=FAINT, linewidth=0.8, zorder=1)
    good = rows[rows["mean"].notna()]
    place = [factors.index(s) for s in good["factor"]]
    axes.plot(place, good["mean"] / scale, color=FAINT, linewidth=1.0, zorder=2)
    for k, (_, row) in zip(place, good.iterrows(), strict=True):
        bar = 0.0 if math.isnan(row["u"]) else coverage * row["u"] / scale
        axes.errorbar(k, row["mean"] / scale, yerr=bar, zorder=3, capsize=3, markersize=6.5, **_look(row, factors[0]))
    lacking = [k for k, s in enumerate(factors) if s not in set(good["factor"])]
    for k in lacking:
        axes.text(k, 0.04, "no value", transform=axes.get_xaxis_transform(), ha="center", fontsize=8, color=FAINT)
    axes.set_xlim(-0.5, len(factors) - 0.5)
    axes.set_xticks(range(len(factors)), [f"{s:g}" for s in factors])
    unit = "" if rows["unit"].iloc[0] == "1" else f" [{rows['unit'].iloc[0]}]"
    tidy(axes, y=f"over that at s = {factors[0]:g}" if relative else f"value{unit}")
    axes.ticklabel_format(axis="y", useOffset=False)
    _at_least(axes, 0.02)


def _look(row: Any, first: float) -> dict[str, Any]:
    if row["factor"] == first:
        return {"color": INK, "fmt": "o"}
    if row["moved"] is None:
        return {"color": FAINT, "fmt": "o"}
    return {"color": RED, "fmt": "D"} if row["moved"] else {"color": "#1f5f8b", "fmt": "o"}


def _at_least(axes: Axes, span: float) -> None:
    """Show no less than so much of the axis, so that round-off looks like round-off."""
    low, high = axes.get_ylim()
    if high - low < span:
        middle = (low + high) / 2
        axes.set_ylim(middle - span / 2, middle + span / 2)
