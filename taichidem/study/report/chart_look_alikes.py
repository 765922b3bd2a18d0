"""The matrix of look-alikes as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from taichidem.study.report.chart_style import INK, new_figure, plain_text, tidy
from taichidem.study.report.series import LookAlikes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_POSITIVE, _NEGATIVE, _NONE = (31, 95, 139), (200, 112, 26), "#eef0f2"


def look_alikes_figure(matrix: LookAlikes) -> Figure:
    """Return the heat map of ρ: deep blue where two effects change the tests alike, deep orange where oppositely."""
    from matplotlib.patches import Rectangle

    n = len(matrix.effects)
    figure, axes = new_figure(2.1 + 0.42 * n, width=2.4 + 0.42 * n)
    for i, row in enumerate(matrix.rho):
        for j, rho in enumerate(row):
            axes.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, facecolor=cell_colour(rho), edgecolor="white"))
            ink = "white" if light_ink(rho) else INK
            axes.text(j, i, cell_text(rho), ha="center", va="center", fontsize=8, color=ink)
    axes.set_xlim(-0.5, n - 0.5)
    axes.set_ylim(n - 0.5, -0.5)
    axes.set_aspect("equal")
    tidy(axes)
    names = [plain_text(name) for name in matrix.effects]
    axes.set_xticks(range(n), names, rotation=90)
    axes.set_yticks(range(n), names)
    axes.tick_params(length=0)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    figure.suptitle("Look-alikes: ρ between effects", fontsize=10.5, color=INK)
    return figure


def cell_text(rho: float | None) -> str:
    """Return ρ with two places, without the zero before the point."""
    if rho is None:
        return "–"
    text = f"{abs(rho):.2f}"
    text = text[1:] if text.startswith("0") else text
    return ("−" if rho <= -0.005 else "") + text


def cell_colour(rho: float | None) -> str:
    """Return the colour of a cell: white at 0, blue towards 1, orange towards −1."""
    return _NONE if rho is None else "#" + "".join(f"{channel:02x}" for channel in _channels(rho))


def light_ink(rho: float | None) -> bool:
    """Return whether white letters stand out better from a cell than dark ones."""
    return rho is not None and _luminance(_channels(rho)) < 0.22


def _channels(rho: float) -> tuple[int, ...]:
    strength = min(abs(rho), 1.0) ** 1.5  # pale below 0.5, where effects can be told apart
    end = _POSITIVE if rho > 0 else _NEGATIVE
    return tuple(round(255 + strength * (c - 255)) for c in end)


def _luminance(channels: tuple[int, ...]) -> float:
    """Return the relative luminance of an sRGB colour (WCAG 2.2)."""
    linear = [c / 255 / 12.92 if c <= 10 else ((c / 255 + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
