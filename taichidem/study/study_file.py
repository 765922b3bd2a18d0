"""Read a study folder: what the analyst believes, what may be re-calibrated, and which tests there are."""

from __future__ import annotations

import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

from taichidem.errors import InputError, nearest, unknown_name
from taichidem.experiments.base import Experiment
from taichidem.materials import Material, MaterialPair
from taichidem.scene import Model
from taichidem.shapes.base import GrainShape
from taichidem.study.calibrate_section import Calibration, check_ends, read_calibrations
from taichidem.study.effect_section import (
    Given,
    build_effects,
    check_pairs,
    complete,
    read_composition,
    read_given,
)
from taichidem.study.experiment_section import StudyExperiment, check_scenes, read_experiments
from taichidem.study.material_section import Particle, in_order, read_materials, read_particle
from taichidem.study.parameter_key import all_pairs, pair_name, with_values
from taichidem.study.problems import FileError, Problems
from taichidem.study.study_point import StudyPoint, held, moved

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found, no-redef]

SCHEMA = 1
FILE = "study.toml"
SECTIONS = ("schema", "title", "particle", "materials", "contacts", "effects", "calibrate", "experiments")


@dataclass(frozen=True)
class Study:
    """A study folder, checked.

    Attributes:
        path: the folder.
        file: its study.toml.
        schema: number of the file's format.
        title: for people.
        particle: shape, diameter [m], material and form of the grains.
        materials: by name.
        effects: what the file says of each effect of the model, options and values (SI).
        calibrate: the parameters of effects and settings of experiments that may be re-calibrated.
        experiments: by name, in the order of the file.
    """

    path: Path
    file: Path
    schema: int
    title: str
    particle: Particle
    materials: Mapping[str, Material]
    effects: Mapping[str, Given]
    calibrate: tuple[Calibration, ...]
    experiments: Mapping[str, StudyExperiment]
    _model: Model

    def model(self) -> Model:
        """Return the model that the analyst believes."""
        return self._model

    def model_with(self, values: Mapping[str, Any]) -> Model:
        """Return the model with parameters changed; keys as under [calibrate] (see `with_values`)."""
        return with_values(self._model, values)

    def at(self, values: Mapping[str, Any]) -> StudyPoint:
        """Return model and experiments with values set, of parameters and of settings; keys as under [calibrate].

        Args:
            values: key → number in the unit of its Calibration, or a text with a unit. What isn't named stays as believed.

        Raises:
            InputError: a key that names nothing, two keys for one number, or a value that is not allowed.
        """
        return moved(self._model, self._tests(), values)

    def believed(self, key: str) -> float:
        """Return the number that the study holds for a key of [calibrate], in the unit of its Calibration.

        Raises:
            InputError: a key that names nothing, or one for all pairs whose values differ.
        """
        return held(self._model, self._tests(), key)

    def _tests(self) -> dict[str, Experiment]:
        return {name: entry.experiment for name, entry in self.experiments.items()}

    def experiment(self, name: str) -> Experiment:
        """Return an experiment with the particle's diameter and materials filled in.

        Raises:
            InputError: an unknown name.
        """
        if name not in self.experiments:
            raise unknown_name(f"experiment of {self.path.name}", name, self.experiments)
        return self.experiments[name].experiment


def study_file(path: str | Path) -> Path:
    """Return the study.toml that a folder or a file means.

    Raises:
        InputError: there is none.
    """
    given = Path(path)
    file = given / FILE if given.is_dir() else given
    if not file.is_file():
        raise InputError(f"There is no study file {file}. Give a folder that holds {FILE}, or the file itself.")
    return file


def read_study(path: str | Path) -> Study:
    """Read and check a study folder.

    Args:
        path: the folder, or its study.toml.

    Raises:
        FileError: (an InputError) everything that is wrong with the file, each with its key.
        InputError: no such file, or it can't be read.
    """
    file = study_file(path)
    document = _load(file)
    problems = Problems(str(file))
    problems.refuse_others(document, SECTIONS, "", "section")
    _check_schema(document, problems)
    title = document.get("title", file.parent.resolve().name)
    if not isinstance(title, str):
        problems.add("title", f"title is {title!r}; give a text.")
    materials = read_materials(document, problems)
    names = list(problems.table(document, "materials"))
    particle = read_particle(document, names, file.parent, problems)
    experiments = read_experiments(document, particle, names, problems)
    grain = problems.table(document, "particle").get("material")
    pairs = touching(likely_grain(grain, names), experiments, names) if names else []
    effects = read_composition(document, problems)
    given = read_given(document, effects, names, problems)
    complete(given, effects, pairs, problems)
    tests = {name: entry.experiment for name, entry in experiments.items()}
    calibrate = read_calibrations(document, effects, pairs if grain in names else all_pairs(names), tests, problems)
    model = None
    if particle is not None and not problems.concern("materials", "contacts", "effects"):
        model = _build_model(in_order(materials, particle.material), given, effects, pairs, particle.form, problems)
    if model is not None:
        check_scenes(experiments, model, problems)
        check_ends(calibrate, tests, model, problems)
    problems.raise_if_any()
    assert particle is not None
    assert model is not None
    return Study(file.parent, file, SCHEMA, title, particle, materials, given, calibrate, experiments, model)


def _load(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_bytes().decode("utf-8-sig"))
    except OSError as error:
        raise InputError(f"{file} can't be read ({error.strerror}).") from error
    except UnicodeDecodeError as error:
        raise FileError(str(file), [f"it is no UTF-8 text (byte {error.start}); save it as UTF-8."]) from error
    except tomllib.TOMLDecodeError as error:
        raise FileError(str(file), [f"it is not valid TOML: {error}"]) from error


def _check_schema(document: Mapping[str, Any], problems: Problems) -> None:
    if "schema" not in document:
        problems.missing("schema", f"write schema = {SCHEMA} at the top of the file.")
    elif document["schema"] != SCHEMA or isinstance(document["schema"], bool):
        problems.add(
            "schema",
            f"schema is {document['schema']!r}; this version reads schema = {SCHEMA}. A newer one may need a newer taichidem.",
        )


def likely_grain(given: object, materials: Collection[str]) -> str:
    """Return the material of the grains, or the one that was likely meant, so that what its contacts lack is told as well."""
    if given in materials:
        return str(given)
    near = nearest(str(given), materials) if given is not None else None
    return near or next((name for name in materials if name != "wall"), "wall")


def touching(grain: str, experiments: Mapping[str, StudyExperiment], materials: Collection[str]) -> list[str]:
    """Return the pairs of materials that may touch: those of grains (also of a single test) with everything."""
    chosen = [getattr(entry.experiment.settings, "grain_material", "") for entry in experiments.values()]
    grains = dict.fromkeys([grain, *(name for name in chosen if name)])
    return list(dict.fromkeys(pair_name(grain, name) for grain in grains for name in materials))


def _build_model(
    materials: tuple[Material, ...],
    given: Mapping[str, Given],
    effects: Mapping[str, Any],
    pairs: Collection[str],
    form: GrainShape | None,
    problems: Problems,
) -> Model | None:
    """Return the model, or None after noting what its effects refuse."""
    built = build_effects(given, effects, problems)
    both = [MaterialPair(a, b) for a, b in combinations_with_replacement(materials, 2)]
    check_pairs(built, [p for p in both if pair_name(p.first.name, p.second.name) in pairs], problems)
    if problems.concern("effects", "contacts"):
        return None
    with problems.catching("effects"):
        return Model(materials, built, form)
    return None
