"""A heap poured onto a cup from a fixed height: the angle of repose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from analysis.repose_profile import ProfileSettings, measure_repose_profile
from analysis.repose_window import FitWindow
from taichidem.errors import InputError
from taichidem.experiments.base import Experiment, GranularSettings, Observable, Settings, gravity_of
from taichidem.grains import Grains
from taichidem.graphics import require_graphics
from taichidem.insertion import CylinderRegion
from taichidem.procedure import Procedure, World, pour, settle, wait
from taichidem.scene import Model, Scene
from taichidem.simulation import Snapshot
from taichidem.units import Duration, Length, Number, PerSecond, Speed, quantity
from taichidem.walls import Wall, cup


class FixedFunnelSettings(GranularSettings):
    """A heap of 6 mm grains on a cup of 84 mm by default, averaged over eight sectors."""

    cup_radius: Length = quantity("m", "Inner radius of the cup.", 0.042, gt=0)
    rim_height: Length = quantity("m", "Height of the rim above the cup's bottom.", 0.018, gt=0)
    stream_radius: Length = quantity(
        "m", "Radius of the cylinder in which grains appear, whole grains inside.", 0.015, gt=0
    )
    stream_bottom: Length = quantity("m", "Lower end of that cylinder.", 0.096, gt=0)
    stream_top: Length = quantity("m", "Upper end of that cylinder.", 0.18, gt=0)
    stream_rate: PerSecond = quantity("1/s", "Grains per second.", 400.0, coarse_graining=-3, gt=0)
    batch_interval: Duration = quantity("s", "Time between batches.", 0.06, gt=0)
    drop_velocity: Speed = quantity("m/s", "Downward speed at which grains appear.", 0.5, ge=0)
    particles: int = quantity("1", "Grains poured in all.", 900, coarse_graining=-3, ge=1)
    settle_time: Duration = quantity("s", "Time to settle after the last grain.", 1.3, gt=0)
    longest_settle_time: Duration | None = quantity(
        "s",
        "Where given, settling goes on until the grains are quiet, but no longer than this; where not, it ends on time.",
        None,
        gt=0,
    )
    method: Literal["rings", "sectors", "pictures"] = quantity(
        "1",
        "How the angle is measured: positions averaged in rings over all azimuths or in eight sectors, or pictures from all "
        "around.",
        "sectors",
    )
    fit_from: Number = quantity("1", "Start of the fitted flank, share of the cup radius.", 0.15, ge=0, lt=1)
    fit_to: Number = quantity("1", "End of the fitted flank, share of the cup radius.", 0.95, gt=0)

    @model_validator(mode="after")
    def _fits(self) -> FixedFunnelSettings:
        if self.stream_bottom <= self.rim_height or self.stream_top <= self.stream_bottom:
            raise ValueError("the stream must lie above the rim: rim_height < stream_bottom < stream_top")
        FitWindow(self.fit_from, self.fit_to)  # better refused now than by the measurement, after minutes of pouring
        if self.longest_settle_time is not None and self.longest_settle_time < self.settle_time:
            raise ValueError("longest_settle_time must not be below settle_time")
        if self.stream_radius > self.cup_radius:
            raise ValueError("stream_radius must not exceed cup_radius")
        return self


class FixedFunnel(Experiment):
    """Pour grains through a fixed funnel onto a thin-walled cup until it overflows, let them settle, measure the slope.

    The stream's cylinder stands for the funnel's outlet; what falls off the cup leaves. The angle is that of a straight
    line through the heap's flank over a stated window, from the grains' positions or, as in a laboratory, from pictures.
    """

    name: ClassVar[str] = "fixed_funnel"
    title: ClassVar[str] = "Heap from a fixed funnel"
    imitates: ClassVar[str] = "fixed-funnel angle of repose on a cup, as ISO 4324 for powders"
    observables: tuple[Observable, ...] = (
        Observable("angle_of_repose", "deg", "Slope of the heap's flank over the stated window."),
    )
    settings_type: ClassVar[type[Settings]] = FixedFunnelSettings

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the cup: a tube and a bottom."""
        s = self.settings
        return cup(s.cup_radius, s.rim_height, self.wall_material(model))

    def scene(self, model: Model) -> Scene:
        s = self.settings
        if s.cup_radius < 3 * s.diameter:
            raise InputError(
                f"cup_radius is {s.cup_radius:g} m, less than three grains of {s.diameter:g} m. Take a wider cup."
            )
        if s.method == "pictures":
            require_graphics()  # better now than after minutes of pouring
        wide = s.cup_radius + 8 * s.diameter
        return self.scene_within(model, (-wide, -wide, -2 * s.diameter), (wide, wide, s.stream_top + s.diameter))

    def procedure(self, world: World, model: Model) -> Procedure:
        s = self.settings
        grain = self.grain(model)
        region = CylinderRegion(s.stream_radius, s.stream_bottom, s.stream_top)
        drop = (0.0, 0.0, -s.drop_velocity)
        pouring = s.particles / s.stream_rate
        share = pouring / (pouring + s.settle_time)
        yield from pour(world, grain, region, s.particles, s.stream_rate, s.batch_interval, drop, (0.0, share))
        if s.longest_settle_time is None:
            yield from wait(world, s.settle_time, world.time + s.settle_time)
        else:
            longest = s.longest_settle_time
            yield from settle(world, grain, at_least=s.settle_time, at_most=longest, gravity=gravity_of(model))

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        s = self.settings
        kept = snapshot.position[:, 2] > 0
        method = "rings" if s.method == "pictures" else s.method
        profile = measure_repose_profile(
            snapshot.position[kept],
            snapshot.radius[kept],
            s.cup_radius,
            ProfileSettings(method=method, fit_from=s.fit_from, fit_to=s.fit_to, bin_width_m=s.diameter),
        )
        if profile.angle_deg <= 0:
            raise InputError(
                f"The grains form no heap: their surface rises outwards, {profile.angle_deg:.1f}° over the window from "
                f"{s.fit_from:g} to {s.fit_to:g} of the cup radius. Pour more grains."
            )
        inside = np.hypot(*snapshot.position[:, :2].T) < s.cup_radius
        details = {"profile": profile, "grains_in_cup": int(np.count_nonzero(kept & inside))}
        if s.method != "pictures":
            return {"angle_of_repose": profile.angle_deg}, details
        from taichidem.heap_views import grains_on_base, measure_heap  # which takes a second to import

        grains = grains_on_base(Grains.of(snapshot), s.cup_radius)
        pictures = measure_heap(grains, s.cup_radius, s.fit_from, s.fit_to)
        return {"angle_of_repose": pictures.angle_deg}, details | {"pictures": pictures}
