"""The road once on a shipped study: compare, diagnose, add the effect that is missing, write the page.

Where a diagnosis names several effects that it can't tell apart, each is added, and simulations on fresh seeds decide.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from taichidem.errors import InputError
from taichidem.study import Addition, Comparison, Diagnosis, RunStore, add, compare, diagnose, read_study, write_report
from taichidem.study.addition import JSON_FILE, WITH_EFFECT
from taichidem.study.campaign import STORE
from taichidem.study.comparison_run import Report
from taichidem.study.measurements import FILE as MEASUREMENTS
from taichidem.study.result_file import RESULTS
from taichidem.study.study_file import FILE as STUDY

EXAMPLE = Path(__file__).parent.parent / "examples" / "hidden_effect"
# Of every family one that these tests could show; more laws take longer to compile than to simulate.
RIVALS = (
    "rolling_constant_torque",
    "rolling_spring_dashpot",
    "cohesion_jkr",
    "cohesion_dmt",
    "twisting_resistance",
    "size_spread",
)
MOST = 3  # of the effects named, that are added


@dataclass(frozen=True, eq=False)
class Road:
    """What the road gave.

    Attributes:
        comparison, diagnosis: of the study as shipped.
        additions: of every effect that was named, up to `MOST`, the one that agrees best first.
        page: the report, with the best addition.
    """

    comparison: Comparison
    diagnosis: Diagnosis
    additions: tuple[Addition, ...]
    page: Path


def go(
    output: str | Path,
    effects: Sequence[str] | None = RIVALS,
    report: Report | None = None,
    example: Path = EXAMPLE,
    effect_rows: int | None = None,
) -> Road:
    """Compare, diagnose, add and report on a copy of a study; runs that an earlier road left there are used again.

    Args:
        output: folder in which the copy is made; the study with the effect stands beside it.
        effects: to put on trial; every registered one where None.
        report: called with the stage and the share done, for a progress bar.
        example: the study to copy.
        effect_rows: simulated points per effect; see `diagnose`.

    Raises:
        InputError: there is no such study, or the folder can't be written.
    """
    folder = _copied(example, Path(output))
    study, tell = read_study(folder), report or (lambda stage, share: None)
    with RunStore(folder / STORE) as store:
        compared = compare(study, store=store, report=lambda _, share: tell("comparing", share))
        found = diagnose(
            study, effects, store=store, report=lambda _, share: tell("diagnosing", share), effect_rows=effect_rows
        )
        additions = [
            add(
                study,
                effect,
                _emptied(folder.parent / f"{folder.name}_with_{effect}"),
                store,
                lambda stage, share, effect=effect: tell(f"adding {effect}, {stage}", share),  # type: ignore[misc]
                effect_rows=effect_rows,
            )
            for effect in found.effects[:MOST]
        ]
    additions.sort(key=lambda added: added.step(WITH_EFFECT)["chi2"])
    if additions:
        shutil.copyfile(additions[0].folder / JSON_FILE, found.folder / JSON_FILE)  # the page tells the whole road
    return Road(compared, found, tuple(additions), write_report(folder))


def _copied(example: Path, output: Path) -> Path:
    """Return a copy of a study in a folder, its results of before gone, its runs kept."""
    if not (example / STUDY).is_file():
        raise InputError(
            f"There is no study in {example}. The example comes with the source of taichidem, in examples/."
        )
    folder = output / example.name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in (STUDY, MEASUREMENTS):
            shutil.copyfile(example / name, folder / name)
        (folder / RESULTS / JSON_FILE).unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"{folder} can't be written ({error.strerror}). Give another folder with -o.") from error
    return folder


def _emptied(folder: Path) -> Path:
    """Return a folder without the study that an earlier road wrote there."""
    (folder / STUDY).unlink(missing_ok=True)
    return folder
