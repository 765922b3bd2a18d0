"""How many runs were there before, were made, failed, or were repeated."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd


def counted(table: pd.DataFrame) -> dict[str, int]:
    """Return what became of the runs of a table, as `run_all` returns it: stored, new, failed, repeated."""
    stored = int(table["stored"].sum())
    return {
        "stored": stored,
        "new": len(table) - stored,
        "failed": int((table["status"] == "failed").sum()),
        "repeated": int((table["attempts"] > 1).sum()),
    }


def in_words(counts: Mapping[str, int]) -> str:
    """Return counts as one or two sentences."""
    told = (
        f"{counts['stored'] + counts['new']} runs: {counts['stored']} were in the store, {counts['new']} simulated now; "
        f"{counts['failed']} failed."
    )
    repeated = counts["repeated"]
    if not repeated:
        return told
    subject, pronoun = ("1 run was", "it") if repeated == 1 else (f"{repeated} runs were", "they")
    why = "had diverged, overlapped too far or run out of room"
    return f"{told} {subject} repeated with another random stream after {pronoun} {why}."
