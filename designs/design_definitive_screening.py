"""Definitive screening designs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from designs.base import DesignGenerator, Points, check_whole
from designs.errors import DesignError
from designs.hadamard import conference_matrix, has_conference_matrix
from designs.space import FactorSpace
from designs.stack import stacked

_MOST_FACTORS = 48


@dataclass(frozen=True, kw_only=True)
class DefinitiveScreening(DesignGenerator):
    """Definitive screening: three levels, 2m + 1 runs, main effects clear of squares and interactions.

    Rows of a conference matrix C of even order m ≥ k, the same with all signs changed, and a centre run; since
    CᵀC = (m − 1) I, main effects are exactly orthogonal for every k (m is the next order that has a C; surplus
    columns are fake factors and give error degrees of freedom).

    Args:
        centre_points: number of centre runs, ≥ 1.
        fake_factors: columns to leave unused on purpose; each pair adds four runs and two error degrees of freedom.

    Sources: Jones & Nachtsheim, J. Quality Technol. 43 (2011) 1, doi 10.1080/00224065.2011.11917841; Xiao, Lin &
    Bai, J. Quality Technol. 44 (2012) 2, doi 10.1080/00224065.2012.11917877.
    """

    centre_points: int = 1
    fake_factors: int = 0

    name: ClassVar[str] = "definitive_screening"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole(self, "centre_points", self.centre_points, at_least=1)
        check_whole(self, "fake_factors", self.fake_factors, at_least=0)

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return fold-over pairs row by row, then the centre runs."""
        k = len(space)
        if not 3 <= k <= _MOST_FACTORS:
            raise DesignError(f"definitive_screening works for 3 to {_MOST_FACTORS} factors; {k} were given.")
        order = self._order(space)
        half = conference_matrix(order)[:, :k]
        pairs = np.stack([half, -half], axis=1).reshape(-1, k)
        fake = order - k
        note = f"The conference matrix has order {order}: {fake} column{'s' if fake != 1 else ''} left unused."
        centre = ("centre", np.zeros((self.centre_points, k)))
        return stacked(("screening", pairs), centre, notes=(note,) if fake else ())

    def _order(self, space: FactorSpace) -> int:
        orders = [m for m in range(4, 2 * _MOST_FACTORS, 2) if m >= len(space) + self.fake_factors]
        orders = [m for m in orders if has_conference_matrix(m)]
        if self.runs is None:
            return orders[0]
        for m in orders:
            if 2 * m + self.centre_points == self.runs:
                return m
        raise self.wrong_runs(space, (2 * m + self.centre_points for m in orders))

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return 2m + centre points for the orders m that have a conference matrix."""
        orders = range(max(4, len(space) + len(space) % 2), 2 * _MOST_FACTORS, 2)
        return [2 * m + self.centre_points for m in orders if has_conference_matrix(m)]
