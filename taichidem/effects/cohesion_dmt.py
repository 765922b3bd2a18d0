"""Adhesion of hard grains by Derjaguin, Muller and Toporov: a constant pull while they touch."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair


class CohesionDmt(ContactEffect):
    """A constant attraction between touching grains, on top of Hertz, whose contact radius it leaves as it is.

    F = −2 π w R* for δ > 0, else 0;  w = 2γ for like surfaces

    It sets in with a jump as soon as the contact has a radius (at δ = 0 itself there is none) and ends with the same jump.
    Its energy, −2 π w R* δ, has none: a pair gives back on parting what it gained on meeting, so that only the normal
    effect's losses let grains stick. Coulomb's cap rises by μ 2 π w R* with the load that the pull puts on the contact,
    as Derjaguin's law of friction says; the Hertz force holds that load already.

    Expected behaviour: as an added load between all grains: steeper heaps and drums, lumps, slower discharge; it doesn't
    depend on stiffness. Limits: hard, small grains with a Tabor parameter well below 1; surface forces out of contact,
    which make it tear later, are left out; one pull per element, so that a body of several spheres which touches with two
    is held twice; of a superquadric R* is that of the curvatures at the contact, so that its flat sides hold more firmly.
    """

    name: ClassVar[str] = "cohesion_dmt"
    title: ClassVar[str] = "Adhesion of hard spheres (DMT)"
    family: ClassVar[str] = "cohesion"
    stage: ClassVar[Stage] = Stage.ADHESION
    needs: ClassVar[Mapping[str, tuple[str, ...]]] = {"normal": ("normal_hertz", "normal_viscoelastic")}
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="work_of_adhesion",
            unit="J/m^2",
            low=0.0,
            high=1e3,
            plausible=(0.0, 1.0),
            vanishing=0.0,
            coarse_graining=2.0,  # w R* ∝ s³, as the weight
            meaning="Energy per area to part the surfaces, twice the surface energy where they are alike.",
        ),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("pull_off",)
    conservative: ClassVar[bool] = True
    visible_as: ClassVar[str] = "grains that cling to each other and to walls, the smaller the more"
    similarity: ClassVar[Similarity] = Similarity("pull-off force over weight", *UNDER_WEIGHT)
    source: ClassVar[str] = "Derjaguin, Muller & Toporov (1975), doi 10.1016/0021-9797(75)90018-1"

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return w with a pull-off 2 π w R* of one and a half weights, between grains as at walls."""
        w = 1.5 * scale.weight / (2 * math.pi * scale.radius / 2)
        return {"work_of_adhesion": scale.between_grains_and_at_walls(w, w / 2)}

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 2 π w [N/m]."""
        return {"pull_off": 2 * math.pi * self.value("work_of_adhesion", pair)}

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        force = 0.0
        if c.overlap > 0.0:
            force = -p.pull_off * c.radius
        return Wrench(force=force * c.normal, torque=vec3(0.0))

    @ti.func
    def energy(self, p, c: ti.template()):
        """Return −2 π w R* δ [J] while touching."""
        return -p.pull_off * c.radius * ti.max(c.overlap, 0.0)
