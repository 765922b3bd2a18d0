"""Photographs of measured heaps: which there are, whether they can be used, and their pictures beside the simulated heaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from taichidem.errors import InputError
from taichidem.study.comparison_conditions import labels, records
from taichidem.study.execution import Run, second_seed
from taichidem.study.measurements import PHOTOGRAPH, measurements_file
from taichidem.study.problems import Problems
from taichidem.study.study_file import Study
from taichidem.whole_file import save_figure


@dataclass(frozen=True)
class Photographed:
    """A measurement with photographs.

    Attributes:
        experiment: its test.
        label: what the row is called.
        files: views of one heap.
    """

    experiment: str
    label: str
    files: tuple[Path, ...]


def photographed(study: Study, measurements: pd.DataFrame) -> list[Photographed]:
    """Return the measurements with photographs, each of which can be read.

    Raises:
        FileError: everything that is wrong with them.
        EnvironmentProblem: nothing can be drawn on this machine, so that no heap can be shown beside them.
    """
    if PHOTOGRAPH not in measurements:
        return []
    from taichidem.graphics import require_graphics
    from taichidem.heap_photograph import check_photograph

    problems = Problems(str(measurements_file(study)))
    found = []
    for row, label in zip(records(measurements), labels(study, measurements), strict=True):
        names = [name.strip() for name in row[PHOTOGRAPH].split(";") if name.strip()]
        files = tuple(study.path / name for name in names)
        for file in files:
            try:
                check_photograph(study.experiment(row["experiment"]), row["observable"], file)
            except InputError as error:
                problems.add(label, f"{label}: {error}")
        if files:
            found.append(Photographed(row["experiment"], label, files))
    problems.raise_if_any()
    if found:
        require_graphics()
    return found


def heap_pictures(
    study: Study, rows: list[Photographed], table: pd.DataFrame, folder: Path, tell: Callable[[float], None]
) -> tuple[dict[str, str], list[str], list[dict[str, Any]]]:
    """Draw each photographed heap beside a simulated one, that of the seed nearest to the mean.

    Args:
        study: whose model was run.
        rows: as `photographed` returns them.
        table: of its runs.
        folder: where pictures and grains are written; grains that are there already are not simulated again.
        tell: called with the share done.

    Returns:
        Pictures by name, relative to the folder; a sentence for each heap; what was measured.
    """
    from taichidem.heap_photograph import FAULTS, draw_pair

    pictures: dict[str, str] = {}
    texts: list[str] = []
    numbers: list[dict[str, Any]] = []
    for done, row in enumerate(rows):
        tell(done / len(rows))
        name = f"heap_{_file_name(row.label)}"
        try:
            pair = _pair(study, row, table, folder)
            save_figure(draw_pair(pair, row.label), folder / f"{name}.png")
        except FAULTS as error:  # the runs are done: one bad picture must not lose their comparison
            texts.append(f"{row.label}: photograph and simulation can't be shown side by side: {error}")
            continue
        pictures[name] = f"{name}.png"
        texts.append(f"{row.label}: {pair.text}")
        numbers.append(_numbers(row, pair))
    tell(1.0)
    return pictures, texts, numbers


def _pair(study: Study, row: Photographed, table: pd.DataFrame, folder: Path) -> Any:
    from taichidem.heap_photograph import OBSERVABLE, grains_of, measure_pair

    runs = table[(table["experiment"] == row.experiment) & (table["status"] == "done")]
    if runs.empty:
        raise InputError("no run of it succeeded.")
    typical = runs.loc[(runs[OBSERVABLE] - runs[OBSERVABLE].mean()).abs().idxmin()]
    run = Run(study.experiment(row.experiment), study.model(), int(typical["seed"]), row.experiment)
    # The run's key in the name: grains of another model or setting are never taken for these.
    file = folder / f"grains_{_file_name(row.experiment)}_seed_{run.seed}_{run.key[:12]}.vtp"
    seed = second_seed(run.seed) if typical["attempts"] > 1 else run.seed
    grains = grains_of(run.experiment, run.model, seed, file)
    return measure_pair(run.experiment, grains, dict(typical), run.seed, row.files)


def _numbers(row: Photographed, pair: Any) -> dict[str, Any]:
    return {
        "experiment": row.experiment,
        "label": row.label,
        "photographs": [file.name for file in row.files],
        "photograph_deg": pair.photograph.angle_deg,
        "u_photograph_deg": pair.photograph.standard_uncertainty_deg,
        "simulated_deg": pair.simulated.angle_deg,
        "u_simulated_deg": pair.simulated.standard_uncertainty_deg,
        "seed": pair.seed,
    }


def _file_name(label: str) -> str:
    return "".join(c if c.isalnum() or c in "._+-" else "_" for c in label)
