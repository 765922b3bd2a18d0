"""Factors that a search leaves where they are told to stay."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from designs.errors import nearest_hint
from designs.space import FactorSpace

EXAMPLE = "Write a factor and its value, such as hold=B=910,D=0.55."


def coded_hold_values(hold: str | Mapping[str, float] | None, space: FactorSpace) -> dict[int, float]:
    """Return place of a factor → coded value to hold it at.

    Args:
        hold: factor → value in natural units, or a text such as ``B=910, D=0.55``.
        space: the factors of the model.

    Raises:
        AnalysisError: an unknown factor, a value that is no number or lies outside low … high.
    """
    given = _parsed(hold) if isinstance(hold, str) else {} if hold is None else hold
    if not isinstance(given, Mapping):
        raise AnalysisError(f"hold is {hold!r}, which names no factor. {EXAMPLE}")
    return {_place(name, space): _coded(name, value, space) for name, value in given.items()}


def _parsed(text: str) -> dict[str, str]:
    values: dict[str, str] = {}
    for part in filter(None, (part.strip() for part in text.split(","))):
        name, equals, value = (piece.strip() for piece in part.partition("="))
        if not equals:
            raise AnalysisError(f"hold has {part!r}, which gives no value. {EXAMPLE}")
        if name in values:
            raise AnalysisError(f"hold gives {name!r} twice, {values[name]} and {value}. Give it once.")
        values[name] = value
    return values


def _place(name: str, space: FactorSpace) -> int:
    if name not in space.names:
        raise AnalysisError(f"hold names {name!r}, which is no factor. {nearest_hint(name, space.names)}")
    return space.names.index(name)


def _coded(name: str, value: Any, space: FactorSpace) -> float:
    factor = space[name]
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise AnalysisError(f"hold gives {name} = {value!r}, which is no number. {EXAMPLE}")
    if not factor.low <= number <= factor.high:
        raise AnalysisError(
            f"hold gives {name} = {number:g}, outside its range {factor.low:g} … {factor.high:g}, where the model knows "
            "nothing. Give a value inside."
        )
    return float(factor.to_coded(np.array([number]))[0])
