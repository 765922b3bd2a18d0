"""Latin hypercube samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.stats import qmc

from designs.base import DesignGenerator, Points, check_choice
from designs.space import FactorSpace
from designs.unit_cube import from_unit_cube, runs_or_default


@dataclass(frozen=True, kw_only=True)
class LatinHypercube(DesignGenerator):
    """Latin hypercube: in every factor each of n equal slices holds exactly one run.

    Default n = 10 k (Loeppky, Sacks & Welch, Technometrics 51 (2009) 366, doi 10.1198/TECH.2009.08040).

    Args:
        optimise: ``none``, or ``discrepancy`` to swap entries until the centred discrepancy stops falling.
        centred: put runs in the middle of their slices instead of anywhere in them.

    Source: McKay, Beckman & Conover, Technometrics 21 (1979) 239, doi 10.1080/00401706.1979.10489755.
    """

    optimise: str = "none"
    centred: bool = False

    name: ClassVar[str] = "latin_hypercube"
    model: ClassVar[str] = "quadratic"
    space_filling: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice(self, "optimise", self.optimise, ("none", "discrepancy"))

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return n points, one in each slice of each factor."""
        sampler = qmc.LatinHypercube(
            d=len(space),
            scramble=not self.centred,
            optimization="random-cd" if self.optimise == "discrepancy" else None,
            rng=rng,
        )
        return from_unit_cube(sampler.random(runs_or_default(self, space)), space)
