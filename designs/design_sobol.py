"""Sobol' sequences."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.stats import qmc

from designs.base import DesignGenerator, Points
from designs.space import FactorSpace
from designs.unit_cube import from_unit_cube, runs_or_default


@dataclass(frozen=True, kw_only=True)
class Sobol(DesignGenerator):
    """Sobol' sequence: low-discrepancy points, n = 2, 4, 8, 16 … runs, scrambled by the seed.

    A number of runs that is no power of two loses the balance of the sequence and is refused unless asked for.
    Without ``runs``: the next power of two above ten per factor.

    Args:
        scramble: random linear scramble and shift; without it the first run is the corner of all lows.
        unbalanced: allow any number of runs.

    Source: Sobol', USSR Comput. Math. Math. Phys. 7 (1967) 86, doi 10.1016/0041-5553(67)90144-9; Owen, J. Complexity
    14 (1998) 466, doi 10.1006/jcom.1998.0487.
    """

    scramble: bool = True
    unbalanced: bool = False

    name: ClassVar[str] = "sobol"
    model: ClassVar[str] = "quadratic"
    space_filling: ClassVar[bool] = True

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the first n points of the sequence."""
        n = runs_or_default(self, space)
        if self.runs is None:
            n = 2 ** (n - 1).bit_length()
        elif n & (n - 1) and not self.unbalanced:
            raise self.wrong_runs(space, self.possible_runs(space))
        sampler = qmc.Sobol(d=len(space), scramble=self.scramble, rng=rng)
        unit = sampler.random_base2(n.bit_length())[:n] if n & (n - 1) else sampler.random_base2(n.bit_length() - 1)
        return from_unit_cube(unit, space)

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the powers of two."""
        return [2**m for m in range(1, 31)]
