"""Diagnose and add again and again, until nothing is missing or nothing helps."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from taichidem import plugins
from taichidem.errors import InputError
from taichidem.study.addition import RECALIBRATED, WITH_EFFECT, Addition
from taichidem.study.addition_run import add
from taichidem.study.campaign import STORE
from taichidem.study.comparison_run import Report, writable
from taichidem.study.diagnosis import Diagnosis
from taichidem.study.diagnosis_run import diagnose
from taichidem.study.result_file import RESULTS, ResultFile
from taichidem.study.run_store import RunStore
from taichidem.study.study_file import FILE as STUDY_FILE
from taichidem.study.study_file import Study, read_study

JSON_FILE = "discovery.json"
FOLDER = "discovery"
STEP = "step_"  # begins the names of the studies that a search makes
MOST = 3  # effects added; a bench that asks for more lacks something else
TRIED = 2  # rivals that can't be told apart are added in turn, and fresh simulations choose
NEEDED = 2.0  # standard uncertainties from vanishing that an added effect keeps once others are in


@dataclass(frozen=True, eq=False)
class Discovery(ResultFile):
    """What was found step by step.

    Attributes:
        study: the study's title.
        steps: a dictionary per diagnosis: verdict, effects, added (or None), chi2, dof, folder.
        removed: effects that the backward check took out again.
        stopped_because: why it ended.
        text: one paragraph.
        final: folder of the last study.
        folder: where discovery.json was written.
    """

    file: ClassVar[str] = JSON_FILE
    hidden: ClassVar[tuple[str, ...]] = ("folder", "final")

    study: str
    steps: Sequence[Mapping[str, Any]]
    removed: Sequence[str]
    stopped_because: str
    text: str
    final: Path
    folder: Path

    def extra(self) -> dict[str, Any]:
        """Return the folder of the last study as text."""
        return {"final": str(self.final)}


def discover(
    study: Study | str | Path,
    effects: Iterable[str] | None = None,
    store: RunStore | str | Path | None = None,
    output: str | Path | None = None,
    report: Report | None = None,
    *,
    most: int = MOST,
    effect_rows: int | None = None,
    base_rows: int | None = None,
    executor: Executor | None = None,
) -> Discovery:
    """Repeat diagnose and add until nothing is missing or nothing helps; then ask of each added effect if it is still needed.

    Args:
        study: as `read_study` returns it, or its folder.
        effects: names of those to test; every registered one by default.
        store: that keeps the runs, or its file; by default runs.sqlite in the study's folder, shared by all steps.
        output: folder for verdict.json, discovery.json and the studies step_1_EFFECT …; by default the study's results, and its
            folder discovery for the studies. Those of an earlier search are made anew.
        report: called with the stage and the share done.
        most: effects that may be added.
        effect_rows, base_rows: sizes of the screening designs; see `plan`.
        executor: workers that simulate, as for `run_all`.

    Raises:
        InputError: what `diagnose` refuses, or a folder with studies in it that no earlier search made. What `add` refuses, and
            `diagnose` once something was added, ends the search.
    """
    first = study if isinstance(study, Study) else read_study(study)
    folder = writable(first.path / RESULTS if output is None else output)
    names = None if effects is None else list(effects)
    steps = folder / FOLDER if output is None else folder
    _check_own(folder, steps)
    kept = first.path / STORE if store is None else store
    trail = _Trail(
        first,
        folder,
        steps,
        kept,
        names,
        _Options(effect_rows, base_rows, executor),
        report or (lambda stage, share: None),
    )
    trail.found().save()
    while trail.step(len(trail.added) < most):
        trail.found().save()
    trail.look_back()
    found = trail.found()
    found.save()
    return found


def _check_own(folder: Path, steps: Path) -> None:
    """Refuse a folder with studies that an earlier search did not make; its own are made anew, from the runs in the store."""
    there = sorted(path.name for path in steps.glob(f"{STEP}*") if (path / STUDY_FILE).exists())
    if there and not (folder / JSON_FILE).exists():
        raise InputError(
            f"{steps} holds {', '.join(there)} already; nothing is overwritten. Give another folder with -o."
        )


@dataclass(frozen=True)
class _Options:
    """Sizes of the screening designs and workers, as arguments of `diagnose` and `add`."""

    effect_rows: int | None
    base_rows: int | None
    executor: Executor | None


class _Trail:
    """A search under way: the study as it stands now, what was added, why it stopped."""

    def __init__(
        self,
        first: Study,
        results: Path,
        folder: Path,
        store: RunStore | str | Path,
        names: list[str] | None,
        options: _Options,
        tell: Report,
    ) -> None:
        self.first = self.now = first
        self.results, self.folder, self.store = results, folder, store
        self.names, self.options, self.tell = names, vars(options), tell
        self.steps: list[dict[str, Any]] = []
        self.added: list[Addition] = []
        self.removed: list[str] = []
        self.stopped = "it was interrupted; the same command goes on"
        self.last: Diagnosis | None = None

    def step(self, may_add: bool) -> bool:
        """Diagnose the study as it stands, add what is missing; return whether to go on."""
        number = len(self.steps) + 1
        try:
            self.last = found = self._diagnosed(f"diagnosis {number}")
        except InputError as error:
            if not self.added:
                raise
            self.stopped = str(error)  # such as more knobs than measurements; what was added stays
            return False
        chi2 = {"chi2": found.chi2["recalibrated"], "dof": found.chi2["dof"], "folder": str(self.now.path)}
        self.steps.append({"verdict": found.verdict, "effects": list(found.effects), "added": None, **chi2})
        if not found.effects:
            self.stopped = f"the verdict is {found.verdict}"
        elif not may_add:
            self.stopped = (
                f"no more effects were to be added than {len(self.added)}, though the verdict is {found.verdict}"
            )
        else:
            return self._add(found.effects, number)
        return False

    def _diagnosed(self, stage: str) -> Diagnosis:
        return diagnose(
            self.now,
            self._to_test(),
            store=self.store,
            output=self.results if self.now is self.first else None,
            report=self._told(stage),
            **self.options,
        )

    def _add(self, rivals: Sequence[str], number: int) -> bool:
        """Add each of the leading rivals and go on with the one that fresh seeds bear out best; return whether one did."""
        tried, refused = [], []
        for effect in rivals[:TRIED]:
            try:
                tried.append(self._joined(self.now, effect, f"{STEP}{number}_{effect}", f"adding {effect}"))
            except InputError as error:
                refused.append(str(error))
        if not tried:
            self.stopped = " ".join(refused)
            return False
        best = min(tried, key=lambda added: added.step(WITH_EFFECT)["chi2"])
        before, after = best.step(RECALIBRATED), best.step(WITH_EFFECT)
        if after["chi2"] >= before["chi2"]:
            self.stopped = (
                f"{best.effect} did not lower χ² on fresh seeds ({before['chi2']:.3g} to {after['chi2']:.3g})"
            )
            return False
        self.steps[-1]["added"] = best.effect
        self.added.append(best)
        self.now = read_study(best.new_study)
        return True

    def _joined(self, study: Study, effect: str, name: str, stage: str) -> Addition:
        target = self.folder / name
        if target.is_dir():
            shutil.rmtree(target)  # of an earlier search
        return add(study, effect, target, self.store, self._told(stage), **self.options)

    def look_back(self) -> None:
        """Take out effects whose strength came near vanishing when others joined them, if χ² on fresh seeds agrees."""
        if self.last is None or len(self.steps) <= len(self.added):
            return  # the last study was not diagnosed
        unneeded = [earlier for earlier in self.added[:-1] if self._vanished(earlier)]
        if not unneeded:
            return
        try:
            kept, study = self._rebuilt([a for a in self.added if a not in unneeded])
        except InputError:
            return  # without them the others are not asked for: they stay
        rise = kept[-1].step(WITH_EFFECT)["chi2"] - self.added[-1].step(WITH_EFFECT)["chi2"]
        if not rise > NEEDED**2 * len(unneeded):
            self.removed = [a.effect for a in unneeded]
            self.added, self.now = kept, study

    def _vanished(self, earlier: Addition) -> bool:
        """Return whether every strength of an added effect, re-calibrated with the others, lies near where it vanishes."""
        assert self.last is not None
        parameters = plugins.get("effect", earlier.effect).parameters
        vanishing = next(p.vanishing for p in parameters if p.name == earlier.parameter)
        rows = [p for p in self.last.parameters if p["key"].endswith(f"{earlier.effect}.{earlier.parameter}")]
        return bool(rows) and all(abs(p["recalibrated"] - vanishing) < NEEDED * p["u_recalibrated"] for p in rows)

    def _rebuilt(self, wanted: Sequence[Addition]) -> tuple[list[Addition], Study]:
        """Return additions and study built anew from the first one with some of the effects only."""
        study, made = self.first, []
        for number, earlier in enumerate(wanted, 1):
            made.append(self._joined(study, earlier.effect, f"{STEP}back_{number}", "looking back"))
            study = read_study(made[-1].new_study)
        return made, study

    def _to_test(self) -> list[str] | None:
        present = {effect.name for effect in self.now.model().effects}
        return None if self.names is None else [name for name in self.names if name not in present]

    def _told(self, stage: str) -> Report:
        return lambda part, share: self.tell(f"{stage}: {part}", share)

    def found(self) -> Discovery:
        """Return what was found so far."""
        return Discovery(
            study=self.first.title,
            steps=self.steps,
            removed=self.removed,
            stopped_because=self.stopped,
            text=self.text(),
            final=self.now.path,
            folder=self.results,
        )

    def text(self) -> str:
        """Return what happened as one paragraph."""
        told = ["No effect was added."]
        if self.added:
            before, after = self.added[0].step(RECALIBRATED)["chi2"], self.added[-1].step(WITH_EFFECT)["chi2"]
            names = ", ".join(a.effect for a in self.added)
            told = [f"Added: {names}; on fresh seeds χ² fell from {before:.3g} re-calibrated to {after:.3g}."]
        if self.removed:
            told.append(f"Taken out again, since beside the others it is not needed: {', '.join(self.removed)}.")
        return " ".join([*told, f"It stopped because {self.stopped.rstrip('.')}."])
