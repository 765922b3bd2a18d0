"""A drum that turns: the angle at which its contents flow."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from taichidem.experiments.base import Experiment, GranularSettings, Observable, Settings
from taichidem.experiments.surface_line import surface_line
from taichidem.insertion import BoxRegion, smaller
from taichidem.procedure import Procedure, World, rain, wait
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import AngularSpeed, Duration, Length, quantity
from taichidem.walls import Cylinder, Disc, Wall

SAMPLE_INTERVAL = 0.05  # [s]
WINDOW = 0.5  # of the radius, to both sides of the middle
PASSES = 3  # of levelling the surface, measuring it, correcting the angle
RAIN = (0.0, 0.0, -0.1)  # [m/s]
FILL = 0.68  # half the side of the rained square, of the radius
PARTS = ("drum", "near end", "far end")


class RotatingDrumSettings(GranularSettings):
    """A drum of 144 mm at 6 turns a minute, with 671 grains of 6 mm, by default."""

    radius: Length = quantity("m", "Inner radius of the drum.", 0.072, gt=0)
    length: Length = quantity("m", "Inner length of the drum.", 0.036, gt=0)
    speed: AngularSpeed = quantity("rad/s", "Angular speed, such as '6 rpm'.", 2 * math.pi / 10, gt=0)
    particles: int = quantity("1", "Grains in all.", 671, coarse_graining=-3, ge=1)
    settle_time: Duration = quantity("s", "Time to settle before the drum turns.", 0.6, gt=0)
    spin_up_time: Duration = quantity("s", "Time of turning before the first frame.", 1.5, ge=0)
    averaging_time: Duration = quantity("s", "Time over which frames are taken, one every 0.05 s.", 2.0, ge=0.05)

    @model_validator(mode="after")
    def _fits(self) -> RotatingDrumSettings:
        if smaller(self.radius, 4, self.diameter):
            raise ValueError("radius must be at least 4 diameters, so that the surface can be measured")
        if smaller(self.length, 2.5, self.diameter):
            raise ValueError("length must be at least 2.5 diameters, so that grains rain clear of the ends")
        return self


class RotatingDrum(Experiment):
    """Fill a drum, turn it, and follow the slope of the surface while its contents flow.

    In each frame the grains are turned by the angle found so far, a straight line goes through the highest centres of bins
    one diameter wide within half a radius of the middle, and its slope corrects the angle; three passes. The observable is
    the mean size of that angle over all frames.
    """

    name: ClassVar[str] = "rotating_drum"
    title: ClassVar[str] = "Rotating drum"
    imitates: ClassVar[str] = (
        "rotating-drum powder analyser: dynamic angle of repose from frames through the end window"
    )
    observables: tuple[Observable, ...] = (
        Observable("dynamic_angle_of_repose", "deg", "Slope of the flowing surface, mean of all frames."),
    )
    settings_type: ClassVar[type[Settings]] = RotatingDrumSettings
    view: ClassVar[tuple[float, float]] = (-75.0, 8.0)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the cylinder about the y axis and its two ends; all of it turns later."""
        s, material = self.settings, self.wall_material(model)
        mantle, near, far = PARTS
        return (
            Cylinder(name=mantle, material=material, base=(0, 0, 0), axis=(0, 1, 0), radius=s.radius, height=s.length),
            Disc(name=near, material=material, centre=(0, 0, 0), normal=(0, 1, 0), radius=s.radius),
            Disc(name=far, material=material, centre=(0, s.length, 0), normal=(0, -1, 0), radius=s.radius),
        )

    def scene(self, model: Model) -> Scene:
        s, d = self.settings, self.settings.diameter
        wide = s.radius + d
        return self.scene_within(model, (-wide, -d, -wide), (wide, s.length + d, wide))

    def procedure(self, world: World, model: Model) -> Procedure:
        s = self.settings
        total = s.settle_time + s.spin_up_time + s.averaging_time
        half, end = FILL * s.radius, 0.6 * s.diameter
        rain(world, self.grain(model), BoxRegion((-half, end, -half), (half, s.length - end, half)), s.particles, RAIN)
        yield from wait(world, s.settle_time, total)
        for part in PARTS:
            world.move_wall(part, spin=(0.0, s.speed, 0.0))
        yield from wait(world, s.spin_up_time, total)
        for pause in wait(world, s.averaging_time, total, SAMPLE_INTERVAL):
            yield pause
            world.note(frame=world.look(lambda grains: grains.position[:, [0, 2]]))

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        s = self.settings
        angles = [math.degrees(self._angle(frame)) for frame in record["frame"]]
        mean = float(np.mean(np.abs(angles)))
        details = {"frame_angles_deg": angles, "turns": s.speed * (s.spin_up_time + s.averaging_time) / (2 * math.pi)}
        return {"dynamic_angle_of_repose": mean}, details

    def _angle(self, frame: np.ndarray) -> float:
        """Return the angle of the surface [rad] from the grains' x and z, (n, 2) [m]."""
        s, angle = self.settings, 0.0
        limits = (-WINDOW * s.radius, WINDOW * s.radius)
        for _ in range(PASSES):
            cosine, sine = math.cos(angle), math.sin(angle)
            along, across = frame @ (cosine, sine), frame @ (-sine, cosine)
            angle += math.atan(surface_line(along, across, limits, s.diameter).slope)
        return angle
