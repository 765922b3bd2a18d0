"""Plackett–Burman screening designs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from designs.base import DesignGenerator, Points, check_whole
from designs.errors import DesignError
from designs.hadamard import HADAMARD_ORDERS, plackett_burman_columns
from designs.space import FactorSpace
from designs.stack import stacked, stacked_blocks


@dataclass(frozen=True, kw_only=True)
class PlackettBurman(DesignGenerator):
    """Plackett–Burman screening: main effects of up to n − 1 factors in n = 12, 20, 24, 28, 36 … runs.

    Columns are orthogonal; in runs that are no power of two each two-factor interaction leaks partly (±1/3 for 12
    runs) into every main effect that isn't in it. n = 4 … 100 in steps of four, 92 excepted. Without ``runs`` the
    smallest n above the number of factors is taken, but no power of two: 8, 16, 32 and 64 runs are regular fractions,
    where interactions coincide with main effects.

    Args:
        centre_points: extra runs at the centre; they show curvature and give pure error.
        fold_over: add all runs with all signs changed, as block 2: main effects become clear of two-factor
            interactions.

    Source: Plackett & Burman, Biometrika 33 (1946) 305, doi 10.1093/biomet/33.4.305.
    """

    centre_points: int = 0
    fold_over: bool = False

    name: ClassVar[str] = "plackett_burman"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole(self, "centre_points", self.centre_points, at_least=0)

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the cyclic rows, then the row of all −1, then centre points, then the fold-over."""
        k = len(space)
        order = self._order(space)
        coded = plackett_burman_columns(order)[:, :k].copy()
        centre = np.zeros((self.centre_points, k))
        groups = [("factorial", coded), ("centre", centre)]
        notes = self._notes(order, k)
        if not self.fold_over:
            return stacked(*groups, notes=notes)
        return stacked_blocks([groups, [("fold-over", -coded), ("centre", centre)]], notes=notes)

    def _order(self, space: FactorSpace) -> int:
        k = len(space)
        if not 2 <= k <= HADAMARD_ORDERS[-1] - 1:
            raise DesignError(f"plackett_burman works for 2 to {HADAMARD_ORDERS[-1] - 1} factors; {k} were given.")
        enough = [n for n in HADAMARD_ORDERS if n > k]
        if self.runs is None:
            return next(n for n in enough if n & (n - 1))
        for n in enough:
            if self._total(n) == self.runs:
                return n
        raise self.wrong_runs(space, self.possible_runs(space))

    def _total(self, n: int) -> int:
        return (n + self.centre_points) * (2 if self.fold_over else 1)

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the multiples of four above the number of factors, centre points and fold-over counted."""
        return [self._total(n) for n in HADAMARD_ORDERS if n > len(space)]

    def _notes(self, order: int, k: int) -> tuple[str, ...]:
        if self.fold_over:
            return ("Block 2 is the fold-over: with it, main effects are clear of two-factor interactions.",)
        if order & (order - 1) == 0 and k > order // 2:
            return (
                f"{order} runs are a regular fraction of resolution III: interactions coincide with main effects. "
                f"{order + 4} or more runs, or fold_over, spread or remove that.",
            )
        return ()
