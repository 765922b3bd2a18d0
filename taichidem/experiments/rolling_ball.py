"""One grain rolling over a level plate: how far it comes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from taichidem.bodies import Bodies
from taichidem.experiments.base import Experiment, GranularSettings, Observable, Settings
from taichidem.procedure import Procedure, World, wait
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import Duration, Speed, quantity
from taichidem.walls import Plane, Wall

LOOKS = 100  # at the ball, for the share done; its way is read at the end


class RollingBallSettings(GranularSettings):
    """A grain of 6 mm that starts at 0.1 m/s by default."""

    speed: Speed = quantity("m/s", "Speed at which the grain starts to roll.", 0.1, gt=0)
    time: Duration = quantity("s", "Time after which its way is read.", 1.0, gt=0)


class RollingBall(Experiment):
    """Let one grain roll over a level plate and read how far it has come, at the latest when it stops.

    A grain that nothing resists comes s = v t. A constant rolling couple μ_r R F_n slows it by a = (5/7) μ_r g, so it comes
    v t − a t²/2 and stops after v²/(2 a). Cohesion between grains does not act on a single one, and an attraction by the
    plate acts through its centre; so this test tells rolling resistance from cohesion, which heaps and drums hardly do.
    Where the model holds grains of several sizes, this one has their nominal size; where they are no spheres, it is a ball of
    their material and volume, so that this test tells rolling resistance from shape. Measure it with such a ball.
    """

    name: ClassVar[str] = "rolling_ball"
    title: ClassVar[str] = "One grain rolling on a plate"
    imitates: ClassVar[str] = "rolling test of a single particle, launched from a small ramp and filmed"
    observables: tuple[Observable, ...] = (
        Observable("rolling_distance", "mm", "Way of the grain along the plate in the time given."),
    )
    random: ClassVar[bool] = False
    settings_type: ClassVar[type[Settings]] = RollingBallSettings

    @classmethod
    def proposed(cls, diameter: float) -> tuple[dict[str, Any], dict[str, float]]:
        """Return a start at 0.1 m/s and 0.3 s for grains of 6 mm, read to 1 mm; other sizes in proportion."""
        scale = diameter / 0.006
        return {"speed": 0.1 * scale**0.5, "time": 0.3 * scale**0.5}, {"rolling_distance": 1.0 * scale}

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the plate z = 0."""
        s = self.settings
        half = 0.6 * s.speed * s.time
        point = (0.5 * s.speed * s.time, 0, 0)
        return (
            Plane(name="plate", material=self.wall_material(model), point=point, normal=(0, 0, 1), picture_size=half),
        )

    def scene(self, model: Model) -> Scene:
        s, grain = self.settings, self.grain(model)
        far = 2 * s.speed * s.time + 10 * s.time**2 + 4 * s.diameter
        ball = Bodies.spheres(
            np.array([[0.0, 0.0, grain.radius]]),
            grain.radius,
            grain.material.density,
            material=grain.number,
            velocity=(s.speed, 0.0, 0.0),
            spin=(0.0, s.speed / grain.radius, 0.0),
        )
        return Scene(model=model, walls=self.walls(model), bodies=ball, domain=((-far,) * 3, (far,) * 3))

    def procedure(self, world: World, model: Model) -> Procedure:
        yield from wait(world, self.settings.time, self.settings.time, self.settings.time / LOOKS)

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        way = float(snapshot.position[0, 0])
        return {"rolling_distance": 1e3 * way}, {"end_speed_m_s": float(snapshot.velocity[0, 0])}
