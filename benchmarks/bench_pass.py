"""How long one pass over all experiments of a study takes: one seed on one thread, two seeds on two, and LIGGGHTS.

`python -m benchmarks.bench_pass` plays the study pub-a with its true friction. Every experiment is compiled before its clock
starts: its first grains are inserted, one step done and one look taken, on the engine that is then timed. The three
measurements of an experiment follow one another at once, so that a busy machine meets all of them; ours with one thread and
LIGGGHTS share one processor. LIGGGHTS is timed by its own clock over its steps, without start-up and without insertion of the
rain, ours from the experiment to its observable. The rebound tests, thousands of steps of one grain, are left out of the
comparison.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks import pass_decks, pass_liggghts, pass_ours, peer_liggghts
from benchmarks.agreement import STUDIES
from benchmarks.pass_liggghts import PeerTiming
from benchmarks.pass_ours import Timing
from benchmarks.report import aligned, last_core, load, machine, tell
from benchmarks.worker import Worker
from taichidem.errors import InputError
from taichidem.experiments import Experiment
from taichidem.scene import Model
from taichidem.study import read_study

TRUE = {"granule-granule.static_friction": 0.40, "granule-wall.static_friction": 0.30}
AIM = 1.15  # seconds of two seeds on two threads over those of one on one
QUICK = 0.02  # [s] that every stage of a quick pass lasts
STAGES = ("settle_time", "flow_time", "spin_up_time", "averaging_time")
SHORTEST = {"averaging_time": 0.05}
QUICK_STREAM = 48  # grains of a quick pass that are poured


@dataclass(frozen=True)
class Row:
    """What one experiment took: ours with one seed and thread, with two of both, and LIGGGHTS with one."""

    experiment: str
    particles: int
    one: Timing
    two: Timing | None
    peer: PeerTiming | None

    @property
    def outside(self) -> float:
        """Share of our seconds in which nothing stepped."""
        return 1 - self.one.stepping / self.one.seconds


def shortened(test: Experiment) -> Experiment:
    """Return an experiment whose stages last some hundredths of a second; it tests the benchmark and measures nothing."""
    settings = dict(test.settings)
    settings |= {stage: SHORTEST.get(stage, QUICK) for stage in STAGES if stage in settings}
    if "stream_rate" in settings:
        settings["particles"] = QUICK_STREAM
    return type(test)(**settings)


def checked(name: str, timing: Timing | PeerTiming) -> None:
    """Raise RuntimeError if a test gave no observable, as its time would then mean nothing."""
    failure = timing.failure if isinstance(timing, PeerTiming) else " ".join(timing.failures)
    if failure:
        raise RuntimeError(f"{name} failed: {failure}")


def measure(
    tests: Mapping[str, Experiment], model: Model, seeds: Sequence[int], *, peer: bool, two: bool, quick: bool
) -> tuple[list[Row], float]:
    """Measure the experiments one by one; return a row of each, and the seconds that compiling for one thread took."""
    core, rows, compiling = last_core(), [], 0.0
    with Worker(1, core) as single, Worker(2) as double:
        for name, test in tests.items():
            tell(f"{name}: compiling")
            compiling += single.call(pass_ours.warm, test, model, 1)
            if two:
                double.call(pass_ours.warm, test, model, 2)
            tell(f"{name}: one seed")
            one = single.call(pass_ours.timed, test, model, seeds[:1])
            theirs = None
            if peer and test.name in pass_decks.PROCEDURES:
                tell(f"{name}: LIGGGHTS")
                theirs = pass_liggghts.timed(pass_decks.Case(test, model, seeds[0]), core or 0)
            pair = None
            if two:
                tell(f"{name}: two seeds")
                pair = double.call(pass_ours.timed, test, model, seeds[:2])
            for timing in (one, theirs, pair):
                if timing is not None and not quick:
                    checked(name, timing)
            rows.append(Row(name, test.particles_needed(), one, pair, theirs))
    return rows, compiling


def table(rows: Sequence[Row]) -> str:
    """Return the rows as text, with totals of all tests and of those that LIGGGHTS ran."""
    heads = ["experiment", "particles", "steps", "M particle-steps", "ours [s]", "M/s", "not stepping", "2 seeds [s]"]
    lines = [[*heads, "ratio", "LIGGGHTS [s]", "its steps", "ours/LIGGGHTS"]]
    for r in rows:
        lines.append([r.experiment, str(r.particles), *_numbers([r])])
    lines.append(["all", "", *_numbers(rows)])
    compared = [row for row in rows if row.peer]
    if compared:
        lines.append(["compared", "", *_numbers(compared)])
    return aligned(lines)


def _numbers(rows: Sequence[Row]) -> list[str]:
    """Return the sums over rows and their ratios; LIGGGHTS' only where it ran all of them."""
    ones, pairs, peers = [r.one for r in rows], [r.two for r in rows if r.two], [r.peer for r in rows if r.peer]
    seconds, work = sum(t.seconds for t in ones), sum(t.particle_steps for t in ones)
    cells = [str(sum(t.steps for t in ones)), f"{work / 1e6:.2f}", f"{seconds:.2f}", f"{work / seconds / 1e6:.2f}"]
    cells.append(f"{100 * (1 - sum(t.stepping for t in ones) / seconds):.1f} %")
    double = sum(t.seconds for t in pairs)
    cells += [f"{double:.2f}", f"{double / seconds:.2f}"] if len(pairs) == len(rows) else ["–", "–"]
    if len(peers) < len(rows):
        return [*cells, "–", "–", "–"]
    theirs = sum(t.seconds for t in peers)
    return [*cells, f"{theirs:.2f}", str(sum(t.steps for t in peers)), f"{seconds / theirs:.2f}"]


