"""A conical hopper whose outlet is opened: the mass flow rate."""

from __future__ import annotations

import math
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
from taichidem.units import Angle, Duration, Length, quantity
from taichidem.walls import Cone, Cylinder, Plane, Wall

SAMPLE_INTERVAL = 0.01  # [s]
WINDOW = (0.85, 0.25)  # remaining share of the mass between which the rate is taken
FEWEST_SAMPLES = 5


class HopperDischargeSettings(GranularSettings):
    """A hopper of 30° with an outlet of 36 mm, filled with 6 mm grains, by default."""

    outlet_diameter: Length = quantity("m", "Diameter of the outlet.", 0.036, gt=0)
    bin_radius: Length = quantity("m", "Radius of the cylinder above the cone.", 0.048, gt=0)
    half_angle: Angle = quantity("deg", "Angle of the cone to the vertical.", 30.0, gt=0, lt=90)
    particles: int = quantity("1", "Grains in all.", 1000, coarse_graining=-3, ge=1)
    rain_height: Length | None = quantity(
        "m",
        "Height above the cone up to which the grains rain; 19 diameters where not given.",
        None,
        coarse_graining=1,
        gt=0,
    )
    settle_time: Duration = quantity("s", "Time to settle on the closed outlet.", 0.9, gt=0)
    flow_time: Duration = quantity("s", "Time for which the outlet is open.", 3.0, gt=0)

    @model_validator(mode="after")
    def _fits(self) -> HopperDischargeSettings:
        if self.outlet_diameter >= 2 * self.bin_radius:
            raise ValueError("outlet_diameter must be below twice the bin_radius")
        if self.outlet_diameter <= self.diameter:
            raise ValueError("outlet_diameter must be above the grains' diameter, or none can pass")
        if smaller(self.bin_radius, 2, self.diameter):
            raise ValueError("bin_radius must be at least 2 diameters, so that grains rain clear of the wall")
        if self.rain_height is not None and smaller(self.rain_height, 2, self.diameter):
            raise ValueError("rain_height must be at least 2 diameters")
        return self


class HopperDischarge(Experiment):
    """Fill a conical hopper on a closed outlet, open it at once, follow the mass that remains.

    The rate is minus the least-squares slope of the remaining mass between 85 % and 25 % of the initial mass, so that
    neither the start nor the last grains count. A hopper that stops before it is down to 25 % gives the slope up to the
    last sample, its standstill included, and says so in `details["note"]`; one that stops above 85 % gives 0. So a
    blocked outlet stays a number that a comparison can use: the flow it doesn't have. An outlet narrower than about five
    diameters may block; that is a result and no error.
    """

    name: ClassVar[str] = "hopper_discharge"
    title: ClassVar[str] = "Discharge of a conical hopper"
    imitates: ClassVar[str] = "flow through a funnel, as ISO 6186 and ASTM D1895 for pourability"
    observables: tuple[Observable, ...] = (
        Observable("mass_flow_rate", "g/s", "Mass that leaves the open outlet per time."),
    )
    settings_type: ClassVar[type[Settings]] = HopperDischargeSettings
    shown_at: ClassVar[float] = 0.8

    def _cone_height(self) -> float:
        s = self.settings
        return (s.bin_radius - s.outlet_diameter / 2) / math.tan(math.radians(s.half_angle))

    def _rain_top(self) -> float:
        return self._cone_height() + (self.settings.rain_height or 19 * self.settings.diameter)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the cone, the cylinder above it and the slide that closes the outlet."""
        s, material, cone = self.settings, self.wall_material(model), self._cone_height()
        above = self._rain_top() + s.diameter - cone
        outlet = s.outlet_diameter / 2
        return (
            Cone(
                name="cone", material=material, base=(0, 0, 0), base_radius=outlet, top_radius=s.bin_radius, height=cone
            ),
            Cylinder(name="bin", material=material, base=(0, 0, cone), radius=s.bin_radius, height=above),
            Plane(name="slide", material=material, point=(0, 0, 0), normal=(0, 0, 1), picture_size=s.bin_radius),
        )

    def scene(self, model: Model) -> Scene:
        s, d = self.settings, self.settings.diameter
        wide = s.bin_radius + d
        return self.scene_within(model, (-wide, -wide, -4 * d), (wide, wide, self._rain_top() + d))

    def procedure(self, world: World, model: Model) -> Procedure:
        s, d = self.settings, self.settings.diameter
        total = s.settle_time + s.flow_time
        region = CylinderRegion(s.bin_radius - d, self._cone_height(), self._rain_top())
        rain(world, self.grain(model), region, s.particles)
        yield from wait(world, s.settle_time, total)
        world.remove_wall("slide")
        _note_what_remains(world)
        for pause in wait(world, s.flow_time, total, SAMPLE_INTERVAL):
            yield pause
            if _note_what_remains(world) == 0:
                break

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        time, mass = np.asarray(record["time"]), np.asarray(record["mass"])
        share = mass / mass[0]
        used = (share <= WINDOW[0]) & (share >= WINDOW[1])
        details = {"time_s": time - time[0], "particles_above_outlet": record["count"], "mass_kg": mass}
        if share[-1] > WINDOW[1]:
            details["note"] = (
                f"{100 * share[-1]:.0f} % of the mass is still in the hopper after {time[-1] - time[0]:.3g} s; the rate is "
                f"taken up to there instead of down to {100 * WINDOW[1]:.0f} %."
            )
        if share[-1] > WINDOW[0] and mass[-1] == mass[len(mass) // 2]:
            return {"mass_flow_rate": 0.0}, details
        if np.count_nonzero(used) < FEWEST_SAMPLES:
            raise InputError(
                f"Only {np.count_nonzero(used)} samples, {SAMPLE_INTERVAL:g} s apart, lie between {100 * WINDOW[0]:.0f} % and "
                f"{100 * WINDOW[1]:.0f} % of the mass, and a rate needs {FEWEST_SAMPLES}; {100 * share[-1]:.0f} % remained "
                "at the end. Give a longer flow_time to a slow hopper, more particles to a quick one."
            )
        slope = np.polyfit(time[used] - time[0], mass[used], 1)[0]
        return {"mass_flow_rate": -1e3 * float(slope)}, details


def _note_what_remains(world: World) -> int:
    """Note time [s], number and mass [kg] of the grains above the outlet; return their number."""
    count, mass = world.look(_above_outlet)
    world.note(time=world.time, count=count, mass=mass)
    return count


def _above_outlet(grains: Snapshot) -> tuple[int, float]:
    above = grains.position[:, 2] > 0
    return int(np.count_nonzero(above)), float(grains.mass[above].sum())
