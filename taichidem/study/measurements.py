"""Read measurements.csv: what was measured on each test of a study, with its standard uncertainty."""

from __future__ import annotations

import math
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
    table = _load(file)
    problems = Problems(str(file))
    for column in COLUMNS:
        if column not in table.columns:
            problems.missing(f"column {column}", f"the table needs the columns {', '.join(COLUMNS)}.")
    problems.raise_if_any()
    rows = [_read_row(study, f"line {line}", row, problems) for line, row in _lines(table)]
    _note_repeats(table, problems)
    if not rows:
        problems.add("rows", "the table holds no measurement.")
    problems.raise_if_any()
    return pd.DataFrame(rows)


def _load(file: Path) -> pd.DataFrame:
    try:
        table = pd.read_csv(
            file,
            dtype=str,
            keep_default_na=False,
            skip_blank_lines=False,  # so that lines keep their numbers
            skipinitialspace=True,
            encoding="utf-8-sig",
        )
    except FileNotFoundError:
        columns = ",".join(COLUMNS)
        raise InputError(
            f"There is no {file}. Write a table with the columns {columns}, a row per measurement."
        ) from None
    except OSError as error:
        raise InputError(f"{file} can't be read ({error.strerror}).") from error
    except (ValueError, pd.errors.ParserError, pd.errors.EmptyDataError) as error:
        raise InputError(f"{file} is no table of comma-separated values in UTF-8: {error}") from error
    table.columns = table.columns.str.strip()
    table = table.fillna("").apply(lambda column: column.str.strip())
    return table[(table != "").any(axis=1)]


def _lines(table: pd.DataFrame) -> list[tuple[int, dict[str, str]]]:
    """Return every row with its line in the file, of which the first holds the names of the columns."""
    rows: list[Any] = table.to_dict("records")
    return [(int(number) + 2, row) for number, row in zip(table.index, rows, strict=True)]


def _read_row(study: Study, line: str, row: dict[str, str], problems: Problems) -> dict[str, Any]:
    observable = _observable(study, line, row, problems)
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
        name = experiment.observable_at(row["observable"], {k: v for k, v in row.items() if k not in COLUMNS})
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


def _note_repeats(table: pd.DataFrame, problems: Problems) -> None:
    """Note rows that measure the same: same experiment, observable and condition (every further column)."""
    same = [column for column in table.columns if column not in ("value", "u", "unit", "n")]
    first: dict[tuple, int] = {}
    for line, row in _lines(table):
        what = tuple(row[column] for column in same)
        if what in first:
            problems.add(
                f"line {line}",
                f"line {line}: {row['experiment']}, {row['observable']} stands in line {first[what]} already. Join them into "
                "one value with its u, or tell them apart by a further column.",
            )
        first.setdefault(what, line)
