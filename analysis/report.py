"""What an analyser returns: tables, numbers, sentences a non-programmer can use, and what to do next."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd


@dataclass(frozen=True)
class Report:
    """The frozen result of an analysis.

    Args:
        analyser: name of the analyser.
        subject: what was analysed, for the title (usually the response).
        tables: tables by name, in the order in which people read them.
        numbers: single results by name, for programs.
        sentences: what the numbers mean, one sentence each.
        advice: what to measure, run or check next.
        details: objects for plots and further computing (the fitted model, say); not written to files.
    """

    analyser: str
    subject: str
    tables: Mapping[str, pd.DataFrame]
    numbers: Mapping[str, float]
    sentences: tuple[str, ...]
    advice: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        for name in ("tables", "numbers", "details"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def text(self) -> str:
        """Return the whole report as text: sentences, tables, advice."""
        parts = [f"{self.analyser}: {self.subject}", "\n".join(self.sentences)]
        parts += [f"{_title(name)}\n{table_text(table)}" for name, table in self.tables.items()]
        if self.advice:
            parts.append("Next\n" + "\n".join(f"- {line}" for line in self.advice))
        return "\n\n".join(part for part in parts if part)

    def to_json(self) -> str:
        """Return the report as JSON text; missing numbers become null."""
        return _json_text(self._plain())

    def _plain(self) -> dict[str, Any]:
        return {
            "analyser": self.analyser,
            "subject": self.subject,
            "numbers": {name: _plain(value) for name, value in self.numbers.items()},
            "tables": {name: records(table) for name, table in self.tables.items()},
            "sentences": list(self.sentences),
            "advice": list(self.advice),
        }

    def save(self, folder: str | Path, figures: Mapping[str, Any] | None = None) -> list[Path]:
        """Write ``report.txt``, ``report.json``, one CSV per table and one PNG per figure; return the paths.

        ``report.json`` names under ``files`` what belongs to it: an earlier report may have left other files in the folder.
        """
        target = Path(folder)
        target.mkdir(parents=True, exist_ok=True)
        tables = {target / f"{name}.csv": table for name, table in self.tables.items()}
        drawn = {target / f"{name}.png": figure for name, figure in (figures or {}).items()}
        (target / "report.txt").write_text(self.text() + "\n", encoding="utf-8")
        content = {**self._plain(), "files": [path.name for path in (*tables, *drawn)]}
        (target / "report.json").write_text(_json_text(content) + "\n", encoding="utf-8")
        for path, table in tables.items():
            table.to_csv(path, index=False)
        for path, figure in drawn.items():
            figure.savefig(path, dpi=150)
        return [target / "report.txt", target / "report.json", *tables, *drawn]


def _json_text(data: Mapping[str, Any]) -> str:
    return json.dumps(data, indent=2, ensure_ascii=False)


def table_text(table: pd.DataFrame) -> str:
    """Return a table as aligned text with five significant digits, gaps left empty."""
    columns = {c: [_cell(value, str(c)) for value in table[c]] for c in table.columns}
    shown = pd.DataFrame(columns)
    widths = {c: max([len(str(c)), *(len(v) for v in shown[c])]) for c in shown.columns}
    left = {c for c in table.columns if not pd.api.types.is_numeric_dtype(table[c])}
    rows = [[str(c) for c in shown.columns], *shown.to_numpy().tolist()]
    lines = []
    for row in rows:
        cells = zip(shown.columns, row, strict=True)
        lines.append("  ".join(v.ljust(widths[c]) if c in left else v.rjust(widths[c]) for c, v in cells).rstrip())
    return "\n".join(lines)


def _cell(value: Any, column: str) -> str:
    if isinstance(value, float):
        if math.isnan(value):
            return ""
        if column in ("p", "P"):
            return "<0.0001" if value < 5e-5 else f"{value:.4f}"
        return f"{value:.5g}"
    return "" if value is None else str(value)


def _title(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _plain(value: Any) -> Any:
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table as dictionaries of plain numbers and text; missing numbers are None."""
    rows = table.to_dict(orient="records")
    return [{str(key): _plain(value) for key, value in row.items()} for row in rows]
