"""Capillary bridges between wet grains, with the liquid they are made of."""

import math
from typing import Any, ClassVar

import numpy as np
import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import ContactEffect, Memory, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.errors import InputError
from taichidem.materials import MaterialPair

LARGEST_VOLUME = 0.1  # V/R³ up to which Willett's fit holds
SHARPEST = 2.0 * (1.0 + 1e-9)  # of R*, that a body counts as at most; two spheres are never larger, the rounding aside
SMALLEST_VOLUME = 1e-5  # V/R³; below it the fit passes 2πRγ cos θ, and on real grains the liquid stays in the roughness
TOUCHING = 1e-4  # S⁺ below which the force is that of touch: the fit, singular at 0, differs from it by less than 1e-6

# Willett's f₁ … f₄: f_n = Σ_k (a + b θ + c θ²) (ln V*)^k, a row (a, b, c) for each k.
FITS = (
    (
        (-0.44507, 0.050832, -1.1466),
        (-0.1119, -0.000411, -0.1490),
        (-0.012101, -0.0036456, -0.01255),
        (-0.0005, -0.0003505, -0.00029076),
    ),
    ((1.9222, -0.57473, -1.2918), (-0.0668, -0.1201, -0.22574), (-0.0013375, -0.0068988, -0.01137)),
    (
        (1.268, -0.01396, -0.23566),
        (0.198, 0.092, -0.06418),
        (0.02232, 0.02238, -0.009853),
        (0.0008585, 0.001318, -0.00053),
    ),
    ((-0.010703, 0.073776, -0.34742), (0.03345, 0.04543, -0.09056), (0.0018574, 0.004456, -0.006257)),
)
_TERMS = tuple(f"f{n}_{k}" for n, rows in enumerate(FITS, start=1) for k in range(len(rows)))


def rupture_gap(volume: float, angle: float) -> float:
    """Return S_c/R = (1 + θ/2)(V*^(1/3) + 0.1 V*^(2/3)) of a bridge V* = V/R³ at contact angle θ [rad].

    Source: Willett et al. (2000), eq. 15.
    """
    return (1 + angle / 2) * (volume ** (1 / 3) + 0.1 * volume ** (2 / 3))


