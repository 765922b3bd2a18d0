"""Write a study with other numbers and one effect more, keeping the file's comments and order."""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit
from tomlkit.toml_document import TOMLDocument

from taichidem.effects.base import Effect
from taichidem.errors import InputError
from taichidem.study.comparison_run import writable
from taichidem.study.measurements import FILE as MEASUREMENTS
from taichidem.study.measurements import PHOTOGRAPH, read_measurements
from taichidem.study.parameter_key import SHORT, ParameterKey, all_pairs, pair_name
from taichidem.study.setting_key import SettingKey, unit_of_setting
from taichidem.study.study_file import FILE, Study, read_study
from taichidem.whole_file import write_whole

DIGITS = 6  # of the numbers written


@dataclass(frozen=True)
class AddedParameter:
    """A parameter of the added effect that may be re-calibrated from now on, for one pair or (None) as one number."""

    name: str
    pair: str | None
    low: float
    high: float


def write_study(
    study: Study,
    folder: str | Path,
    values: Mapping[str, float],
    added: Effect,
    free: Sequence[AddedParameter],
    title: str,
) -> Study:
    """Write a study with values changed and an effect added into a new folder, with its measurements, and return it.

    Args:
        study: from which everything else is taken, comments included.
        folder: that must not hold a study yet.
        values: key under [calibrate] → number in that entry's unit.
        added: the effect; one of its family gives way.
        free: what of it may be re-calibrated.
        title: of the new study.

    Raises:
        InputError: a folder that holds a study already or can't be written, or a file that can't be changed faithfully.
    """
    target = Path(folder)
    document = tomlkit.parse(study.file.read_text(encoding="utf-8-sig"))
    document["title"] = title
    for key, value in values.items():
        _set(document, study, key, value)
    _put_in(document, study, added)
    _free(document, added, free)
    save_study(study, target, tomlkit.dumps(document))
    return read_study(target)


def check_new(folder: str | Path) -> Path:
    """Return a folder for a new study, or raise InputError where one stands already or nothing can be written."""
    target = Path(folder)
    if (target / FILE).exists():
        raise InputError(f"{target} holds a study already; nothing is overwritten. Give another folder with -o.")
    there = target.exists()
    writable(target)
    if not there:
        target.rmdir()
    return target


def save_study(study: Study, target: Path, text: str) -> None:
    """Write a study file, and before it the measurements of the study it comes from, into a folder that holds none.

    Where the study file stands, the folder is complete; a call that was killed before may be given again.
    """
    writable(check_new(target))
    _copy_measurements(study, target)
    write_whole(target / FILE, text)


def _copy_measurements(study: Study, target: Path) -> None:
    """Copy the measurements of a study, the photographs that they name, and the file of the grains' form."""
    form = tomlkit.parse(study.file.read_text(encoding="utf-8-sig")).get("particle", {}).get("file")
    if form is not None:
        _copy(study, target, str(form))
    if not (study.path / MEASUREMENTS).exists():
        return
    shutil.copyfile(study.path / MEASUREMENTS, target / MEASUREMENTS)
    measured = read_measurements(study)
    for cell in measured[PHOTOGRAPH] if PHOTOGRAPH in measured else ():
        for name in filter(None, (part.strip() for part in str(cell or "").split(";"))):
            _copy(study, target, name)


def _copy(study: Study, target: Path, name: str) -> None:
    """Copy a file that the study names, where it lies beside it."""
    source, copy = study.path / name, target / name
    shared = copy.exists() and copy.samefile(source)  # "../heap.png" beside both folders
    if not Path(name).is_absolute() and source.is_file() and not shared:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, copy)


