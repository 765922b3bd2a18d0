"""The new study that adding an effect makes: its file, and what of the effect may be re-calibrated in it later."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

from taichidem.effects.base import Parameter
from taichidem.errors import InputError
from taichidem.study.diagnosis_plan import Plan
from taichidem.study.hypothesis import Hypothesis
from taichidem.study.study_file import Study
from taichidem.study.study_writer import AddedParameter, write_study

ROOM = 1.5  # times the strongest setting: up to where the strength may be re-calibrated later


def write_addition(
    planned: Plan, hypothesis: Hypothesis, values: Mapping[str, float], share: float, target: Path
) -> Study:
    """Write the study with parameters at values and the effect at a share of its strongest setting, and return it.

    Raises:
        InputError: a folder that holds a study already or can't be written.
    """
    added = hypothesis.at(share, planned.study.at(values).model)
    title = f"{planned.study.title}, with {hypothesis.name}"
    return write_study(planned.study, target, values, added, free_parameters(hypothesis, share, planned), title)


def rehearse(planned: Plan, hypothesis: Hypothesis) -> None:
    """Write the new study where nobody sees it, so that a file that can't be changed is told before anything is run.

    Raises:
        InputError: what stands in the way.
    """
    believed = {entry.key: planned.study.believed(entry.key) for entry in planned.study.calibrate}
    with tempfile.TemporaryDirectory() as folder:
        try:
            write_addition(planned, hypothesis, believed, 1.0, Path(folder) / "study")
        except InputError as error:
            raise InputError(f"{planned.study.file} can't be written with {hypothesis.name} in it: {error}") from error


def free_parameters(hypothesis: Hypothesis, share: float, planned: Plan) -> list[AddedParameter]:
    """Return what of an added effect may be re-calibrated later: its measuring parameter, per pair where it has pairs."""
    parameter, model = hypothesis.parameter, planned.study.model()
    held = hypothesis.at(1.0 if share > 0 else -1.0, model).values[parameter.name]
    grain = hypothesis.scale.materials[0].name
    full = held if isinstance(held, Mapping) else {None: held}
    vanishing = float(parameter.vanishing or 0.0)
    return [
        AddedParameter(parameter.name, pair, *sorted((vanishing, _end(parameter, vanishing, float(strongest)))))
        for pair, strongest in full.items()
        if pair is None or grain in pair.split("-")
    ]


def _end(parameter: Parameter, vanishing: float, strongest: float) -> float:
    """Return the far end of a range with some room beyond the strongest setting, within what the parameter may be."""
    end = vanishing + ROOM * (strongest - vanishing)
    if end < parameter.low or (parameter.open_low and end == parameter.low):
        return strongest if parameter.open_low else parameter.low
    return min(end, parameter.high)
