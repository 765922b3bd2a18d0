"""From a plain table to factors in coded units and clean response columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from analysis.errors import AnalysisError
from designs.errors import nearest_hint
from designs.space import CODED_PREFIX, RESERVED_COLUMNS, Array, Factor, FactorSpace

#: Columns of a run table that are never factors: the design's own and those a campaign of simulations adds.
NEVER_FACTORS = (*RESERVED_COLUMNS, "experiment", "status", "reason", "wall_time_s")

#: Coded values are compared after rounding: coding, decoding and coding again changes the last bits.
_REPLICATE_DECIMALS = 6


@dataclass(frozen=True)
class RunTable:
    """Runs ready for a fit.

    Args:
        space: the factors and their coding.
        coded: coded factor values, shape (n, k).
        block: block number from 0 of each run, shape (n,).
        responses: response values by name, each of shape (n,).
        order: run order for plots, shape (n,).
    """

    space: FactorSpace
    coded: Array
    block: npt.NDArray[np.int64]
    responses: dict[str, Array]
    order: npt.NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.coded)

    @property
    def names(self) -> tuple[str, ...]:
        """Factor names."""
        return self.space.names

    @property
    def n_blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max(initial=0)) + 1

    def replicate_groups(self) -> npt.NDArray[np.int64]:
        """Return a group number per run; runs in one group share all factor values and the block."""
        key = np.column_stack([np.round(self.coded, _REPLICATE_DECIMALS) + 0.0, self.block])
        return np.unique(key, axis=0, return_inverse=True)[1].reshape(-1)


def read_runs(
    table: pd.DataFrame,
    responses: Sequence[str],
    *,
    factors: Sequence[str] | None = None,
    space: FactorSpace | None = None,
) -> RunTable:
    """Return the runs of a table, checked.

    Factors are all columns but the responses and ``NEVER_FACTORS``, unless ``factors`` or ``space`` names them. Without
    a space each factor is coded by its own range in the table: lowest value −1, highest +1.

    Args:
        table: one row per run, natural units.
        responses: names of response columns.
        factors: names of factor columns.
        space: factors with their low and high.

    Raises:
        AnalysisError: for a column that is missing, holds text or gaps, is constant, or is factor and response.
    """
    if len(table) == 0:
        raise AnalysisError("The table has no rows. Give a table with one row per run.")
    names = _factor_names(table, responses, factors, space)
    values = {name: numbers(table, name, "response") for name in responses}
    natural = pd.DataFrame({name: numbers(table, name, "factor") for name in names})
    used = space.subset(names) if space is not None else _space_of(natural)
    block = np.zeros(len(table), dtype=np.int64)
    if "block" in table.columns:
        block = pd.factorize(table["block"], sort=True)[0].astype(np.int64)
        if (block < 0).any():
            raise AnalysisError("Column 'block' has gaps. Fill in the block of every run, or drop the column.")
    order = np.arange(1, len(table) + 1)
    if "run_order" in table.columns:
        order = np.argsort(np.argsort(numbers(table, "run_order", "run order"), kind="stable")) + 1
    return RunTable(used, used.to_coded(natural), block, values, order)


def numbers(table: pd.DataFrame, name: str, role: str) -> Array:
    """Return a column as finite numbers.

    Raises:
        AnalysisError: naming the first row that holds text, a gap or an infinite value.
    """
    if name not in table.columns:
        raise AnalysisError(f"The table has no column {name!r} for the {role}. {nearest_hint(name, table.columns)}")
    values = pd.to_numeric(table[name], errors="coerce").to_numpy(dtype=float)
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        value = table[name].iloc[bad[0]]
        found = "nothing" if pd.isna(value) else repr(str(value))
        raise AnalysisError(
            f"Column {name!r} ({role}) holds {found} in row {bad[0] + 1} and {bad.size} unusable value"
            f"{'s' if bad.size > 1 else ''} in all; finite numbers are needed. Correct or repeat these runs, or drop "
            "their rows."
        )
    return values


def _factor_names(
    table: pd.DataFrame, responses: Sequence[str], factors: Sequence[str] | None, space: FactorSpace | None
) -> list[str]:
    if factors is None:
        factors = space.names if space is not None else _guessed(table, responses)
    names = list(factors)
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise AnalysisError(f"Factor {twice[0]!r} is named twice. Name each factor once.")
    both = [name for name in names if name in responses]
    if both:
        raise AnalysisError(f"{both[0]!r} is named as factor and as response. Choose one.")
    if not names:
        raise AnalysisError(f"The table has no factor columns besides {', '.join(responses)}. Add them or name them.")
    reserved = [name for name in names if name in RESERVED_COLUMNS]
    if reserved:
        raise AnalysisError(f"{reserved[0]!r} is a column of the run table and never a factor. Leave it out.")
    return names


def _guessed(table: pd.DataFrame, responses: Sequence[str]) -> list[str]:
    doubled = table.columns[table.columns.duplicated()]
    if len(doubled):
        raise AnalysisError(f"Column {doubled[0]!r} appears twice in the table. Rename one.")
    names = [str(c) for c in table.columns if c not in responses and str(c) not in NEVER_FACTORS]
    return [name for name in names if not name.startswith(CODED_PREFIX)]


def _space_of(natural: pd.DataFrame) -> FactorSpace:
    factors = []
    for name in natural.columns:
        low, high = float(natural[name].min()), float(natural[name].max())
        if low == high:
            raise AnalysisError(
                f"Column {name!r} has the one value {low:g} in all {len(natural)} runs, so it can't be a factor. "
                "Leave it out: name the factors (--factors A,B,…)."
            )
        factors.append(Factor(name, low, high))
    return FactorSpace(factors)


def match_design(table: pd.DataFrame, design: pd.DataFrame, factors: Sequence[str]) -> None:
    """Check that a table of results holds exactly the runs of a design, row by row by ``run``.

    Raises:
        AnalysisError: for missing, surplus or doubled runs, or a factor value that differs.
    """
    for which, frame in (("table", table), ("design", design)):
        if "run" not in frame.columns:
            raise AnalysisError(f"The {which} has no column 'run', so its runs can't be matched. Keep that column.")
        if frame["run"].duplicated().any():
            run = frame["run"][frame["run"].duplicated()].iloc[0]
            raise AnalysisError(f"The {which} holds run {run} more than once. Give replicates numbers of their own.")
    missing = sorted(set(design["run"]) - set(table["run"]))
    surplus = sorted(set(table["run"]) - set(design["run"]))
    if missing or surplus:
        raise AnalysisError(
            f"The table doesn't match the design of {len(design)} runs: missing runs {missing[:10] or 'none'}, surplus "
            f"runs {surplus[:10] or 'none'}. Analyse the table of this design, or leave the design out."
        )
    merged = design.set_index("run").loc[table["run"]]
    for name in factors:
        planned, done = numbers(merged, name, "factor of the design"), numbers(table, name, "factor")
        slack = 1e-6 * max(float(np.ptp(planned)), 1e-300)
        wrong = np.flatnonzero(np.abs(planned - done) > slack)
        if wrong.size:
            raise AnalysisError(
                f"Run {table['run'].iloc[wrong[0]]} of the table has {name} = {done[wrong[0]]:g}, the design has "
                f"{planned[wrong[0]]:g} ({wrong.size} runs differ). Analyse the values really used and leave the "
                "design out, or correct the table."
            )
