"""Drag and buoyancy of a fluid at rest."""

import math
from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, BodyEffect, Parameter, Similarity
from taichidem.effects.probe import ProbeScale

# The correlation of Brown & Lawler: C_D = 24/Re (1 + 0.15 Re^0.681) + 0.407/(1 + 8710/Re).
TRANSITION = 0.15
EXPONENT = 0.681
PLATEAU = 0.407
HALF_PLATEAU = 8710.0  # Reynolds number at which half of the plateau is reached
SMALLEST = 1e-300  # keeps a quotient finite where both its parts vanish


class AirDrag(BodyEffect):
    """Drag of a sphere from Stokes' to Newton's range, and buoyancy, in a fluid at rest.

    F = −½ ρ_f C_D π R² |v| v − ρ_f V g,  C_D = 24/Re (1 + 0.15 Re^0.681) + 0.407/(1 + 8710/Re),  Re = 2 ρ_f R |v|/μ

    The correlation was fitted to measurements corrected for the walls of their vessels and is good to a few percent up to
    Re = 2·10⁵; its limits are exactly Stokes' 6 π μ R v (also at density 0) and, without viscosity, C_D = 0.407. A
    coarse grain stands for s³ grains of radius R/s, s = `represented_scale`: F = s³ F(R/s).

    Expected behaviour: falls and flights come to a terminal velocity; small and light grains first. Limits: one sphere
    alone (no hindrance by neighbours, no added mass or history, no spin); smooth, without the drag crisis, which lies near
    Re = 3·10⁵ for smooth spheres and earlier for rough ones: beyond 2·10⁵ C_D is held near 0.46. Grains of another form are
    dragged as the sphere of their volume, however they lie; in truth long and flat ones fall more slowly and turn.
    """

    name: ClassVar[str] = "air_drag"
    title: ClassVar[str] = "Drag and buoyancy of air"
    family: ClassVar[str] = "drag"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="fluid_density",
            unit="kg/m^3",
            low=0.0,
            high=2e3,
            plausible=(0.0, 1.3),
            vanishing=0.0,
            default=1.204,
            per_pair=False,
            meaning="Density of the fluid around the grains, by default of air at 20 °C.",
        ),
        Parameter(
            name="viscosity",
            unit="Pa s",
            low=0.0,
            high=1e3,
            plausible=(0.0, 2e-5),
            vanishing=0.0,
            default=1.825e-5,
            per_pair=False,
            meaning="Dynamic viscosity of the fluid, by default of air at 20 °C.",
        ),
        Parameter(
            name="represented_scale",
            unit="1",
            low=0.0,
            high=1e3,
            open_low=True,
            plausible=(1.0, 10.0),
            default=1.0,
            per_pair=False,
            coarse_graining=1.0,
            meaning="Radius of a grain over the radius of the real grains it stands for.",
        ),
    )
    visible_as: ClassVar[str] = "light or small grains fall more slowly and fly less far; dense grains hardly"
    similarity: ClassVar[Similarity] = Similarity("drag and buoyancy over weight at the same speed", *UNDER_WEIGHT)
    source: ClassVar[str] = "Brown & Lawler (2003), doi 10.1061/(ASCE)0733-9372(2003)129:3(222)"

    @property
    def coefficients(self) -> tuple[str, ...]:
        return ("density", "viscosity", "intermediate", "scale")

    def kernel_coefficients(self) -> dict[str, float]:
        """Return ρ_f [kg/m³], μ [Pa s], 0.15 μ^0.319 and s [1]."""
        viscosity = self.value("viscosity")
        return {
            "density": self.value("fluid_density"),
            "viscosity": viscosity,
            "intermediate": TRANSITION * viscosity ** (1.0 - EXPONENT),
            "scale": self.value("represented_scale"),
        }

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return air of one and a half times its density and viscosity."""
        usual = {p.name: p.default for p in cls.parameters if p.default is not None}
        return {name: 1.5 * usual[name] for name in ("fluid_density", "viscosity")}

    @ti.func
    def wrench(self, p, b: ti.template()):
        # Multiplied out, so that nothing divides by a speed, a density or a viscosity of zero: flux is μ Re.
        diameter = 2.0 * b.radius / p.scale
        flux = p.density * diameter * b.velocity.norm()
        drag = 3.0 * math.pi * diameter * (p.viscosity + p.intermediate * flux**EXPONENT)
        drag += PLATEAU * math.pi / 8.0 * diameter * flux * (flux / (flux + HALF_PLATEAU * p.viscosity + SMALLEST))
        lift = 4.0 / 3.0 * math.pi * b.radius**3 * p.density
        return Wrench(force=-(p.scale**3 * drag) * b.velocity - lift * b.gravity, torque=vec3(0.0))
