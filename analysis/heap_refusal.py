"""The error for a picture that shows no heap an angle could be measured on."""

from __future__ import annotations

from analysis.errors import AnalysisError

WHAT_TO_DO = (
    "Show one whole heap from the side, before a plain background, with free background above it and on both sides; "
    "or give the part of the picture that does so as region=(left, top, right, bottom)."
)


def no_heap(name: str, seen: str) -> AnalysisError:
    """Return the error for a picture that shows no usable heap."""
    return AnalysisError(f"No heap found in {name}: {seen}. {WHAT_TO_DO}")
