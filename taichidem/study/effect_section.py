"""The sections [effects] and [contacts] of a study file: which effects act, and with which values."""

from __future__ import annotations

import inspect
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from taichidem import plugins
from taichidem.effects.base import ContactEffect, Effect, Parameter
from taichidem.errors import InputError
from taichidem.materials import MaterialPair
from taichidem.study.parameter_key import Composition, pair_name, parse_parameter, short_name
from taichidem.study.problems import Problems

#: Effects of every model, unless [effects] names another of their family.
ALWAYS = ("normal_hertz", "tangential_mindlin", "body_gravity")

REFUSED = 0.0  # stands for a number that was refused, so that it isn't missing; nobody computes with a faulty file

Values = dict[str, "float | dict[str, float]"]


@dataclass
class Given:
    """What a file says of one effect: constructor options, and values in SI, per pair where given so.

    `faulty` holds parameter and pair of every value that was refused, so that it doesn't count as missing.
    """

    options: dict[str, Any] = field(default_factory=dict)
    values: Values = field(default_factory=dict)
    faulty: set[tuple[str, str]] = field(default_factory=set)


def read_composition(document: Mapping[str, Any], problems: Problems) -> dict[str, type[Effect]]:
    """Return the effects of the model by name: the usual ones, those of [effects], one per family."""
    named: dict[str, type[Effect]] = {}
    for name in problems.table(document, "effects"):
        with problems.catching(f"effects.{name}"):
            named[name] = plugins.get("effect", name)
    families: dict[str, str] = {}
    for name, effect in named.items():
        family = effect.family or name
        if family in families:
            problems.add(
                f"effects.{name}",
                f"it is of family {family!r} like effects.{families[family]}; a model holds one. Leave one out.",
            )
        families[family] = name
    usual = {name: plugins.get("effect", name) for name in ALWAYS}
    return {n: e for n, e in usual.items() if n in named or (e.family or n) not in families} | named


def read_given(
    document: Mapping[str, Any], effects: Composition, materials: Collection[str], problems: Problems
) -> dict[str, Given]:
    """Return what [effects] and [contacts] say of each effect of the model."""
    given = {name: Given() for name in effects}
    tables = problems.table(document, "effects")
    for name in tables:
        if name in effects:
            table = problems.table(tables, name, f"effects.{name}")
            _read_effect(f"effects.{name}", table, effects[name], given[name], materials, problems)
    _read_contacts(document, effects, given, materials, problems)
    return given


def _read_effect(
    path: str,
    table: Mapping[str, Any],
    effect: type[Effect],
    given: Given,
    materials: Collection[str],
    problems: Problems,
) -> None:
    parameters = {p.name: p for p in effect.parameters}
    options = constructor_options(effect)
    problems.refuse_others(table, [*parameters, *options], path, f"parameter or option of {effect.name}")
    for name, value in table.items():
        key = f"{path}.{name}"
        if name in parameters and isinstance(value, Mapping):
            if not parameters[name].per_pair:
                problems.add(key, f"{key} is one number for the whole model; a table was given.")
                given.values[name] = REFUSED
                continue
            for pair, number in value.items():
                _set(given, effect.name, parameters[name], f"{key}.{pair}", pair, number, materials, problems)
        elif name in parameters:
            number = _checked(effect.name, parameters[name], key, value, problems)
            given.values[name] = REFUSED if number is None else number
        elif name in options:
            _read_option(key, options[name], value, given, name, problems)


def _read_option(key: str, default: Any, value: Any, given: Given, name: str, problems: Problems) -> None:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    fits = number if isinstance(default, float) else isinstance(value, type(default))
    if default is not inspect.Parameter.empty and default is not None and not fits:
        problems.add(key, f"{key} is {value!r}; give a {type(default).__name__} such as {default!r}.")
    else:
        given.options[name] = value


def constructor_options(effect: type[Effect]) -> dict[str, Any]:
    """Return the options of an effect's constructor with their defaults."""
    parameters = inspect.signature(effect.__init__).parameters.values()
    declared = {p.name for p in effect.parameters}
    variadic = (inspect.Parameter.VAR_KEYWORD, inspect.Parameter.VAR_POSITIONAL)
    return {
        p.name: p.default for p in parameters if p.name != "self" and p.kind not in variadic and p.name not in declared
    }


def _checked(effect: str, parameter: Parameter, key: str, value: object, problems: Problems) -> float | None:
    number = problems.quantity(key, value, parameter.unit)
    if number is not None:
        with problems.catching(key):
            return parameter.check(effect, "", number)
    return None


