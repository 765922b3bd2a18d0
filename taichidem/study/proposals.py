"""Tests that propose themselves as the next measurement: cheap to simulate, cheap to make, not yet in the study."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from taichidem import plugins
from taichidem.errors import InputError, TaichidemError
from taichidem.experiments.base import Experiment
from taichidem.study.experiment_section import FILLED_IN
from taichidem.study.material_section import wall_material
from taichidem.study.study_file import Study


@dataclass(frozen=True)
class Proposal:
    """A test that one might make next, and what its observables would be uncertain by, in their units."""

    experiment: Experiment
    uncertainties: dict[str, float]


def proposals(study: Study, only: Iterable[str] | None = None) -> list[Proposal]:
    """Return a test of every registered type that proposes itself and of which the study has none.

    Args:
        study: whose grains and materials the tests take.
        only: names of types; all by default.

    Raises:
        InputError: a type among `only` that is not registered, or that doesn't propose itself.
    """
    there = {entry.type for entry in study.experiments.values()}
    found = []
    for name in plugins.names("experiment") if only is None else only:
        kind: type[Experiment] = plugins.get("experiment", name)
        settings, uncertainties = kind.proposed(study.particle.diameter)
        if not uncertainties and only is not None:
            raise InputError(
                f"{name} does not say what its result would be uncertain by, so that it can't be weighed as a next measurement. "
                f"Those that can: {', '.join(_proposing(study.particle.diameter)) or 'none'}."
            )
        if name in there or not uncertainties:
            continue
        try:
            test = kind(**settings, **_filled_in(kind, study))
            test.scene(study.model())
        except TaichidemError:
            continue  # its usual apparatus does not suit these grains
        found.append(Proposal(test, uncertainties))
    return found


def _proposing(diameter: float) -> list[str]:
    return [n for n in plugins.names("experiment") if plugins.get("experiment", n).proposed(diameter)[1]]


def _filled_in(kind: type[Experiment], study: Study) -> dict[str, object]:
    grain = study.particle.material
    wall = wall_material(study.materials, grain) or study.model().materials[-1].name
    derived = dict(zip(FILLED_IN, (study.particle.diameter, grain, wall), strict=True))
    return {name: value for name, value in derived.items() if name in kind.settings_type.model_fields}
