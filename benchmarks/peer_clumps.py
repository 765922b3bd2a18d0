"""A settled bed of clumps on LIGGGHTS (`fix multisphere`), where it is installed, held ready so that blocks can be timed in turn.

It drops its clumps at random into the same box and settles them itself, as it takes no clumps from a file of ours.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
import time
from pathlib import Path

from benchmarks.bed import DENSITY, DIAMETER, SKIN, WIDTH
from benchmarks.peer_liggghts import LAW, PLANES, executable
from taichidem.shapes import Multisphere

HEIGHT = 0.16  # of the region where clumps appear [m]


class PeerClumps:
    """LIGGGHTS with a bed of clumps; it runs a block whenever asked, on one processor.

    Args:
        shape: the clump.
        grains: how many.
        stiffness: of the grains [Pa].
        time_step: [s].
        settling: steps before the first block.
        core: the processor.
    """

    def __init__(
        self, shape: Multisphere, grains: int, stiffness: float, time_step: float, settling: int, core: int
    ) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._grains, self._blocks = grains, 0
        self._seconds: list[float] = []

        def pin() -> None:
            if hasattr(os, "sched_setaffinity"):
                os.sched_setaffinity(0, {core})

        self._printed = (Path(self._folder.name) / "printed").open("w+")
        self._process = subprocess.Popen(
            [str(executable())],
            cwd=self._folder.name,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=self._printed,
            stderr=subprocess.STDOUT,
            preexec_fn=pin,  # the process that starts it must not have started Taichi
            text=True,
        )
        self._tell(_deck(shape, grains, stiffness, time_step))
        self.run(settling)
        self._settled = self._blocks

    def run(self, steps: int) -> None:
        """Run steps and wait for their end; an empty file tells it, as what LIGGGHTS prints comes late."""
        done = Path(self._folder.name) / f"done{self._blocks}"
        self._blocks += 1
        before = self._processor_seconds()
        self._tell(f"run {steps}\nshell touch {done.name}\n")
        while not done.exists():
            if self._process.poll() is not None:
                raise RuntimeError("LIGGGHTS stopped in the bed of clumps:\n" + self._text()[-1500:])
            time.sleep(0.02)
        self._seconds.append(self._processor_seconds() - before)

    def close(self) -> tuple[list[float], list[int]]:
        """End it; return each block's rate, clump-steps per second of processor time, and how often it built lists."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait(timeout=60)
        text = self._text()
        loops = re.findall(r"Loop time of (\S+) on 1 procs for (\d+) steps with (\d+) atoms", text)
        builds = re.findall(r"Neighbor list builds = (\d+)", text)
        self._printed.close()
        self._folder.cleanup()
        per_clump = {int(atoms) % self._grains for _, _, atoms in loops}
        if len(loops) != self._blocks or per_clump != {0}:
            raise RuntimeError(f"LIGGGHTS lost clumps or did not finish: {loops}")
        timed = loops[self._settled :]
        rates = [
            self._grains * int(steps) / seconds
            for (_, steps, _), seconds in zip(timed, self._seconds[self._settled :], strict=True)
        ]
        return rates, [int(number) for number in builds[-len(timed) :]]

    def _processor_seconds(self) -> float:
        """Return the processor time it has used [s]."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def _tell(self, text: str) -> None:
        if self._process.stdin is None:
            raise RuntimeError("LIGGGHTS takes no commands.")
        self._process.stdin.write(text)
        self._process.stdin.flush()

    def _text(self) -> str:
        self._printed.seek(0)
        return self._printed.read()


def _deck(shape: Multisphere, grains: int, stiffness: float, time_step: float) -> str:
    """Return the commands up to the first step."""
    walls = "\n".join(
        f"fix wall{k} all wall/gran {LAW} primitive type 2 {kind} {place:.17g}"
        for k, (kind, place) in enumerate(PLANES)
    )
    spheres = " ".join(f"{v:.12g}" for row, r in zip(shape.centres, shape.radii, strict=True) for v in (*row, r))
    return f"""{_laws(stiffness)}
timestep {time_step}
fix weight all gravity 9.81 vector 0.0 0.0 -1.0
{walls}
fix clump all particletemplate/multisphere 15485863 atom_type 1 density constant {DENSITY} nspheres {len(shape.radii)} &
 ntry 100000 spheres {spheres} type 1
fix mix all particledistribution/discrete 32452843 1 clump 1.0
region space block 0 {WIDTH} 0 {WIDTH} 0 {HEIGHT} units box
fix drop all insert/pack seed 49979687 distributiontemplate mix maxattempt 500 insert_every once overlapcheck yes &
 all_in yes vel constant 0. 0. 0. orientation random region space particles_in_region {grains}
fix motion all multisphere
thermo 1000000
"""


def _laws(stiffness: float) -> str:
    """Return box and contact laws; type 1 is polypropylene, type 2 the steel of the walls."""
    side = f"{-DIAMETER:.17g} {WIDTH + DIAMETER:.17g}"
    return f"""
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
units si
hard_particles yes
region box block {side} {side} {-DIAMETER:.17g} {HEIGHT + DIAMETER:.17g} units box
create_box 2 box
neighbor {SKIN} bin
neigh_modify delay 0 every 1 check yes
fix m1 all property/global youngsModulus peratomtype {stiffness} 198e9
fix m2 all property/global poissonsRatio peratomtype 0.36 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 2 0.55 0.55 0.55 0.55
fix m4 all property/global coefficientFriction peratomtypepair 2 0.52 0.26 0.26 0.26
fix m5 all property/global coefficientRollingFriction peratomtypepair 2 0.05 0.246 0.246 0.246
pair_style gran {LAW}
pair_coeff * *"""
