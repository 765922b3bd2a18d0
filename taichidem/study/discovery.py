"""Diagnose and add again and again, until nothing is missing or nothing helps."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from taichidem.errors import InputError
from taichidem.study.addition import RECALIBRATED, WITH_EFFECT, Addition
from taichidem.study.addition_run import add
from taichidem.study.campaign import STORE
from taichidem.study.comparison import plain
from taichidem.study.comparison_run import Report, writable
from taichidem.study.diagnosis import Diagnosis
from taichidem.study.diagnosis_run import diagnose
from taichidem.study.run_store import RunStore
from taichidem.study.study_file import Study, read_study

SCHEMA = 1
JSON_FILE = "discovery.json"
FOLDER = "discovery"
MOST = 3  # effects added; a bench that asks for more lacks something else
TRIED = 2  # rivals that can't be told apart are added in turn, and fresh simulations choose
NEEDED = 2.0  # standard uncertainties from vanishing that an added effect keeps once others are in


@dataclass(frozen=True, eq=False)
class Discovery:
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

    study: str
    steps: Sequence[Mapping[str, Any]]
    removed: Sequence[str]
    stopped_because: str
    text: str
    final: Path
    folder: Path

    def as_dict(self) -> dict[str, Any]:
        """Return what discovery.json holds."""
        held = {name: value for name, value in vars(self).items() if name not in ("folder", "final")}
        return plain({"schema": SCHEMA, **held, "final": str(self.final)})

    def to_json(self) -> str:
        """Return discovery.json as text."""
        return json.dumps(self.as_dict(), indent=2, ensure_ascii=False, allow_nan=False)

    def save(self) -> Path:
        """Write discovery.json into the folder and return its path."""
        path = self.folder / JSON_FILE
        path.write_text(self.to_json() + "\n", encoding="utf-8")
        return path


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
) -> Discovery:
    """Repeat diagnose and add until nothing is missing or nothing helps; then ask of each added effect if it is still needed.

    Args:
        study: as `read_study` returns it, or its folder.
        effects: names of those to test; every registered one by default.
        store: that keeps the runs, or its file; by default runs.sqlite in the study's folder, shared by all steps.
        output: folder for discovery.json and the studies step_1_EFFECT …; by default discovery in the study's results.
        report: called with the stage and the share done.
        most: effects that may be added.
        effect_rows, base_rows: sizes of the screening designs; see `plan`.

    Raises:
        InputError: what `diagnose` and `add` refuse.
    """
    first = study if isinstance(study, Study) else read_study(study)
    folder = writable(first.path / "results" if output is None else output)
    names = None if effects is None else list(effects)
    steps = folder / FOLDER if output is None else folder
    kept = first.path / STORE if store is None else store
    trail = _Trail(first, steps, kept, names, _Sizes(effect_rows, base_rows), report or (lambda stage, share: None))
    while trail.step(len(trail.added) < most):
        pass
    trail.look_back()
    found = Discovery(
        study=first.title,
        steps=trail.steps,
        removed=trail.removed,
        stopped_because=trail.stopped,
        text=trail.text(),
        final=trail.now.path,
        folder=folder,
    )
    found.save()
    return found


@dataclass(frozen=True)
class _Sizes:
    """Sizes of the screening designs, as arguments of `diagnose` and `add`."""

    effect_rows: int | None
    base_rows: int | None


class _Trail:
    """A search under way: the study as it stands now, what was added, why it stopped."""

    def __init__(
        self,
        first: Study,
        folder: Path,
        store: RunStore | str | Path,
        names: list[str] | None,
        sizes: _Sizes,
        tell: Report,
    ) -> None:
        self.first = self.now = first
        self.folder, self.store, self.names, self.sizes, self.tell = folder, store, names, sizes, tell
        self.steps: list[dict[str, Any]] = []
        self.added: list[Addition] = []
        self.removed: list[str] = []
        self.stopped = ""
        self.last: Diagnosis | None = None

    def step(self, may_add: bool) -> bool:
        """Diagnose the study as it stands, add what is missing; return whether to go on."""
        number = len(self.steps) + 1
        found = diagnose(
            self.now,
            self._to_test(),
            store=self.store,
            report=self._told(f"diagnosis {number}"),
            effect_rows=self.sizes.effect_rows,
            base_rows=self.sizes.base_rows,
        )
        self.last = found
        chi2 = {"chi2": found.chi2["recalibrated"], "dof": found.chi2["dof"], "folder": str(self.now.path)}
        self.steps.append({"verdict": found.verdict, "effects": list(found.effects), "added": None, **chi2})
        if not found.effects:
            self.stopped = f"the verdict is {found.verdict}"
        elif not may_add:
            self.stopped = f"{len(self.added)} effects were added, and more would be another search"
        else:
            return self._add(found.effects, number)
        return False

    def _add(self, rivals: Sequence[str], number: int) -> bool:
        """Add each of the leading rivals and go on with the one that fresh seeds bear out best; return whether one did."""
        tried: list[Addition] = []
        for effect in rivals[:TRIED]:
            try:
                tried.append(
                    self._joined(self.now, effect, self.folder / f"step_{number}_{effect}", f"adding {effect}")
                )
            except InputError as error:
                self.stopped = str(error)
        if not tried:
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

    def _joined(self, study: Study, effect: str, target: Path, stage: str) -> Addition:
        sizes, told = self.sizes, self._told(stage)
        return add(study, effect, target, self.store, told, effect_rows=sizes.effect_rows, base_rows=sizes.base_rows)

    def look_back(self) -> None:
        """Take out an effect whose strength came near vanishing when another joined it."""
        if self.last is None or len(self.added) < 2:
            return
        for earlier in self.added[:-1]:
            rows = [p for p in self.last.parameters if f"{earlier.effect}.{earlier.parameter}" in p["key"]]
            if rows and all(abs(p["recalibrated"] - _vanishing(p)) < NEEDED * p["u_recalibrated"] for p in rows):
                self._without(earlier)

    def _without(self, unneeded: Addition) -> None:
        """Build the study anew from the first one with the effects that are still needed."""
        study = self.first
        for number, kept in enumerate((a for a in self.added if a is not unneeded), 1):
            target = self.folder / f"without_{unneeded.effect}_{number}"
            study = read_study(self._joined(study, kept.effect, target, "looking back").new_study)
        self.removed.append(unneeded.effect)
        self.now = study

    def _to_test(self) -> list[str] | None:
        present = {effect.name for effect in self.now.model().effects}
        return None if self.names is None else [name for name in self.names if name not in present]

    def _told(self, stage: str) -> Report:
        return lambda part, share: self.tell(f"{stage}: {part}", share)

    def text(self) -> str:
        """Return what happened as one paragraph."""
        kept = [a.effect for a in self.added if a.effect not in self.removed]
        fell = f"χ² fell from {self.steps[0]['chi2']:.3g} to {self.steps[-1]['chi2']:.3g}" if self.steps else ""
        added = f"Added: {', '.join(kept)}; {fell}." if kept else "No effect was added."
        gone = (
            f" {', '.join(self.removed)} was taken out again: beside the others it is not needed."
            if self.removed
            else ""
        )
        return f"{added}{gone} It stopped because {self.stopped.rstrip('.')}."


def _vanishing(row: Mapping[str, Any]) -> float:
    """Return the end of an added parameter's range at which the effect vanishes: the low one, or 1 for ratios that fall."""
    return float(row["high"] if row["high"] == 1.0 and row["low"] > 0 else row["low"])
