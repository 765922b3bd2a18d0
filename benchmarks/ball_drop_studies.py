"""Study folders of filmed ball drops, to be compared and diagnosed: `python -m benchmarks.ball_drop_studies --output FOLDER`.

A study per ball. Its model knows gravity alone; each drop is a `free_fall` of the ball's mass and diameter that begins well
after the ball was let go. Where and how fast the ball was then nobody measured, so that height and speed of each drop are
re-calibrated, within what the frames around show. A dozen well-separated frames are the measurements.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.ball_drops import DATA, Ball, Drop, fallen, lay, read_balls
from taichidem.errors import InputError, SimulationError

ORIGIN = 0.5  # [s] in the film from which on heights are used; every ball then moves at 3 m/s or more
HEIGHTS = 12  # measurements per drop, 0.2 s and more apart
NEIGHBOURS = 3  # frames before and after the origin between which its speed is read
DENSE = ("bowling_ball", "baseball")  # balls whose fall is known best: air hardly slows them
SPEED_RANGE = 2.0  # [m/s] on either side of the speed that was read
HEIGHT_RANGE = 1.0  # [m] on either side of the height that was read


@dataclass(frozen=True)
class HeightUncertainty:
    """Standard uncertainty of one height in the film [m], and what it is made of.

    Attributes:
        scatter: RMS error of the dense balls about a fall without drag [m].
        correlation: of errors at the distance between two measurements [1].
        film: what the film may be wrong by beyond that [m].
    """

    scatter: float
    correlation: float
    film: float

    @property
    def value(self) -> float:
        """u² = σ² (1 + ρ)/(1 − ρ) + u_film² [m]: as many independent errors of this size say as much as the correlated ones."""
        return math.sqrt(self.scatter**2 * (1 + self.correlation) / (1 - self.correlation) + self.film**2)


def height_uncertainty(dense: Sequence[Ball]) -> HeightUncertainty:
    """Return the uncertainty of a height, from dense balls alone, so that it owes nothing to the drag of light ones.

    The dense balls fall in these films as if there were no air. Whether the films' scale hides their drag, or the drag crisis
    takes it away, nobody knows: the films may be wrong by anything up to what the drag of a smooth sphere would do to the heights
    after height and speed at the origin were fitted. A rectangular distribution of that half-width has the standard
    uncertainty RMS/√3.
    """
    plain, dragged, correlations = [], [], []
    for ball in dense:
        cut = from_origin(ball)
        without, with_drag = (lay(cut, distance) for distance in fallen(cut, [0.0, 1.0]))
        plain.append(without.misfit**2)
        dragged.append(max(0.0, with_drag.misfit**2 - without.misfit**2))
        correlations += [autocorrelation(e, len(e) // HEIGHTS) for e in without.errors]
    scatter, film = math.sqrt(np.mean(plain)), math.sqrt(np.mean(dragged) / 3)
    return HeightUncertainty(scatter, max(0.0, float(np.mean(correlations))), film)


def autocorrelation(errors: np.ndarray, lag: int) -> float:
    """Return how far errors follow those `lag` frames before, 1 for wholly."""
    return float(np.sum(errors[lag:] * errors[:-lag]) / np.sum(errors**2))


def from_origin(ball: Ball) -> Ball:
    """Return a ball with the frames before the origin left out; times still count from the first frame."""
    return replace(ball, drops=tuple(Drop(d.time[d.time >= ORIGIN], d.height[d.time >= ORIGIN]) for d in ball.drops))


def write_study(ball: Ball, u: float, folder: Path) -> Path:
    """Write the study of a ball whose heights have a standard uncertainty u [m]; return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    entries, tests, rows = [], [], []
    for number, drop in enumerate(ball.drops, 1):
        times, heights = measured(drop)
        speed = speed_at_origin(drop)
        name = f"drop_{number}"
        entries += [
            _range(f"{name}.release_height", heights[0], HEIGHT_RANGE, "m"),
            _range(f"{name}.release_speed", speed, SPEED_RANGE, "m/s"),
        ]
        tests.append(_test(name, ball, heights[0], speed, times))
        rows += [f"{name},height,{h:.6f},{u:.3f},m,1,{t:g}" for t, h in zip(times, heights, strict=True)]
    text = HEAD.format(
        title=ball.name.replace("_", " ").capitalize(),
        mass=1e3 * ball.mass,
        diameter=1e3 * ball.diameter,
        density=ball.mass / (math.pi / 6 * ball.diameter**3),
        entries="\n".join(entries),
        tests="\n".join(tests),
    )
    (folder / "study.toml").write_text(text, encoding="utf-8")
    table = "\n".join(["experiment,observable,value,u,unit,n,time", *rows])
    (folder / "measurements.csv").write_text(table + "\n", encoding="utf-8")
    return folder


