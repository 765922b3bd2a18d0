"""Write a study whose grains stand in for smaller ones, keeping the file's comments and order."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.toml_document import TOMLDocument

from taichidem.coarse_graining import CoarseGraining, setting_powers
from taichidem.errors import InputError
from taichidem.study.calibrate_section import Calibration
from taichidem.study.parameter_key import ParameterKey
from taichidem.study.setting_key import SettingKey, unit_of_setting
from taichidem.study.study_file import Study, read_study
from taichidem.study.study_writer import check_new, effect_table, forget, save_study

DIGITS = 12  # of the numbers written
PARTS = ("low", "high", "value", "u")


def write_coarse_grained(study: Study, factor: float, folder: str | Path) -> Study:
    """Write a study with grains `factor` times as large into a new folder, with its measurements, and return it.

    Particle, tests, effects and ranges under [calibrate] follow their rules; measurements are copied as they are, since they
    are of the real grains.

    Raises:
        InputError: a factor below 1, an effect or test without rules, an apparatus too small for the grains, or a folder that
            holds a study already or can't be written.
    """
    graining = CoarseGraining(factor)
    model = graining.model(study.model())
    for test in (study.experiment(name) for name in study.experiments):
        coarse = graining.experiment(test)
        try:
            coarse.scene(model)
        except InputError as error:
            raise graining.refusal(test, error) from error
    target = check_new(folder)
    document = tomlkit.parse(study.file.read_text(encoding="utf-8-sig"))
    document["title"] = f"{study.title}, grains × {factor:g}"
    document["particle"]["diameter"] = f"{_number(1e3 * study.particle.diameter * factor)!r} mm"  # type: ignore[index]
    for name in study.experiments:
        _settings(document, study, graining, name)
    _parameters(document, study, graining)
    for entry in study.calibrate:
        _range(document, entry, factor ** _power(study, entry))
    save_study(study, target, tomlkit.dumps(document))
    return read_study(target)


def _number(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _settings(document: TOMLDocument, study: Study, graining: CoarseGraining, name: str) -> None:
    """Set what a test has fewer or larger of, also where the file left it at its default."""
    given, test = study.experiments[name].settings, study.experiment(name)
    coarse = graining.experiment(test).settings
    for setting in setting_powers(test):
        value = getattr(coarse, setting)
        if value is None or (setting == "diameter" and setting not in given):
            continue  # not given, or that of [particle]
        unit = unit_of_setting(test, setting)
        as_text = unit != "1" and not isinstance(given.get(setting), (int, float))
        document["experiments"][name][setting] = _written(value, unit if as_text else "1")  # type: ignore[index]


def _written(value: Any, unit: str) -> Any:
    if isinstance(value, tuple):
        return [_written(part, unit) for part in value]
    if isinstance(value, int):
        return value
    return _number(value) if unit == "1" else f"{_number(value)!r} {unit}"


def _parameters(document: TOMLDocument, study: Study, graining: CoarseGraining) -> None:
    """Set the parameters that have a rule; each then stands under its effect alone, not under [contacts]."""
    for effect in graining.model(study.model()).effects:
        for p in effect.parameters:
            if not p.coarse_graining:
                continue
            forget(document, study, ParameterKey(effect.name, p.name, None))
            held = effect.values[p.name]
            if isinstance(held, Mapping):
                value: Any = tomlkit.inline_table()
                value.update({pair: _number(number) for pair, number in held.items()})
            else:
                value = _number(held)
            effect_table(document, effect.name)[p.name] = value


def _power(study: Study, entry: Calibration) -> float:
    if isinstance(entry.names, SettingKey):
        return setting_powers(study.experiment(entry.names.experiment)).get(entry.names.setting, 0.0)
    effect = next(e for e in study.model().effects if e.name == entry.names.effect)
    return next(p.coarse_graining for p in effect.parameters if p.name == entry.names.parameter)


def _range(document: TOMLDocument, entry: Calibration, scale: float) -> None:
    if scale == 1:
        return
    table = _find(document["calibrate"], entry.key)
    for part in PARTS:
        if part in table:
            table[part] = _number(getattr(entry, part) * scale)


def _find(section: Any, key: str) -> Any:
    """Return the table of an entry, also of one written as an unquoted dotted key, which makes inner tables."""
    if key in section:
        return section[key]
    for name in section:
        if key.startswith(f"{name}."):
            return _find(section[name], key.removeprefix(f"{name}."))
    raise KeyError(key)
