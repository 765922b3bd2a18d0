"""Regular fractions of two-level factorials."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from designs.base import DesignGenerator, Points, check_whole
from designs.errors import DesignError
from designs.generators import LETTERS, fraction, fractions, parse_generators, resolution_of
from designs.space import Array, FactorSpace
from designs.stack import stacked, stacked_blocks

_ROMAN = {3: "III", 4: "IV", 5: "V", 6: "VI", 7: "VII", 8: "VIII", 9: "IX", 10: "X"}


@dataclass(frozen=True, kw_only=True)
class FractionalFactorial(DesignGenerator):
    """Two-level fractional factorial, chosen by generators, by resolution or by number of runs.

    2^(k−p) runs: a full factorial in k − p factors, and p columns that are products of these. Letters are given to
    the factors in their order (A, B, …, H, J, …; no I). Choose at most one of ``generators``, ``resolution`` and
    ``runs``; none of them means the smallest fraction of resolution IV or more.

    Args:
        generators: text such as ``D=ABC, E=-AB``.
        resolution: wanted resolution, ≥ 3; the smallest fraction that has it is taken.
        centre_points: extra runs at the centre.
        fold_over: add all runs with all signs changed, as block 2; it frees the main effects of two-factor aliases.

    Source: Box, Hunter & Hunter, "Statistics for Experimenters", 2nd ed. (2005), chapter 6.
    """

    generators: str | None = None
    resolution: int | None = None
    centre_points: int = 0
    fold_over: bool = False

    name: ClassVar[str] = "fractional_factorial"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole(self, "centre_points", self.centre_points, at_least=0)
        if self.resolution is not None:
            check_whole(self, "resolution", self.resolution, at_least=3)
        if self.generators is not None and self.resolution is not None:
            raise DesignError("fractional_factorial takes generators or a resolution, not both. Drop one of them.")

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the fraction in standard order, then the centre points, then the fold-over."""
        k = len(space)
        if not 2 <= k <= len(LETTERS):
            raise DesignError(f"fractional_factorial works for 2 to {len(LETTERS)} factors; {k} were given.")
        coded, words = self._fraction(space)
        resolution = resolution_of(k, words)
        notes = (self._describe(space, words, resolution),)
        centre = np.zeros((self.centre_points, k))
        groups = [("factorial", coded), ("centre", centre)]
        if not self.fold_over:
            return stacked(*groups, notes=notes)
        note = "Block 2 is the fold-over: with it, main effects are clear of two-factor interactions."
        return stacked_blocks([groups, [("fold-over", -coded), ("centre", centre)]], notes=(*notes, note))

    def _fraction(self, space: FactorSpace) -> tuple[Array, tuple[str, ...]]:
        k = len(space)
        if self.generators is not None:
            words, signs = parse_generators(self.generators, k)
            coded = fraction(k, words)
            coded[:, k - len(words) :] *= signs
            if resolution_of(k, words) in (1, 2):
                raise DesignError(
                    f"Generators {self.generators!r} make two factors equal; use different, longer words."
                )
            return coded, words
        for runs, resolution, words in fractions(k):
            if self._fits(runs, resolution):
                return fraction(k, words), words
        if self.runs is not None and self.resolution is None:
            raise self.wrong_runs(space, self.possible_runs(space))
        best = ", ".join(f"{_ROMAN.get(r, 'full')} with {n} runs" for n, r, _ in fractions(k))
        asked = f"resolution {self.resolution}" + (f" and {self.runs} runs" if self.runs is not None else "")
        raise DesignError(f"No fractional_factorial of {k} factors has {asked}. There are: {best}.")

    def _fits(self, runs: int, resolution: int) -> bool:
        total = (runs + self.centre_points) * (2 if self.fold_over else 1)
        if self.runs is not None:
            return total == self.runs and (resolution == 0 or resolution >= (self.resolution or 3))
        return resolution == 0 or resolution >= (self.resolution or 4)

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the runs of all fractions that exist, centre points and fold-over counted."""
        return [(n + self.centre_points) * (2 if self.fold_over else 1) for n, _, _ in fractions(len(space))]

    def _describe(self, space: FactorSpace, words: tuple[str, ...], resolution: int) -> str:
        k = len(space)
        letters = ", ".join(f"{letter} = {name}" for letter, name in zip(LETTERS, space.names, strict=False))
        if not words:
            return f"Full two-level factorial. {letters}."
        added = ", ".join(f"{LETTERS[k - len(words) + i]} = {word}" for i, word in enumerate(words))
        added = added if self.generators is None else self.generators
        return f"Resolution {_ROMAN.get(resolution, resolution)}, generators {added}. {letters}."
