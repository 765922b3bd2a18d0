"""From points in the unit cube to coded points, for the space-filling designs."""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from designs.base import DesignGenerator, Points
from designs.space import Array, FactorSpace

_RUNS_PER_FACTOR = 10


def runs_or_default(generator: DesignGenerator, space: FactorSpace) -> int:
    """Return the number of runs asked for, or ten per factor."""
    return _RUNS_PER_FACTOR * len(space) if generator.runs is None else int(generator.runs)


def from_unit_cube(unit: Array, space: FactorSpace) -> Points:
    """Return the points of shape (n, k) in [0, 1) as a design, with their centred discrepancy as a note."""
    coded = np.column_stack([factor.from_unit(unit[:, i]) for i, factor in enumerate(space)])
    note = f"Centred L2 discrepancy {qmc.discrepancy(unit):.4g} (smaller is more even)."
    return Points(coded, ("space-filling",) * len(unit), notes=(note,))
