"""The result of checking what coarse graining moves, and the sentences that say so."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import pandas as pd

from taichidem.study.result_file import ResultFile

MOST_NAMED = 8  # observables that moved, named in the text; the table holds all


@dataclass(frozen=True, eq=False)
class CoarseGrainingCheck(ResultFile):
    """The same tests with small and with large grains, and which observables moved beyond their uncertainty.

    Attributes:
        study: its title, or the model's materials.
        factors: of coarse graining, the smallest first; shifts are from that one.
        seeds: with which every test that has a scatter was run.
        coverage: k for many seeds, 2 for 95 %; with few seeds the limit of |z| is wider, Student's t.
        table: a row per experiment, observable and factor: experiment, observable, unit, factor, n, mean, u, shift, u_shift,
            z, limit, moved (None where it can't be told), wall_time [s per run], time_ratio, mass_kept.
        failures: factors at which a test could not be set up, and runs that failed: experiment, factor, seed, reason.
        runs: how many were stored, new, failed.
        text: one paragraph for a reader who doesn't program.
        pictures: files by name, relative to `folder`.
        folder: where everything was written, or None.
    """

    file: ClassVar[str] = "coarse_graining.json"
    hidden: ClassVar[tuple[str, ...]] = ("folder", "table")

    study: str
    factors: tuple[float, ...]
    seeds: tuple[int, ...]
    coverage: float
    table: pd.DataFrame
    failures: tuple[Mapping[str, Any], ...]
    runs: Mapping[str, int]
    text: str
    folder: Path  # None where nothing was to be written
    pictures: Mapping[str, str] = field(default_factory=dict)

    def extra(self) -> dict[str, Any]:
        """Return the table as rows."""
        return {"rows": self.table.to_dict("records")}

    def moved(self) -> pd.DataFrame:
        """Return the rows of the table whose observable moved."""
        return self.table[self.table["moved"] == True]  # noqa: E712 - None is neither


def words(table: pd.DataFrame, factors: tuple[float, ...], coverage: float, failures: int) -> str:
    """Return what a table says as one paragraph."""
    first, others = factors[0], " and ".join(f"{s:g}" for s in factors[1:])
    judged = table[(table["factor"] > first) & table["moved"].notna()]
    if judged.empty:
        return (
            f"No observable can be compared between s = {first:g} and s = {others}: of every test too few runs succeeded. "
            "Give two seeds or more, and smaller factors or a larger apparatus to the tests that failed."
        )
    moved = judged[judged["moved"] == True]  # noqa: E712
    names = judged.groupby(["experiment", "observable"], sort=False).ngroups
    still = names - moved.groupby(["experiment", "observable"], sort=False).ngroups
    parts = [f"From s = {first:g} to {others}, {still} of {names} observables stayed within their uncertainty."]
    if len(moved):
        parts.append(f"Moved: {'; '.join(_moves(moved))}.")
    by_chance = len(judged) * math.erfc(coverage / math.sqrt(2))
    parts.append(
        f"An observable counts as moved where its shift is larger than {coverage:g} standard uncertainties of it (wider by "
        f"Student's t with few seeds); of {len(judged)} comparisons {by_chance:.1f} would be by chance alone."
    )
    if failures:
        parts.append(f"{failures} set-ups or runs failed; they are listed with their reasons.")
    parts += _times(judged)
    return " ".join(parts)


def _moves(moved: pd.DataFrame) -> list[str]:
    """Return one text per observable that moved: where it did so most."""
    told = []
    for (experiment, observable), rows in moved.groupby(["experiment", "observable"], sort=False):
        row = max(rows.to_dict("records"), key=lambda row: abs(row["shift"]))
        base = row["mean"] - row["shift"]
        share = f", {100 * row['shift'] / abs(base):+.0f} %" if base else ""
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        told.append(
            f"{observable} of {experiment} by {row['shift']:+.3g} ± {row['u_shift']:.2g}{unit} at s = {row['factor']:g}{share}"
        )
    told = [text.replace(" -", " −") for text in told]
    return told[:MOST_NAMED] + ([f"and {len(told) - MOST_NAMED} more"] if len(told) > MOST_NAMED else [])


def _times(judged: pd.DataFrame) -> list[str]:
    """Return how much time the largest factor saved, over tests of many grains."""
    last = judged[(judged["factor"] == judged["factor"].max()) & (judged["grains"] > 1)].drop_duplicates("experiment")
    if last.empty:
        return []
    after, before = last["wall_time"].sum(), (last["wall_time"] / last["time_ratio"]).sum()
    return [
        f"A run of each of these tests took {before:.3g} s at first and {after:.3g} s at s = {last['factor'].iloc[0]:g}."
    ]
