"""Box–Behnken designs with the published run counts."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from designs.base import DesignGenerator, Points, check_whole
from designs.errors import DesignError
from designs.space import Array, FactorSpace
from designs.stack import stacked_blocks

#: Which factors move together, by number of factors, grouped into the orthogonal blocks where there are some.
#: Six and seven factors use triples; all pairs would cost 12 and 28 runs more.
_GROUPS: dict[int, tuple[tuple[tuple[int, ...], ...], ...]] = {
    3: (((0, 1), (0, 2), (1, 2)),),
    4: (((0, 1), (2, 3)), ((0, 3), (1, 2)), ((0, 2), (1, 3))),
    5: (((0, 1), (2, 3), (1, 4), (0, 2), (3, 4)), ((1, 2), (0, 3), (2, 4), (0, 4), (1, 3))),
    6: (((0, 1, 3), (1, 2, 4), (2, 3, 5), (0, 3, 4), (1, 4, 5), (0, 2, 5)),),
    7: (((3, 4, 5), (0, 5, 6), (1, 4, 6), (0, 1, 3), (2, 3, 6), (0, 2, 4), (1, 2, 5)),),
}
_CENTRE_POINTS = {3: 3, 4: 3, 5: 6, 6: 6, 7: 6}


@dataclass(frozen=True, kw_only=True)
class BoxBehnken(DesignGenerator):
    """Box–Behnken: three levels, no corners, 15, 27, 46, 54 or 62 runs for 3 to 7 factors.

    Edge midpoints of the cube (the factors of a pair or triple at ±1, all others at 0) and centre points. It never
    leaves the box, so physical bounds are safe.

    Args:
        centre_points: number of centre points; default 3, 3, 6, 6, 6 for 3 … 7 factors.
        blocks: 1, or the number of orthogonal blocks that exist: 3 for 4 factors, 2 for 5 factors.

    Source: Box & Behnken, Technometrics 2 (1960) 455, doi 10.1080/00401706.1960.10489912.
    """

    centre_points: int | None = None
    blocks: int = 1

    name: ClassVar[str] = "box_behnken"
    model: ClassVar[str] = "quadratic"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_whole(self, "blocks", self.blocks, at_least=1)
        if self.centre_points is not None:
            check_whole(self, "centre_points", self.centre_points, at_least=0)

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the edges group by group, then the centre points, block by block."""
        k = len(space)
        if k not in _GROUPS:
            raise DesignError(
                f"box_behnken is tabulated for 3 to 7 factors; {k} were given. Use central_composite or d_optimal."
            )
        groups = _GROUPS[k]
        if self.blocks not in (1, len(groups)):
            raise DesignError(
                f"box_behnken in {k} factors can have {' or '.join(sorted({'1', str(len(groups))}))} blocks; "
                f"blocks = {self.blocks} was given."
            )
        centre = self._centre_points(k)
        if self.blocks == 1:
            edges = _edges([pair for block in groups for pair in block], k)
            return stacked_blocks([[("edge", edges), ("centre", np.zeros((centre, k)))]])
        if centre % self.blocks:
            raise DesignError(
                f"{centre} centre points can't be shared equally by {self.blocks} blocks; use a multiple."
            )
        each = np.zeros((centre // self.blocks, k))
        return stacked_blocks([[("edge", _edges(block, k)), ("centre", each)] for block in groups])

    def _centre_points(self, k: int) -> int:
        return _CENTRE_POINTS[k] if self.centre_points is None else self.centre_points

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the runs with 0 to 20 centre points."""
        k = len(space)
        edges = sum(2 ** len(pair) for block in _GROUPS.get(k, ()) for pair in block)
        return [edges + centre for centre in range(21)] if edges else []


def _edges(groups: Sequence[tuple[int, ...]], k: int) -> Array:
    rows = []
    for group in groups:
        for signs in itertools.product((-1.0, 1.0), repeat=len(group)):
            row = np.zeros(k)
            row[list(group)] = signs[::-1]  # first factor of the group changes fastest
            rows.append(row)
    return np.array(rows)
