"""Run scenes: worlds side by side in one engine, stepped to a time, read out, added to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from taichidem import runtime
from taichidem.bodies import Bodies
from taichidem.checkpoints import checkpoint, file
from taichidem.effects.base import ContactEffect
from taichidem.errors import InputError, SimulationError, unknown_name
from taichidem.loading import motion_columns
from taichidem.scene import Scene
from taichidem.shapes.forms import Forms
from taichidem.snapshot import Snapshot, WallState
from taichidem.walls import Motion, Wall

__all__ = ["Simulation", "Snapshot", "WallState"]

_COLUMN = {"centre": "origin"}  # columns that the table of walls calls otherwise

MOST_STEPS = 2_000_000_000  # counters in kernels are 32 bits wide

REASONS = {
    1: "diverged: a grain moved more than its radius in one step, or its position is no number. Reduce the time step or "
    "the speeds.",
    2: "ran out of room in its neighbour lists. Raise `partners` of the scene.",
    3: "overlaps too far: a contact passed half a radius (or smallest semi-axis). Reduce the time step, the speeds, or "
    "stiffen the material.",
}


class Simulation:
    """One or more worlds that share a compiled law.

    Compiled engines are reused: a simulation whose engine a later one of the same kind took over can't be used any more,
    and says so. Read its results first, or put both scenes into one simulation.

    Args:
        scenes: one scene per world, or a single scene.
        schedule: "worlds" (a thread per world) or "particles" (every thread on every world).

    Raises:
        CompositionError: scenes with different effects.
    """

    def __init__(self, scenes: Scene | Sequence[Scene], schedule: str = "worlds") -> None:
        runtime.start()
        from taichidem import pool

        self.scenes = [scenes] if isinstance(scenes, Scene) else list(scenes)
        if not self.scenes or not all(isinstance(scene, Scene) for scene in self.scenes):
            raise InputError("Give a Scene, or a list of at least one Scene.")
        if schedule not in ("worlds", "particles"):
            raise InputError(f"schedule is {schedule!r}; allowed are 'worlds' and 'particles'.")
        self.schedule = schedule
        self._engine, self._exchange, self._stepper = pool.engine_for(self.scenes, schedule)
        self._engine.user = self
        self._asked = [0.0] * len(self.scenes)  # time each world was asked to reach [s]
        self._inserted: list[list[Bodies]] = [[] for _ in self.scenes]
        for world, scene in enumerate(self.scenes):
            if scene.bodies is not None:
                self.insert(scene.bodies, world=world)

    def __len__(self) -> int:
        return len(self.scenes)

    def _world(self, world: int) -> dict[str, float]:
        self._check_open()
        if world not in range(len(self)):
            raise InputError(f"world is {world!r}; this simulation has {len(self)}, numbered from 0.")
        return self._engine.access["worlds"].read(world)

    def _check_open(self) -> None:
        if self._engine.user is not self:
            raise SimulationError(
                "This simulation's engine was handed to a newer one; read its results before starting another."
            )

    def time(self, world: int = 0) -> float:
        """Return the time of a world [s]."""
        return self._world(world)["step"] * self.scenes[world].dt

    def insert(self, bodies: Bodies, *, world: int = 0) -> None:
        """Add bodies to a world.

        Raises:
            InputError: there is no room for so many.
        """
        self._check_open()
        present = int(self._world(world)["bodies"])
        room = self.scenes[world].room
        if present + len(bodies) > room:
            raise InputError(
                f"World {world} holds {present} bodies and {len(bodies)} more were given; it has room for {room}. "
                "Raise `room` of the scene."
            )
        kind = self._engine.kind
        if bodies.kind not in (kind, "sphere"):
            raise InputError(
                f"Bodies of kind {bodies.kind!r} were given to a simulation made for {kind!r}; put one like them into the "
                "scene's bodies or grains_like."
            )
        if kind == "superquadric":
            bodies = bodies.as_superquadrics()
        self.scenes[world].check_bodies(bodies)
        row = self._world(world)
        if not self._engine.single and row["elements"] + len(bodies.element_body) > row["element_capacity"]:
            raise InputError(
                f"World {world} has room for {int(row['element_capacity'])} elements, of which {int(row['elements'])} are "
                f"taken; {len(bodies.element_body)} more were given. Raise `room` of the scene."
            )
        for effect in self.scenes[world].model.effects:
            if isinstance(effect, ContactEffect) and effect.carries:
                self._exchange.give(world, effect.initial_amounts(bodies.mass, bodies.radius))
        self._exchange.insert(world, bodies, sum(map(len, self._inserted[world])))
        self._inserted[world].append(bodies)

    def run(self, duration: float | Sequence[float] | np.ndarray, between: Callable[[], None] | None = None) -> None:
        """Advance every running world by a duration [s], one for all or one each; a stopped world is left as it is.

        Args:
            between: called now and then on the way, when every world is at the end of a step, such as to save.
        """
        self._check_open()
        if np.shape(duration) not in ((), (len(self),)):
            raise InputError(
                f"duration is {duration!r}; give seconds, one number or one for each of {len(self)} worlds."
            )
        durations = np.broadcast_to(np.asarray(duration, float), (len(self),))
        if not (np.all(np.isfinite(durations)) and np.all(durations >= 0)):
            raise InputError(f"duration is {duration!r}; give finite seconds from 0, one number or one for each world.")
        for world, (scene, seconds) in enumerate(zip(self.scenes, durations, strict=True)):
            if seconds > 0:
                # Counted from the time that was asked for, so that rounding to whole steps never adds up.
                self._asked[world] += float(seconds)
                self._set_target(world, round(self._asked[world] / scene.dt))
        self._stepper.run(len(self), between)

    def run_steps(self, steps: int) -> None:
        """Advance every running world by a number of steps.

        Raises:
            InputError: no whole number from 0.
        """
        self._check_open()
        if not isinstance(steps, (int, np.integer)) or steps < 0:
            raise InputError(f"steps is {steps!r}; give a whole number from 0.")
        for world, scene in enumerate(self.scenes):
            target = int(self._world(world)["step"]) + int(steps)
            self._asked[world] = target * scene.dt
            self._set_target(world, target)
        self._stepper.run(len(self))

    def _set_target(self, world: int, target: int) -> None:
        if target > MOST_STEPS:
            raise InputError(
                f"World {world} would come to step {target:.3g}; one simulation does up to {MOST_STEPS:.3g}, that is "
                f"{MOST_STEPS * self.scenes[world].dt:.4g} s at its time step. Take a larger step or a softer material."
            )
        self._engine.set_target(world, target)

    def save(self, path: str | Path) -> None:
        """Write the complete state to a file, from which `load` goes on to the same last bit.

        Raises:
            InputError: a path that can't be written to.
        """
        self._check_open()
        about, state = checkpoint.about_scenes(self.scenes, self.schedule), checkpoint.state_of(self)
        file.write_checkpoint(Path(path), "simulation", about, state)

    @classmethod
    def load(cls, path: str | Path, scenes: Scene | Sequence[Scene], schedule: str = "worlds") -> Simulation:
        """Return the simulation that was saved to a file.

        Args:
            path: of the file.
            scenes: those that the saved simulation was made of.
            schedule: that of the saved simulation.

        Raises:
            InputError: a file that is damaged, of another version, or saved from other scenes or another schedule.
        """
        every = [scenes] if isinstance(scenes, Scene) else list(scenes)
        state = file.read_checkpoint(Path(path), "simulation", checkpoint.about_scenes(every, schedule))
        simulation = cls(every, schedule)
        checkpoint.restore(simulation, state)
        return simulation

    def snapshot(self, world: int = 0) -> Snapshot:
        """Return the bodies of a world now."""
        self._check_open()
        row = self._world(world)
        arrays = self._exchange.read(world, int(row["bodies"]))
        time = row["step"] * self.scenes[world].dt
        forms = Forms.of(self._inserted[world]).rows(arrays["identity"])
        return Snapshot(
            time=time,
            kinetic_energy=float(self._exchange.kinetic(world)),
            left=int(row["left"]),
            rebuilds=int(row["rebuilds"]),
            forms=forms,
            **arrays,  # type: ignore[arg-type]
        )

    def wall(self, name: str, world: int = 0) -> WallState:
        """Return where a wall is, how it moves and what the grains do to it.

        Raises:
            InputError: no wall of that name, or several.
        """
        row = self._engine.access["walls"].read_row(self._wall_number(name, world)[0])
        return WallState(**{f.name: row[_COLUMN.get(f.name, f.name)] for f in fields(WallState)})

    def move_wall(
        self,
        name: str,
        *,
        velocity: Sequence[float] | None = None,
        spin: Sequence[float] | None = None,
        load: Sequence[float] | None = None,
        mass: float = 0.0,
        world: int = 0,
    ) -> None:
        """Give a wall another velocity [m/s], spin [rad/s] about the centre of its motion, or load; what is left out stays.

        Args:
            load: force [N] that pushes the wall from now on, as `Motion.load`; (0, 0, 0) makes it move as it is told.
            mass: of a wall that is given a load [kg].

        Raises:
            InputError: no wall of that name, several, numbers that are not finite, or a load without a mass.
        """
        number, wall = self._wall_number(name, world)
        access = self._engine.access["walls"]
        row = access.read_row(number)
        if load is None:
            load, mass = row["load"] * row["guide"], 1 / row["inverse_mass"] if row["inverse_mass"] else 0.0
        motion = Motion(
            velocity=tuple(row["velocity"] if velocity is None else velocity),
            spin=tuple(row["spin"] if spin is None else spin),
            centre=wall.motion.centre,
            load=tuple(load),
            mass=mass,
        )
        self.scenes[world].check_load(name, motion)
        access.write(number, [row | motion_columns(replace(wall, motion=motion))])

    def remove_wall(self, name: str, *, world: int = 0) -> None:
        """Take a wall away now, at once.

        Raises:
            InputError: no wall of that name, or several.
        """
        number, _ = self._wall_number(name, world)
        access = self._engine.access["walls"]
        gone = {"removed_at": self.time(world), "force": np.zeros(3), "torque": np.zeros(3)}
        access.write(number, [access.read_row(number) | gone])

    def standing_walls(self, world: int = 0) -> list[str]:
        """Return the names of the walls that have not been taken away; walls without a name of their own are left out."""
        first, time = int(self._world(world)["first_wall"]), self.time(world)
        names = [wall.name for wall in self.scenes[world].walls]
        rows = (self._engine.access["walls"].read(first + k) for k in range(len(names)))
        return [n for n, row in zip(names, rows, strict=True) if n and names.count(n) == 1 and time < row["removed_at"]]

    def _wall_number(self, name: str, world: int) -> tuple[int, Wall]:
        """Return the row of a world's wall in the table of walls, and the wall as it was given."""
        first = int(self._world(world)["first_wall"])
        names = [wall.name for wall in self.scenes[world].walls]
        if names.count(name) != 1:
            if name in names:
                raise InputError(f"{names.count(name)} walls are named {name!r}; give each a name of its own.")
            raise unknown_name("wall", name, filter(None, names))
        number = names.index(name)
        return first + number, self.scenes[world].walls[number]

    def kinetic_energy(self, world: int = 0) -> float:
        """Return the kinetic energy of a world [J]."""
        self._world(world)
        return float(self._exchange.kinetic(world))

    def failure(self, world: int = 0) -> str | None:
        """Return why a world stopped, or None while it is well."""
        row = self._world(world)
        status = int(row["status"])
        deep = f", overlap {row['largest_overlap']:.3g} m" if row["largest_overlap"] else ""
        return None if status == 0 else f"World {world} {REASONS[status]} (at {self.time(world):.6g} s{deep})"

    def check(self) -> None:
        """Raise SimulationError if any world stopped."""
        failures = [reason for world in range(len(self)) if (reason := self.failure(world))]
        if failures:
            raise SimulationError(" ".join(failures))
