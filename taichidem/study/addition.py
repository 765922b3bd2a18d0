"""The result of adding an effect to a study, and the files it is kept in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from taichidem.study.result_file import ResultFile

JSON_FILE = "addition.json"
BELIEVED, RECALIBRATED, WITH_EFFECT = "believed", "recalibrated", "with_effect"


@dataclass(frozen=True, eq=False)
class Addition(ResultFile):
    """A study with one effect more, re-calibrated together with it, and what that did to its errors.

    Attributes:
        study: title of the study it began from.
        effect, title: name of the effect, and in words.
        parameter, unit: what its strength is measured by.
        strength, u_strength: jointly re-calibrated.
        waterfall: a dictionary per step: step, label, chi2, dof, rms_fitted, rms_held_out.
        tests: a dictionary per measurement: simulated values and standardised errors of every step.
        parameters: a dictionary per calibrated parameter.
        fresh_seeds: on which every step was simulated for the errors; none of them was fitted to.
        text: one paragraph for a reader who doesn't program.
        runs: how many were stored, new, failed.
        failures: runs that failed: experiment, seed, reason.
        wall_s: time it took [s].
        new_study: the folder of the new study.
        folder: where results were written.
        pictures: files by name, relative to `folder`.
    """

    file: ClassVar[str] = JSON_FILE
    hidden: ClassVar[tuple[str, ...]] = ("folder", "new_study")

    study: str
    effect: str
    title: str
    parameter: str
    unit: str
    strength: float
    u_strength: float
    waterfall: Sequence[Mapping[str, Any]]
    tests: Sequence[Mapping[str, Any]]
    parameters: Sequence[Mapping[str, Any]]
    fresh_seeds: Sequence[int]
    text: str
    runs: Mapping[str, int]
    failures: Sequence[Mapping[str, Any]]
    wall_s: float
    new_study: Path
    folder: Path
    pictures: Mapping[str, str] = field(default_factory=dict)

    def step(self, name: str) -> Mapping[str, Any]:
        """Return one step of the waterfall."""
        return next(step for step in self.waterfall if step["step"] == name)

    def extra(self) -> dict[str, Any]:
        """Return the folder of the new study as text."""
        return {"new_study": str(self.new_study)}
