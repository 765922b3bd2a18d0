"""A cup filled by rain: the density of the packing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from taichidem.errors import InputError
from taichidem.experiments.base import Experiment, GranularSettings, Observable, Settings
from taichidem.insertion import CylinderRegion, smaller
from taichidem.procedure import Procedure, World, rain, wait
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import Duration, Length, quantity
from taichidem.walls import Wall, cup


class BulkDensitySettings(GranularSettings):
    """A cup of 72 mm across and 48 mm high, with 6 mm grains heaped above it, by default."""

    cup_radius: Length = quantity("m", "Inner radius of the cup.", 0.036, gt=0)
    cup_height: Length = quantity("m", "Height at which the cup is struck off.", 0.048, gt=0)
    particles: int = quantity("1", "Grains in all.", 1184, coarse_graining=-3, ge=1)
    rain_top: Length | None = quantity(
        "m", "Height up to which the grains rain; 29 diameters where not given.", None, coarse_graining=1, gt=0
    )
    settle_time: Duration = quantity("s", "Time to settle.", 1.2, gt=0)

    @model_validator(mode="after")
    def _fits(self) -> BulkDensitySettings:
        if smaller(self.cup_radius, 2, self.diameter):
            raise ValueError("cup_radius must be at least 2 diameters, so that grains rain clear of the wall")
        if self.rain_top is not None and smaller(self.rain_top, 3, self.diameter):
            raise ValueError("rain_top must be at least 3 diameters")
        return self


class BulkDensity(Experiment):
    """Let grains rain into a cup that is higher than needed, and weigh what lies below the plane of its stated height.

    ρ = Σ m clip((H − (z − R))/2R, 0, 1) / (π R_cup² H)

    R is that of the sphere of equal volume: what a grain of another form has below the plane depends on how it lies, which
    evens out over the many that the plane cuts.
    """

    name: ClassVar[str] = "bulk_density"
    title: ClassVar[str] = "Poured bulk density"
    imitates: ClassVar[str] = "poured (apparent) density in a cup that is struck off level, as ISO 60 and ISO 697"
    observables: tuple[Observable, ...] = (
        Observable("bulk_density", "kg/m^3", "Mass below the plane of the cup's height over the volume below it."),
    )
    settings_type: ClassVar[type[Settings]] = BulkDensitySettings

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return a cup with a wall high enough for all."""
        s = self.settings
        return cup(s.cup_radius, self._rain_top() + s.diameter, self.wall_material(model))

    def scene(self, model: Model) -> Scene:
        s, d = self.settings, self.settings.diameter
        wide = s.cup_radius + d
        return self.scene_within(model, (-wide, -wide, -d), (wide, wide, self._rain_top() + d))

    def _rain_top(self) -> float:
        return self.settings.rain_top or 29 * self.settings.diameter

    def procedure(self, world: World, model: Model) -> Procedure:
        s, d = self.settings, self.settings.diameter
        rain(world, self.grain(model), CylinderRegion(s.cup_radius - d, d, self._rain_top()), s.particles)
        yield from wait(world, s.settle_time, s.settle_time)

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        s = self.settings
        z, radius = snapshot.position[:, 2], snapshot.radius
        above = float(np.sum(np.pi * radius[z > s.cup_height] ** 2) / (np.pi * s.cup_radius**2))
        if above < 0.5:
            raise InputError(
                f"The cup isn't full: grains above its height of {s.cup_height:g} m cover {100 * above:.0f} % of its "
                "cross-section, and less than half can't be struck off. Give more particles or a lower cup_height."
            )
        share = np.clip((s.cup_height - (z - radius)) / (2 * radius), 0.0, 1.0)
        mass = float(share @ snapshot.mass)
        volume = np.pi * s.cup_radius**2 * s.cup_height
        return {"bulk_density": mass / volume}, {"mass_kg": mass, "volume_m3": volume}
