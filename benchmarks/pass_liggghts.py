"""The bulk tests of a pass on LIGGGHTS, on one processor: run the scripts, read its clock, measure what it left behind."""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from benchmarks.pass_decks import Case, deck
from benchmarks.pass_ours import seen
from benchmarks.peer_liggghts import run_deck
from taichidem.errors import TaichidemError


@dataclass(frozen=True)
class PeerTiming:
    """One test by LIGGGHTS' own clock ("Loop time"), all its runs summed; `failure` where it could not be measured."""

    seconds: float
    steps: int
    observables: dict[str, float]
    failure: str = ""


def frames(path: Path) -> list[np.ndarray]:
    """Return the positions of the grains, (n, 3) [m], in each frame of a dump of id, x, y, z."""
    parts = path.read_text().split("ITEM: ATOMS id x y z")[1:]
    rows = [part.split("ITEM:")[0].split() for part in parts]
    return [np.array(row, float).reshape(-1, 4)[:, 1:] for row in rows]


def observe(case: Case, printed: str, folder: Path) -> dict[str, float]:
    """Return the observables of what LIGGGHTS left behind, measured as ours are."""
    last, grain = frames(folder / "last.dump")[-1], case.test.grain(case.model)
    snapshot = SimpleNamespace(
        position=last, radius=np.full(len(last), grain.radius), mass=np.full(len(last), grain.mass)
    )
    looks = np.array(re.findall(r"^look (\S+) (\d+)", printed, re.M), float).reshape(-1, 2)
    record = {"time": looks[:, 0], "count": looks[:, 1], "mass": looks[:, 1] * grain.mass}
    if (folder / "frames.dump").exists():
        record["frame"] = [frame[:, [0, 2]] for frame in frames(folder / "frames.dump")]
    values, details = case.test.measure(snapshot, record)  # type: ignore[arg-type]
    return seen(values, details)


def loops(printed: str) -> tuple[float, int]:
    """Return the seconds and the steps of all runs, by LIGGGHTS' own clock."""
    found = re.findall(r"Loop time of (\S+) on 1 procs for (\d+) steps", printed)
    return sum(float(seconds) for seconds, _ in found), sum(int(steps) for _, steps in found)


def timed(case: Case, core: int) -> PeerTiming:
    """Run a test on one processor.

    Raises:
        RuntimeError: LIGGGHTS failed; the end of what it printed is shown.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        printed, _ = run_deck(name, deck(case, folder), core)
        seconds, steps = loops(printed)
        if "ERROR" in printed or not (folder / "last.dump").exists():
            raise RuntimeError(f"LIGGGHTS did not finish {case.test.name}:\n{printed[-1500:]}")
        try:
            return PeerTiming(seconds, steps, observe(case, printed, folder))
        except (TaichidemError, ValueError) as error:
            return PeerTiming(seconds, steps, {}, str(error))
