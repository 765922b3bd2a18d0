"""Standardised errors per test: as believed, re-calibrated and with the effect, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from taichidem.study.report.chart_style import COLOURS, FAINT, INK, MARKERS, new_figure, tidy, wrapped
from taichidem.study.report.series import STEP_NAMES, STEPS, TestErrors
from taichidem.study.report.wording import standardised

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROWS_PER_PAGE = 24
_LINEAR_TO = 12.0  # beyond this error the axis becomes logarithmic outside ±3, or one huge error would hide all others
_THRESHOLD = 3.0
_SIZES = {"believed": 7, "recalibrated": 5.5, "with_effect": 5.5}


def errors_figure(tests: Sequence[TestErrors], reach: float | None = None) -> Figure:
    """Return a row per test with its errors, and a band where they are within two standard uncertainties.

    Args:
        tests: rows from top to bottom.
        reach: largest error that the axis must show; that of the tests where left out.
    """
    labels = [wrapped(test.label, 20, 2) for test in tests]
    lines = sum(0.26 + 0.14 * label.count("\n") for label in labels)
    figure, axes = new_figure(1.25 + lines)
    axes.axvspan(-2, 2, color="#dcebdf", zorder=0)
    axes.axvline(0, color=FAINT, linewidth=0.8)
    for i, test in enumerate(tests):
        values = list(test.by_step.values())
        if len(values) > 1:
            axes.plot([min(values), max(values)], [i, i], color="#c3cad1", linewidth=1.2, zorder=1)
    for order, step in enumerate(STEPS):
        rows = [i for i, test in enumerate(tests) if step in test.by_step]
        if rows:
            axes.plot([tests[i].by_step[step] for i in rows], rows, zorder=2 + order, **_marks(step))
    axes.set_yticks(range(len(tests)), labels)
    axes.set_ylim(len(tests) - 0.4, -0.6)
    _scale(axes, largest(tests) if reach is None else reach)
    tidy(axes, "", "error in standard uncertainties")
    figure.legend(frameon=False, fontsize=9, loc="outside upper left", ncols=3, handletextpad=0.2, columnspacing=1.0)
    return figure


def largest(tests: Sequence[TestErrors]) -> float:
    """Return the largest absolute error of any test at any step."""
    return max((abs(z) for test in tests for z in test.by_step.values()), default=0.0)


def describe_errors(tests: Sequence[TestErrors]) -> str:
    """Return the same in words, for those who can't see the picture."""
    told = [
        f"{test.label}: " + ", ".join(f"{STEP_NAMES[s]} {standardised(z)}" for s, z in test.by_step.items())
        for test in tests
        if test.by_step
    ]
    return f"Errors in standard uncertainties per test. {'; '.join(told)}."


def _marks(step: str) -> dict:
    filled = step != "believed"
    return {
        "linestyle": "none",
        "marker": MARKERS[step],
        "color": COLOURS[step],
        "markerfacecolor": COLOURS[step] if filled else "white",
        "markeredgewidth": 1.6,
        "markersize": _SIZES[step],
        "label": STEP_NAMES[step],
    }


def _scale(axes: Axes, reach: float) -> None:
    edge = max(3.0, 1.12 * reach)
    if reach > _LINEAR_TO:
        axes.set_xscale("symlog", linthresh=_THRESHOLD, linscale=1.0)
        edge = max(edge, 1.4 * reach)
        decades = [3 * 10**n for n in range(9)] + [10 * 10**n for n in range(9)]
        ticks = sorted(t for t in decades if t < edge)
        ticks = ticks if len(ticks) <= 3 else ticks[:: -(-len(ticks) // 3)]
        both = [-t for t in reversed(ticks)] + [0] + ticks
        axes.set_xticks(both, [f"{t:+.0f}".replace("-", "−") if t else "0" for t in both])
        axes.minorticks_off()
    axes.set_xlim(-edge, edge)
    axes.text(
        0, 1.0, "within ±2", transform=axes.get_xaxis_transform(), ha="center", va="bottom", fontsize=8, color=INK
    )