def _number(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def _set(document: TOMLDocument, study: Study, key: str, value: float) -> None:
    """Set a calibrated number where the file has it, or where it belongs."""
    entry = next(c for c in study.calibrate if c.key == key)
    number = _number(value)
    if isinstance(entry.names, SettingKey):
        name, setting = entry.names.experiment, entry.names.setting
        unit = unit_of_setting(study.experiment(name), setting)
        document["experiments"][name][setting] = number if unit == "1" else f"{number!r} {unit}"  # type: ignore[index]
        return
    forget(document, study, entry.names)
    if entry.names.pair is None:
        effect_table(document, entry.names.effect)[entry.names.parameter] = number
        return
    section, text = _contact(document, entry.names.pair), _contact_key(study, entry.names)
    section[text] = number


def _contact_key(study: Study, key: ParameterKey) -> str:
    family = next(effect.family for effect in study.model().effects if effect.name == key.effect)
    return key.parameter if SHORT.get(key.parameter) == family else key.name


def _contact(document: TOMLDocument, pair: str) -> Any:
    contacts = document.setdefault("contacts", tomlkit.table())
    name = next((name for name in contacts if pair_name(*name.split("-")) == pair), None)
    if name is None:
        contacts[pair] = tomlkit.table()
    return contacts[name or pair]


def effect_table(document: TOMLDocument, name: str) -> Any:
    """Return the section of an effect, made where there is none."""
    effects = document.setdefault("effects", tomlkit.table(is_super_table=True))
    if name not in effects:
        effects[name] = tomlkit.table()
    return effects[name]


def forget(document: TOMLDocument, study: Study, key: ParameterKey) -> None:
    """Remove every place where the file sets this number; of a number for all pairs, the values of single pairs."""
    texts = {_contact_key(study, key), key.name}
    for pair, section in document.get("contacts", {}).items():
        if key.pair in (None, pair_name(*pair.split("-"))):
            _drop(section, texts)
    held = document.get("effects", {}).get(key.effect, {}).get(key.parameter)
    if held is None or key.pair is None:
        return
    if isinstance(held, Mapping):
        for pair in [p for p in held if pair_name(*p.split("-")) == key.pair]:
            del held[pair]  # type: ignore[attr-defined]
    else:  # one number for all pairs: the others keep it, this one gets its own
        others = tomlkit.inline_table()
        others.update({pair: held for pair in all_pairs(list(study.materials)) if pair != key.pair})
        document["effects"][key.effect][key.parameter] = others  # type: ignore[index]


def _drop(section: Any, texts: set[str], path: str = "") -> None:
    """Remove keys from a table, also those written as dotted keys, which make inner tables."""
    for name in list(section):
        key = f"{path}.{name}" if path else name
        if key in texts:
            del section[name]
        elif isinstance(section[name], Mapping):
            _drop(section[name], texts, key)


def _put_in(document: TOMLDocument, study: Study, added: Effect) -> None:
    """Write the effect's section, and take out those of its family with what is said of them elsewhere."""
    present = {e.name: e for e in study.model().effects}
    for name in [n for n, e in present.items() if added.family and e.family == added.family]:
        _take_out(document, study, present[name], {p.name for p in added.parameters})
    table = effect_table(document, added.name)
    table.comment("added because the measurements ask for it")
    for name, value in {**added.options, **added.values}.items():
        default = next((p.default for p in added.parameters if p.name == name), None)
        if value is None or value == default:
            continue
        if isinstance(value, Mapping):
            inner = tomlkit.inline_table()
            inner.update({pair: _number(number) for pair, number in value.items()})
            table[name] = inner
        else:
            table[name] = _number(value) if isinstance(value, float) else value


def _take_out(document: TOMLDocument, study: Study, effect: Effect, shared: set[str]) -> None:
    """Remove an effect's section, and of contacts and ranges what the effect in its place doesn't know."""
    effects = document.get("effects", {})
    if effect.name in effects:
        del effects[effect.name]
    gone = {f"{effect.name}.{p.name}" for p in effect.parameters}
    gone |= {p.name for p in effect.parameters if SHORT.get(p.name) == effect.family}
    for section in document.get("contacts", {}).values():
        _drop(section, gone)
    for entry in study.calibrate:
        lost = isinstance(entry.names, ParameterKey) and entry.names.effect == effect.name
        if lost and (entry.names.parameter not in shared or effect.name in entry.key):  # type: ignore[union-attr]
            _drop(document["calibrate"], {entry.key})


def _free(document: TOMLDocument, added: Effect, free: Sequence[AddedParameter]) -> None:
    """Let parameters of the added effect be re-calibrated."""
    section = document.setdefault("calibrate", tomlkit.table())
    for parameter in free:
        entry = tomlkit.inline_table()
        entry.update({"low": _number(parameter.low), "high": _number(parameter.high)})
        key = f"{added.name}.{parameter.name}"
        section[key if parameter.pair is None else f"{parameter.pair}.{key}"] = entry
