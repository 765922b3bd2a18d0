"""The result of a diagnosis, and the files it is kept in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from taichidem.study.result_file import ResultFile

JSON_FILE = "verdict.json"


@dataclass(frozen=True, eq=False)
class Diagnosis(ResultFile):
    """Which effect a study's model lacks.

    Attributes:
        study: the study's title.
        verdict: nothing_missing, effect, one_of, something_else or cannot_tell.
        effects: those in question, best first; empty for nothing_missing and cannot_tell.
        text: one paragraph for a reader who doesn't program.
        advice: what to do next, a sentence each.
        chi2: believed, recalibrated, with_effect (nan where there is none), and their degrees of freedom and p.
        held_out_error: before and after, RMS of z of predictions of tests that were left out.
        table: a dictionary per candidate, best first.
        not_tested: effect and reason.
        parameters: a dictionary per calibrated parameter.
        standardised_errors: a dictionary per measurement.
        next_measurement: what to measure next, or None.
        threshold, bootstrap: 95 % quantile of the largest score if nothing is missing, and the draws behind it.
        design: how the points were drawn.
        runs: how many were stored, new, failed.
        failures: runs that failed: experiment, seed, reason.
        assumptions: what the verdict rests on, a sentence each.
        wall_s: time it took [s].
        folder: where everything was written.
        pictures: files by name, relative to `folder`.
    """

    file: ClassVar[str] = JSON_FILE

    study: str
    verdict: str
    effects: tuple[str, ...]
    text: str
    advice: tuple[str, ...]
    chi2: Mapping[str, float]
    held_out_error: Mapping[str, float]
    table: Sequence[Mapping[str, Any]]
    not_tested: Sequence[Mapping[str, str]]
    parameters: Sequence[Mapping[str, Any]]
    standardised_errors: Sequence[Mapping[str, Any]]
    next_measurement: Mapping[str, Any] | None
    threshold: float
    bootstrap: int
    design: Mapping[str, Any]
    runs: Mapping[str, int]
    failures: Sequence[Mapping[str, Any]]
    assumptions: Sequence[str]
    wall_s: float
    folder: Path
    pictures: Mapping[str, str] = field(default_factory=dict)
