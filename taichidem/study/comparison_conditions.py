"""Under which conditions each measurement was made: settings that differ between tests, and how a row is called."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from taichidem.experiments.base import Experiment, Observable
from taichidem.study.measurements import COLUMNS, PHOTOGRAPH
from taichidem.study.study_file import Study


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rows of a table by the names of their columns."""
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def observable_of(study: Study, experiment: str, name: str) -> Observable:
    """Return the declaration of an observable that a row of measurements names."""
    return next(o for o in study.experiment(experiment).observables if o.name == name)


def quantity_name(observable: Observable) -> str:
    """Return what is measured, whatever the condition: height for height_at_1_s."""
    return observable.series or observable.name


def condition_columns(study: Study, measurements: pd.DataFrame) -> pd.DataFrame:
    """Return the settings that differ among the measured tests of a type, a column "name [unit]" each, a row per measurement.

    Settings that tell how long one waits or looks (in s, named …_time) are no conditions: two hoppers of different outlets
    discharge at different rates, however long each was observed. Several times of one test are, each for its own row.
    """
    rows = []
    for row in records(measurements):
        experiment = study.experiment(row["experiment"])
        rows.append(_conditions(experiment, observable_of(study, row["experiment"], row["observable"])))
    types = [study.experiments[name].type for name in measurements["experiment"]]
    names = [name for name in dict.fromkeys(n for row in rows for n in row) if _differs(name, rows, types)]
    return pd.DataFrame([{name: row.get(name) for name in names} for row in rows], columns=names)


def _conditions(experiment: Experiment, observable: Observable) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, field in type(experiment.settings).model_fields.items():
        extra = field.json_schema_extra
        unit = str(extra.get("unit", "1")) if isinstance(extra, Mapping) else "1"
        if unit == "s" and name.endswith("_time"):
            continue
        own = observable.at is not None and observable.at[0] == name
        value = observable.at[1] if own else getattr(experiment.settings, name)  # type: ignore[index]
        found[f"{name} [{unit}]"] = _plain(value)
    return found


def _plain(value: Any) -> Any:
    """Return a number as such, one in a list too; anything else as a text that can be told from others."""
    if isinstance(value, (list, tuple)) and len(value) == 1:
        value = value[0]
    if value is None or (isinstance(value, (int, float)) and not isinstance(value, bool)):
        return value
    return repr(value)


def _differs(name: str, rows: Sequence[Mapping[str, Any]], types: Sequence[str]) -> bool:
    return any(
        len({row[name] for row, kind in zip(rows, types, strict=True) if kind == one and name in row}) > 1
        for one in set(types)
    )


def condition_texts(study: Study, measurements: pd.DataFrame) -> list[str]:
    """Return for each measurement what tells it from others of its test and quantity, such as "time = 1 s, drop = 2"."""
    parts = _parts(study, measurements)
    return [", ".join(f"{name} = {value}" for name, value in (*own, *others)) for own, others in parts]


def labels(study: Study, measurements: pd.DataFrame) -> list[str]:
    """Return a short name for each measurement, different ones for all: "heap", "fall at 1 s", "fall at 1 s (drop 2)"."""
    quantities = _quantities(study, measurements)
    several = {name for name, count in Counter(name for name, _ in set(quantities)).items() if count > 1}
    found = []
    for (name, quantity), (own, others) in zip(quantities, _parts(study, measurements), strict=True):
        text = (f"{name} {quantity}" if name in several else name) + "".join(f" at {value}" for _, value in own)
        found.append(text + (f" ({', '.join(' '.join(part) for part in others)})" if others else ""))
    return _unique(found)


def _quantities(study: Study, measurements: pd.DataFrame) -> list[tuple[str, str]]:
    pairs = zip(measurements["experiment"], measurements["observable"], strict=True)
    return [(name, quantity_name(observable_of(study, name, observable))) for name, observable in pairs]


Parts = list[tuple[str, str]]


def _parts(study: Study, measurements: pd.DataFrame) -> list[tuple[Parts, Parts]]:
    """Return for each row the conditions, name and text, that differ within its test and quantity: its own, and others."""
    quantities = _quantities(study, measurements)
    further = [str(c) for c in measurements if c not in (*COLUMNS, PHOTOGRAPH)]
    rows = records(measurements)
    found = []
    for row, mine in zip(rows, quantities, strict=True):
        alike = [other for other, theirs in zip(rows, quantities, strict=True) if theirs == mine]
        observable = observable_of(study, row["experiment"], row["observable"])
        own, told = [], ""
        if observable.at is not None:
            told = observable.at[0]
            if len({other["observable"] for other in alike}) > 1:
                own = [(told, f"{observable.at[1]:g} {_unit(study, row['experiment'], observable)}")]
        others = [(c, row[c]) for c in further if c != told and row[c] and len({other[c] for other in alike}) > 1]
        found.append((own, others))
    return found


def _unit(study: Study, experiment: str, observable: Observable) -> str:
    fields = type(study.experiment(experiment).settings).model_fields
    extra = fields[observable.at[0]].json_schema_extra  # type: ignore[index]
    return str(extra.get("unit", "")) if isinstance(extra, Mapping) else ""


def _unique(texts: Sequence[str]) -> list[str]:
    """Return the texts, those that stand for several rows numbered."""
    total: Counter[str] = Counter(texts)
    seen: Counter[str] = Counter()
    found = []
    for text in texts:
        seen[text] += 1
        found.append(f"{text} #{seen[text]}" if total[text] > 1 else text)
    return found