class LiquidBridge(ContactEffect):
    """The pull and the viscous resistance of a pendular bridge, whose liquid comes from films on the grains.

    F = −2π R γ exp(f₁ − f₂ exp(f₃ ln S⁺ + f₄ ln² S⁺)),  S⁺ = (S/2)/√(V/R),  f_n polynomials in θ and ln V*,  V* = V/R³,
    R = 2 R₁R₂/(R₁ + R₂) (Derjaguin), which at a wall is 2 R₁, so that F → −4π R₁ γ cos θ there for little liquid;
    S_c = (1 + θ/2)(V*^(1/3) + 0.1 V*^(2/3)) R ends it;
    F_n = −6π η R*² v_n/S,  F_t = −6π η R* (8/15 ln(R*/S) + 0.9588) v_t,  S ≥ ε R*

    Touching grains pull with the limit S → 0, 2π R γ exp f₁; the same holds for gaps S⁺ < 1e-4, where the fit is within
    1e-6 of it. Against the equation of Young and Laplace this is 1 to 3 % low at touch, within 4 % up to 0.8 S_c
    and up to 13 % high near rupture, where the force is small. The fit holds for θ < 50° and V* < 0.1. The cut-off ε R* of
    the viscous part stands for roughness.

    Grains carry a film of `liquid_fraction` times their volume. A new bridge takes from each side `bridge_share` of the
    film that the smaller of the two had at first, or what is left of its own; walls are dry and give nothing. The volume
    stays until the bridge ruptures and gives half to each side, all of it to the grain at a wall. A contact that would
    get less than V* = 1e-5 stays dry. What grains and bridges hold together is constant; where several bridges form at
    a grain in one step, its film may fall below zero by what was then missing, and gives nothing until that is paid.
    A bridge at a face of a mesh is given back where the grain passes over an edge, and forms anew where it touches; one
    to a grain that leaves the domain leaves with it.

    `forms="touch"` (the default) lets a bridge form when surfaces touch, so that a cycle of touch and rupture costs
    ∫ F dS; `forms="reach"` as soon as the films could span the gap, as for thick films, which costs nothing by itself.
    The pull is carried by the elastic force, so it enters Coulomb's cap through that and is not added to it again.

    Expected behaviour: steep heaps, lumps, slow discharge, and grains that stay together until S_c; more liquid reaches
    farther but hardly pulls harder. With viscosity impacts below a critical speed do not rebound. Limits: pendular state,
    no gravity in the bridge, no flow between bridges; explicit steps need 6π η R*/ε well below m*/Δt.
    Grains of any form carry that share of their volume. A bridge of theirs is that of spheres with the curvatures at the
    contact, takes no more than a sphere of 2 R* would give, and breaks at the latest where one between the spheres about
    the largest grains would.
    """

    name: ClassVar[str] = "liquid_bridge"
    title: ClassVar[str] = "Liquid bridges"
    family: ClassVar[str] = "cohesion"
    stage: ClassVar[Stage] = Stage.ADHESION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="surface_tension",
            unit="N/m",
            low=0.0,
            high=1e3,  # coarse-grained grains have a larger one than any liquid
            plausible=(0.0, 0.075),
            vanishing=0.0,
            coarse_graining=2.0,  # 2π R γ over the weight
            meaning="Surface tension of the liquid; water has 0.072.",
        ),
        Parameter(
            name="liquid_fraction",
            unit="1",
            low=0.0,
            high=0.1,
            plausible=(0.0, 0.03),
            vanishing=0.0,
            per_pair=False,
            meaning="Volume of liquid over volume of grains.",
        ),
        Parameter(
            name="contact_angle",
            unit="deg",
            low=0.0,
            high=50.0,
            plausible=(0.0, 45.0),
            default=0.0,
            meaning="Angle at which the liquid meets the solid; it may be another one at walls.",
        ),
        Parameter(
            name="viscosity",
            unit="Pa s",
            low=0.0,
            high=1e4,
            plausible=(0.0, 0.1),
            vanishing=0.0,
            default=0.0,
            coarse_graining=2.0,  # 6π η R v over the weight at equal speed
            meaning="Dynamic viscosity of the liquid; water has 0.001.",
        ),
        Parameter(
            name="bridge_share",
            unit="1",
            low=0.0,
            high=1.0,
            open_low=True,
            plausible=(0.07, 0.2),
            # Random packings of wet beads have about six bridges a grain (Kohonen et al. 2004, doi
            # 10.1016/j.physa.2004.03.047), which then hold all of its film.
            default=1 / 6,
            per_pair=False,
            meaning="Share of a grain's first film that it gives to one bridge.",
        ),
        Parameter(
            name="smallest_gap",
            unit="1",
            low=0.0,
            high=1.0,
            open_low=True,
            plausible=(1e-3, 0.05),
            default=0.01,
            meaning="Gap over reduced radius below which the viscous force grows no more, such as the height of asperities.",
        ),
    )
    memory: ClassVar[tuple[Memory, ...]] = tuple(
        Memory(name, size=1, odd=False)
        for name in ("volume", "rupture", "width", "pull", "steepness", "slope", "curvature")
    )
    coefficients: ClassVar[tuple[str, ...]] = ("tension", "gift", "rupture", "viscous", "smallest_gap", *_TERMS)
    grows: ClassVar[tuple[str, ...]] = ("surface_tension",)
    carries: ClassVar[str] = "liquid [m^3]"
    visible_as: ClassVar[str] = "steep heaps and lumps of wet grains that hold together across small gaps"
    similarity: ClassVar[Similarity] = Similarity(
        "force over weight, gap over radius, and viscous force over weight at equal speed",
        overlap=1.0,
        speed=0.0,
        force=3.0,
    )
    source: ClassVar[str] = (
        "Willett, Adams, Johnson & Seville (2000), doi 10.1021/la000657y; "
        "Nase, Vargas, Abatan & McCarthy (2001), doi 10.1016/S0032-5910(00)00398-1"
    )

    def __init__(self, forms: str = "touch", **values) -> None:  # type: ignore[no-untyped-def]
        super().__init__(**values)
        if forms not in ("touch", "reach"):
            raise InputError(f"liquid_bridge.forms is {forms!r}; allowed are 'touch' and 'reach'.")
        self.forms = forms
        if self._largest_volume() > LARGEST_VOLUME:
            fraction, share = self.value("liquid_fraction"), self.value("bridge_share")
            raise InputError(
                f"liquid_bridge.liquid_fraction {fraction:g} and liquid_bridge.bridge_share {share:g} give bridges of "
                f"{self._largest_volume():.3g} R^3; the force law holds up to {LARGEST_VOLUME:g} R^3. Lower one of them; "
                f"with this share up to {fraction * LARGEST_VOLUME / self._largest_volume():.3g} is allowed."
            )

    def _gift(self) -> float:
        """Return the volume that a grain gives to one bridge, over its radius cubed."""
        return self.value("bridge_share") * self.value("liquid_fraction") * 4 / 3 * math.pi

    def _largest_volume(self) -> float:
        """Return V* of a bridge between equal grains, to which both have given in full."""
        return 2 * self._gift()

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return 1 % of liquid with a pull 2 π R γ of three quarters of a weight at a wall, half of that between grains."""
        tension = 0.75 * scale.weight / (2 * math.pi * scale.radius)
        return {"surface_tension": tension, "liquid_fraction": 0.01}

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 2πγ [N/m], a gift over R³ [1], 1 + θ/2, 6πη [Pa s], ε [1] and the polynomials of θ in f₁ … f₄."""
        angle = math.radians(self.value("contact_angle", pair))
        terms = [a + b * angle + c * angle**2 for rows in FITS for a, b, c in rows]
        return {
            "tension": 2 * math.pi * self.value("surface_tension", pair),
            "gift": self._gift(),
            "rupture": 1 + angle / 2,
            "viscous": 6 * math.pi * self.value("viscosity", pair),
            "smallest_gap": self.value("smallest_gap", pair),
            **dict(zip(_TERMS, terms, strict=True)),
        }

    def reach(self, pair: MaterialPair, largest_radius: float) -> float:
        """Return the rupture distance of the largest bridge, between two of the largest grains [m]."""
        angle = math.radians(self.value("contact_angle", pair))
        return rupture_gap(self._largest_volume(), angle) * largest_radius

    def initial_amounts(self, mass: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Return the films [m³] of new bodies: `liquid_fraction` of their volume."""
        return self.value("liquid_fraction") * 4 / 3 * math.pi * radius**3

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template(), h: ti.template()):
        gap = -c.overlap
        if m.volume > 0.0:
            if gap > m.rupture:
                self.release(m, h, c.radius_j == 0.0)
        elif gap <= 0.0 or ti.static(self.forms == "reach"):
            self.form(p, c, m, h, gap)
        force = vec3(0.0)
        if m.volume > 0.0:
            pull = m.pull
            if gap > TOUCHING * m.width:
                logarithm = ti.log(gap / m.width)
                pull *= ti.exp(-m.steepness * ti.exp((m.slope + m.curvature * logarithm) * logarithm))
            force = -pull * c.normal
            if p.viscous > 0.0:
                force += self.drag(p, c, gap)
        return Wrench(force=force, torque=vec3(0.0))

    @ti.func
    def drag(self, p, c: ti.template(), gap):
        """Return the viscous force on side i [N]."""
        closeness = 1.0 / ti.max(gap / c.radius, p.smallest_gap)
        normal = c.velocity.dot(c.normal) * c.normal
        shear = 8.0 / 15.0 * ti.log(closeness) + 0.9588
        return -(p.viscous * c.radius) * (closeness * normal + shear * (c.velocity - normal))

    @ti.func
    def form(self, p, c: ti.template(), m: ti.template(), h: ti.template(), gap):
        """Take liquid from the films, and keep what only depends on it."""
        smaller = ti.min(h.size_i, SHARPEST * c.radius)
        if c.radius_j > 0.0:
            smaller = ti.min(smaller, h.size_j)
        gift = p.gift * smaller**3
        from_i = ti.max(ti.min(gift, h.held_i), 0.0)
        from_j = ti.max(ti.min(gift, h.held_j), 0.0)  # a wall holds nothing
        radius = 2.0 * c.radius
        volume = (from_i + from_j) / radius**3
        root = ti.pow(volume, 1.0 / 3.0)
        rupture = p.rupture * (root + 0.1 * root * root) * radius
        if volume >= SMALLEST_VOLUME and gap < rupture:
            x = ti.log(volume)
            m.volume = from_i + from_j
            m.rupture = rupture
            m.width = 2.0 * ti.sqrt(volume) * radius
            m.pull = p.tension * radius * ti.exp(p.f1_0 + x * (p.f1_1 + x * (p.f1_2 + x * p.f1_3)))
            m.steepness = p.f2_0 + x * (p.f2_1 + x * p.f2_2)
            m.slope = p.f3_0 + x * (p.f3_1 + x * (p.f3_2 + x * p.f3_3))
            m.curvature = p.f4_0 + x * (p.f4_1 + x * p.f4_2)
            h.change_i -= from_i
            h.change_j -= from_j

    @ti.func
    def release(self, m: ti.template(), h: ti.template(), at_wall):
        """Give the liquid of a bridge back, half to each grain, all of it to the one at a wall."""
        share = 0.5
        if at_wall:
            share = 1.0
        h.change_i += share * m.volume
        h.change_j += (1.0 - share) * m.volume
        m.volume = 0.0
