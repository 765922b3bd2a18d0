"""Say what happens in an experiment as a plain Python function per world, and play many of them side by side.

A procedure is a generator: it acts on its own world (insert grains, look, decide) and yields the duration [s] it wants
to pass. All worlds are then advanced together, and each procedure goes on where it stopped. A world only ever sees
itself, so it behaves the same alone and among others.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from taichidem.bodies import Bodies
from taichidem.errors import InputError, TaichidemError
from taichidem.grain import Grain
from taichidem.insertion import Region, fill_at_random, place_at_random
from taichidem.shapes.outlines import Outlines
from taichidem.simulation import Simulation, Snapshot, WallState

Procedure = Generator[float, None, None]

LONGEST_WAIT = 0.5  # [s] for which a stream may find no free place at all


@dataclass(frozen=True)
class Frame:
    """What one would see at one time: the grains, and the walls that are there.

    Args:
        snapshot: the grains.
        walls: name → centre of its motion now [m], of every wall that has not been taken away.
    """

    snapshot: Snapshot
    walls: Mapping[str, np.ndarray]


@dataclass
class World:
    """One world as its procedure sees it."""

    simulation: Simulation
    number: int
    rng: np.random.Generator
    record: dict[str, list] = field(default_factory=dict)  # what the procedure wrote down, by name
    progress: float = 0.0  # share of the procedure that is done
    failure: str | None = None  # why its procedure ended early
    frames: list[Frame] = field(default_factory=list)  # taken on the way, where asked for

    def insert(self, bodies: Bodies) -> None:
        """Add bodies."""
        self.simulation.insert(bodies, world=self.number)

    def snapshot(self) -> Snapshot:
        """Return the bodies now."""
        return self.simulation.snapshot(self.number)

    def note(self, **values: object) -> None:
        """Write values down, each at the end of the list of its name."""
        for name, value in values.items():
            self.record.setdefault(name, []).append(value)

    def wall(self, name: str) -> WallState:
        """Return where a wall is and what the grains do to it."""
        return self.simulation.wall(name, self.number)

    def move_wall(self, name: str, **changes: Any) -> None:
        """Give a wall another velocity, spin or load; see `Simulation.move_wall`."""
        self.simulation.move_wall(name, **changes, world=self.number)

    def remove_wall(self, name: str) -> None:
        """Take a wall away now."""
        self.simulation.remove_wall(name, world=self.number)

    def frame(self) -> Frame:
        """Return what one would see now."""
        names = self.simulation.standing_walls(self.number)
        return Frame(self.snapshot(), {name: self.wall(name).centre for name in names})

    @property
    def time(self) -> float:
        """The time [s]."""
        return self.simulation.time(self.number)

    @property
    def kinetic_energy(self) -> float:
        """The kinetic energy [J]."""
        return self.simulation.kinetic_energy(self.number)


def pour(
    world: World,
    grain: Grain,
    region: Region,
    count: int,
    rate: float,
    batch_interval: float,
    velocity: tuple[float, float, float],
    share: tuple[float, float] = (0.0, 1.0),
) -> Procedure:
    """Let grains appear in batches at a rate [1/s] until `count` have come; what finds no place comes with a later batch.

    It ends with the last batch, at once.

    Raises:
        InputError: the region stays full, so that the rate can't be kept.
    """
    step = world.simulation.scenes[world.number].dt
    if batch_interval < step:
        raise InputError(
            f"batch_interval is {batch_interval:g} s, below the time step of {step:g} s. Take a longer one."
        )
    drawn = grain.draw(world.rng, count)
    waiting: np.ndarray = np.arange(count)
    done = 0
    began = placed_at = world.time
    while done < count:
        due = min(count, int(np.floor((world.time - began) * rate + rate * batch_interval + 1e-9)))
        present = world.snapshot()
        tried = waiting[: due - done]
        outlines = Outlines.of(grain.bodies(drawn.rows(tried)))
        centres = place_at_random(world.rng, region, outlines, present.position, Outlines.of(present))
        placed = np.isfinite(centres[:, 0])
        if np.any(placed):
            world.insert(grain.bodies(drawn.rows(tried[placed]), centres[placed], velocity))
            waiting = np.concatenate([tried[~placed], waiting[due - done :]])
            done += int(np.count_nonzero(placed))
        if np.any(placed) or due == done:
            placed_at = world.time
        if due - done > 20 * rate * batch_interval + 20 or world.time - placed_at > LONGEST_WAIT:
            raise InputError(
                f"The stream can't keep {rate:g} grains per second: {due - done} of them wait for a free place. Enlarge "
                "its region, raise the drop velocity, or lower the rate."
            )
        world.progress = share[0] + (share[1] - share[0]) * done / count
        if done < count:
            yield batch_interval


def rain(
    world: World, grain: Grain, region: Region, count: int, velocity: tuple[float, float, float] = (0.0, 0.0, -0.3)
) -> None:
    """Put all grains at once at random places in a region.

    Raises:
        InputError: the region is too small for so many.
    """
    present = world.snapshot()
    drawn = grain.draw(world.rng, count)
    outlines = Outlines.of(grain.bodies(drawn))
    centres = fill_at_random(world.rng, region, outlines, present.position, Outlines.of(present))
    world.insert(grain.bodies(drawn, centres, velocity))


def wait(world: World, duration: float, total: float, every: float | None = None) -> Procedure:
    """Let a duration [s] pass, and after each interval say which share of the procedure's total time [s] is done.

    Args:
        every: interval [s] at whose ends the caller wants to look; a tenth of the duration where left out.
    """
    intervals = 10 if every is None else int(duration / every + 1e-9)
    for _ in range(intervals):
        yield duration / intervals if every is None else every
        world.progress = min(1.0, world.time / total)


def settle(
    world: World, grain: Grain, *, at_least: float, at_most: float, gravity: float, quiet: float = 1e-4
) -> Procedure:
    """Wait until the mean kinetic energy of a grain is below `quiet` times m g d, within given times [s].

    A grain that trembles, as the constant-torque rolling law lets it, never rests fully; the limit is well above that.
    """
    yield at_least
    looks = max(1, math.ceil((at_most - at_least) / max(0.1 * at_least, 0.02)))
    for _ in range(looks if at_most > at_least else 0):
        grains = max(1, len(world.snapshot().mass))
        if world.kinetic_energy < quiet * grains * grain.mass * gravity * 2 * grain.radius:
            return
        yield (at_most - at_least) / looks


def play(
    simulation: Simulation,
    procedures: Sequence[Procedure],
    worlds: Sequence[World],
    report: Callable[[float], None] | None = None,
    frames: float | None = None,
) -> None:
    """Play the procedures of all worlds to their ends; a world that fails drops out, the others go on.

    Args:
        report: called with the mean share done, for a progress bar.
        frames: interval [s] at which each world's frame is kept, none where left out. Waits are only cut in two for it;
            a run in pieces gives the same bits as a whole one.

    Raises:
        TaichidemError: what every single world failed with.
    """
    waiting = dict(enumerate(procedures))
    due = np.zeros(len(procedures))  # what each procedure still waits for [s]
    to_frame = np.full(len(procedures), np.inf if frames is None else 0.0)
    errors: list[TaichidemError] = []
    while waiting:
        for number in list(waiting):
            if simulation.failure(number):
                waiting.pop(number)
                due[number] = 0.0
                continue
            try:
                due[number] = due[number] or next(waiting[number])
            except StopIteration:
                waiting.pop(number)
                worlds[number].progress = 1.0
            except TaichidemError as error:
                waiting.pop(number)
                worlds[number].failure = str(error)
                errors.append(error)
        if waiting:
            _advance(simulation, worlds, due, to_frame, frames)
        if report:
            report(float(np.mean([world.progress for world in worlds])))
    if len(errors) == len(worlds):
        raise errors[0]


def _advance(
    simulation: Simulation, worlds: Sequence[World], due: np.ndarray, to_frame: np.ndarray, frames: float | None
) -> None:
    """Run every world until its procedure goes on or its next frame is due, whichever comes first; take those frames."""
    for number in np.flatnonzero((to_frame == 0) & (due > 0)).tolist():
        worlds[number].frames.append(worlds[number].frame())
        to_frame[number] = frames
    duration = np.minimum(due, to_frame)
    simulation.run(duration)
    due -= duration
    to_frame -= duration
