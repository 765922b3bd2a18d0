"""Rolling resistance as a spring and a dashpot with a cap, so that grains come to rest."""

from typing import Any, ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Memory, Parameter, Similarity, Stage
from taichidem.effects.probe import ProbeScale
from taichidem.materials import MaterialPair


class RollingSpringDashpot(ContactEffect):
    """Elastic-plastic spring-dashpot rolling resistance (EPSD, model C of Ai et al.).

    dM = −k_r dθ,  |M| ≤ μ_r R* F_el,  k_r = 2.25 k_n (μ_r R*)² in three dimensions;
    while k_n shrinks M shrinks with it: M ← M k_n/k_n_before (else a spring wound up under load and let go after
    unloading would give back more than it took, M²/(2 k_r));
    below the cap a dashpot 2 η_r √(I_r k_r) acts too, 1/I_r = 1/(I_i + m_i R_i²) + 1/(I_j + m_j R_j²).

    Expected behaviour: like the constant torque while rolling, and at rest a couple that holds the grain: kinetic energy
    of a heap falls to round-off, balls stay on slopes below tan⁻¹ μ_r. Limits: for the dashpot
    I = 2/5 m R² of a solid sphere, also where the body is made of several: there m is that of the body and R that of the
    element that touches, so the share of critical damping is another one than was asked for. Of a superquadric R is the
    radius of curvature at the contact, and the share grows with it on flat sides. Grains whose form is simulated need less
    of this couple, as of any that keeps spheres from rolling.
    """

    name: ClassVar[str] = "rolling_spring_dashpot"
    title: ClassVar[str] = "Rolling resistance, spring and dashpot (EPSD)"
    family: ClassVar[str] = "rolling"
    stage: ClassVar[Stage] = Stage.ROLLING
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="rolling_friction",
            unit="1",
            low=0.0,
            high=10.0,
            plausible=(0.0, 0.4),
            vanishing=0.0,
            meaning="Largest rolling couple over normal force times effective radius.",
        ),
        Parameter(
            name="rolling_damping",
            unit="1",
            low=0.0,
            high=10.0,
            plausible=(0.1, 0.5),
            default=0.3,
            meaning="Share of critical damping of the rolling spring.",
        ),
    )
    memory: ClassVar[tuple[Memory, ...]] = (Memory("couple"), Memory("normal_stiffness", size=1, odd=False))
    coefficients: ClassVar[tuple[str, ...]] = ("rolling_friction", "rolling_damping")
    visible_as: ClassVar[str] = "steeper heaps that stand still; balls rest on gentle slopes"
    similarity: ClassVar[Similarity] = Similarity("rolling couple over weight times radius", *UNDER_WEIGHT)
    source: ClassVar[str] = "Ai, Chen, Rotter & Ooi (2011), doi 10.1016/j.powtec.2010.09.030, model C"

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return μ_r = 0.2, at which spheres roll hardly better than angular grains."""
        return {"rolling_friction": 0.2}

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return μ_r [1] and η_r [1]."""
        return {name: self.value(name, pair) for name in self.coefficients}

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        turning = c.spin_i - c.spin_j
        turning = turning - turning.dot(c.normal) * c.normal
        arm = p.rolling_friction * c.radius
        stiffness = 2.25 * c.normal_stiffness * arm * arm
        held = m.couple
        held = held + (0.5 * c.dt) * (c.spin_i + c.spin_j).cross(held)  # the memory turns with the pair
        if c.normal_stiffness < m.normal_stiffness:
            held = held * (c.normal_stiffness / m.normal_stiffness)
        held = held - held.dot(c.normal) * c.normal - (stiffness * c.dt) * turning
        cap = arm * c.elastic_force
        size = held.dot(held)
        couple = held
        if size > cap * cap:
            held = held * (cap / ti.sqrt(size))
            couple = held
        else:
            inverse_inertia = c.inverse_mass_i / (1.4 * c.radius_i * c.radius_i)
            if c.inverse_mass_j > 0.0:
                inverse_inertia += c.inverse_mass_j / (1.4 * c.radius_j * c.radius_j)
            couple = held - (2.0 * p.rolling_damping * ti.sqrt(stiffness / inverse_inertia)) * turning
        m.couple = held
        m.normal_stiffness = c.normal_stiffness
        return Wrench(force=vec3(0.0), torque=couple)
