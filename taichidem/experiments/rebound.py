"""One sphere against a flat wall: the coefficient of restitution."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from taichidem.bodies import Bodies
from taichidem.experiments.base import Experiment, GranularSettings, Observable, Settings
from taichidem.procedure import Procedure, World
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import Speed, quantity
from taichidem.walls import Plane, Wall

GAP = 0.05  # between sphere and wall at the start, in radii
LOOKS = 50  # at the sphere while it would cross the gap at its first speed, or every step where steps are longer
SLOWEST = 0.01  # share of the speed below which a rebound counts as none
CONTACT = 100  # Rayleigh times; no contact that ends by itself lasts longer


class ReboundSettings(GranularSettings):
    """A grain of 6 mm at 1 m/s by default."""

    speed: Speed = quantity("m/s", "Speed towards the wall, normal to it.", 1.0, gt=0)


class Rebound(Experiment):
    """Shoot one sphere normally at a flat wall without gravity; e = speed back at the start distance / speed there before.

    A sphere that isn't back by the time that a rebound at one hundredth of its speed would take sticks: e = 0. Where the
    model holds grains of several sizes, this one has their nominal size; where they are no spheres, it is a ball of their
    material and volume: how another body comes back depends on how it falls.
    """

    name: ClassVar[str] = "rebound"
    title: ClassVar[str] = "Rebound of one grain"
    imitates: ClassVar[str] = "drop test of a single particle, filmed at high speed: coefficient of restitution"
    observables: tuple[Observable, ...] = (
        Observable("coefficient_of_restitution", "1", "Speed of rebound over speed of impact, away from the wall."),
    )
    random: ClassVar[bool] = False
    settings_type: ClassVar[type[Settings]] = ReboundSettings
    frame_interval: ClassVar[float] = 5e-5  # a contact lasts a few tenths of a millisecond

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the plane z = 0."""
        size = 2 * self.settings.diameter
        material = self.wall_material(model)
        return (Plane(name="wall", material=material, point=(0, 0, 0), normal=(0, 0, 1), picture_size=size),)

    def scene(self, model: Model) -> Scene:
        s, grain = self.settings, self.grain(model)
        wide = 4 * s.diameter
        place, velocity = np.array([[0.0, 0.0, (1 + GAP) * grain.radius]]), (0.0, 0.0, -s.speed)
        ball = Bodies.spheres(place, grain.radius, grain.material.density, material=grain.number, velocity=velocity)
        return Scene(
            model=model.without_gravity(),
            walls=self.walls(model),
            bodies=ball,
            domain=((-wide, -wide, -wide), (wide, wide, wide)),
        )

    def procedure(self, world: World, model: Model) -> Procedure:
        radius, scene = self.settings.diameter / 2, world.simulation.scenes[world.number]
        crossing = GAP * radius / self.settings.speed
        longest = crossing * (1 + 1 / SLOWEST) + CONTACT * scene.rayleigh_time()
        while world.time < longest:
            yield max(scene.dt, crossing / LOOKS)
            world.progress = world.time / longest
            height, speed = world.look(lambda ball: (float(ball.position[0, 2]), float(ball.velocity[0, 2])))
            if speed > 0 and height >= (1 + GAP) * radius:
                world.note(rebound_speed=speed)
                return

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        back = record.get("rebound_speed", [0.0])[0]
        return {"coefficient_of_restitution": back / self.settings.speed}, {"rebound_speed_m_s": back}
