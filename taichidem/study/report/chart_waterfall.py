"""The waterfall: how far off the model was as believed, after re-calibration, and with the effect."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from taichidem.study.report.chart_style import COLOURS, FAINT, INK, RED, new_figure, tidy, wrapped
from taichidem.study.report.series import WaterfallStep
from taichidem.study.report.wording import number, size

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BAR = 0.62
_PAIR = 0.34
_ROOMY = 0.25  # share of the axis above which an empty bar holds two lines of letters


def waterfall_figure(steps: Sequence[WaterfallStep]) -> Figure:
    """Return χ² per step with what fell since the step before, and below it the RMS error of fitted and held-out tests.

    Re-calibration has a bar of its own, so that an effect takes no credit for it.
    """
    errors = any(s.fitted is not None or s.held_out is not None for s in steps)
    if not errors:
        figure, upper = new_figure(3.1)
        _chi2(upper, steps)
        _name_steps(upper, [_of_dof(step, f"{step.label}, ") for step in steps])
        return figure
    figure, (upper, lower) = new_figure(5.0, rows=2, height_ratios=(3, 2))
    _chi2(upper, steps)
    _name_steps(upper, [_of_dof(step) for step in steps])
    _rms(lower, steps)
    _name_steps(lower, [step.label for step in steps])
    return figure


def describe_waterfall(steps: Sequence[WaterfallStep]) -> str:
    """Return the same in words, for those who can't see the picture."""
    told = [f"{s.label}: {number(s.chi2)}" + (f" at {s.dof:.0f} degrees of freedom" if s.dof else "") for s in steps]
    return f"Bars of χ². {'; '.join(told)}."


def _chi2(axes: Axes, steps: Sequence[WaterfallStep]) -> None:
    top = max(s.chi2 for s in steps) or 1.0
    for i, step in enumerate(steps):
        colour = COLOURS.get(step.step, FAINT)
        axes.bar(i, step.chi2, _BAR, color=colour, zorder=2)
        before = steps[i - 1].chi2 if i else step.chi2
        if before > step.chi2:
            _fallen(axes, i, step.chi2, before, colour, top)
        beneath = before - step.chi2 > _ROOMY * top  # then the number stands on the full bar, inside the empty one
        height = step.chi2 if beneath else max(step.chi2, before)
        axes.text(i, height + 0.02 * top, number(step.chi2, 3), ha="center", va="bottom", fontsize=9.5, color=INK)
        if step.dof:
            axes.hlines(step.dof, i - 0.42, i + 0.42, color=RED, linestyle="--", linewidth=1.3, zorder=4)
    axes.plot([], [], color=RED, linestyle="--", linewidth=1.3, label="expected of a right model")
    axes.legend(frameon=False, fontsize=9, loc="upper right", bbox_to_anchor=(1, 1.02))
    axes.set_ylim(0, top * 1.3)
    axes.yaxis.set_major_formatter(lambda value, _: number(value, 3))
    tidy(axes, "Misfit χ², and what each step took away", y="χ²")


def _fallen(axes: Axes, i: int, low: float, high: float, colour: str, top: float) -> None:
    """Draw what fell since the step before as an empty bar."""
    axes.bar(i, high - low, _BAR, bottom=low, color="none", edgecolor=colour, linestyle=":", linewidth=1.2, zorder=1)
    axes.hlines(high, i - 1 + _BAR / 2, i - _BAR / 2, color=FAINT, linewidth=0.8)
    if high - low > 0.07 * top:
        text = f"−{number(high - low, 3)}"
        middle = (low + high) / 2 + 0.06 * top * (high - low > _ROOMY * top)
        axes.text(i, middle, text, ha="center", va="center", fontsize=9.5, color=colour)


def _of_dof(step: WaterfallStep, before: str = "") -> str:
    return before if step.dof is None else f"{before}dof {step.dof:.0f}"


def _rms(axes: Axes, steps: Sequence[WaterfallStep]) -> None:
    known = [v for s in steps for v in (s.fitted, s.held_out) if v is not None]
    top = max([*known, 1.0])
    for i, step in enumerate(steps):
        colour = COLOURS.get(step.step, FAINT)
        both = step.fitted is not None and step.held_out is not None
        for value, side, hatch in ((step.fitted, -1, ""), (step.held_out, 1, "////")):
            if value is None:
                continue
            at = i + side * _PAIR / 2 * both
            face = "white" if hatch else colour
            axes.bar(at, value, _PAIR * 0.92, color=face, edgecolor=colour, hatch=hatch, linewidth=1, zorder=2)
            axes.text(at, value + 0.03 * top, size(value), ha="center", va="bottom", fontsize=9, color=INK)
    axes.axhline(1, color=RED, linestyle="--", linewidth=1.3, zorder=1)
    axes.bar([0], [0], color=FAINT, label="tests fitted")
    axes.bar([0], [0], color="white", edgecolor=FAINT, hatch="////", label="tests held out")
    axes.legend(frameon=False, fontsize=9, loc="upper right")
    axes.set_ylim(0, top * 1.3)
    tidy(axes, "RMS error", y="standard uncertainties")


def _name_steps(axes: Axes, names: Sequence[str]) -> None:
    axes.set_xticks(range(len(names)), [wrapped(name, 15, 4) for name in names])
    axes.set_xlim(-0.6, len(names) - 0.4)
