"""What the sensitivity table changes, one thing at a time: parameters down and up, every effect weak and strong."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from taichidem import effects as e
from taichidem.effects.base import Effect
from taichidem.scene import Model

GRAINS, WALL, NONE = "granule-granule", "granule-wall", "wall-wall"


@dataclass(frozen=True)
class Change:
    """One departure from the centre.

    Attributes:
        name: of the effect or parameter.
        level: "weak" or "strong" for an effect, "down" or "up" for a parameter.
        setting: in words, with units.
        apply: centre model → changed model.
        reference: key of the same change in the reference table, or "".
    """

    name: str
    level: str
    setting: str
    apply: Callable[[Model], Model]
    reference: str = ""

    @property
    def is_parameter(self) -> bool:
        """True if a parameter of the centre model is changed and nothing added."""
        return self.level in ("down", "up")

    @property
    def label(self) -> str:
        """Name and level."""
        return f"{self.name} {self.level}"


def adding(*more: Effect) -> Callable[[Model], Model]:
    """Return the change that adds effects; one of a family that is there takes its place."""
    families = {effect.family for effect in more}
    return lambda model: Model(model.materials, [*(x for x in model.effects if x.family not in families), *more])


def parameter(name: str, pair: str, value: float) -> Callable[[Model], Model]:
    """Return the change of one parameter of the centre model."""
    return lambda model: model.with_value(name, value, pair)


def between_grains(value: float) -> dict[str, float]:
    """Return a value that holds between grains and vanishes at walls."""
    return {GRAINS: value, WALL: 0.0, NONE: 0.0}


RESTITUTION, FRICTION = "normal_hertz.restitution", "tangential_mindlin.static_friction"

PARAMETERS = (
    Change("restitution_pp", "down", "0.45", parameter(RESTITUTION, GRAINS, 0.45), "e_pp-"),
    Change("restitution_pp", "up", "0.75", parameter(RESTITUTION, GRAINS, 0.75), "e_pp+"),
    Change("restitution_pw", "down", "0.5", parameter(RESTITUTION, WALL, 0.5), "e_pw-"),
    Change("restitution_pw", "up", "0.7", parameter(RESTITUTION, WALL, 0.7), "e_pw+"),
    Change("static_friction_pp", "down", "0.3", parameter(FRICTION, GRAINS, 0.3), "mu_pp-"),
    Change("static_friction_pp", "up", "0.6", parameter(FRICTION, GRAINS, 0.6), "mu_pp+"),
    Change("static_friction_pw", "down", "0.2", parameter(FRICTION, WALL, 0.2), "mu_pw-"),
    Change("static_friction_pw", "up", "0.4", parameter(FRICTION, WALL, 0.4), "mu_pw+"),
)


def _two(
    name: str,
    weak: tuple[str, Effect],
    strong: tuple[str, Effect],
    references: tuple[str, str] = ("", ""),
) -> tuple[Change, Change]:
    return (
        Change(name, "weak", weak[0], adding(weak[1]), references[0]),
        Change(name, "strong", strong[0], adding(strong[1]), references[1]),
    )


# A grain of 6 mm weighs 1.0 mN; adhesive strengths are chosen so that the pull-off is about 0.2 and 1.5 weights.
EFFECTS = (
    *_two(
        "rolling_constant_torque",
        ("0.02", e.RollingConstantTorque(rolling_friction=0.02)),
        ("0.08", e.RollingConstantTorque(rolling_friction=0.08)),
        ("", "roll"),
    ),
    *_two(
        "rolling_spring_dashpot",
        ("0.02", e.RollingSpringDashpot(rolling_friction=0.02)),
        ("0.08", e.RollingSpringDashpot(rolling_friction=0.08)),
    ),
    *_two(
        "twisting_resistance",
        ("0.2", e.TwistingResistance(twisting_friction=0.2)),
        ("1", e.TwistingResistance(twisting_friction=1.0)),
    ),
    *_two(
        "kinetic_friction",
        ("0.8 of static", e.KineticFriction(kinetic_ratio=0.8)),
        ("0.5 of static", e.KineticFriction(kinetic_ratio=0.5)),
    ),
    *_two(
        "cohesion_area",
        ("10 kJ/m³ between grains", e.CohesionArea(energy_density=between_grains(1e4))),
        ("38 kJ/m³ between grains", e.CohesionArea(energy_density=between_grains(3.8e4))),
        ("", "coh"),
    ),
    *_two(
        "cohesion_jkr",
        ("0.03 J/m² between grains", e.CohesionJkr(work_of_adhesion=between_grains(0.03))),
        ("0.2 J/m² between grains", e.CohesionJkr(work_of_adhesion=between_grains(0.2))),
    ),
    *_two(
        "cohesion_dmt",
        ("0.02 J/m² between grains", e.CohesionDmt(work_of_adhesion=between_grains(0.02))),
        ("0.15 J/m² between grains", e.CohesionDmt(work_of_adhesion=between_grains(0.15))),
    ),
    *_two(
        "liquid_bridge",
        ("15 mN/m, 1 % liquid", e.LiquidBridge(surface_tension=0.015, liquid_fraction=0.01)),
        ("72 mN/m, 1 % liquid", e.LiquidBridge(surface_tension=0.072, liquid_fraction=0.01)),
    ),
    *_two(
        "wall_adhesion",
        ("0.01 J/m²", e.WallAdhesion(work_of_adhesion=0.01)),
        ("0.08 J/m²", e.WallAdhesion(work_of_adhesion=0.08)),
    ),
    *_two(
        "normal_viscoelastic",
        ("dissipation time 20 µs", e.NormalViscoelastic(dissipation_time=2e-5)),
        ("dissipation time 50 µs", e.NormalViscoelastic(dissipation_time=5e-5)),
    ),
    *_two(
        "normal_elastoplastic",
        ("E*/p_y = 20", e.NormalElastoplastic(modulus_over_yield_pressure=20.0, restitution=0.6)),
        ("E*/p_y = 80", e.NormalElastoplastic(modulus_over_yield_pressure=80.0, restitution=0.6)),
    ),
    *_two(
        "air_drag",
        ("air", e.AirDrag()),
        ("linear, 0.5 g/s per grain", e.AirDrag(fluid_density=0.0, viscosity=8.842e-3)),
        ("", "drag"),
    ),
    *_two(
        "size_spread",
        ("±15 %", e.SizeSpread(half_width=0.15)),
        ("±35 %", e.SizeSpread(half_width=0.35)),
        ("", "spread"),
    ),
    *_two("base_tilt", ("1°", e.BaseTilt(angle=1.0)), ("3°", e.BaseTilt(angle=3.0)), ("", "tilt")),
    *_two(
        "electrostatic_charge",
        ("3 µC/m² to 1 mm", e.ElectrostaticCharge(surface_charge_density=3e-6, cut_off=1e-3)),
        ("10 µC/m² to 1 mm", e.ElectrostaticCharge(surface_charge_density=1e-5, cut_off=1e-3)),
    ),
)
