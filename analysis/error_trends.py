"""Whether a model's error follows a condition of the tests: a weighted straight line of E = S − D over it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from analysis.familywise import holm
from analysis.known_and_estimated import joint_degrees, two_sided
from analysis.standardised_errors_text import trend_text

FEWEST = 2  # different values of a condition; with known uncertainties two points make a line that can be judged


@dataclass(frozen=True)
class Series:
    """Rows that differ in one condition alone.

    Args:
        observable: what all of them measure.
        condition: name of the column in which they differ.
        rows: their positions in the table, by rising condition.
        values: the condition of each, shape (n,).
    """

    observable: str
    condition: str
    rows: tuple[int, ...]
    values: tuple[float, ...]


def series_of(table: pd.DataFrame, conditions: Sequence[str]) -> list[Series]:
    """Return the series in a table: rows of one type and observable that differ in exactly one numeric condition.

    Args:
        table: with the columns type and observable (where missing, all rows are of one) and one per condition, numbers or
            texts; a condition that a row doesn't have is missing (nan).
        conditions: names of these columns.
    """
    found = []
    for observable, positions in _alike(table, [c for c in ("type", "observable") if c in table]):
        for condition in conditions:
            values = pd.to_numeric(table[condition], errors="coerce").to_numpy(float)
            own = [row for row in positions if not math.isnan(values[row])]
            others = [other for other in conditions if other != condition]
            for _, rows in _alike(table.iloc[own], others, own):
                if len({values[row] for row in rows}) >= FEWEST:
                    ordered = sorted(rows, key=lambda row: values[row])
                    named = str(observable[-1]) if observable else ""
                    found.append(Series(named, condition, tuple(ordered), tuple(float(values[r]) for r in ordered)))
    return found


def _alike(
    table: pd.DataFrame, columns: Sequence[str], positions: Sequence[int] | None = None
) -> Iterator[tuple[tuple, list[int]]]:
    """Yield the values of some columns and the positions of all rows that have them, in order of appearance."""
    groups: dict[tuple, list[int]] = {}
    positions = range(len(table)) if positions is None else positions
    missing = table[list(columns)].isna()
    for k, row in enumerate(positions):
        key = tuple(None if missing.iloc[k][c] else table.iloc[k][c] for c in columns)
        groups.setdefault(key, []).append(row)
    yield from groups.items()


@dataclass(frozen=True)
class Line:
    """A weighted straight line through errors.

    Args:
        slope: [unit of the error / unit of the condition].
        u_slope: its standard uncertainty.
        p: two-sided, of no slope at all.
        low, high: the errors themselves at the lowest and highest condition, weighted means where there are several.
    """

    slope: float
    u_slope: float
    p: float
    low: float
    high: float


def weighted_line(x: Any, error: Any, u_val: Any, u_seeds: Any, n_seeds: Any) -> Line:
    """Lay a straight line E = a + b x through errors, weights 1/u_val².

    b = Σ w (x − x̄) E / S with S = Σ w (x − x̄)², u_b = 1/√S: the uncertainties are taken as they are, not from the scatter
    about the line. In its p the part that seeds estimate, c u_S with c = ∂b/∂E, is Student's t (see `two_sided`).

    Args:
        x: condition, shape (n,), two different values or more.
        error, u_val: E and its standard uncertainty, shape (n,).
        u_seeds, n_seeds: the part of u_val that is the scatter of the mean over n seeds, shape (n,).
    """
    x, error, u_val, u_seeds = (np.asarray(v, float) for v in (x, error, u_val, u_seeds))
    weights = u_val**-2.0
    middle = np.average(x, weights=weights)
    spread = float(np.sum(weights * (x - middle) ** 2))
    shares = weights * (x - middle) / spread
    slope, u_slope = float(shares @ error), 1.0 / math.sqrt(spread)
    freedom = np.maximum(np.asarray(n_seeds, float) - 1.0, 1.0)
    known = math.sqrt(float(np.sum(shares**2 * np.maximum(u_val**2 - u_seeds**2, 0.0))))
    estimated = math.sqrt(float(np.sum((shares * u_seeds) ** 2)))
    p = two_sided(slope, known, estimated, joint_degrees(shares * u_seeds, freedom))
    low, high = (float(np.average(error[x == end], weights=weights[x == end])) for end in (x.min(), x.max()))
    return Line(slope, u_slope, p, low, high)


def trends_table(table: pd.DataFrame, rows: pd.DataFrame, series: Sequence[Series], alpha: float) -> pd.DataFrame:
    """Return a line per series whose errors are all known, with p, p adjusted for the number of series, and what it says.

    Args:
        table: as given to the analyser.
        rows: error, u_val, p of each of its rows, in the same order.
        series: as `series_of` finds them.
        alpha: largest adjusted p at which a trend is claimed.
    """
    found: list[tuple[Series, Line]] = []
    for one in series:
        at = [row for row in one.rows if not math.isnan(rows["p"].iloc[row])]
        x = [value for row, value in zip(one.rows, one.values, strict=True) if row in at]
        if len(set(x)) >= FEWEST:
            part, given = rows.iloc[at], table.iloc[at]
            seeds = (given["u_simulated"].fillna(0.0), given["n_seeds"])
            line = weighted_line(x, part["error"], part["u_val"], *seeds)
            found.append((replace(one, rows=tuple(at), values=tuple(x)), line))
    adjusted = holm([line.p for _, line in found])
    lines = [_row(one, line, float(p), alpha, rows) for (one, line), p in zip(found, adjusted, strict=True)]
    for row in lines:
        row["text"] = trend_text(row, str(table["unit"].iloc[row["rows"][0]]))
    return pd.DataFrame(lines, columns=COLUMNS)


COLUMNS = ["observable", "condition", "rows", "conditions", "z", "slope", "u_slope", "p", "adjusted_p", "low", "high"]
COLUMNS += ["claimed", "text"]


def _row(one: Series, line: Line, adjusted: float, alpha: float, rows: pd.DataFrame) -> dict[str, Any]:
    return {
        "observable": one.observable,
        "condition": one.condition,
        "rows": list(one.rows),
        "conditions": list(one.values),
        "z": [float(z) for z in rows["z"].iloc[list(one.rows)]],
        "slope": line.slope,
        "u_slope": line.u_slope,
        "p": line.p,
        "adjusted_p": adjusted,
        "low": line.low,
        "high": line.high,
        "claimed": bool(adjusted <= alpha),
    }
