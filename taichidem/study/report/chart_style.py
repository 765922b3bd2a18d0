"""One look for the charts of a diagnosis, and their way into a page; made without pyplot, so no display and no state."""

from __future__ import annotations

import io
import re
import textwrap
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from taichidem.whole_file import save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, FAINT = "#1f2933", "#5f6b76"
COLOURS = {"believed": "#7b8794", "recalibrated": "#c8701a", "with_effect": "#1f5f8b"}
MARKERS = {"believed": "o", "recalibrated": "s", "with_effect": "D"}
RED = "#b3372f"
WIDTH = 4.3  # [in], so that nine-point letters can still be read where a phone shrinks the picture to 330 pixels
PNG_DPI = 180


def new_figure(height: float, *, rows: int = 1, width: float = WIDTH, **settings: Any) -> tuple[Figure, Any]:
    """Return a figure and its axes (one, or an array), in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained", facecolor="white")
    return figure, figure.subplots(rows, 1, **settings)


def tidy(axes: Axes, title: str = "", x: str = "", y: str = "") -> None:
    """Label the axes, take the box away and keep letters large."""
    axes.set_title(plain_text(title), fontsize=10.5, loc="left", color=INK)
    axes.set_xlabel(x, fontsize=9.5, color=INK)
    axes.set_ylabel(y, fontsize=9.5, color=INK)
    axes.tick_params(labelsize=9, colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def wrapped(text: str, width: int, most: int = 3) -> str:
    """Break a text into lines, names also after an underscore; more than `most` of them end in …"""
    lines = [line.replace("_ ", "_") for line in textwrap.wrap(text.replace("_", "_ "), width)] or [""]
    if len(lines) > most:
        lines = lines[:most]
        lines[-1] = lines[-1][: width - 1] + "…"
    return plain_text("\n".join(lines))


def plain_text(text: str) -> str:
    """Return a text that Matplotlib shows as it is: a pair of $ would be read as a formula."""
    printable = "".join(c if c.isprintable() or c == "\n" else " " for c in text)
    return printable.replace("$", r"\$")


def save_png(figure: Figure, path: str | Path) -> Path:
    """Write a figure as PNG and return the path."""
    save_figure(figure, path, dpi=PNG_DPI)
    return Path(path)


def as_svg(figure: Figure, name: str, description: str) -> str:
    """Return a figure as an SVG element for the middle of a page.

    Letters are outlines, so that they look alike wherever the page is read; `description` is for those who can't see it.
    Ids begin with `name`, because a page has one set of ids for all its pictures.
    """
    from matplotlib import rc_context

    out = io.StringIO()
    with rc_context({"svg.fonttype": "path", "svg.hashsalt": name}):
        figure.savefig(out, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    text = out.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", text)
    (view,) = re.findall(r'viewBox="([^"]+)"', text)
    opening = f'<svg class="chart" role="img" aria-label="{escape(description)}" viewBox="{view}">'
    text = re.sub(r"<svg[^>]*>", lambda _: opening, text, count=1)
    return re.sub(r"\n\s*", "\n", text.replace("xlink:href", "href")).strip()
