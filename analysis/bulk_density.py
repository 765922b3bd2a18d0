"""Bulk density from weighings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pandas as pd

from analysis.base import Analyser
from analysis.errors import AnalysisError
from analysis.property_statistics import describe
from analysis.report import Report
from analysis.run_table import numbers
from designs.space import FactorSpace


@dataclass(frozen=True, kw_only=True)
class BulkDensity(Analyser):
    """Bulk density from weighings of a vessel, full and empty: ρ_b = (m_full − m_empty) / V.

    The standard uncertainty of the mean joins scatter and instruments:
    u² = s²/n + 2 (u_m/V)² + (ρ_b u_V/V)²; the balance and the vessel are the same for all weighings, so their part
    doesn't shrink with n.

    Args:
        full, empty: columns with the mass of the full and the empty vessel [kg].
        volume: column with the volume of the vessel [m³], or the volume itself.
        u_mass: standard uncertainty of one weighing [kg].
        u_volume: standard uncertainty of the volume [m³].

    Source: Sudsawat, Chongchitpaisan & Arunyanart, EUREKA: Physics and Engineering 6 (2023) 34, Eq. 1,
    doi 10.21303/2461-4262.2023.002968; uncertainty as in JCGM 100:2008.
    """

    full: str = "mass_full_kg"
    empty: str = "mass_empty_kg"
    volume: str | float = "volume_m3"
    u_mass: float = 0.0
    u_volume: float = 0.0

    name: ClassVar[str] = "bulk_density"
    n_responses: ClassVar[tuple[int, int | None]] = (0, 0)

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the density of each weighing, their statistics and the uncertainty of the mean."""
        self.check_responses(responses)
        full, empty = numbers(table, self.full, "full vessel"), numbers(table, self.empty, "empty vessel")
        volume = self._volume(table)
        if not len(full):
            raise AnalysisError("The table has no rows. Give one row per weighing.")
        if (volume <= 0).any() or (empty < 0).any() or (full <= empty).any():
            bad = int(np.flatnonzero((volume <= 0) | (empty < 0) | (full <= empty))[0])
            raise AnalysisError(
                f"Row {bad + 1}: full {full[bad]:g} kg, empty {empty[bad]:g} kg, volume {volume[bad]:g} m³; the "
                "full vessel must weigh more than the empty one and the volume be positive. Check columns and units."
            )
        density = (full - empty) / volume
        statistics = describe(density)
        u = self._uncertainty(density, volume)
        each = pd.DataFrame({"Row": np.arange(1, len(density) + 1), "Bulk density": density})
        sentence = (
            f"Bulk density {statistics['Mean']:.5g} kg/m³, standard uncertainty {u:.2g} kg/m³ (n = {len(density)})."
        )
        numbers_out = {"bulk_density": statistics["Mean"], "u": u}
        return Report(
            self.name,
            "weighings",
            {"bulk_density": pd.DataFrame([{"Property": "bulk density [kg/m³]", **statistics}]), "weighings": each},
            numbers_out,
            (sentence,),
        )

    def _volume(self, table: pd.DataFrame) -> np.ndarray:
        if isinstance(self.volume, str):
            return numbers(table, self.volume, "volume")
        return np.full(len(table), float(self.volume))

    def _uncertainty(self, density: np.ndarray, volume: np.ndarray) -> float:
        scatter = float(np.std(density, ddof=1)) / math.sqrt(len(density)) if len(density) > 1 else 0.0
        mean, vessel = float(density.mean()), float(volume.mean())
        return math.sqrt(scatter**2 + 2 * (self.u_mass / vessel) ** 2 + (mean * self.u_volume / vessel) ** 2)
