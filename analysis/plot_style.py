"""One look for all pictures; figures are made without pyplot, so they need no display and leak no state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, ORANGE, GREY, RED = "#1f5f8b", "#d9822b", "#8a8a8a", "#b3372f"


def new_figure(
    rows: int = 1, columns: int = 1, *, width: float = 6.4, height: float = 4.4, **settings: Any
) -> tuple[Figure, Any]:
    """Return a figure and its axes (one, or an array), in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, **settings)


def tidy(axes: Axes, title: str = "", x: str = "", y: str = "") -> Axes:
    """Label the axes and take the box away."""
    axes.set_title(title, fontsize=11, loc="left")
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return axes
