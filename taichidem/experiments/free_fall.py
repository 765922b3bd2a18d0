"""One ball that falls: its height over time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from taichidem.bodies import Bodies
from taichidem.errors import InputError
from taichidem.experiments.base import GRAVITY, Experiment, GranularSettings, Observable, Settings, gravity_of
from taichidem.procedure import Procedure, World, wait
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import Durations, Length, Mass, Speed, quantity, to_si
from taichidem.walls import Plane, Wall

FEWEST_STEPS = 10_000  # in the whole fall
LONGEST_MOVE = 0.1  # of the ball's radius in one step
SAME_TIME = 1e-9  # relative, the rounding of decimal numbers and units


class FreeFallSettings(GranularSettings):
    """A grain of 6 mm that falls for a second from 10 m by default."""

    mass: Mass | None = quantity(
        "kg", "Mass of the ball; by the density of its material where not given.", None, coarse_graining=3, gt=0
    )
    release_height: Length = quantity("m", "Height of the ball's lowest point at release.", 10.0)
    release_speed: Speed = quantity("m/s", "Downward speed at release; negative for a throw upwards.", 0.0)
    time: Durations = quantity("s", "When its height is measured, one time or several, from release.", (1.0,))
    floor: bool = quantity("1", "Whether there is a floor at height 0 to bounce on.", False)

    @model_validator(mode="after")
    def _fits(self) -> FreeFallSettings:
        if not self.time or min(self.time) < 0 or max(self.time) == 0 or len(set(self.time)) < len(self.time):
            raise ValueError("time must be one or more different times from 0, not 0 alone")
        if self.floor and self.release_height < 0:
            raise ValueError("release_height must be above the floor, which is at 0")
        return self


class FreeFall(Experiment):
    """Release one ball and read the height of its lowest point at each time; a ball also where the model's grains are none.

    Nothing touches the ball, so the step follows its free motion and not the Rayleigh time: ten thousand steps in the fall
    or more, and never farther than a tenth of its radius in one. Velocity Verlet is then exact under constant forces, and
    for a drag with relaxation time τ off by about dt/τ of what the drag does. With a floor the usual step is taken. A time
    between two steps is reached by z + v δt + a δt²/2.
    """

    name: ClassVar[str] = "free_fall"
    title: ClassVar[str] = "Fall of one ball"
    imitates: ClassVar[str] = "a ball dropped from a height and filmed beside a scale"
    random: ClassVar[bool] = False
    settings_type: ClassVar[type[Settings]] = FreeFallSettings

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        times = self.settings.time
        names = {time: "height" if len(times) == 1 else f"height_at_{time:g}_s" for time in times}
        self.observables = tuple(
            Observable(
                name, "m", f"Height of the ball's lowest point {time:g} s after release.", "height", ("time", time)
            )
            for time, name in names.items()
        )
        if len(set(names.values())) < len(times):
            raise InputError(f"free_fall.time is {times!r}; give times that differ in their first six digits.")

    def observable_at(self, name: str, conditions: Mapping[str, str]) -> str:
        """Return the observable that `height` is at the condition `time`, a text such as "0.5" [s] or "500 ms"."""
        given = conditions.get("time", "")
        if name != "height" or (not given and len(self.observables) == 1):
            return name
        allowed = f"{self.name} measures it at {', '.join(f'{time:g} s' for time in self.settings.time)}"
        if not given:
            raise InputError(f"height is given without its time; {allowed}. Say which in a column time.")
        wanted = to_si(given, "s", "time")
        for observable, time in zip(self.observables, self.settings.time, strict=True):
            if math.isclose(time, wanted, rel_tol=SAME_TIME):
                return observable.name
        raise InputError(f"height is given at time {given!r}; {allowed}. Add the time to the test's setting `time`.")

    def typical_speed(self, model: Model) -> float:
        """Return the speed of half the fall [m/s]."""
        s = self.settings
        return abs(s.release_speed) + 0.5 * (gravity_of(model) or GRAVITY) * max(s.time)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the floor, if there is one."""
        if not self.settings.floor:
            return ()
        size = 2 * self.settings.diameter
        material = self.wall_material(model)
        return (Plane(name="floor", material=material, point=(0, 0, 0), normal=(0, 0, 1), picture_size=size),)

    def scene(self, model: Model) -> Scene:
        s, radius = self.settings, self.settings.diameter / 2
        model = self._with_density(model)
        grain, last, gravity = self.grain(model), max(s.time), gravity_of(model)
        fastest = abs(s.release_speed) + gravity * last
        far = 2 * fastest * last + 10 * s.diameter
        centre = np.array([0.0, 0.0, s.release_height + radius])
        step = min(last / FEWEST_STEPS, LONGEST_MOVE * radius / fastest if fastest else last)
        ball = Bodies.spheres(
            centre[None], radius, grain.material.density, material=grain.number, velocity=(0, 0, -s.release_speed)
        )
        return Scene(
            model=model,
            walls=self.walls(model),
            bodies=ball,
            domain=(centre - far, centre + far),
            time_step=None if s.floor else step,
            force_time_step=True,
            skin=4 * far,  # there is no other grain to look for: the lists are built once
        )

    def _with_density(self, model: Model) -> Model:
        """Return the model with the ball's material as dense as its mass says."""
        s, number = self.settings, self.grain(model).number
        if s.mass is None:
            return model
        materials = list(model.materials)
        materials[number] = replace(materials[number], density=s.mass / (np.pi / 6 * s.diameter**3))
        return replace(model, materials=materials)

    def procedure(self, world: World, model: Model) -> Procedure:
        now, last = 0.0, max(self.settings.time)
        for time in sorted(self.settings.time):
            yield from wait(world, time - now, last)
            now = time
            world.note(time=time, height=world.look(partial(_height_at, time)))

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        heights = dict(zip(record["time"], record["height"], strict=True))
        values = [heights[time] for time in self.settings.time]
        return dict(zip([o.name for o in self.observables], values, strict=True)), {
            "velocity_m_s": snapshot.velocity[0]
        }


def _height_at(time: float, ball: Snapshot) -> float:
    """Return the height of the ball's lowest point [m] at a time less than a step away."""
    ahead = time - ball.time
    acceleration = ball.force[0, 2] / ball.mass[0]
    centre = ball.position[0, 2] + ball.velocity[0, 2] * ahead + acceleration * ahead**2 / 2
    return float(centre - ball.radius[0])
