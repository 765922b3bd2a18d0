"""Read measurements.csv: what was measured on each test of a study, with its standard uncertainty."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pandas as pd

from taichidem.errors import InputError, unknown_name
from taichidem.experiments.base import Observable
from taichidem.study.problems import Problems
from taichidem.study.study_file import Study
from taichidem.units import to_si

FILE = "measurements.csv"
COLUMNS = ("experiment", "observable", "value", "u", "unit", "n")
PHOTOGRAPH = "photograph"  # pictures of what was measured, a file or several with ";" between: no condition of it
WAITING = ("value", "u", "n")  # empty in a row that waits to be filled in


def measurements_file(study: Study) -> Path:
    """Return where a study's measurements stand."""
    return study.path / FILE


def read_measurements(study: Study, path: str | Path | None = None) -> pd.DataFrame:
    """Read and check the measurements of a study.

    Args:
        study: whose experiments the rows name.
        path: of the table; by default measurements.csv in the study's folder.

    Returns:
        One row per measurement: experiment, observable, value, u, unit, n, and every further column as text. Values are
        converted to the unit in which the experiment gives the observable; a height at a time gets the name under which the
        experiment gives it, such as height_at_1_s.

    Raises:
        FileError: (an InputError) everything that is wrong, each with the line of the file.
        InputError: no such file, or it can't be read as a table.
    """
    file = measurements_file(study) if path is None else Path(path)
    (_, header), *lines = _load(file)
    problems = Problems(str(file))
    _check_header(header, problems)
    problems.raise_if_any()
    table = [(line, _named(header, cells)) for line, cells in lines if _fits(line, header, cells, problems)]
    rows = [_read_row(study, f"line {line}", row, problems) for line, row in table]
    _note_repeats(table, problems)
    if not lines:
        problems.add("rows", "the table holds no measurement.")
    problems.raise_if_any()
    return pd.DataFrame(rows)


def _load(file: Path) -> list[tuple[int, list[str]]]:
    """Return the cells of every line that holds any, with the line's number; the first is the header."""
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            lines = list(_numbered(csv.reader(stream, skipinitialspace=True, strict=True)))
    except FileNotFoundError:
        columns = ",".join(COLUMNS)
        raise InputError(
            f"There is no {file}. Write a table with the columns {columns}, a row per measurement."
        ) from None
    except OSError as error:
        raise InputError(f"{file} can't be read ({error.strerror}).") from error
    except (ValueError, csv.Error) as error:
        raise InputError(f"{file} is no table of comma-separated values in UTF-8: {error}") from error
    if not lines:
        raise InputError(f"{file} is no table, it is empty. Write a row with the columns {', '.join(COLUMNS)} first.")
    return lines


def _numbered(reader: Any) -> Iterator[tuple[int, list[str]]]:
    before = 0  # a quoted cell may hold line breaks: a row begins where the last one ended
    for row in reader:
        cells = [cell.strip() for cell in row]
        while cells and not cells[-1]:  # commas at the end of a line, as spreadsheets write them
            cells.pop()
        if cells:
            yield before + 1, cells
        before = reader.line_num


def _check_header(header: list[str], problems: Problems) -> None:
    for sign, name in ((";", "';'"), ("\t", "a tab")):
        if len(header) == 1 and sign in header[0]:
            problems.add(
                "separator", f"the cells are separated by {name}; separate them by ',' and write decimals with '.'."
            )
            return
    for column in COLUMNS:
        if column not in header:
            problems.missing(f"column {column}", f"the table needs the columns {', '.join(COLUMNS)}.")
    for name in dict.fromkeys(header):
        if not name:
            problems.add("line 1", f"line 1: column {header.index(name) + 1} has no name; give it one or remove it.")
        elif header.count(name) > 1:
            problems.add(f"column {name}", f"column {name} stands {header.count(name)} times in line 1; keep one.")


def _fits(line: int, header: list[str], cells: list[str], problems: Problems) -> bool:
    """Return whether every cell of a line has a column; note it if not."""
    if len(cells) > len(header):
        problems.add(
            f"line {line}",
            f"line {line}: it has {len(cells)} cells, but line 1 names {len(header)} columns. Write decimals with '.', put a "
            "text that holds ',' between quotation marks.",
        )
    return len(cells) <= len(header)


