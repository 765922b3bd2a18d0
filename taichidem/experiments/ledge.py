"""A box that loses its front wall: the slope that stays behind."""

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
from taichidem.units import Duration, Length, quantity
from taichidem.walls import Mesh, Plane, Wall

WINDOW = (0.2, 0.9)  # of the length
STRIP = 1.5  # width of a strip in diameters


class LedgeSettings(GranularSettings):
    """A box of 20 × 6 diameters of 6 mm grains by default."""

    length: Length = quantity("m", "Inner length of the box, from the back wall to the front wall.", 0.12, gt=0)
    width: Length = quantity("m", "Inner width of the box.", 0.036, gt=0)
    particles: int = quantity("1", "Grains in all.", 800, coarse_graining=-3, ge=1)
    rain_top: Length | None = quantity(
        "m", "Height up to which the grains rain; 47 diameters where not given.", None, coarse_graining=1, gt=0
    )
    settle_time: Duration = quantity("s", "Time to settle behind the front wall.", 1.0, gt=0)
    flow_time: Duration = quantity("s", "Time to flow after the front wall is taken away.", 2.0, gt=0)

    @model_validator(mode="after")
    def _fits(self) -> LedgeSettings:
        if smaller(self.length, 6, self.diameter):
            raise ValueError("length must be at least 6 diameters, so that the surface can be measured")
        if smaller(self.width, 3, self.diameter):
            raise ValueError("width must be at least 3 diameters, so that grains rain clear of the walls")
        if self.rain_top is not None and smaller(self.rain_top, 3, self.diameter):
            raise ValueError("rain_top must be at least 3 diameters")
        return self


class Ledge(Experiment):
    """Fill a box, take its front wall away at once, let the grains run off over the edge, measure the slope that stays.

    θ = atan(−mean slope) of the strips, 1.5 diameters wide, that fit into the width; in each a straight line goes through
    the highest centres of bins one diameter wide, from 0.2 to 0.9 of the length.
    """

    name: ClassVar[str] = "ledge"
    title: ClassVar[str] = "Ledge: what stays in a box without its front wall"
    imitates: ClassVar[str] = "ledge or rectangular-container test: the drained angle of repose"
    observables: tuple[Observable, ...] = (
        Observable("angle_of_repose", "deg", "Slope of the surface that stays behind the edge."),
    )
    settings_type: ClassVar[type[Settings]] = LedgeSettings
    view: ClassVar[tuple[float, float]] = (-65.0, 20.0)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the floor, which ends with the box, and four upright walls, of which the front one will go."""
        s = self.settings
        material, size = self.wall_material(model), 0.6 * s.length
        middle = (s.length / 2, s.width / 2, s.length / 2)

        def upright(name: str, x: float, y: float, normal: tuple[float, float, float]) -> Plane:
            return Plane(name=name, material=material, point=(x, y, middle[2]), normal=normal, picture_size=size)

        # The floor passes under the other walls and ends at x = length.
        low, high = -s.diameter, s.width + s.diameter
        corners = np.array([[low, low, 0.0], [s.length, low, 0.0], [s.length, high, 0.0], [low, high, 0.0]])
        return (
            Mesh(name="floor", material=material, vertices=corners, facets=np.array([[0, 1, 2], [0, 2, 3]])),
            upright("back", 0.0, middle[1], (1, 0, 0)),
            upright("front", s.length, middle[1], (-1, 0, 0)),
            upright("left", middle[0], 0.0, (0, 1, 0)),
            upright("right", middle[0], s.width, (0, -1, 0)),
        )

    def scene(self, model: Model) -> Scene:
        s, d = self.settings, self.settings.diameter
        return self.scene_within(model, (-d, -d, -3 * d), (s.length + 3 * d, s.width + d, self._rain_top() + d))

    def _rain_top(self) -> float:
        return self.settings.rain_top or 47 * self.settings.diameter

    def procedure(self, world: World, model: Model) -> Procedure:
        s, d = self.settings, self.settings.diameter
        total = s.settle_time + s.flow_time
        region = BoxRegion((d, d, d), (s.length - d, s.width - d, self._rain_top()))
        rain(world, self.grain(model), region, s.particles)
        yield from wait(world, s.settle_time, total)
        world.remove_wall("front")
        yield from wait(world, s.flow_time, total)

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        s = self.settings
        x, y, z = snapshot.position[snapshot.position[:, 2] > 0].T
        strip, count = STRIP * s.diameter, int(s.width / (STRIP * s.diameter) + 1e-9)
        limits = (WINDOW[0] * s.length, WINDOW[1] * s.length)
        across = (y - (s.width - count * strip) / 2) / strip  # the strips lie in the middle where they don't fill it
        inside = [np.floor(across) == k for k in range(count)]
        slopes = [surface_line(x[kept], z[kept], limits, s.diameter).slope for kept in inside]
        angles = [math.degrees(math.atan(-slope)) for slope in slopes]
        angle = math.degrees(math.atan(-float(np.mean(slopes))))
        return {"angle_of_repose": angle}, {"strip_angles_deg": angles, "grains_in_box": len(z)}