def measured(drop: Drop) -> tuple[np.ndarray, np.ndarray]:
    """Return times from the origin [s] and heights [m] of a dozen frames from the origin to the last, evenly apart."""
    used = np.flatnonzero(drop.time >= ORIGIN)
    chosen = used[np.unique(np.linspace(0, len(used) - 1, HEIGHTS).round().astype(int))]
    return (drop.time[chosen] - drop.time[chosen[0]]).round(6), drop.height[chosen]


def speed_at_origin(drop: Drop) -> float:
    """Return the downward speed at the origin as the frames around it show it [m/s]."""
    first = int(np.flatnonzero(drop.time >= ORIGIN)[0])
    near = slice(max(0, first - NEIGHBOURS), first + NEIGHBOURS + 1)
    return float(-np.polyfit(drop.time[near], drop.height[near], 1)[0])


def _range(key: str, believed: float, width: float, unit: str) -> str:
    return f'"{key}" = {{ low = "{believed - width:.3f} {unit}", high = "{believed + width:.3f} {unit}" }}'


def _test(name: str, ball: Ball, height: float, speed: float, times: np.ndarray) -> str:
    lines = [
        f"[experiments.{name}]",
        'type = "free_fall"',
        f'mass = "{1e3 * ball.mass:g} g"',
        f'release_height = "{height:.3f} m"',
        f'release_speed = "{speed:.3f} m/s"',
        f"time = [{', '.join(f'{t:g}' for t in times)}]",
    ]
    return "\n".join([*lines, ""])


HEAD = """\
# A real ball, filmed as it falls from about 47 m: de Silva, Higdon, Brunton & Kutz (2020), doi 10.3389/frai.2020.00025.
# Time counts from a frame well after the ball was let go; where it was then and how fast is only known from the frames.
schema = 1
title = "{title}, {mass:.0f} g"

[particle]
diameter = "{diameter:g} mm"
material = "ball"

[materials.ball]                        # only its density matters, since nothing is touched
density = "{density:.1f} kg/m^3"
youngs_modulus = "10 MPa"
poissons_ratio = 0.3

[contacts.ball-ball]
restitution = 0.5
static_friction = 0.5

[calibrate]
{entries}

{tests}"""


def write_studies(data: Path, output: Path, names: Sequence[str] = ()) -> tuple[list[Path], HeightUncertainty]:
    """Write a study for each ball of a folder, or for those named; return their folders, and the uncertainty of a height.

    Raises:
        InputError: there are no drops in the folder.
    """
    balls = read_balls(data, names)
    u = height_uncertainty(read_balls(data, DENSE))
    return [write_study(ball, u.value, output / ball.name) for ball in balls], u


def main() -> None:
    """Read the arguments, write, say where."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, help="folder with balls.csv and a table per ball")
    parser.add_argument("--output", type=Path, required=True, help="folder for the studies, one per ball")
    arguments = parser.parse_args()
    try:
        folders, u = write_studies(arguments.data, arguments.output)
    except (InputError, SimulationError) as error:
        sys.exit(str(error))
    print(
        f"u of a height: {u.value:.2f} m (scatter {u.scatter:.2f} m, correlation {u.correlation:.2f} between measurements, "
        f"film {u.film:.2f} m)"
    )
    for folder in folders:
        print(f"wrote {folder}")


if __name__ == "__main__":
    main()