def _named(header: list[str], cells: list[str]) -> dict[str, str]:
    """Return the cells of a line by the names of their columns; those left out at its end are empty."""
    return dict(zip_longest(header, cells, fillvalue=""))


def is_not_filled_in(study: Study) -> bool:
    """Return whether a study's table still waits for every one of its measurements, as `init_study` writes it."""
    (_, header), *lines = _load(measurements_file(study))
    return bool(lines) and all(_waits(_named(header, cells)) for _, cells in lines)


def _waits(row: dict[str, str]) -> bool:
    return not any(row.get(name) for name in WAITING)


def _read_row(study: Study, line: str, row: dict[str, str], problems: Problems) -> dict[str, Any]:
    observable = _observable(study, line, row, problems)
    if _waits(row):
        problems.add(
            line,
            f"{line}: {row['experiment']}, {row['observable']} is not filled in; write value, its standard uncertainty u and the "
            "number n of repeats, or remove the line.",
        )
        return row
    number = {name: _number(line, name, row[name], problems) for name in ("value", "u", "n")}
    u, n = number["u"], number["n"]
    if u is not None and u <= 0:
        problems.add(line, f"{line}: u is {row['u']}; a standard uncertainty is above 0.")
    if n is not None and (n < 1 or n != int(n)):
        problems.add(line, f"{line}: n is {row['n']}; give the whole number of repeats, from 1.")
    if observable is None:
        return row
    with problems.catching(line):
        factor = _factor(row["unit"], observable, line)
        if None not in number.values():
            converted = {"value": number["value"] * factor, "u": u * factor, "unit": observable.unit, "n": int(n)}  # type: ignore[operator, arg-type]
            return row | {"observable": observable.name} | converted
    return row


def _observable(study: Study, line: str, row: dict[str, str], problems: Problems) -> Observable | None:
    if row["experiment"] not in study.experiments:
        error = unknown_name(f"experiment of {study.file.name}", row["experiment"], study.experiments)
        problems.add(line, f"{line}: {error}")
        return None
    experiment = study.experiment(row["experiment"])
    made = {o.name: o for o in experiment.observables}
    try:
        name = experiment.observable_at(
            row["observable"], {k: v for k, v in row.items() if k not in (*COLUMNS, PHOTOGRAPH)}
        )
        if name not in made:
            raise unknown_name(f"observable of {row['experiment']} ({experiment.name})", name, made)
    except InputError as error:
        problems.add(line, f"{line}: {error}")
        return None
    return made[name]


def _number(line: str, name: str, text: str, problems: Problems) -> float | None:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        problems.add(line, f"{line}: {name} is {text!r}; give a finite number.")
        return None
    return number


def _factor(unit: str, observable: Observable, line: str) -> float:
    """Return by what a number in `unit` is multiplied to be in the observable's."""
    if not unit:
        raise InputError(f"{line}: unit is empty; {observable.name} is measured in {observable.unit}.")
    if unit == observable.unit:
        return 1.0
    if not any(sign.isalpha() or sign in "%°" for sign in unit):  # "1" for an angle would be taken for radians
        raise InputError(f"{line}: unit is {unit!r}; {observable.name} is measured in {observable.unit}.")
    return to_si(f"1 {unit}", observable.unit, f"{line}: unit of {observable.name}")


def _note_repeats(table: list[tuple[int, dict[str, str]]], problems: Problems) -> None:
    """Note rows that measure the same: same experiment, observable and condition (every further column but the photograph)."""
    first: dict[tuple, int] = {}
    for line, row in table:
        what = tuple(text for column, text in row.items() if column not in ("value", "u", "unit", "n", PHOTOGRAPH))
        if what in first:
            problems.add(
                f"line {line}",
                f"line {line}: {row['experiment']}, {row['observable']} stands in line {first[what]} already. Join them into "
                "one value with its u, or tell them apart by a further column.",
            )
        first.setdefault(what, line)
