"""The section [experiments] of a study file: tests of registered types, with the particle and materials filled in."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from taichidem import plugins
from taichidem.errors import InputError
from taichidem.experiments.base import Experiment
from taichidem.scene import Model
from taichidem.study.material_section import Particle, wall_material
from taichidem.study.problems import Problems

FILLED_IN = ("diameter", "grain_material", "wall_material")
NAME = re.compile(r"[\w.+-]+")


@dataclass(frozen=True)
class StudyExperiment:
    """One test of a study: its registered type, the settings as the file gives them, the experiment built of both."""

    type: str
    settings: Mapping[str, Any]
    experiment: Experiment


def read_experiments(
    document: Mapping[str, Any], particle: Particle | None, materials: Collection[str], problems: Problems
) -> dict[str, StudyExperiment]:
    """Return the experiments that are in order, in the order of the file; what is wrong with the others is noted."""
    tables = problems.table(document, "experiments")
    if not tables:
        problems.missing("experiments", "give each test a section such as [experiments.heap] with its type.")
    found = {}
    for name in tables:
        path = f"experiments.{name}"
        if not NAME.fullmatch(name):
            problems.add(path, f"{name!r} is no name of an experiment; use letters, digits and _ . + - only.")
        table = problems.table(tables, name, path)
        if not isinstance(tables[name], Mapping):
            continue
        kind = _read_type(path, table, problems)
        if kind is None:
            continue
        settings = {key: value for key, value in table.items() if key != "type"}
        experiment = _build(
            path, kind, settings, _filled_in(path, kind, settings, particle, materials, problems), problems
        )
        if experiment is not None:
            found[name] = StudyExperiment(kind.name, settings, experiment)
    return found


def _read_type(path: str, table: Mapping[str, Any], problems: Problems) -> type[Experiment] | None:
    if "type" not in table:
        problems.missing(f"{path}.type", f"give one of: {', '.join(sorted(plugins.names('experiment')))}.")
        return None
    with problems.catching(f"{path}.type"):
        return plugins.get("experiment", str(table["type"]))
    return None


def _filled_in(
    path: str,
    kind: type[Experiment],
    settings: Mapping[str, Any],
    particle: Particle | None,
    materials: Collection[str],
    problems: Problems,
) -> dict[str, Any]:
    """Return the settings that follow from [particle] and [materials] where the file does not give them."""
    for name, value in settings.items():
        if name.endswith("_material") and name in kind.settings_type.model_fields and value not in materials:
            problems.unknown(f"{path}.{name}", "material", str(value), materials)
    if particle is None:
        return {}
    wall = wall_material(materials, particle.material)
    derived = dict(zip(FILLED_IN, (particle.diameter, particle.material, wall), strict=True))
    wanted = {k: v for k, v in derived.items() if k in kind.settings_type.model_fields and k not in settings}
    if wanted.get("wall_material", "") is None:
        problems.missing(
            f"{path}.wall_material",
            f"name the walls' material, one of {', '.join(materials)}; one called 'wall' is taken by itself.",
        )
        del wanted["wall_material"]
    return wanted


def _build(
    path: str, kind: type[Experiment], settings: Mapping[str, Any], derived: Mapping[str, Any], problems: Problems
) -> Experiment | None:
    declared = kind.settings_type.model_fields
    allowed = [name for name in declared if name not in derived] + list(derived)
    problems.refuse_others(settings, allowed, path, f"setting of {kind.name}")
    known = {name: value for name, value in settings.items() if name in declared} | dict(derived)
    try:
        kind.settings_type(**known)
        return kind(**known)
    except ValidationError as error:
        for problem in error.errors():
            _note(path, kind, problem, problems)
    except InputError as error:
        problems.add(path, str(error))
    return None


def _note(path: str, kind: type[Experiment], problem: Any, problems: Problems) -> None:
    """Note one thing that pydantic refused."""
    cause = problem["msg"].removeprefix("Value error, ").rstrip(".")
    key = ".".join([path, *(str(part) for part in problem["loc"])])
    if not problem["loc"]:
        problems.add(key, f"{cause}.")
        return
    field = kind.settings_type.model_fields[str(problem["loc"][0])]
    if problem["type"] == "missing":
        if problem["loc"][0] in FILLED_IN:
            return  # [particle] is faulty, which is noted there
        problems.missing(key, f"{field.description or 'it has no default.'}")
        return
    extra = field.json_schema_extra
    unit = extra.get("unit", "1") if isinstance(extra, Mapping) else "1"
    problems.add(key, f"{key} is {problem['input']!r} [{unit}]: {cause}. {field.description or ''}".rstrip())


def check_scenes(experiments: Mapping[str, StudyExperiment], model: Model, problems: Problems) -> None:
    """Note what an experiment finds wrong with its own apparatus for this model."""
    for name, entry in experiments.items():
        with problems.catching(f"experiments.{name}"):
            entry.experiment.scene(model)
