"""Put the standardised errors of a study into sentences: which fail, what their size follows, what to do next."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

import pandas as pd

MOST_NAMED = 6  # rows named one by one in a sentence
LARGE_SHARE = 0.5  # of u_val², from which a source of uncertainty is said to dominate

_UNIT = re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]")


def name_and_unit(condition: str) -> tuple[str, str]:
    """Return "speed" and "rad/s" of a column "speed [rad/s]"; the unit is empty where none is stated."""
    found = _UNIT.fullmatch(condition)
    return (found["name"], found["unit"]) if found else (condition, "")


def quantity(value: float, unit: str = "", digits: int = 3) -> str:
    """Return a number with its unit, such as "0.036 m"; a pure number stands alone."""
    sign = "−" if value < 0 else ""
    return f"{sign}{abs(value):.{digits}g}" + ("" if unit in ("", "1") else f" {unit}")


def probability(p: float) -> str:
    """Return "p = 0.031" or "p < 0.0001"."""
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.2g}"


def listed(names: Iterable[str]) -> str:
    """Return "a, b and c"."""
    names = list(names)
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def sentences(said: dict[str, Any]) -> list[str]:
    """Return what the errors say, from the table given, its errors, their trends and χ²."""
    table, rows = said["table"], said["rows"]
    tests = table["kind"] == "test"
    found = [_overall(said["numbers"], rows)]
    found += _failing(table[tests], rows[tests], said["numbers"]["alpha"])
    found += _parameters(table[~tests], rows[~tests])
    found += [str(text) for text in said["trends"].loc[said["trends"]["claimed"].astype(bool), "text"]]
    return found + _gaps(rows)


def _overall(numbers: dict[str, float], rows: pd.DataFrame) -> str:
    count = int(numbers["dof"])
    if count == 0:
        return "Nothing can be compared: no run gave a value."
    chi2 = f"χ² = {numbers['chi2']:.1f} with {count} degree{'s' if count > 1 else ''} of freedom"
    if math.isnan(numbers["p_value"]):
        return f"{chi2}; what single seeds scatter isn't known, so it has no p-value."
    if rows["fails"].any() and numbers["p_value"] > numbers["alpha"]:
        return f"{chi2} ({probability(numbers['p_value'])}) doesn't show a misfit, single values do."
    verdict = "doesn't agree" if numbers["p_value"] <= numbers["alpha"] else "agrees"
    return (
        f"As a whole the model {verdict} with the measurements within their uncertainties: {chi2} "
        f"({probability(numbers['p_value'])})."
    )


def _failing(table: pd.DataFrame, rows: pd.DataFrame, alpha: float) -> list[str]:
    """Return which rows fail, the worst first, each with its direction."""
    judged = int(rows["p"].notna().sum())
    if judged == 0:
        return []
    failing = rows[rows["fails"]].sort_values("z", key=abs, ascending=False)
    how = f"at {100 * alpha:g} %, corrected for {judged} measurements" if judged > 1 else f"at {100 * alpha:g} %"
    if failing.empty:
        return [f"No single measurement is missed by more than the uncertainties explain ({how})."]
    named = [_miss(table.loc[i], row) for i, row in failing.head(MOST_NAMED).iterrows()]
    more = f", and {len(failing) - MOST_NAMED} more" if len(failing) > MOST_NAMED else ""
    return [f"{len(failing)} of {judged} measurements fail ({how}): {'; '.join(named)}{more}."]


def _miss(given: pd.Series, row: pd.Series) -> str:
    size = quantity(abs(row["error"]), given["unit"], 2)
    where = "high" if row["error"] > 0 else "low"
    return f"{row['label']} is simulated {size} too {where} (|E|/u_val = {abs(row['z']):.1f})"


def _parameters(table: pd.DataFrame, rows: pd.DataFrame) -> list[str]:
    return [
        f"The model holds {row['label']} = {quantity(table.loc[i, 'simulated'], table.loc[i, 'unit'])}, but it was measured as "
        f"{quantity(table.loc[i, 'measured'])} ± {quantity(table.loc[i, 'u_measured'], table.loc[i, 'unit'], 2)}."
        for i, row in rows[rows["fails"]].iterrows()
    ]


def _gaps(rows: pd.DataFrame) -> list[str]:
    empty, single = rows[rows["z"].isna()]["label"], rows[rows["z"].notna() & rows["p"].isna()]["label"]
    found = []
    if len(empty):
        found.append(f"Not compared, as no run gave a value: {listed(empty)}.")
    if len(single):
        found.append(
            f"Run with a single seed, so that their scatter isn't known and they can't be judged: {listed(single)}."
        )
    return found


def trend_text(trend: dict[str, Any], unit: str) -> str:
    """Return what a trend says: how the error changes from the lowest to the highest condition."""
    name, condition_unit = name_and_unit(trend["condition"])
    first, last = min(trend["conditions"]), max(trend["conditions"])
    low, high = trend["low"], trend["high"]
    if not trend["claimed"]:
        return (
            f"The error of {trend['observable']} shows no trend with {name} ({probability(trend['adjusted_p'])}, corrected "
            "for the number of series)."
        )
    if low * high < 0 and min(abs(low), abs(high)) > 0.2 * max(abs(low), abs(high)):
        change = f"changes sign along {name}"
    else:
        change = f"{'grows' if abs(high) > abs(low) else 'shrinks'} with {name}"
    return (
        f"The error of {trend['observable']} {change}: from {quantity(low, unit)} at {quantity(first, condition_unit)} to "
        f"{quantity(high, unit)} at {quantity(last, condition_unit)} (straight line through all, "
        f"{probability(trend['adjusted_p'])})."
    )


def advice(said: dict[str, Any]) -> list[str]:
    """Return what to do next."""
    table, rows, numbers = said["table"], said["rows"], said["numbers"]
    found = []
    if (rows["z"].notna() & rows["p"].isna()).any():
        found.append("Run at least three seeds: without their scatter no difference can be judged.")
    if rows["fails"].any() or numbers["p_value"] <= numbers["alpha"]:
        found.append(
            "Find out whether re-calibration can explain the misfit or which physical effect is missing: diagnose the study."
        )
    else:
        found += _sharpen(table, rows)
    return found


def _sharpen(table: pd.DataFrame, rows: pd.DataFrame) -> list[str]:
    """Return what limits the comparison where nothing fails."""
    there = rows["u_val"].notna() & (table["kind"] == "test")
    if not there.any():
        return []
    variance = rows.loc[there, "u_val"] ** 2
    seeds = table.loc[there, "u_simulated"].fillna(0.0) ** 2 / variance
    noisy = rows.loc[there, "label"][seeds > LARGE_SHARE]
    found = []
    if len(noisy):
        found.append(f"The scatter between seeds is the largest uncertainty of {listed(noisy)}: run more seeds.")
    if len(noisy) < int(there.sum()):
        found.append("A smaller error of the model could be seen with more precise measurements.")
    return found
