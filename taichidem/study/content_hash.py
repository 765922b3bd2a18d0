"""The key of a run: a hash of everything that its outcome depends on, and of nothing else."""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from pydantic import BaseModel

from taichidem.experiments.base import Experiment
from taichidem.physics_version import PHYSICS_VERSION
from taichidem.scene import Model
from taichidem.shapes.base import GrainShape
from taichidem.study.parameter_key import options_of, pair_name

DECIMALS = 12  # of a shape's numbers
TEXTS_KEPT = 4096  # models and experiments whose texts are remembered, some kilobytes each
LARGEST_EXACT = 2**53  # whole numbers up to here are the same as float64


def canonical(value: Any) -> Any:
    """Return a value in plain types such that equal values become equal texts.

    Whole numbers and floats that are equal become one, −0 and subnormal numbers become 0, numbers that JSON lacks (nan, inf)
    become texts.

    Raises:
        TypeError: a value of a type that has no such form.
    """
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, np.bool_):
        return bool(value)
    if isinstance(value, (int, np.integer)) and abs(int(value)) > LARGEST_EXACT:
        return str(int(value))
    if isinstance(value, (int, float, np.number)):
        number = float(value)
        if abs(number) < sys.float_info.min:
            return (
                0.0  # also for subnormal numbers: once Taichi runs, the processor takes them for 0, before it does not
            )
        return number if math.isfinite(number) else repr(number)
    if isinstance(value, BaseModel):
        return canonical(value.model_dump())
    if isinstance(value, Mapping):
        return {str(key): canonical(held) for key, held in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [canonical(held) for held in value]
    raise TypeError(f"{value!r} of type {type(value).__name__} can't be written as JSON.")


def canonical_json(value: Any) -> str:
    """Return the one JSON text of a value: keys sorted, no spaces, floats as their shortest exact decimal."""
    return json.dumps(canonical(value), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def model_as_dict(model: Model) -> dict[str, Any]:
    """Return all that a model says, in plain types.

    Effects and pairs have no order. Materials keep theirs, since an experiment may take the first or the last.
    """
    materials = [{"name": m.name, **_properties(m)} for m in model.materials]
    effects = {}
    for effect in model.effects:
        values = {name: _one_if_equal(held, [m.name for m in model.materials]) for name, held in effect.values.items()}
        effects[effect.name] = {"values": values, "options": options_of(effect), **_version(effect)}
    shape = {} if model.shape is None else {"shape": shape_as_dict(model.shape)}
    return canonical({"materials": materials, "effects": effects, **shape})


def shape_as_dict(shape: GrainShape) -> dict[str, Any]:
    """Return what a shape is made of, over the radius of the sphere of equal volume: forms that differ in size are one.

    Numbers are rounded to twelve decimals, since volumes and moments come from functions whose last digits differ between
    versions of libraries.
    """
    own, parts = shape.equal_volume_radius, shape.elements
    lengths = {"offset": parts.offset, "radius": parts.radius, "axes": parts.axes}
    found: dict[str, Any] = {name: held / own for name, held in lengths.items() if held is not None}
    found |= {"inertia": shape.inertia / own**2, "exponents": parts.exponents}
    return canonical({name: np.round(held, DECIMALS) for name, held in found.items() if held is not None})


def _properties(material: Any) -> dict[str, Any]:
    return {name: held for name, held in vars(material).items() if name != "name"}


def _one_if_equal(value: Any, materials: Sequence[str]) -> Any:
    """Return a value per pair by the pairs' one name, or one number where a table says the same for all that can touch.

    Some material must be in the table with every one, itself included: that of the grains. What it leaves out can't touch.
    """
    if not isinstance(value, Mapping):
        return value
    table = {pair_name(*pair.split("-")): float(number) for pair, number in value.items()}
    covers = any(all(pair_name(grain, other) in table for other in materials) for grain in materials)
    return next(iter(table.values())) if covers and len(set(table.values())) == 1 else table


def _version(plugin: Any) -> dict[str, Any]:
    """Return the version that an outside effect or experiment states of itself, if any."""
    version = getattr(plugin, "version", None)
    return {} if version is None else {"version": str(version)}


def experiment_as_dict(experiment: Experiment) -> dict[str, Any]:
    """Return type and all settings of an experiment, defaults included, in plain types."""
    return canonical({"type": experiment.name, "settings": experiment.settings, **_version(experiment)})


class _Same:
    """An object by its identity, as a key of a cache that keeps it alive."""

    __slots__ = ("held",)

    def __init__(self, held: Any) -> None:
        self.held = held

    def __hash__(self) -> int:
        return id(self.held)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.held is other.held


@lru_cache(maxsize=TEXTS_KEPT)
def _model_text(model: _Same) -> str:
    return canonical_json(model_as_dict(model.held))


@lru_cache(maxsize=TEXTS_KEPT)
def _experiment_text(experiment: _Same) -> str:
    return canonical_json(experiment_as_dict(experiment.held))


def model_text(model: Model) -> str:
    """Return a model as canonical JSON; computed once for all the seeds that a campaign runs it with."""
    return _model_text(_Same(model))


def experiment_text(experiment: Experiment) -> str:
    """Return type and settings of an experiment as canonical JSON; computed once for all the runs of a campaign."""
    return _experiment_text(_Same(experiment))


def run_key(experiment: Experiment, model: Model, seed: int) -> str:
    """Return the key of a run: SHA-256 of experiment type, all settings, model, seed and physics version.

    Titles, names that a study gives to its experiments and paths of files are no part of it. What is hashed is the canonical
    JSON of {"experiment": …, "model": …, "physics": …, "seed": …}, put together from texts that many runs share.
    """
    parts = {
        "experiment": experiment_text(experiment),
        "model": model_text(model),
        "physics": canonical_json(PHYSICS_VERSION),
        "seed": canonical_json(int(seed)),
    }
    content = "{" + ",".join(f'"{name}":{text}' for name, text in parts.items()) + "}"
    return hashlib.sha256(content.encode()).hexdigest()
