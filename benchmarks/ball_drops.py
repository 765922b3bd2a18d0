"""Real balls dropped from 47 m, simulated with and without the drag of air: `python -m benchmarks.ball_drops`.

The films don't say when and where a ball was let go, and drops begin before or after the first frame. So each drop has a
release time and a release height of its own that are fitted by least squares, for either model in the same way; nothing of
the drag is fitted. That favours the model without drag, which hides a part of its lack in a late release.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from taichidem.errors import InputError, SimulationError

DATA = Path(__file__).resolve().parents[2] / "shared" / "lab" / "ball_drops"
RELEASE = (-1.0, 1.0)  # [s] around the first frame within which a ball was let go
LONGEST = 5.0  # [s] of a fall
GRID = np.linspace(0.1, LONGEST, 50)  # [s] when a simulated fall is looked at
FACTORS = tuple(np.linspace(0.1, 1.5, 15))  # of the correlation's drag, to see which would fit best
LIGHT = 0.1  # [kg]


@dataclass(frozen=True)
class Drop:
    """One filmed fall: times [s] from the first frame and heights [m]."""

    time: np.ndarray
    height: np.ndarray


@dataclass(frozen=True)
class Ball:
    """A ball of a mass [kg] and a diameter [m], and its falls."""

    name: str
    mass: float
    diameter: float
    drops: tuple[Drop, ...]


@dataclass(frozen=True)
class Fit:
    """A simulated fall laid through filmed ones: error of height [m] per drop, and the fitted release [s], [m]."""

    errors: tuple[np.ndarray, ...]
    releases: tuple[tuple[float, float], ...]

    @property
    def misfit(self) -> float:
        """Root mean square error of height over all frames [m]."""
        return float(np.sqrt(np.mean(np.concatenate(self.errors) ** 2)))


@dataclass(frozen=True)
class Row:
    """A ball with its fits, its largest Reynolds number, and the factor on the drag that would fit best."""

    ball: Ball
    without: Fit
    with_drag: Fit
    reynolds: float
    best_factor: float

    @property
    def ratio(self) -> float:
        """Misfit without drag over misfit with it."""
        return self.without.misfit / self.with_drag.misfit


def read_balls(folder: Path = DATA, names: Sequence[str] = ()) -> list[Ball]:
    """Return the balls of a folder, all or those named.

    Raises:
        InputError: there is no such folder.
    """
    if not (folder / "balls.csv").is_file():
        raise InputError(f"There is no table {folder / 'balls.csv'}. Give the folder with --data.")
    table = pd.read_csv(folder / "balls.csv").set_index("ball")
    balls = []
    for name, row in table.loc[list(names) or table.index].iterrows():
        frames = pd.read_csv(folder / f"{name}.csv")
        drops = [Drop(f["time_s"].to_numpy(), f["height_m"].to_numpy()) for _, f in frames.groupby("drop")]
        balls.append(Ball(str(name), row["mass_kg"], row["diameter_m"], tuple(drops)))
    return balls


def fallen(ball: Ball, factors: Sequence[float]) -> list[CubicSpline]:
    """Return the simulated distances fallen [m] over the time [s] since release; factor 0 is the model without drag.

    A fluid whose density and viscosity are both k times those of air has the same Reynolds number and k times the drag.
    """
    from taichidem.effects import AirDrag, BodyGravity, NormalHertz
    from taichidem.experiments import FreeFall
    from taichidem.materials import Material
    from taichidem.scene import Model

    air, ground = AirDrag(), [NormalHertz(restitution=0.5), BodyGravity()]
    density, viscosity = air.value("fluid_density"), air.value("viscosity")
    material = Material(ball.name, 1000.0, 1e7, 0.3)  # the mass that is given below says how dense it is
    drags = [AirDrag(fluid_density=k * density, viscosity=k * viscosity) for k in factors]
    fall = FreeFall(diameter=ball.diameter, mass=ball.mass, release_height=0.0, time=tuple(GRID))
    outcomes = fall.run([Model([material], [*ground, drag]) for drag in drags], [1] * len(drags))
    failures = [str(o.failure) for o in outcomes if o.failure]
    if failures:
        raise SimulationError("Falls failed: " + " ".join(failures))
    at = np.concatenate([[0.0], GRID])
    distances = [np.concatenate([[0.0], -np.array(list(o.observables.values()))]) for o in outcomes]
    return [CubicSpline(at, d, bc_type=((1, 0.0), "not-a-knot")) for d in distances]


def lay(ball: Ball, distance: CubicSpline) -> Fit:
    """Fit release time and height of each drop to a simulated fall by least squares."""
    errors, releases = [], []
    for drop in ball.drops:
        # For any release time the best height is a mean, so that only the time is searched.
        found = minimize_scalar(
            lambda t, drop=drop: np.var(_raised(drop, distance, t)), bounds=RELEASE, method="bounded"
        )
        raised = _raised(drop, distance, found.x)
        errors.append(raised.mean() - raised)
        releases.append((float(found.x), float(raised.mean())))
    return Fit(tuple(errors), tuple(releases))


def _raised(drop: Drop, distance: CubicSpline, release: float) -> np.ndarray:
    """Return the filmed heights raised by what a simulated fall has lost until then; constant where they agree [m]."""
    return drop.height + distance(np.maximum(drop.time - release, 0.0))


def measure(ball: Ball, factors: Sequence[float] = FACTORS) -> Row:
    """Return a ball's misfits with and without drag, and with the drag times each of some factors."""
    from taichidem.effects import AirDrag

    distances = fallen(ball, [0.0, 1.0, *factors])
    fits = [lay(ball, distance) for distance in distances]
    last = max(drop.time[-1] - release for drop, (release, _) in zip(ball.drops, fits[1].releases, strict=True))
    speed = float(distances[1](last, 1))
    air = AirDrag()
    reynolds = air.value("fluid_density") * speed * ball.diameter / air.value("viscosity")
    scan = [fits[0], *fits[2:]]
    best = [0.0, *factors][int(np.argmin([fit.misfit for fit in scan]))]
    return Row(ball, fits[0], fits[1], reynolds, float(best))


