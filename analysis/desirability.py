"""Derringer–Suich desirability: one number from several goals."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from designs.errors import nearest_hint
from designs.space import Array

KINDS = ("maximise", "minimise", "target")
_NUMBERS = ("low", "target", "high", "weight", "importance")


@dataclass(frozen=True)
class Goal:
    """What one response shall be.

    d = 0 at the bad end and 1 at the good one: maximise ((y − low)/(high − low))^w, minimise ((high − y)/(high −
    low))^w, target the two halves ((y − low)/(target − low))^w and ((high − y)/(high − target))^w.

    Args:
        response: name of the response.
        kind: ``maximise``, ``minimise`` or ``target``.
        low, high: where d is 0 (1 for the good end of maximise and minimise), in the unit of the response.
        target: the value wanted (only for ``target``).
        weight: exponent w > 0; above 1 only values near the good end count.
        importance: exponent of d in the overall desirability, > 0.

    Raises:
        AnalysisError: for numbers out of order or missing.

    Source: Derringer & Suich, J. Quality Technol. 12 (1980) 214, doi 10.1080/00224065.1980.11980968.
    """

    response: str
    kind: str = "maximise"
    low: float | None = None
    high: float | None = None
    target: float | None = None
    weight: float = 1.0
    importance: float = 1.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise AnalysisError(f"Goal for {self.response!r} is {self.kind!r}. {nearest_hint(self.kind, KINDS)}")
        if (self.kind == "target") != (self.target is not None):
            raise AnalysisError(
                f"Goal for {self.response!r}: 'target' needs a target value, the other kinds take none."
            )
        given = [value for value in (self.low, self.target, self.high) if value is not None]
        if not all(math.isfinite(value) for value in given) or any(a >= b for a, b in itertools.pairwise(given)):
            raise AnalysisError(f"Goal for {self.response!r} needs low < target < high; given {given}.")
        if not (self.weight > 0 and self.importance > 0):
            raise AnalysisError(f"Goal for {self.response!r} needs weight > 0 and importance > 0.")

    def bounded(self, observed: Array) -> Goal:
        """Return the goal with missing ends taken from the observed range."""
        low, high = float(observed.min()), float(observed.max())
        if self.target is not None:
            low, high = min(low, self.target - 1e-9), max(high, self.target + 1e-9)
        low = low if self.low is None else self.low
        high = high if self.high is None else self.high
        return Goal(self.response, self.kind, low, high, self.target, self.weight, self.importance)

    def desirability(self, predicted: Array) -> Array:
        """Return d in 0 … 1, same shape."""
        y = np.asarray(predicted, dtype=float)
        if self.low is None or self.high is None:
            raise AnalysisError(f"Goal for {self.response!r} has no low or high; give both.")
        if self.kind == "maximise":
            share = (y - self.low) / (self.high - self.low)
        elif self.kind == "minimise":
            share = (self.high - y) / (self.high - self.low)
        else:
            target = float(self.target or 0.0)
            share = np.where(y <= target, (y - self.low) / (target - self.low), (self.high - y) / (self.high - target))
        return np.clip(share, 0.0, 1.0) ** self.weight

    def text(self) -> str:
        """Return the goal in words."""
        return f"{self.kind} {self.response}" + (f" = {self.target:g}" if self.target is not None else "")


def overall(goals: Sequence[Goal], each: Sequence[Array]) -> Array:
    """Return D = (Π dᵢ^rᵢ)^(1/Σ rᵢ), r the importances."""
    total = sum(goal.importance for goal in goals)
    return np.prod([d ** (goal.importance / total) for goal, d in zip(goals, each, strict=True)], axis=0)


def parse_goals(text: str) -> list[Goal]:
    """Return goals written as ``aor_deg:target=30.18:low=29:high=31, density:maximise:weight=2``.

    Raises:
        AnalysisError: for a word or key that no goal has.
    """
    return [_parse_goal(part.strip()) for part in text.split(",") if part.strip()]


def _parse_goal(part: str) -> Goal:
    response, *words = (word.strip() for word in part.split(":"))
    kind, values = "maximise", {}
    for word in words:
        key, equals, value = (piece.strip() for piece in word.partition("="))
        if not equals:
            kind = key
            continue
        if key not in _NUMBERS:
            raise AnalysisError(f"Unknown key {key!r} in goal {part!r}. {nearest_hint(key, _NUMBERS)}")
        try:
            values[key] = float(value)
        except ValueError:
            raise AnalysisError(f"{key} = {value!r} in goal {part!r} is no number.") from None
    if "target" in values:
        kind = "target"
    return Goal(response, kind, **values)
