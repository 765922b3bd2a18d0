"""Name a numeric setting of one experiment by a text "EXPERIMENT.setting", and tell it from a parameter of an effect."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Any, Union, get_args, get_origin

from taichidem.errors import InputError, nearest, unknown_name
from taichidem.experiments.base import Experiment
from taichidem.study.parameter_key import Composition, ParameterKey, parse_key

Experiments = Mapping[str, Experiment]


@dataclass(frozen=True)
class SettingKey:
    """A numeric setting of one experiment of a study."""

    experiment: str
    setting: str

    @property
    def name(self) -> str:
        """Experiment and setting, joined by a dot."""
        return f"{self.experiment}.{self.setting}"

    def overlaps(self, other: SettingKey | ParameterKey) -> bool:
        """Return True if both name the same number."""
        return self == other


Key = SettingKey | ParameterKey


def parse_any_key(text: str, effects: Composition, pairs: Collection[str], experiments: Experiments) -> Key:
    """Return what a key names, a parameter of an effect (see `parse_key`) or a setting of an experiment.

    Where an experiment and an effect (or a pair of materials) have one name, the part after the dot decides.

    Raises:
        InputError: it names nothing, both at once, or a setting that is no number to move.
    """
    parameter = _or_error(parse_key, text, effects, pairs)
    setting = _or_error(parse_setting, text, experiments)
    if isinstance(parameter, ParameterKey) and isinstance(setting, SettingKey):
        raise InputError(
            f"{text!r} is a parameter of {parameter.effect} and a setting of the experiment {setting.experiment!r}. "
            "Give the experiment another name."
        )
    if isinstance(parameter, ParameterKey):
        return parameter
    if isinstance(setting, SettingKey):
        return setting
    experiment, head = text.rpartition(".")[0], text.partition(".")[0]
    if experiment in experiments:
        known = head in effects or head in pairs
        raise InputError(f"{setting} {parameter}" if known else str(setting))
    raise InputError(f"{parameter}{_hint(experiment, experiments)}")


def _or_error(parse: Any, *arguments: Any) -> Key | InputError:
    try:
        return parse(*arguments)
    except InputError as error:
        return error


def _hint(experiment: str, experiments: Experiments) -> str:
    """Return what to say of experiments where a key names neither an effect nor one of them."""
    if not experiment or not experiments:
        return ""
    near = nearest(experiment, experiments)
    return f" A setting is written EXPERIMENT.setting; experiments: {', '.join(experiments)}." + (
        f" Did you mean {near!r}?" if near else ""
    )


def parse_setting(text: str, experiments: Experiments) -> SettingKey:
    """Return what "EXPERIMENT.setting" names.

    Raises:
        InputError: an unknown experiment or setting, or a setting that is no number to move or has no value.
    """
    name, _, setting = text.rpartition(".")  # names of experiments may hold dots, those of settings don't
    if name not in experiments:
        raise unknown_name("experiment", name, experiments)
    experiment = experiments[name]
    movable = movable_settings(experiment)
    if setting not in experiment.settings_type.model_fields:
        raise unknown_name(f"setting of {name} ({experiment.name})", setting, movable)
    if setting not in movable:
        raise InputError(
            f"{setting} of {name} ({experiment.name}) is no number that can be moved a little. "
            f"Such are: {', '.join(movable) or 'none'}."
        )
    if getattr(experiment.settings, setting) is None:
        raise InputError(f"{text} has no value to start from; give {setting} in [experiments.{name}].")
    return SettingKey(name, setting)


def movable_settings(experiment: Experiment) -> list[str]:
    """Return the names of the settings that are single real numbers."""
    return [name for name in experiment.settings_type.model_fields if _is_number(experiment, name)]


def _is_number(experiment: Experiment, setting: str) -> bool:
    """Return whether a setting is one real number (or, left out, none)."""
    declared = experiment.settings_type.model_fields[setting].annotation
    parts = get_args(declared) if get_origin(declared) in (Union, UnionType) else (declared,)
    kinds = {get_args(part)[0] if hasattr(part, "__metadata__") else part for part in parts}
    return kinds - {type(None)} == {float}


def unit_of_setting(experiment: Experiment, setting: str) -> str:
    """Return the unit in which a setting is kept."""
    extra = experiment.settings_type.model_fields[setting].json_schema_extra
    return str(extra.get("unit", "1")) if isinstance(extra, Mapping) else "1"


def with_settings(experiment: Experiment, changes: Mapping[str, Any]) -> Experiment:
    """Return a copy of an experiment with settings changed.

    Raises:
        InputError: a value that the setting, or its fit with the others, doesn't allow.
    """
    held = {name: getattr(experiment.settings, name) for name in experiment.settings_type.model_fields}
    return type(experiment)(**held | dict(changes))
