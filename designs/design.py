"""A finished design: its runs, what it can tell, and how it is written down."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from designs import evaluation
from designs.errors import DesignError
from designs.space import CODED_PREFIX, RESERVED_COLUMNS, FactorSpace
from designs.terms import model_terms


@dataclass(frozen=True)
class Design:
    """Runs in the order in which they are to be done.

    Args:
        name: name of the generator.
        space: the factors.
        table: one row per run: ``run``, ``std_order``, ``run_order``, ``block``, ``point_type``, ``seed``, then the
            factors in natural units.
        coded: the factors in coded units, same rows.
        model: the model the design is meant for.
        notes: sentences that the user must read.
        seed: the seed the design was made with.
    """

    name: str
    space: FactorSpace
    table: pd.DataFrame
    coded: pd.DataFrame
    model: str
    notes: tuple[str, ...]
    seed: int

    def __len__(self) -> int:
        return len(self.table)

    @property
    def natural(self) -> pd.DataFrame:
        """The factors in natural units."""
        return self.table[list(self.space.names)]

    def side_by_side(self) -> pd.DataFrame:
        """Return the run table with the coded values in columns ``coded NAME`` beside the natural ones."""
        return pd.concat([self.table, self.coded.add_prefix(CODED_PREFIX)], axis=1)

    def error_degrees_of_freedom(self, model: str | None = None) -> int:
        """Return n − p for a model: how many runs are left to estimate the noise."""
        return len(self) - len(model_terms(len(self.space), model or self.model)) - 1

    def d_efficiency(self, model: str | None = None) -> float:
        """Return the D-efficiency in per cent for a model (``designs.evaluation.d_efficiency``)."""
        return evaluation.d_efficiency(self.coded.to_numpy(), model or self.model)

    def alias_table(self) -> pd.DataFrame:
        """Return which two-factor interactions bias which effect (``designs.evaluation.alias_table``)."""
        return evaluation.alias_table(self.coded.to_numpy(), self.space.names)

    def power(self, *, effect: float, noise: float, alpha: float = 0.05, model: str | None = None) -> pd.DataFrame:
        """Return the chance of seeing an effect of that size in each term (``designs.evaluation.power_table``)."""
        return evaluation.power_table(
            self.coded.to_numpy(), self.space.names, effect=effect, noise=noise, alpha=alpha, model=model or self.model
        )

    def text(self) -> str:
        """Return what people want to read before they run it."""
        kinds = self.table.sort_values("std_order")["point_type"].value_counts(sort=False)
        parts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
        blocks = self.table["block"].nunique()
        lines = [
            f"{self.name}: {len(self)} runs ({parts}) in {blocks} block{'s' if blocks > 1 else ''}, seed {self.seed}.",
            self._efficiency_sentence(),
            *self.notes,
            "Alias structure (main effects and two-factor interactions):",
            evaluation.alias_text(self.alias_table(), self.space.names),
        ]
        return "\n".join(lines)

    def _efficiency_sentence(self) -> str:
        spare = self.error_degrees_of_freedom()
        efficiency = self.d_efficiency()
        if spare < 0 or efficiency == 0.0:
            return f"These runs can't carry the whole {self.model} model; fit fewer terms or add runs."
        words = f"D-efficiency {efficiency:.1f} % for the {self.model} model; {spare} degrees of freedom for the error."
        if spare == 0:
            words += " The design is saturated: no p-values; use Lenth's method, or add centre points or replicates."
        return words

    def to_csv(self, path: str | Path) -> Path:
        """Write the run table as plain CSV and return the path."""
        target = Path(path)
        self.table.to_csv(target, index=False)
        return target


def check_run_table(table: pd.DataFrame, space: FactorSpace) -> pd.DataFrame:
    """Return the run columns and factor columns of a table, all numbers.

    Raises:
        DesignError: for a missing column, or for text or gaps in a factor column.
    """
    space.to_coded(table.head(0))
    for name in space.names:
        values = pd.to_numeric(table[name], errors="coerce")
        if values.isna().any():
            row = int(values.isna().to_numpy().argmax())
            raise DesignError(
                f"Factor {name!r} holds {str(table[name].iloc[row])!r} in row {row + 1}; numbers are needed."
            )
    kept = [c for c in table.columns if c in RESERVED_COLUMNS] + list(space.names)
    return table[kept].astype(dict.fromkeys(space.names, float)).reset_index(drop=True)