def _set(
    given: Given,
    effect: str,
    parameter: Parameter,
    key: str,
    pair: str,
    value: object,
    materials: Collection[str],
    problems: Problems,
) -> None:
    """Take the value of one pair, if the pair exists and has none yet."""
    name = parameter.name
    number = _checked(effect, parameter, key, value, problems)
    if not known_pair(pair, key, materials, problems):
        return
    pair = pair_name(*pair.split("-"))
    held = given.values.setdefault(name, {})
    if not isinstance(held, dict) or pair in held:
        problems.add(key, f"{key} is given twice: {effect}.{name} has a value for this pair already. Leave one out.")
    elif number is None:
        given.faulty.add((name, pair))
    else:
        held[pair] = number


def known_pair(pair: str, key: str, materials: Collection[str], problems: Problems) -> bool:
    """Return whether a text names two materials of the study; note why not."""
    parts = pair.split("-")
    if len(parts) != 2:
        problems.add(key, f"{pair!r} is no pair of materials; write two of {', '.join(materials)} joined by '-'.")
        return False
    strangers = [part for part in parts if part not in materials]
    for part in strangers:
        problems.unknown(key, f"material in {pair!r}:", part, materials)
    return not strangers


def _read_contacts(
    document: Mapping[str, Any],
    effects: Composition,
    given: dict[str, Given],
    materials: Collection[str],
    problems: Problems,
) -> None:
    contacts = problems.table(document, "contacts")
    announced = problems.table(document, "effects")
    for pair in contacts:
        if not known_pair(pair, f"contacts.{pair}", materials, problems):
            continue
        for text, value in flat(problems.table(contacts, pair, f"contacts.{pair}")).items():
            key = f"contacts.{pair}.{text}"
            name = text.partition(".")[0]
            if name in announced and name not in effects:
                continue  # an unknown effect, which is noted where it is announced
            try:
                name, parameter = parse_parameter(text, effects, short=True)
                if not parameter.per_pair:
                    raise InputError(f"it is one number for the whole model; write it under [effects.{name}].")
            except InputError as error:
                known = name in plugins.names("effect")
                hint = f" Add [effects.{name}] to put it into the model." if known and name not in effects else ""
                problems.add(key, f"{error}{hint}")
                continue
            _set(given[name], name, parameter, key, pair, value, materials, problems)


def flat(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table with the keys of inner tables joined by dots (an unquoted dotted key makes an inner table)."""
    found: dict[str, Any] = {}
    for name, value in table.items():
        inner = isinstance(value, Mapping)
        found |= {f"{name}.{k}": v for k, v in flat(value).items()} if inner else {name: value}
    return found


def complete(given: dict[str, Given], effects: Composition, pairs: Collection[str], problems: Problems) -> None:
    """Note every value that a needed pair lacks; where a parameter has a default, pairs left out of its table get it."""
    for name, effect in effects.items():
        for parameter in effect.parameters:
            held = given[name].values.get(parameter.name, {} if parameter.per_pair else parameter.default)
            if isinstance(held, float):
                continue
            if held is None:
                problems.missing(f"effects.{name}.{parameter.name}", _what(parameter))
                continue
            assert isinstance(held, dict)
            lacking = [pair for pair in pairs if pair not in held and (parameter.name, pair) not in given[name].faulty]
            if parameter.default is not None:
                if held:
                    held |= dict.fromkeys(lacking, parameter.default)
                continue
            for pair in lacking:
                problems.missing(
                    f"contacts.{pair}.{short_name(name, parameter.name, effects)}",
                    f"{_what(parameter)} Write it under [contacts.{pair}], or under [effects.{name}] for all pairs.",
                )


def _what(parameter: Parameter) -> str:
    low, high = parameter.plausible
    return f"give a number in {parameter.unit}. {parameter.meaning} Plausible: {low:g} to {high:g}."


def build_effects(given: Mapping[str, Given], effects: Composition, problems: Problems) -> list[Effect]:
    """Return the effects; one that its own constructor refuses is noted."""
    built = []
    for name, effect in effects.items():
        with problems.catching(f"effects.{name}"):
            built.append(effect(**given[name].options, **given[name].values))
    return built


def check_pairs(effects: Collection[Effect], pairs: Collection[MaterialPair], problems: Problems) -> None:
    """Note what an effect finds wrong with the values of a pair beyond their bounds."""
    for effect in effects:
        if isinstance(effect, ContactEffect):
            for pair in pairs:
                with problems.catching(f"contacts.{pair_name(pair.first.name, pair.second.name)}"):
                    effect.kernel_coefficients(pair)