def observed(rows: Sequence[Row]) -> str:
    """Return what each code saw, seed by seed, to show that the tests were the same."""
    lines = [["experiment", "observable", "ours, seed by seed", "LIGGGHTS"]]
    for r in rows:
        every = (r.one.observables[:1]) + (r.two.observables[1:] if r.two else ())
        for name in dict.fromkeys(name for values in (*every, r.peer.observables if r.peer else {}) for name in values):
            ours = "  ".join(f"{values[name]:.4g}" for values in every if name in values)
            theirs = f"{r.peer.observables[name]:.4g}" if r.peer and name in r.peer.observables else "–"
            lines.append([r.experiment, name, ours, theirs])
    return aligned(lines)


def as_text(rows: Sequence[Row], compiling: float, peer: str, loads: tuple[float, float]) -> str:
    """Return everything for the screen."""
    text = [machine(), f"Peer: {peer}.", f"Load before {loads[0]:.2f}, after {loads[1]:.2f} (idle is near 0).", ""]
    text += [table(rows), "", observed(rows), ""]
    text.append(
        f"Compiling for one thread, not in the above: {compiling:.1f} s (kernels in Taichi's cache load quicker)."
    )
    one = sum(r.one.seconds for r in rows)
    pairs = [r.two.seconds for r in rows if r.two]
    computed = sum(r.one.processor for r in rows)
    text.append(f"One seed on one thread: {one:.1f} s, in which it computed for {computed:.1f} s.")
    if len(pairs) == len(rows):
        ratio = sum(pairs) / one
        verdict = "reached" if ratio <= AIM else "missed"
        text.append(
            f"Two seeds on two threads: {sum(pairs):.1f} s, {ratio:.2f} times that; the aim of {AIM} is {verdict}."
        )
        each = sum(r.two.processor for r in rows if r.two) / 2
        text.append(
            f"They computed for {each:.1f} s each; computed and passed time differ where others use the machine."
        )
    return "\n".join(text)


def as_dict(rows: Sequence[Row], compiling: float, peer: str, loads: tuple[float, float]) -> dict[str, Any]:
    """Return plain values for JSON."""
    return {
        "machine": machine(),
        "peer": peer,
        "load": list(loads),
        "compile_seconds": compiling,
        "experiments": [asdict(row) | {"outside": row.outside} for row in rows],
    }


def parser() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bench_pass",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--study", type=Path, default=STUDIES / "pub-a", help="study folder")
    parser.add_argument("--only", nargs="+", metavar="EXPERIMENT", help="only these experiments")
    parser.add_argument("--seeds", type=int, nargs=2, default=(1, 2), metavar="N")
    parser.add_argument(
        "--quick", action="store_true", help="a few hundredths of a second of each test; measures nothing"
    )
    parser.add_argument("--no-peer", action="store_true", help="do not run LIGGGHTS")
    parser.add_argument("--no-pair", action="store_true", help="do not run two seeds on two threads")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all numbers to a file")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the pass and print its tables."""
    given = parser().parse_args(arguments)
    peer = not given.no_peer and peer_liggghts.executable() is not None
    absent = "left out" if given.no_peer else "liggghts is not on the PATH (Debian: apt-get install liggghts)"
    before = load()
    try:
        study = read_study(given.study)
        tests = {name: study.experiment(name) for name in given.only or study.experiments}
        if given.quick:
            tests = {name: shortened(test) for name, test in tests.items()}
        model = study.model_with(TRUE)
        rows, compiling = measure(tests, model, given.seeds, peer=peer, two=not given.no_pair, quick=given.quick)
    except InputError as error:
        print(f"Error: {error}", file=sys.stderr)
        return 2
    report = (rows, compiling, peer_liggghts.version() if peer else absent, (before, load()))
    print(as_text(*report))
    if given.json is not None:
        given.json.write_text(json.dumps(as_dict(*report), indent=2) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
