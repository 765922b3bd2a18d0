"""A tube lifted off a plate: the heap that its contents form."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from analysis.repose_profile import ProfileSettings, measure_repose_profile
from taichidem.errors import InputError
from taichidem.experiments.base import Experiment, GranularSettings, Observable, Settings
from taichidem.insertion import CylinderRegion, loose_height, smaller
from taichidem.procedure import Procedure, World, rain, wait
from taichidem.scene import Model, Scene
from taichidem.shapes.outlines import highest_point
from taichidem.simulation import Snapshot
from taichidem.units import Duration, Length, Number, Speed, quantity
from taichidem.walls import Cylinder, Disc, Wall

WITHIN = 0.9  # of the grains, whose radius says how wide the heap is
CONE_SHARE = 0.804  # of its base radius, within which a cone holds that much: 3 s² − 2 s³ = 0.9


class LiftingCylinderSettings(GranularSettings):
    """A tube of 60 mm with 600 grains of 6 mm by default."""

    cylinder_radius: Length = quantity("m", "Inner radius of the tube.", 0.03, gt=0)
    plate_radius: Length = quantity("m", "Radius of the plate; what leaves it falls away.", 0.054, gt=0)
    rim_height: Length = quantity(
        "m", "Height of the plate's rim, which keeps the lowest layer from rolling away; 0 for none.", 0.006, ge=0
    )
    particles: int = quantity("1", "Grains in all.", 600, coarse_graining=-3, ge=50)
    settle_time: Duration = quantity("s", "Time to settle in the tube.", 0.7, gt=0)
    lift_speed: Speed = quantity(
        "m/s", "Speed at which the tube is lifted, until it is clear of the grains.", 0.05, gt=0
    )
    rest_time: Duration = quantity("s", "Time to settle after that.", 0.6, gt=0)
    fit_from: Number = quantity("1", "Start of the fitted flank, share of the heap's radius.", 0.15, ge=0, lt=1)
    fit_to: Number = quantity("1", "End of the fitted flank, share of the heap's radius.", 0.85, gt=0, le=1.2)

    @model_validator(mode="after")
    def _fits(self) -> LiftingCylinderSettings:
        if smaller(self.cylinder_radius, 2.5, self.diameter):
            raise ValueError("cylinder_radius must be at least 2.5 diameters, so that grains rain clear of the wall")
        if self.plate_radius <= self.cylinder_radius:
            raise ValueError("plate_radius must be above cylinder_radius")
        if self.fit_to - self.fit_from < 0.15:
            raise ValueError("fit_to must be above fit_from by 0.15 or more")
        return self


class LiftingCylinder(Experiment):
    """Fill a tube that stands on a plate, lift it slowly, measure the heap it leaves.

    The heap's radius is that of a cone of which nine tenths of the grains on the plate lie within their radius r₉₀,
    a = r₉₀ / 0.804, so that single grains that rolled far don't count, or the plate's where that is smaller. The angle is
    that of straight lines through the highest centres in eight sectors, over a stated part of that radius. Spheres without
    rolling resistance run off a smooth plate until one layer is left; hence the rim.
    """

    name: ClassVar[str] = "lifting_cylinder"
    title: ClassVar[str] = "Heap from a lifted tube"
    imitates: ClassVar[str] = "hollow-cylinder (lifting-tube) method for the angle of repose"
    observables: tuple[Observable, ...] = (
        Observable("angle_of_repose", "deg", "Slope of the heap's flank over the stated window."),
        Observable("run_out_radius", "m", "Radius of the heap's base, as of a cone that holds nine tenths as it does."),
    )
    settings_type: ClassVar[type[Settings]] = LiftingCylinderSettings
    shown_at: ClassVar[float] = 0.75

    @classmethod
    def proposed(cls, diameter: float) -> tuple[dict[str, Any], dict[str, float]]:
        """Return the usual apparatus in proportion to the grains, its angle known to 0.7° from four repeats."""
        scale = diameter / 0.006
        sizes = {"cylinder_radius": 0.03, "plate_radius": 0.054, "rim_height": 0.006}
        paces = {"settle_time": 0.7, "lift_speed": 0.05, "rest_time": 0.6}
        settings = {k: v * scale for k, v in sizes.items()} | {k: v * scale**0.5 for k, v in paces.items()}
        return settings, {"angle_of_repose": 0.7}

    def _rain_top(self) -> float:
        s = self.settings
        free = s.cylinder_radius - s.diameter
        return s.diameter + loose_height(s.diameter / 2, s.particles, np.pi * free**2)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the tube, the plate it stands on, and the plate's rim."""
        s, material = self.settings, self.wall_material(model)
        high = self._rain_top() + s.diameter
        tube = Cylinder(name="tube", material=material, base=(0, 0, 0), radius=s.cylinder_radius, height=high)
        plate = Disc(name="plate", material=material, centre=(0, 0, 0), radius=s.plate_radius)
        if s.rim_height == 0:
            return tube, plate
        rim = Cylinder(name="rim", material=material, base=(0, 0, 0), radius=s.plate_radius, height=s.rim_height)
        return tube, plate, rim

    def scene(self, model: Model) -> Scene:
        s, d = self.settings, self.settings.diameter
        wide = s.plate_radius + 2 * d
        return self.scene_within(model, (-wide, -wide, -3 * d), (wide, wide, self._rain_top() + 2 * d))

    def procedure(self, world: World, model: Model) -> Procedure:
        s, d = self.settings, self.settings.diameter
        rain(world, self.grain(model), CylinderRegion(s.cylinder_radius - d, d, self._rain_top()), s.particles)
        longest = s.settle_time + self._rain_top() / s.lift_speed + s.rest_time
        yield from wait(world, s.settle_time, longest)
        grains = world.snapshot()
        lift = highest_point(grains) / s.lift_speed
        total = s.settle_time + lift + s.rest_time
        world.move_wall("tube", velocity=(0.0, 0.0, s.lift_speed))
        yield from wait(world, lift, total)
        world.move_wall("tube", velocity=(0.0, 0.0, 0.0))
        yield from wait(world, s.rest_time, total)

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        s = self.settings
        on_plate = snapshot.position[:, 2] > 0
        places, radii = snapshot.position[on_plate], snapshot.radius[on_plate]
        if len(places) == 0:
            raise InputError("No grain is left on the plate. Give more particles or a larger plate_radius.")
        radius = float(np.quantile(np.hypot(places[:, 0], places[:, 1]), WITHIN)) / CONE_SHARE
        radius = min(radius, s.plate_radius)
        window = ProfileSettings(method="sectors", fit_from=s.fit_from, fit_to=s.fit_to, bin_width_m=s.diameter)
        report = measure_repose_profile(places, radii, radius, window)
        details = {"profile": report, "grains_on_plate": len(places)}
        return {"angle_of_repose": report.angle_deg, "run_out_radius": radius}, details
