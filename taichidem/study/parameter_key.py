"""Name a parameter of a model by a text: "granule-granule.restitution", "effect.parameter", "pair.effect.parameter"."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from typing import Any

from taichidem.effects.base import Effect, Parameter
from taichidem.errors import InputError, unknown_name
from taichidem.scene import Model
from taichidem.units import to_si

#: Parameters that may be written without their effect; they mean the model's effect of this family.
SHORT = {"restitution": "normal", "static_friction": "tangential"}

Composition = Mapping[str, type[Effect]]


@dataclass(frozen=True)
class ParameterKey:
    """A parameter of an effect, for one pair of materials or (pair None) for all."""

    effect: str
    parameter: str
    pair: str | None = None

    @property
    def name(self) -> str:
        """Effect and parameter, joined by a dot."""
        return f"{self.effect}.{self.parameter}"

    def overlaps(self, other: object) -> bool:
        """Return True if both name the same number, or one of them all pairs."""
        return (
            isinstance(other, ParameterKey)
            and self.name == other.name
            and (self.pair == other.pair or None in (self.pair, other.pair))
        )


def pair_name(first: str, second: str) -> str:
    """Return the one name that a pair of materials has in either order."""
    return "-".join(sorted((first, second)))


def all_pairs(materials: Collection[str]) -> list[str]:
    """Return the names of all pairs, each once."""
    return [pair_name(a, b) for a, b in combinations_with_replacement(materials, 2)]


def parse_key(text: str, effects: Composition, pairs: Collection[str]) -> ParameterKey:
    """Return what a key names.

    Args:
        text: "pair.short", "effect.parameter" or "pair.effect.parameter".
        effects: those of the model, by name.
        pairs: names of the pairs of materials that may touch.

    Raises:
        InputError: it names nothing.
    """
    head, _, rest = text.partition(".")
    pair = None
    if "-" in head:
        pair = pair_name(*head.split("-")) if head.count("-") == 1 else head
        if pair not in pairs:
            raise unknown_name("pair of materials that touch", head, pairs)
        text = rest
    name, parameter = parse_parameter(text, effects, short=pair is not None)
    if pair and not parameter.per_pair:
        raise InputError(f"{name}.{parameter.name} is one number for the whole model; leave the pair out.")
    return ParameterKey(name, parameter.name, pair)


def parse_parameter(text: str, effects: Composition, short: bool) -> tuple[str, Parameter]:
    """Return effect and parameter that "effect.parameter" or (where `short` holds) a name such as "restitution" means."""
    name, dot, parameter = text.partition(".")
    if not dot:
        name, parameter = _effect_of_short(text, effects, short), text
    if name not in effects:
        raise unknown_name("effect of the model", name, effects)
    declared = {p.name: p for p in effects[name].parameters}
    if parameter not in declared:
        raise unknown_name(f"parameter of {name}", parameter, declared)
    return name, declared[parameter]


def _effect_of_short(text: str, effects: Composition, allowed: bool) -> str:
    if allowed and text in SHORT:
        for name, effect in effects.items():
            if effect.family == SHORT[text]:
                return name
        raise InputError(f"{text} belongs to an effect of family {SHORT[text]!r}, and the model holds none.")
    known = [f"{name}.{p.name}" for name, effect in effects.items() for p in effect.parameters]
    raise unknown_name("parameter", text, [*(SHORT if allowed else ()), *known])


def short_name(effect: str, parameter: str, effects: Composition) -> str:
    """Return how a parameter is written under [contacts]: without its effect where that is clear."""
    return parameter if SHORT.get(parameter) == effects[effect].family else f"{effect}.{parameter}"


def with_values(model: Model, values: Mapping[str, Any]) -> Model:
    """Return a copy of a model with parameters changed.

    Args:
        model: materials and effects; every effect that a key names must be among them.
        values: key → number in the parameter's unit, or a text with a unit. "effect.parameter" changes every pair, a key
            with a pair that pair alone.

    Raises:
        InputError: a key that names nothing, two keys for one number, or a value out of its physical bounds.
    """
    effects = {effect.name: type(effect) for effect in model.effects}
    pairs = all_pairs([material.name for material in model.materials])
    done: dict[ParameterKey, str] = {}
    held = {effect.name: dict(effect.values) for effect in model.effects}
    for text, value in values.items():
        key = parse_key(text, effects, pairs)
        for other, earlier in done.items():
            if key.overlaps(other):
                raise InputError(f"{earlier!r} and {text!r} both set {key.name}. Leave one out.")
        done[key] = text
        unit = next(p.unit for p in effects[key.effect].parameters if p.name == key.parameter)
        number = to_si(value, unit, text)
        now = held[key.effect][key.parameter]
        held[key.effect][key.parameter] = number if key.pair is None else _table(now, pairs) | {key.pair: number}
    changed = {key.effect for key in done}
    return replace(model, effects=[_rebuilt(e, held[e.name]) if e.name in changed else e for e in model.effects])


def value_of(model: Model, key: ParameterKey) -> float:
    """Return the number that a model holds for a key, in the parameter's unit.

    Raises:
        InputError: a key for all pairs whose values differ.
    """
    held = next(effect.values[key.parameter] for effect in model.effects if effect.name == key.effect)
    if not isinstance(held, Mapping):
        return held
    pairs = {pair_name(*pair.split("-")): number for pair, number in held.items()}
    if key.pair is not None:
        return pairs[key.pair]
    if len(set(pairs.values())) > 1:
        raise InputError(
            f"{key.name} is calibrated for all pairs at once, but its values differ: "
            f"{', '.join(f'{pair} {number:g}' for pair, number in pairs.items())}. Calibrate each pair, as 'pair.{key.name}'."
        )
    return next(iter(pairs.values()))


def _table(value: float | Mapping[str, float], pairs: Collection[str]) -> dict[str, float]:
    """Return a value per pair, pairs named in their one way."""
    if not isinstance(value, Mapping):
        return dict.fromkeys(pairs, value)
    return {pair_name(*pair.split("-")): number for pair, number in value.items()}


def _rebuilt(effect: Effect, values: Mapping[str, Any]) -> Effect:
    return type(effect)(**options_of(effect), **values)


def options_of(effect: Effect) -> dict[str, Any]:
    """Return the constructor options of an effect: every attribute but its values."""
    return {name: held for name, held in vars(effect).items() if name != "values"}
