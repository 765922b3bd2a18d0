"""An oblique impact integrated by hand: one contact, in its plane, without any code of the engine.

The law is written down a second time here, from the papers: Hertz with the clipped dashpot, Mindlin's spring as an
incremental force that shrinks with the contact while unloading, a tangential dashpot, Coulomb's cap on their sum. Only
relative motion is integrated (normal approach, slip of the surfaces), by the midpoint rule with many steps.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq


def clipped_damping(restitution: float) -> float:
    """Return the damping ratio z at which a contact that never pulls rebounds with e = exp(−2 z acos z/√(1 − z²))."""

    def excess(z):
        if z < 1:
            return -2 * z * math.acos(z) / math.sqrt(1 - z * z) - math.log(restitution)
        return -2 * z * math.acosh(z) / math.sqrt(z * z - 1) - math.log(restitution)

    if restitution >= 1:
        return 0.0
    return brentq(excess, 0.0, 0.999999) if excess(0.999999) < 0 else brentq(excess, 1.000001, 100)


def oblique_impact(
    *,
    modulus,
    shear_modulus,
    mass,
    bodies,
    friction,
    restitution,
    normal_speed,
    tangential_speed,
    steps=6000,
    rigid_lever=False,
    cap_on_sum=False,
):
    """Return the normal rebound speed [m/s], the tangential impulse on i [N s], and the spins after [rad/s].

    Args:
        modulus, shear_modulus: E*, G* [Pa].
        mass: m* [kg].
        bodies: (radius [m], moment of inertia [kg m²], initial spin [rad/s], (n,)) of i, and of j unless it is a rigid
            plane; spins are counted so that a positive one adds to the slip of surface i over surface j.
        friction, restitution: [1].
        normal_speed: approach speed [m/s].
        tangential_speed: of the centre of i relative to that of j [m/s], (n,).
        rigid_lever: leave the overlap out of the lever arms, as closed forms and stored curves do.
        cap_on_sum: the variant of the stored curves, where sliding begins when spring and dashpot together reach the cap
            and the spring then keeps what the dashpot leaves of it. The engine's dashpot acts only while the spring
            itself is below the cap, so that the spring never holds energy that no slip has paid for.
    """
    z = clipped_damping(restitution)
    radius = 1 / sum(1 / r for r, _, _ in bodies)
    part = 0.0 if rigid_lever else 1 / len(bodies)  # share of the overlap that shortens each lever arm
    along = np.array(tangential_speed, float) + 0 * np.asarray(bodies[0][2], float)
    spins = [np.asarray(spin, float) + 0 * along for _, _, spin in bodies]
    approach = np.asarray(normal_speed, float) + 0 * along
    peak = (15 * mass * approach**2 / (16 * modulus * math.sqrt(radius))) ** 0.4
    dt = 1.8 * 2.943275 * peak / approach / steps  # damping lengthens the contact
    overlap, spring, impulse, before = (np.zeros_like(along) for _ in range(4))
    alive = np.ones(along.shape, bool)
    for _ in range(steps):
        # Overlap at the middle of the step, and the force there.
        middle = np.maximum(overlap + 0.5 * dt * approach, 0.0)
        contact = np.sqrt(radius * middle)
        damping = 2 * math.sqrt(5 / 6) * z * np.sqrt(2 * modulus * contact * mass)
        elastic = 4 / 3 * modulus * contact * middle
        # The speed there, with half a step of the present force taken implicitly.
        speed = (approach - 0.5 * dt * elastic / mass) / (1 + 0.5 * dt * damping / mass)
        normal = np.maximum(elastic + damping * speed, 0.0)
        stiffness = 8 * shear_modulus * contact
        dashpot = 2 * math.sqrt(5 / 6) * z * np.sqrt(stiffness * mass)
        cap = friction * normal
        held = spring * np.where(contact < before, contact / np.where(before > 0, before, 1), 1.0)
        levers = [r - part * middle for r, _, _ in bodies]
        slip = along + sum(a * spin for a, spin in zip(levers, spins, strict=True))
        mobility = 1 / mass + sum(a * a / inertia for a, (_, inertia, _) in zip(levers, bodies, strict=True))
        slip = slip + 0.5 * dt * mobility * np.clip(held - dashpot * slip, -cap, cap)
        held = held - stiffness * dt * slip
        if cap_on_sum:
            total = np.clip(held - dashpot * slip, -cap, cap)
            held = total + dashpot * slip
        else:
            sliding = np.abs(held) > cap
            held = np.clip(held, -cap, cap)
            total = np.where(sliding, held, np.clip(held - dashpot * slip, -cap, cap))
        force = np.where(alive, total, 0.0)
        overlap = np.where(alive, overlap + dt * (approach - 0.5 * dt * normal / mass), overlap)
        approach = np.where(alive, approach - dt * normal / mass, approach)
        along = along + dt * force / mass
        spins = [s + dt * a * force / inertia for s, a, (_, inertia, _) in zip(spins, levers, bodies, strict=True)]
        impulse = impulse + dt * force
        spring, before = held, contact
        alive = alive & (overlap > 0)
    assert not alive.any(), "the naive twin has not finished its impact"
    return -approach, impulse, spins
