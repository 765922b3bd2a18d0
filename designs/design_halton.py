"""Halton sequences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.stats import qmc

from designs.base import DesignGenerator, Points
from designs.space import FactorSpace
from designs.unit_cube import from_unit_cube, runs_or_default


@dataclass(frozen=True, kw_only=True)
class Halton(DesignGenerator):
    """Halton sequence: low-discrepancy points for any number of runs, digits permuted by the seed.

    Without the permutation, factors beyond about six are strongly correlated in their first few hundred runs.
    Default n = 10 per factor.

    Args:
        scramble: permute the digits of each factor.

    Source: Halton, Numer. Math. 2 (1960) 84, doi 10.1007/BF01386213; Owen, arXiv 1706.02808.
    """

    scramble: bool = True

    name: ClassVar[str] = "halton"
    model: ClassVar[str] = "quadratic"
    space_filling: ClassVar[bool] = True

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the first n points of the sequence."""
        sampler = qmc.Halton(d=len(space), scramble=self.scramble, rng=rng)
        return from_unit_cube(sampler.random(runs_or_default(self, space)), space)
