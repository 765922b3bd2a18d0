"""Sliding friction with an elastic tangential spring."""

import math
from typing import ClassVar

import taichi as ti

from taichidem.contact import Wrench, vec3
from taichidem.effects.base import UNDER_WEIGHT, ContactEffect, Memory, Parameter, Similarity, Stage
from taichidem.materials import MaterialPair

SMALLEST_RADIUS = 1e-300  # [m] keeps the quotient finite when a contact begins


class TangentialMindlin(ContactEffect):
    """Mindlin's tangential spring in its incremental form, damped, with Coulomb's cap.

    dF_t = −k_t dξ,  k_t = 8 G* a,  a = √(R* δ);  while a shrinks F_t shrinks with it: F_t ← F_t a/a_before;
    |F_t| ≤ μ max(F_n, 0);  below the cap the dashpot γ_t = γ_n √(k_t/S_n) is added, at the cap it is not.

    The stored quantity is the force, not the displacement: with a stored displacement the force would rise or fall when
    only the load changes, and the spring would gain energy while the contact is pressed. Rescaling while unloading makes
    the spring lose and never gain energy, also at grazing incidence (Thornton, Cummins & Cleary's third variant,
    `mindlin_rescale` elsewhere). The history is turned with the contact plane and with the pair's mean spin about the
    normal, so that a pair rotated rigidly feels no new force. The cap never uses an attractive normal force.

    Expected behaviour: a sliding ball starts to roll after 2 u/(7 μ g); heaps grow steeper with μ up to about 0.5 and
    then hardly. Limits: one yield surface, no memory of partial slip rings (Mindlin & Deresiewicz).
    """

    name: ClassVar[str] = "tangential_mindlin"
    title: ClassVar[str] = "Coulomb friction with Mindlin's spring"
    family: ClassVar[str] = "tangential"
    stage: ClassVar[Stage] = Stage.TANGENTIAL
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="static_friction",
            unit="1",
            low=0.0,
            high=10.0,
            plausible=(0.1, 0.9),
            vanishing=0.0,
            meaning="Tangential over normal force at which a contact slides.",
        ),
    )
    memory: ClassVar[tuple[Memory, ...]] = (Memory("force"), Memory("contact_radius", size=1, odd=False))
    coefficients: ClassVar[tuple[str, ...]] = ("friction", "stiffness", "damping_share")
    visible_as: ClassVar[str] = "steeper heaps, slower hoppers; grains roll instead of slipping"
    similarity: ClassVar[Similarity] = Similarity("tangential force over weight", *UNDER_WEIGHT)
    source: ClassVar[str] = "Thornton, Cummins & Cleary (2013), doi 10.1016/j.powtec.2012.08.012"

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return μ [1], 8 G* [Pa] and √(k_t/S_n) = √(4 G*/E*) [1]."""
        return {
            "friction": self.value("static_friction", pair),
            "stiffness": 8 * pair.shear_modulus,
            "damping_share": math.sqrt(4 * pair.shear_modulus / pair.youngs_modulus),
        }

    @ti.func
    def wrench(self, p, c: ti.template(), m: ti.template()):
        slip = c.velocity - c.velocity.dot(c.normal) * c.normal
        held = m.force
        # Turn the memory with the pair by its mean spin, then into the present tangent plane, which also takes away
        # what a spin within that plane has turned out of it.
        held = held + (0.5 * c.dt) * (c.spin_i + c.spin_j).cross(held)
        held = held - held.dot(c.normal) * c.normal
        # Without a branch: whether a resting contact loads or unloads is noise that no processor predicts.
        held = held * ti.min(1.0, c.contact_radius / ti.max(m.contact_radius, SMALLEST_RADIUS))
        c.tangential_stiffness = p.stiffness * c.contact_radius
        held = held - (c.tangential_stiffness * c.dt) * slip
        cap = p.friction * (1.0 - c.friction_loss) * ti.max(c.normal_force + c.friction_load, 0.0)
        size = held.dot(held)
        force = held
        if size > cap * cap:
            held = held * (cap / ti.sqrt(size))
            force = held
        else:
            # The dashpot acts only while the contact sticks; spring and dashpot together obey the cap as well.
            force = held - (c.normal_damping * p.damping_share) * slip
            total = force.dot(force)
            if total > cap * cap:
                force = force * (cap / ti.sqrt(total))
        m.force = held
        m.contact_radius = c.contact_radius
        return Wrench(force=force, torque=vec3(0.0))
