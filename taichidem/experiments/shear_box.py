"""A box in two halves, sheared under a constant load: shear stress, friction angle, cohesion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from taichidem.experiments.base import Experiment, GranularSettings, Observable, Outcome, Settings, gravity_of
from taichidem.experiments.shear_box_walls import lower_half, upper_half
from taichidem.insertion import BoxRegion, loose_height, smaller
from taichidem.procedure import Procedure, World, rain, wait
from taichidem.scene import Model, Scene
from taichidem.shapes.outlines import highest_point
from taichidem.simulation import Snapshot
from taichidem.units import Duration, Length, Speed, Stresses, quantity
from taichidem.walls import Plane, Wall

SAMPLES = 500  # of the shear force
SMOOTHING = 25  # samples of a running mean, in whose course the peak is looked for
STEADY = 1 / 3  # of the displacement, at its end, over which the steady stress is taken
LOWERING = 0.2  # [s] in which the lid comes down onto the grains
ONE = (
    Observable("peak_shear_stress", "Pa", "Largest shear stress, of its running mean."),
    Observable("steady_shear_stress", "Pa", "Mean shear stress over the last third of the displacement."),
)
SEVERAL = (
    Observable("friction_angle", "deg", "Slope of the line through the steady shear stresses over the normal stress."),
    Observable("cohesion", "Pa", "Where that line meets the axis of no normal stress."),
    Observable("peak_friction_angle", "deg", "Slope of the line through the peak shear stresses."),
)


class ShearBoxSettings(GranularSettings):
    """A box of 60 × 60 mm (our choice, ten diameters), with 900 grains of 6 mm, under three loads by default."""

    length: Length = quantity("m", "Inner length of the box, in which it is sheared.", 0.06, gt=0)
    width: Length = quantity("m", "Inner width of the box.", 0.06, gt=0)
    lower_height: Length = quantity("m", "Height of the lower half, whose rim is the shear plane.", 0.024, gt=0)
    particles: int = quantity("1", "Grains in all.", 900, coarse_graining=-3, ge=1)
    normal_stresses: Stresses = quantity(
        "Pa", "Load on the lid over its area, one or several.", (1000.0, 2000.0, 4000.0)
    )
    shear_speed: Speed = quantity("m/s", "Speed of the lower half.", 0.02, gt=0)
    shear_displacement: Length = quantity("m", "Way of the lower half.", 0.009, gt=0)
    settle_time: Duration = quantity("s", "Time to settle without load.", 0.6, gt=0)
    consolidation_time: Duration = quantity("s", "Time under the load before shearing.", 0.3, gt=0)

    @model_validator(mode="after")
    def _fits(self) -> ShearBoxSettings:
        if smaller(min(self.length, self.width), 5, self.diameter):
            raise ValueError("length and width must be at least 5 diameters (ASTM D3080 asks for 10)")
        if smaller(self.lower_height, 2, self.diameter):
            raise ValueError("lower_height must be at least 2 diameters")
        if self.shear_displacement > self.length / 4:
            raise ValueError("shear_displacement must be at most a quarter of the length")
        stresses = self.normal_stresses
        if not stresses or min(stresses) <= 0 or len(set(stresses)) < len(stresses):
            raise ValueError("normal_stresses must be one or more different stresses above 0")
        return self


class ShearBox(Experiment):
    """Press grains in a box with a dead weight, shear its lower half away, read the force; repeat under other loads.

    τ = F_x / A with the horizontal force F_x of the grains on the moving half and the initial area A = length × width, as
    ASTM D3080 computes both stresses; σ is the load over A and the weight of the grains above the shear plane. A
    correction for the shrinking overlap would multiply τ and σ alike and leave the friction angle as it is. Through
    (σ, τ) of several loads goes a straight line, τ = c + σ tan φ.

    What the plane really carries differs: grains that dilate push the fixed upper half up through wall friction and press
    on the plane by as much, as in any box whose upper half can't rise. `details` give that stress; the instrument doesn't
    know it, so σ stays what is applied, and the line may show a cohesion where there is none.

    The lid is a weight in a guide: load divided by grains' mass is its acceleration, so it follows the bed as fast as grains
    move themselves, and needs no controller and no gain; what a servo holds on average, it holds exactly, inertia apart.
    Flanges close what the halves uncover when they slide apart.
    """

    name: ClassVar[str] = "shear_box"
    title: ClassVar[str] = "Direct shear in a box of two halves"
    imitates: ClassVar[str] = "direct shear box, as ASTM D3080"
    settings_type: ClassVar[type[Settings]] = ShearBoxSettings
    view: ClassVar[tuple[float, float]] = (-70.0, 14.0)

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.observables = ONE if len(self.settings.normal_stresses) == 1 else SEVERAL

    def particles_needed(self) -> int:
        return self.settings.particles * len(self.settings.normal_stresses)

    def parts(self) -> Sequence[Experiment]:
        """Return one box per load, all filled alike."""
        given = dict(self.settings)
        return [type(self)(**given | {"normal_stresses": stress}) for stress in self.settings.normal_stresses]

    @property
    def _area(self) -> float:
        return self.settings.length * self.settings.width

    def _rain_top(self) -> float:
        s = self.settings
        return s.diameter + loose_height(s.diameter / 2, s.particles, self._area)

    def walls(self, model: Model) -> tuple[Wall, ...]:
        """Return the lower half with its floor, the upper half, and the lid above all grains."""
        s, material = self.settings, self.wall_material(model)
        top = self._rain_top() + s.diameter
        box = (s.length, s.width, s.lower_height)
        flange = s.shear_displacement + s.diameter
        size = 0.45 * min(s.length, s.width)
        centre = (s.length / 2, s.width / 2, top)
        return (
            lower_half(*box, flange, material),
            upper_half(*box, top, flange, material),
            Plane(name="lid", material=material, point=centre, normal=(0, 0, -1), picture_size=size),
        )

    def scene(self, model: Model) -> Scene:
        s, d = self.settings, self.settings.diameter
        far = s.shear_displacement + 2 * d
        return self.scene_within(
            model, (-far, -2 * d, -2 * d), (s.length + far, s.width + 2 * d, self._rain_top() + 2 * d)
        )

    def procedure(self, world: World, model: Model) -> Procedure:
        s = self.settings
        shearing = s.shear_displacement / s.shear_speed
        total = s.settle_time + LOWERING + s.consolidation_time + shearing
        margin = 0.1 * s.diameter
        region = BoxRegion((margin,) * 3, (s.length - margin, s.width - margin, self._rain_top()))
        rain(world, self.grain(model), region, s.particles)
        yield from wait(world, s.settle_time, total)
        grains = world.snapshot()
        gap = self._rain_top() + s.diameter - highest_point(grains)
        world.move_wall("lid", velocity=(0.0, 0.0, -gap / LOWERING))
        yield from wait(world, LOWERING, total)
        load = (0.0, 0.0, -s.normal_stresses[0] * self._area)
        world.move_wall("lid", velocity=(0.0, 0.0, 0.0), load=load, mass=float(grains.mass.sum()))
        yield from wait(world, s.consolidation_time, total)
        grains = world.snapshot()
        above = grains.position[:, 2] > s.lower_height
        weight = gravity_of(model) * grains.mass
        start = world.wall("lid").centre[2]
        world.note(weight_above=float(weight[above].sum()), weight_below=float(weight[~above].sum()))
        world.move_wall("lower half", velocity=(s.shear_speed, 0.0, 0.0))
        for pause in wait(world, shearing, total, shearing / SAMPLES):
            yield pause
            half, lid = world.wall("lower half"), world.wall("lid")
            world.note(displacement=half.centre[0], lid_rise=lid.centre[2] - start)
            world.note(shear_force=-half.force[0], normal_force=-half.force[2])

    def measure(self, snapshot: Snapshot, record: Mapping[str, list]) -> tuple[dict[str, float], dict[str, Any]]:
        stress = np.asarray(record["shear_force"]) / self._area
        displacement = np.asarray(record["displacement"])
        smooth = np.convolve(stress, np.full(SMOOTHING, 1 / SMOOTHING), mode="valid")
        late = displacement >= (1 - STEADY) * displacement[-1]
        normal = self.settings.normal_stresses[0] + record["weight_above"][0] / self._area
        values = {"peak_shear_stress": float(smooth.max()), "steady_shear_stress": float(stress[late].mean())}
        on_plane = (np.asarray(record["normal_force"]) - record["weight_below"][0]) / self._area
        curves = {
            "displacement_m": displacement,
            "shear_stress_pa": stress,
            "lid_rise_m": np.asarray(record["lid_rise"]),
        }
        return values, {"normal_stress_pa": normal, "stress_on_plane_pa": float(on_plane[late].mean()), **curves}

    def combine(self, outcomes: Sequence[Outcome]) -> Outcome:
        """Return the outcome of a single load as it is, or the lines through those of several."""
        if len(outcomes) == 1:
            return outcomes[0]
        loads = self.settings.normal_stresses
        failures = [f"{load:g} Pa: {o.failure}" for load, o in zip(loads, outcomes, strict=True) if o.failure]
        if failures:
            stopped = any(o.stopped for o in outcomes)
            return Outcome({}, outcomes[0].seed, " ".join(failures), stopped=stopped)
        normal = np.array([o.details["normal_stress_pa"] for o in outcomes])
        steady, peak = (np.array([o.observables[ob.name] for o in outcomes]) for ob in reversed(ONE))
        slope, cohesion = np.polyfit(normal, steady, 1)
        values = {
            "friction_angle": math.degrees(math.atan(slope)),
            "cohesion": float(cohesion),
            "peak_friction_angle": math.degrees(math.atan(np.polyfit(normal, peak, 1)[0])),
        }
        kept = ("normal_stress_pa", "stress_on_plane_pa")
        tests = [{name: o.details[name] for name in kept} | dict(o.observables) for o in outcomes]
        first = outcomes[0]
        return Outcome(values, first.seed, None, first.snapshot, {"tests": tests}, first.frames)
