"""Resistance to spin about the normal of a contact."""

from typing import ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import IN_COLLISION, ContactEffect, Memory, Parameter, Similarity, Stage
from taichidem.materials import MaterialPair


class TwistingResistance(ContactEffect):
    """A couple about the normal against relative spin: spring, dashpot and slider.

    dM = −k_tw Ω dt,  Ω = (ω_i − ω_j)·n,  k_tw = ½ k_t a²,  k_t = 8 G* a,  a = √(R* δ);
    |M| ≤ 2/3 μ_tw a max(F_n, 0);  while a shrinks M shrinks with k_tw, M ← M (a/a_before)³;
    below the cap a dashpot 2 η √(I k_tw) acts too, 1/I = 1/I_i + 1/I_j, and spring and dashpot together obey the cap

    Spring and cap are the sums of Mindlin's stiffness and of Coulomb's friction over the circle of contact, with a
    coefficient of their own. Marshall's dashpot, ½ γ_t a², would damp the twist by a share a/R of critical only (some
    hundredths), and a ball would tremble for long; so the dashpot here is given as a share of critical damping.
    A rigid turn of a pair is no relative spin, and sides that swap see the same Ω: the couple needs no turning.

    Expected behaviour: a ball that spins on a plane stops after I ω/(2/3 μ_tw a F_n); heaps and shear hardly change, as a
    is small beside R. Limits: I of solid spheres, 2/5 m R², also where grains are no spheres (there R is that of the
    curvature at the contact); sliding and twisting do not share one budget of friction.

    Coarse graining keeps it in collisions, where a grows with R, not under a weight, where a/R grows as s^(1/3): there
    the largest couple over weight times radius grows by s^(1/3), which a coefficient s^(−1/3) times as large undoes, but
    the spring, k_tw ∝ s⁴ turned by angles ∝ δ/R ∝ s^(2/3), is then still s^(2/3) times too stiff beside it, and no
    parameter undoes that.
    """

    name: ClassVar[str] = "twisting_resistance"
    title: ClassVar[str] = "Resistance to twisting"
    family: ClassVar[str] = "twisting"
    stage: ClassVar[Stage] = Stage.TWISTING
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="twisting_friction",
            unit="1",
            low=0.0,
            high=100.0,
            plausible=(0.0, 1.0),
            vanishing=0.0,
            meaning="Largest twisting couple over 2/3 of contact radius times normal force; smooth grains have that of sliding.",
        ),
        Parameter(
            name="twisting_damping",
            unit="1",
            low=0.0,
            high=10.0,
            plausible=(0.1, 0.5),
            default=0.3,
            meaning="Share of critical damping of the twisting spring.",
        ),
    )
    # The couple on i along n: swapping the sides turns both n and the couple round, so the number stays.
    memory: ClassVar[tuple[Memory, ...]] = (
        Memory("couple", size=1, odd=False),
        Memory("stiffness", size=1, odd=False),
    )
    coefficients: ClassVar[tuple[str, ...]] = ("cap", "stiffness", "twisting_damping")
    visible_as: ClassVar[str] = "grains that stop spinning like tops; hardly anything in bulk"
    similarity: ClassVar[Similarity] = Similarity(
        "twisting couple over normal force times radius in a collision", *IN_COLLISION
    )
    source: ClassVar[str] = "Marshall (2009), doi 10.1016/j.jcp.2008.10.020"

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return 2/3 μ_tw [1], k_tw/a³ = 4 G* [Pa] and η [1]."""
        return {
            "cap": 2 / 3 * self.value("twisting_friction", pair),
            "stiffness": 4 * pair.shear_modulus,
            "twisting_damping": self.value("twisting_damping", pair),
        }

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        twist = (c.spin_i - c.spin_j).dot(c.normal)
        stiffness = p.stiffness * c.contact_radius * c.contact_radius * c.contact_radius
        held = m.couple
        if stiffness < m.stiffness:
            held *= stiffness / m.stiffness
        held -= stiffness * c.dt * twist
        cap = p.cap * c.contact_radius * ti.max(c.normal_force + c.friction_load, 0.0)
        couple = held
        if ti.abs(held) <= cap:
            inverse_inertia = 2.5 * c.inverse_mass_i / (c.radius_i * c.radius_i)
            if c.inverse_mass_j > 0.0:
                inverse_inertia += 2.5 * c.inverse_mass_j / (c.radius_j * c.radius_j)
            couple -= 2.0 * p.twisting_damping * ti.sqrt(stiffness / inverse_inertia) * twist
        couple = ti.max(ti.min(couple, cap), -cap)
        m.couple = ti.max(ti.min(held, cap), -cap)
        m.stiffness = stiffness
        return Wrench(force=vec3(0.0), torque=couple * c.normal)
