"""The section [calibrate] of a study file: which parameters may move, how far, and what was measured of them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from taichidem.errors import InputError
from taichidem.scene import Model
from taichidem.study.parameter_key import Composition
from taichidem.study.problems import Problems
from taichidem.study.setting_key import Experiments, Key, SettingKey, parse_any_key, unit_of_setting, with_settings


@dataclass(frozen=True)
class Calibration:
    """A number that may be re-calibrated: a parameter of an effect, or a setting of one experiment.

    Attributes:
        key: as the file writes it.
        names: what it means: a ParameterKey (effect, parameter and pair) or a SettingKey (experiment and setting).
        low, high: range that is believed, in `unit`.
        value, u: what a direct measurement gave, with its standard uncertainty, or None.
        unit: of all these numbers.
    """

    key: str
    names: Key
    low: float
    high: float
    value: float | None
    u: float | None
    unit: str

    @property
    def is_setting(self) -> bool:
        """Whether it is a setting of one experiment, which changes that experiment and not the model."""
        return isinstance(self.names, SettingKey)


@dataclass(frozen=True)
class _Target:
    """What a key means, in which unit it is given, and what refuses a number that is out of its bounds."""

    names: Key
    unit: str
    check: Callable[[float], object]


def read_calibrations(
    document: Mapping[str, Any],
    effects: Composition,
    pairs: Collection[str],
    experiments: Experiments,
    problems: Problems,
) -> tuple[Calibration, ...]:
    """Return the entries that are in order; what is wrong with the others is noted.

    Args:
        document: the study file.
        effects, pairs: of the model.
        experiments: those of the study that are in order.
        problems: where to note.
    """
    faulty = set(problems.table(document, "experiments")) - set(experiments)
    found: list[Calibration] = []
    for text, table in _entries(problems.table(document, "calibrate")).items():
        path = f"calibrate.{text}"
        target = None
        try:
            target = _target(text, effects, pairs, experiments)
        except InputError as error:
            if text.rpartition(".")[0] not in faulty:  # what is wrong with that experiment is noted already
                problems.add(path, str(error))
        entry = _read_range(path, table, target, problems)
        if target is None or entry is None:
            continue
        for other in found:
            if target.names.overlaps(other.names):
                problems.add(path, f"it means the same number as calibrate.{other.key}. Leave one out.")
        found.append(Calibration(text, target.names, **entry))
    return tuple(found)


def _target(text: str, effects: Composition, pairs: Collection[str], experiments: Experiments) -> _Target:
    names = parse_any_key(text, effects, pairs, experiments)
    if isinstance(names, SettingKey):
        experiment, setting = experiments[names.experiment], names.setting
        unit = unit_of_setting(experiment, setting)
        return _Target(names, unit, lambda number: with_settings(experiment, {setting: number}))
    parameter = next(p for p in effects[names.effect].parameters if p.name == names.parameter)
    return _Target(names, parameter.unit, lambda number: parameter.check(names.effect, "", number))


def check_ends(
    calibrations: Collection[Calibration], experiments: Experiments, model: Model, problems: Problems
) -> None:
    """Note what an experiment finds wrong with its own apparatus at either end of the range of a setting."""
    for entry in calibrations:
        if isinstance(entry.names, SettingKey):
            experiment = experiments[entry.names.experiment]
            for part in ("low", "high"):
                with problems.catching(f"calibrate.{entry.key}.{part}"):
                    with_settings(experiment, {entry.names.setting: getattr(entry, part)}).scene(model)


def _entries(table: Mapping[str, Any], path: str = "") -> dict[str, Any]:
    """Return range tables by key; an unquoted dotted key, which makes inner tables, counts as a quoted one."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        key = f"{path}.{name}" if path else name
        inner = isinstance(value, Mapping) and value and all(isinstance(part, Mapping) for part in value.values())
        found |= _entries(value, key) if inner else {key: value}
    return found


def _read_range(path: str, table: Any, target: _Target | None, problems: Problems) -> dict[str, Any] | None:
    if not isinstance(table, Mapping):
        problems.add(path, f"{path} is {table!r}; write a table such as {{ low = 0.2, high = 0.8 }}.")
        return None
    before = len(problems.found)
    problems.refuse_others(table, ("low", "high", "value", "u"), path, "key")
    numbers: dict[str, float | None] = dict.fromkeys(("low", "high", "value", "u"))
    for part in numbers:
        if part not in table:
            if part in ("low", "high"):
                problems.missing(f"{path}.{part}", "give both ends of the range that is believed.")
        elif target is not None:
            numbers[part] = problems.quantity(f"{path}.{part}", table[part], target.unit)
            if part != "u" and numbers[part] is not None:
                with problems.catching(f"{path}.{part}"):
                    target.check(numbers[part])  # type: ignore[arg-type]
    _check_range(path, table, numbers, problems)
    if len(problems.found) > before or target is None:
        return None
    return numbers | {"unit": target.unit}


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
