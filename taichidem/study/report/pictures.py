"""The pictures of a diagnosis and of an addition as PNG files; the page draws the same figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from taichidem.study.report.chart_errors import errors_figure
from taichidem.study.report.chart_look_alikes import look_alikes_figure
from taichidem.study.report.chart_style import save_png
from taichidem.study.report.chart_waterfall import waterfall_figure
from taichidem.study.report.series import look_alikes, test_errors, waterfall_steps

WATERFALL = "waterfall.png"
LOOK_ALIKES = "look_alikes.png"
ERRORS = "standardised_errors_after.png"


def write_waterfall(document: Mapping[str, Any], folder: str | Path) -> Path | None:
    """Write waterfall.png: χ² believed → re-calibrated → with the effect, and the RMS errors, fitted and held-out apart.

    Args:
        document: content of verdict.json or addition.json.
        folder: an existing folder.

    Returns:
        The file, or None where there is nothing to draw.
    """
    steps = waterfall_steps(document)
    return save_png(waterfall_figure(steps), Path(folder) / WATERFALL) if steps else None


def write_look_alikes(verdict: Mapping[str, Any], folder: str | Path) -> Path | None:
    """Write look_alikes.png: the cosine ρ between every two candidate effects of verdict.json; None for fewer than two."""
    matrix = look_alikes(verdict)
    return save_png(look_alikes_figure(matrix), Path(folder) / LOOK_ALIKES) if len(matrix.effects) > 1 else None


def write_standardised_errors(document: Mapping[str, Any], folder: str | Path) -> Path | None:
    """Write standardised_errors_after.png: errors per test as believed, re-calibrated and with the effect.

    Args and return value as for `write_waterfall`.
    """
    tests = [test for test in test_errors(document) if test.by_step]
    return save_png(errors_figure(tests), Path(folder) / ERRORS) if tests else None
