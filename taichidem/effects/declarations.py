"""What effects declare: parameters, what contacts remember, what coarse graining keeps."""

from __future__ import annotations

import math
from dataclasses import dataclass

from taichidem.errors import InputError


@dataclass(frozen=True)
class Parameter:
    """A named number of an effect.

    Args:
        name: whole words, unique within the effect.
        unit: SI unit as text, "1" for a pure number.
        low, high: physical bounds, inclusive unless `open_low`.
        plausible: range in which real materials lie; a design takes it where the user gives none.
        vanishing: with every parameter that has such a value at it, the effect does nothing (see `Effect.vanished`); one of
            several alone may leave a part of it. None where there is none.
        default: value used when none is given; None makes the parameter required.
        per_pair: True if each pair of materials may have its own value.
        coarse_graining: exponent k of the rule p′ = s^k p for grains s times as large.
        meaning: one sentence.
    """

    name: str
    unit: str
    low: float
    high: float
    plausible: tuple[float, float]
    meaning: str
    vanishing: float | None = None
    default: float | None = None
    per_pair: bool = True
    open_low: bool = False
    coarse_graining: float = 0.0

    def check(self, effect: str, where: str, value: float) -> float:
        """Return the value as a float; raise InputError when it is no number or out of bounds."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        below = number <= self.low if self.open_low else number < self.low
        if not math.isfinite(number) or below or number > self.high:
            low = "above" if self.open_low else "from"
            raise InputError(
                f"{effect}.{self.name}{where} is {value!r}; allowed is {low} {self.low:g} to {self.high:g} [{self.unit}]. "
                f"{self.meaning} Plausible: {self.plausible[0]:g} to {self.plausible[1]:g}."
            )
        return number


@dataclass(frozen=True)
class Memory:
    """A quantity that a contact remembers while it lives.

    Args:
        name: whole words.
        size: 1 for a number, 3 for a vector.
        odd: True if it changes sign when the two sides are swapped (any quantity of i relative to j).
    """

    name: str
    size: int = 3
    odd: bool = True


@dataclass(frozen=True)
class Similarity:
    """What coarse graining keeps: where grains are s times as large, overlap, speed and force follow as powers of s.

    With the moduli and the density kept, a Hertz contact under its grain's weight has overlap ∝ s^(5/3) and force ∝ s³; one
    in a collision of given speed has overlap ∝ s and force ∝ s². An effect names the case in which it stays similar; the
    conformance suite evaluates its kernel on both sides.

    Args:
        kept: the invariant in words, such as "pull-off force over weight".
        overlap, speed, force: exponents of s.
    """

    kept: str
    overlap: float
    speed: float
    force: float


UNDER_WEIGHT = (5 / 3, 0.0, 3.0)  # exponents of overlap, speed and force of a contact that carries a weight
IN_COLLISION = (1.0, 0.0, 2.0)  # and of one in a collision of given speed
