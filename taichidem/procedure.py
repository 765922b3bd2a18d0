"""Say what happens in an experiment as a plain Python function per world, and play many of them side by side.

A procedure is a generator: it acts on its own world (insert grains, look, decide) and yields the duration [s] it wants
to pass. All worlds are then advanced together, and each procedure goes on where it stopped. A world only ever sees
itself, so it behaves the same alone and among others.

A run can be taken up from a checkpoint by playing its procedure again with the answers it got. So a procedure decides by
what its world answers and by the world's random numbers, and by nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from taichidem.checkpoints.course import Course, Procedure
from taichidem.checkpoints.keeper import Keeper
from taichidem.errors import InputError
from taichidem.grain import Grain
from taichidem.insertion import Region, fill_at_random, place_at_random
from taichidem.shapes.outlines import Outlines
from taichidem.simulation import Simulation
from taichidem.snapshot import Frame
from taichidem.world import World

__all__ = ["Frame", "Procedure", "World", "play", "pour", "rain", "settle", "wait"]

LONGEST_WAIT = 0.5  # [s] for which a stream may find no free place at all


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
        tried = waiting[: due - done]
        centres = world.find_places(place_at_random, region, Outlines.of(grain.bodies(drawn.rows(tried))))
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
    drawn = grain.draw(world.rng, count)
    centres = world.find_places(fill_at_random, region, Outlines.of(grain.bodies(drawn)))
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
        grains = max(1, world.look(lambda seen: len(seen.mass)))
        if world.kinetic_energy < quiet * grains * grain.mass * gravity * 2 * grain.radius:
            return
        yield (at_most - at_least) / looks


def play(
    simulation: Simulation,
    procedures: Sequence[Procedure],
    worlds: Sequence[World],
    report: Callable[[float], None] | None = None,
    frames: float | None = None,
    keeper: Keeper | None = None,
) -> None:
    """Play the procedures of all worlds to their ends; a world that fails drops out, the others go on.

    Args:
        report: called with the mean share done, for a progress bar.
        frames: interval [s] at which each world's frame is kept, none where left out. Waits are only cut in two for it;
            a run in pieces gives the same bits as a whole one.
        keeper: writes checkpoints on the way and takes up an earlier one.

    Raises:
        TaichidemError: what every single world failed with.
    """
    course = Course(simulation, procedures, worlds, frames)
    between = None if keeper is None else keeper.begin(course)
    while course.waiting:
        course.act()
        if course.waiting:
            course.advance(between)
        if report:
            report(course.share)
    if len(course.errors) == len(worlds):  # not kept: the last checkpoint before is of use once the cause is mended
        raise course.errors[0]
    if keeper is not None:
        keeper.end(course)
