"""The same bed on LIGGGHTS, where it is installed, on one processor."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.bed import DENSITY, DIAMETER, SKIN, STIFFNESS, TIME_STEP, WIDTH
from benchmarks.worker import peak_memory

LAW = "model hertz tangential history rolling_friction cdt"
PLANES = (("xplane", 0.0), ("xplane", WIDTH), ("yplane", 0.0), ("yplane", WIDTH), ("zplane", 0.0))


@dataclass(frozen=True)
class PeerBlock:
    """One timed block of LIGGGHTS by its own clock ("Loop time"): rate, list builds, peak resident memory [MB]."""

    rate: float
    rebuilds: int
    memory: float


def executable() -> str | None:
    """Return where LIGGGHTS is, or None."""
    return shutil.which("liggghts")


def version() -> str:
    """Return what LIGGGHTS calls itself."""
    with tempfile.TemporaryDirectory() as folder:  # it leaves a log file wherever it is started
        answer = subprocess.run([str(executable()), "-h"], cwd=folder, capture_output=True, text=True, check=False)
    found = re.search(r"Version ([^,]+),", answer.stdout)
    return found.group(1) if found else "LIGGGHTS of unknown version"


def timed_block(position: np.ndarray, warm_up: int, steps: int, core: int) -> PeerBlock:
    """Start from the settled bed at rest, warm up, and let LIGGGHTS time the steps that follow.

    Raises:
        RuntimeError: LIGGGHTS failed; the end of what it printed is shown.
    """
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "bed.data").write_text(_data(position))
        printed, memory = run_deck(folder, _deck(warm_up, steps), core)
    loops = re.findall(r"Loop time of (\S+) on 1 procs for (\d+) steps with (\d+) atoms", printed)
    builds = re.findall(r"Neighbor list builds = (\d+)", printed)
    if not loops or int(loops[-1][1]) != steps or int(loops[-1][2]) != len(position):
        raise RuntimeError("LIGGGHTS did not finish the bed:\n" + printed[-1500:])
    return PeerBlock(len(position) * steps / float(loops[-1][0]), int(builds[-1]), memory)


def run_deck(folder: str, deck: str, core: int) -> tuple[str, float]:
    """Run an input script in a folder on one processor; return what LIGGGHTS printed and its peak resident memory [MB]."""
    (Path(folder) / "in.deck").write_text(deck)

    def pin() -> None:
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, {core})

    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    with (Path(folder) / "printed").open("w+") as printed:
        process = subprocess.Popen(
            [str(executable()), "-in", "in.deck"],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=printed,
            stderr=subprocess.STDOUT,
            preexec_fn=pin,  # this process starts neither threads nor Taichi, so a fork is safe
        )
        memory = 0.0
        while process.poll() is None:
            memory = np.fmax(memory, peak_memory(process.pid))
            time.sleep(0.05)
        printed.seek(0)
        return printed.read(), float(memory)


def _data(position: np.ndarray) -> str:
    """Return the grains as a data file: id, type, diameter, density, x, y, z."""
    top = float(position[:, 2].max()) + 2 * DIAMETER
    side = f"{-DIAMETER:.17g} {WIDTH + DIAMETER:.17g}"
    head = f"settled bed\n\n{len(position)} atoms\n2 atom types\n\n{side} xlo xhi\n{side} ylo yhi\n"
    head += f"{-DIAMETER:.17g} {top:.17g} zlo zhi\n\nAtoms\n\n"
    rows = (f"{k} 1 {DIAMETER} {DENSITY} {x:.17g} {y:.17g} {z:.17g}\n" for k, (x, y, z) in enumerate(position, 1))
    return head + "".join(rows)


def _deck(warm_up: int, steps: int) -> str:
    """Return the input script; type 1 is polypropylene, type 2 the steel of the walls."""
    walls = "\n".join(
        f"fix wall{k} all wall/gran {LAW} primitive type 2 {kind} {place:.17g}"
        for k, (kind, place) in enumerate(PLANES)
    )
    return f"""
atom_style granular
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
read_data bed.data
neighbor {SKIN} bin
neigh_modify delay 0 every 1 check yes
fix m1 all property/global youngsModulus peratomtype {STIFFNESS} 198e9
fix m2 all property/global poissonsRatio peratomtype 0.36 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.55 0.55 0.55 0.55
fix m4 all property/global coefficientFriction peratomtypepair 2 0.52 0.26 0.26 0.26
fix m5 all property/global coefficientRollingFriction peratomtypepair 2 0.05 0.246 0.246 0.246
pair_style gran {LAW}
pair_coeff * *
timestep {TIME_STEP}
fix weight all gravity 9.81 vector 0.0 0.0 -1.0
{walls}
fix motion all nve/sphere
thermo 1000000
run {warm_up}
run {steps}
"""
