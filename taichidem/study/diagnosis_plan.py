"""What a diagnosis simulates: the model as it is believed, a screening design, and tests that might be made next."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from taichidem.errors import InputError
from taichidem.experiments.base import Experiment
from taichidem.study.campaign import study_runs
from taichidem.study.comparison_conditions import labels, observable_of
from taichidem.study.comparison_run import SEEDS, checked
from taichidem.study.execution import Run
from taichidem.study.hypothesis import Hypotheses, hypotheses
from taichidem.study.proposals import Proposal, proposals
from taichidem.study.screening import BLOCK, EFFECT, SEED, SHARE, screening_design
from taichidem.study.screening_runs import response_table, row_runs
from taichidem.study.study_file import Study

EFFECT_ROWS = 4  # per effect: enough for its size, its curve and how it changes with the parameters, roughly
EXACT_EFFECT_ROWS = 12  # where no test has a scatter and runs cost next to nothing


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything that a diagnosis needs to know before it runs anything.

    Attributes:
        study: what is diagnosed.
        measurements: as `read_measurements` returns them.
        labels: a short unique name of each measurement.
        hypotheses: effects to put in, and those that can't be.
        design: a row per simulated point.
        rows: for each row of the design the run of each test.
        believed: runs of the model as it stands.
        proposals: tests that might be made next, by names that the study doesn't use: those of their types.
    """

    study: Study
    measurements: pd.DataFrame
    labels: Sequence[str]
    hypotheses: Hypotheses
    design: pd.DataFrame
    rows: Sequence[Mapping[str, Run]]
    believed: Sequence[Run]
    proposals: Mapping[str, Proposal]

    @property
    def runs(self) -> list[Run]:
        """Every run, equal ones included."""
        return [*self.believed, *(run for row in self.rows for run in row.values())]

    @property
    def responses(self) -> dict[str, tuple[str, str]]:
        """Label of each measurement → test and observable."""
        rows = zip(self.labels, self.measurements["experiment"], self.measurements["observable"], strict=True)
        return {label: (test, observable_of(self.study, test, name).name) for label, test, name in rows}

    @property
    def new_responses(self) -> dict[str, tuple[str, str]]:
        """Label of each observable that might be measured next → test and observable."""
        return {
            f"{name}.{observable}": (name, observable)
            for name, proposal in self.proposals.items()
            for observable in proposal.uncertainties
        }

    def table(self, outcomes: pd.DataFrame) -> pd.DataFrame:
        """Return the simulated points with their responses, from what `run_all` returned for `runs`.

        The believed model counts as further points without any effect.
        """
        wanted = self.responses | self.new_responses
        known = response_table(self.design, self.rows, outcomes, wanted)
        return self.distinct(pd.concat([known, self._believed_points(outcomes)], ignore_index=True))

    def distinct(self, points: pd.DataFrame) -> pd.DataFrame:
        """Return points without repeats: one that was simulated once must not count twice, as if a second seed agreed."""
        same = [*(entry.key for entry in self.study.calibrate), EFFECT, SHARE, SEED]
        return points.drop_duplicates(same, ignore_index=True)

    def _believed_points(self, outcomes: pd.DataFrame) -> pd.DataFrame:
        values = {entry.key: self.study.believed(entry.key) for entry in self.study.calibrate}
        seeds = list(dict.fromkeys(run.seed for run in self.believed))
        by_seed: list[dict[str, Run]] = [{run.name: run for run in self.believed if run.seed == seed} for seed in seeds]
        points = pd.DataFrame([values | {EFFECT: "", SHARE: 0.0, SEED: seed, BLOCK: 0} for seed in seeds])
        table = response_table(points, by_seed, outcomes, self.responses)
        return table.reindex(columns=[*table.columns, *self.new_responses])


def plan(
    study: Study,
    effects: Iterable[str] | None = None,
    seeds: Sequence[int] = SEEDS,
    effect_rows: int | None = None,
    base_rows: int | None = None,
    new_tests: Iterable[str] | None = None,
) -> Plan:
    """Return what a diagnosis will run.

    Args:
        study: what is diagnosed.
        effects: names of those to test; every registered one by default.
        seeds: of the model as it stands.
        effect_rows: design rows per effect; 4, or 12 where no test has a scatter.
        base_rows: space-filling rows without an effect; three per calibrated parameter, eight where no test has a scatter.
        new_tests: types of tests that might be made next and are simulated too; all that propose themselves by default.

    Raises:
        FileError: (an InputError) what is wrong with the measurements.
        InputError: as many knobs as measurements, a key for pairs that differ, an unknown effect, or too few rows.
    """
    measurements, _ = checked(study)
    _check_count(study, len(measurements))
    for entry in study.calibrate:
        study.believed(entry.key)  # refused now rather than after the runs, where pairs differ under one key
    exact = not any(study.experiment(name).random for name in study.experiments)
    per_effect = effect_rows or (EXACT_EFFECT_ROWS if exact else EFFECT_ROWS)
    if per_effect < 2:
        raise InputError(f"effect_rows is {per_effect}; give 2 or more, so that an effect's curve can be told.")
    base = 8 * len(study.calibrate) if base_rows is None and exact else base_rows
    found = hypotheses(study, effects)
    design = screening_design(study.calibrate, found.tested, base, per_effect)
    new = {_free_name(proposal.experiment.name, study): proposal for proposal in proposals(study, new_tests)}
    extra: dict[str, Experiment] = {name: proposal.experiment for name, proposal in new.items()}
    rows = row_runs(study, found, design, study.experiments, extra)
    return Plan(
        study, measurements, labels(study, measurements), found, design, rows, study_runs(study, None, seeds), new
    )


def _free_name(name: str, study: Study) -> str:
    """Return a name for a new test by which the study calls none of its own."""
    return name if name not in study.experiments else _free_name(f"{name}_new", study)


def _check_count(study: Study, measured: int) -> None:
    direct = sum(entry.value is not None for entry in study.calibrate)
    if measured + direct <= len(study.calibrate):
        raise InputError(
            f"{study.file} lets {len(study.calibrate)} parameters be re-calibrated, and there are {measured + direct} "
            f"measurements"
            f"{f' ({direct} of them of parameters)' if direct else ''}. With as many knobs as measurements a perfect fit proves "
            "nothing: measure more, or fix parameters by taking them out of [calibrate]."
        )
