"""Grains that stick to the apparatus, but not to each other."""

import math
from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair


class WallAdhesion(ContactEffect):
    """A constant attraction between a grain and each wall that it touches; nothing between grains.

    F = −2 π w R for δ > 0 at a wall, else 0

    A hypothesis about the apparatus: charge, dirt or moisture on it, a sticky coating. The form is that of Derjaguin,
    Muller and Toporov for a sphere on a flat, as it asks nothing of the normal law and adds one number and no memory,
    and a bulk test shows of such a film hardly more than its pull-off force. Its energy has no jump; friction at the wall
    rises with the load that the pull puts on the contact. It may act beside a cohesion.

    Expected behaviour: grains hang on walls and on what is lifted out of them, walls seem rougher, the first layer stays;
    away from walls nothing changes, so that a wide apparatus shows it less than a narrow one. Limits: spheres on
    walls flat at their scale; in a corner every wall pulls, and so does every element of a body of several spheres that
    touches. Of a superquadric R is that of the curvature at the contact, so that its flat sides hold more firmly.
    """

    name: ClassVar[str] = "wall_adhesion"
    title: ClassVar[str] = "Adhesion to walls"
    family: ClassVar[str] = "wall_adhesion"
    stage: ClassVar[Stage] = Stage.ADHESION
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="work_of_adhesion",
            unit="J/m^2",
            low=0.0,
            high=1e3,
            plausible=(0.0, 1.0),
            vanishing=0.0,
            coarse_graining=2.0,  # w R ∝ s³, as the weight
            meaning="Energy per area to part a grain from a wall.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("pull_off",)
    conservative: ClassVar[bool] = True
    visible_as: ClassVar[str] = "grains that hang on the walls, a layer that stays behind when a cylinder is lifted"
    similarity: ClassVar[Similarity] = Similarity("pull-off force over weight", *UNDER_WEIGHT)
    source: ClassVar[str] = "Derjaguin, Muller & Toporov (1975), doi 10.1016/0021-9797(75)90018-1, sphere on a flat"

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return w with a pull-off 2 π w R of one and a half weights."""
        return {"work_of_adhesion": 1.5 * scale.weight / (2 * math.pi * scale.radius)}

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 2 π w [N/m]."""
        return {"pull_off": 2 * math.pi * self.value("work_of_adhesion", pair)}

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > 0.0 and c.radius_j == 0.0:
            force = -p.pull_off * c.radius
        return Wrench(force=force * c.normal, torque=vec3(0.0))

    @ti.func
    def energy(self, p, c: ti.template()):
        """Return −2 π w R δ [J] while touching a wall."""
        return ti.select(c.radius_j == 0.0, -p.pull_off * c.radius * ti.max(c.overlap, 0.0), 0.0)