def as_text(rows: Sequence[Row]) -> str:
    """Return the table and the verdict."""
    lines = [
        "Root mean square error of height [m]; release time and height fitted per drop, nothing of the drag.",
        "ball             mass [g]  largest Re | without drag  with drag | ratio | best factor on the drag",
    ]
    for row in rows:
        lines.append(
            f"{row.ball.name:16s} {1e3 * row.ball.mass:8.0f}  {row.reynolds:10.2g} | {row.without.misfit:12.3f} "
            f"{row.with_drag.misfit:10.3f} | {row.ratio:5.2f} | {row.best_factor:10.2f}"
        )
    light = [row.ratio for row in rows if row.ball.mass < LIGHT]
    if light:
        lines.append(
            f"Light balls (below {1e3 * LIGHT:.0f} g): the misfit falls by factors of {min(light):.1f} and more."
        )
    return "\n".join(lines)


def picture(rows: Sequence[Row], path: Path) -> None:
    """Write the error of height against time, a panel per ball."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 2.4), layout="constrained")
    panels = figure.subplots(1, len(rows), sharex=True, squeeze=False)[0]
    for panel, row in zip(panels, rows, strict=True):
        for fit, colour, label in ((row.without, "tab:red", "gravity alone"), (row.with_drag, "tab:blue", "air_drag")):
            for drop, error, mark in zip(row.ball.drops, fit.errors, "ox", strict=False):
                name = label if mark == "o" else None
                panel.plot(drop.time, error, mark, color=colour, markersize=2.5, markeredgewidth=0.7, label=name)
        panel.axhline(0, color="grey", linewidth=0.5)
        panel.set_title(f"{row.ball.name.replace('_', ' ')}, {1e3 * row.ball.mass:.0f} g", fontsize=8)
        panel.tick_params(labelsize=7)
        panel.set_xlabel("time in the film [s]", fontsize=7)
    panels[0].set_ylabel("simulated − filmed height [m]", fontsize=7)
    panels[0].legend(fontsize=7)
    figure.savefig(path, dpi=90)


def main() -> None:
    """Read the arguments, simulate, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=DATA, help="folder with balls.csv and a table per ball")
    parser.add_argument("--picture", type=Path, help="write the errors against time to this PNG file")
    arguments = parser.parse_args()
    try:
        rows = [measure(ball) for ball in read_balls(arguments.data)]
    except (InputError, SimulationError) as error:
        sys.exit(str(error))
    print(as_text(rows))
    if arguments.picture:
        picture(rows, arguments.picture)


if __name__ == "__main__":
    main()
