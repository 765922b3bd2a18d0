"""A study with some of its numbers changed: the model and the experiments as they then are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from taichidem.errors import unknown_name
from taichidem.experiments.base import Experiment
from taichidem.scene import Model
from taichidem.study.parameter_key import all_pairs, value_of, with_values
from taichidem.study.setting_key import Experiments, Key, SettingKey, parse_any_key, unit_of_setting, with_settings
from taichidem.units import to_si


@dataclass(frozen=True)
class StudyPoint:
    """Model and experiments at given values of what may be re-calibrated."""

    model: Model
    experiments: Experiments

    def experiment(self, name: str) -> Experiment:
        """Return an experiment as it is at this point.

        Raises:
            InputError: an unknown name.
        """
        if name not in self.experiments:
            raise unknown_name("experiment", name, self.experiments)
        return self.experiments[name]


def parse(text: str, model: Model, experiments: Experiments) -> Key:
    """Return what a key names in a model and its experiments."""
    pairs = all_pairs([material.name for material in model.materials])
    return parse_any_key(text, {effect.name: type(effect) for effect in model.effects}, pairs, experiments)


def moved(model: Model, experiments: Experiments, values: Mapping[str, Any]) -> StudyPoint:
    """Return model and experiments with values set; keys as under [calibrate].

    Raises:
        InputError: a key that names nothing, two keys for one number, or a value that is not allowed.
    """
    parameters: dict[str, Any] = {}
    settings: dict[str, dict[str, float]] = {}
    for text, value in values.items():
        key = parse(text, model, experiments)
        if isinstance(key, SettingKey):
            unit = unit_of_setting(experiments[key.experiment], key.setting)
            settings.setdefault(key.experiment, {})[key.setting] = to_si(value, unit, text)
        else:
            parameters[text] = value
    changed = {name: with_settings(experiments[name], changes) for name, changes in settings.items()}
    return StudyPoint(with_values(model, parameters) if parameters else model, {**experiments, **changed})


def held(model: Model, experiments: Experiments, text: str) -> float:
    """Return the number that a key names, in its SI unit.

    Raises:
        InputError: a key that names nothing, or one for all pairs whose values differ.
    """
    key = parse(text, model, experiments)
    if isinstance(key, SettingKey):
        return float(getattr(experiments[key.experiment].settings, key.setting))
    return value_of(model, key)
