"""The section [calibrate] of a study file: which parameters may move, how far, and what was measured of them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from taichidem.study.parameter_key import Composition, ParameterKey, parse_key
from taichidem.study.problems import Problems


@dataclass(frozen=True)
class Calibration:
    """A parameter that may be re-calibrated.

    Attributes:
        key: as the file writes it.
        names: the effect, parameter and pair it means.
        low, high: range that is believed, in `unit`.
        value, u: what a direct measurement gave, with its standard uncertainty, or None.
        unit: of all these numbers.
    """

    key: str
    names: ParameterKey
    low: float
    high: float
    value: float | None
    u: float | None
    unit: str


def read_calibrations(
    document: Mapping[str, Any], effects: Composition, pairs: Collection[str], problems: Problems
) -> tuple[Calibration, ...]:
    """Return the entries that are in order; what is wrong with the others is noted."""
    found: list[Calibration] = []
    for text, table in _entries(problems.table(document, "calibrate")).items():
        path = f"calibrate.{text}"
        names = None
        with problems.catching(path):
            names = parse_key(text, effects, pairs)
        entry = _read_range(path, table, names, effects, problems)
        if names is None or entry is None:
            continue
        for other in found:
            if names.overlaps(other.names):
                problems.add(path, f"it means the same number as calibrate.{other.key}. Leave one out.")
        found.append(Calibration(text, names, **entry))
    return tuple(found)


def _entries(table: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """Return range tables by key; an unquoted dotted key, which makes inner tables, counts as a quoted one."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{path}.{name}" if path else name
        inner = isinstance(value, Mapping) and value and all(isinstance(part, Mapping) for part in value.values())
        found |= _entries(value, key) if inner else {key: value}
    return found


def _read_range(
    path: str, table: Any, names: ParameterKey | None, effects: Composition, problems: Problems
) -> dict[str, Any] | None:
    if not isinstance(table, Mapping):
        problems.add(path, f"{path} is {table!r}; write a table such as {{ low = 0.2, high = 0.8 }}.")
        return None
    before = len(problems.found)
    problems.refuse_others(table, ("low", "high", "value", "u"), path, "key")
    parameter = None
    if names is not None:
        parameter = next(p for p in effects[names.effect].parameters if p.name == names.parameter)
    numbers: dict[str, float | None] = dict.fromkeys(("low", "high", "value", "u"))
    for part in numbers:
        if part not in table:
            if part in ("low", "high"):
                problems.missing(f"{path}.{part}", "give both ends of the range that is believed.")
        elif parameter is not None:
            numbers[part] = problems.quantity(f"{path}.{part}", table[part], parameter.unit)
            if part != "u" and numbers[part] is not None:
                with problems.catching(f"{path}.{part}"):
                    parameter.check(names.effect, "", numbers[part])  # type: ignore[union-attr, arg-type]
    _check_range(path, table, numbers, problems)
    if len(problems.found) > before or parameter is None:
        return None
    return numbers | {"unit": parameter.unit}


def _check_range(path: str, table: Mapping[str, Any], numbers: Mapping[str, float | None], problems: Problems) -> None:
    low, high, u = numbers["low"], numbers["high"], numbers["u"]
    if low is not None and high is not None and low >= high:
        problems.add(f"{path}.low", f"{path}.low is {table['low']!r}, not below high = {table['high']!r}.")
    if "value" in table and "u" not in table:
        problems.missing(f"{path}.u", "a measured value needs its standard uncertainty; give u, or leave value out.")
    if "u" in table and "value" not in table:
        problems.missing(f"{path}.value", "u belongs to a measured value; give value, or leave u out.")
    if u is not None and u <= 0:
        problems.add(f"{path}.u", f"{path}.u is {table['u']!r}; a standard uncertainty is above 0.")
