"""Every combination of the levels."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pyDOE3

from designs.base import DesignGenerator, Points, check_whole
from designs.errors import DesignError
from designs.space import Array, FactorSpace
from designs.stack import stacked

_MOST_RUNS = 1_000_000


@dataclass(frozen=True, kw_only=True)
class FullFactorial(DesignGenerator):
    """Full factorial: every combination of the levels of all factors, with optional centre points.

    n = Π mᵢ runs in standard (Yates) order, the first factor changing fastest. A factor that has ``levels`` of its
    own uses all of them; the others use ``levels_each`` equally spaced ones.

    Args:
        levels_each: number of levels of factors without own levels, ≥ 2.
        centre_points: extra runs at the centre, for curvature and pure error.

    Source: Box, Hunter & Hunter, "Statistics for Experimenters", 2nd ed. (2005).
    """

    levels_each: int = 2
    centre_points: int = 0

    name: ClassVar[str] = "full_factorial"
    model: ClassVar[str] = "interactions"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole(self, "levels_each", self.levels_each, at_least=2)
        check_whole(self, "centre_points", self.centre_points, at_least=0)

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the grid in Yates order, then the centre points."""
        levels = [self._levels(space, i) for i in range(len(space))]
        count = math.prod(len(values) for values in levels)
        if count > _MOST_RUNS:
            raise DesignError(
                f"full_factorial of {len(space)} factors would have {count} runs, more than {_MOST_RUNS}. "
                "Use fractional_factorial, plackett_burman or a space-filling design."
            )
        index = pyDOE3.fullfact([len(values) for values in levels]).astype(int)
        grid = np.column_stack([values[index[:, i]] for i, values in enumerate(levels)])
        return stacked(("factorial", grid), ("centre", np.zeros((self.centre_points, len(space)))))

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the grid size with few or no centre points, and of the other small numbers of levels."""
        return [m ** len(space) + c for m in (2, 3, 4, 5) for c in range(11)]

    def _levels(self, space: FactorSpace, i: int) -> Array:
        factor = space.factors[i]
        if factor.levels is None:
            return np.linspace(-1.0, 1.0, self.levels_each)
        return factor.to_coded(np.asarray(factor.levels))
