"""Lively crowds of every kind of grains that use all an engine keeps: contact memories, liquid, moving and loaded walls."""

from __future__ import annotations

import numpy as np

from taichidem.bodies import Bodies
from taichidem.effects import (
    BodyGravity,
    LiquidBridge,
    NormalElastoplastic,
    NormalHertz,
    RollingSpringDashpot,
    TangentialMindlin,
)
from taichidem.scene import Model, Scene
from taichidem.walls import Motion, Plane
from tests.apparatus import effects
from tests.verification import test_schedules as two_ways

RADIUS = two_ways.RADIUS
WET = LiquidBridge(surface_tension=0.05, liquid_fraction=0.03, contact_angle=20.0, viscosity=0.002, forms="touch")
KINDS = ("sphere", "multisphere", "superquadric")


def ellipsoids(seed: int) -> Bodies:
    """Return grains with three different axes."""
    position, velocity = two_ways.grains(seed, 5)
    n, axes = len(position), RADIUS * np.array([0.8, 0.9, 1.1])
    turned = np.random.default_rng(seed).normal(size=(n, 4))
    mass = two_ways.GRAIN.density * 4 / 3 * np.pi * np.prod(axes)
    squares = axes**2
    return Bodies(
        position=position,
        velocity=velocity,
        spin=np.zeros((n, 3)),
        orientation=turned / np.linalg.norm(turned, axis=1, keepdims=True),
        mass=np.full(n, mass),
        inertia=np.tile(0.2 * mass * (squares.sum() - squares), (n, 1)),
        radius=np.full(n, np.prod(axes) ** (1 / 3)),
        element_body=np.arange(n),
        element_offset=np.zeros((n, 3)),
        element_radius=np.full(n, axes.max()),
        element_material=np.zeros(n, int),
        element_axes=np.tile(axes, (n, 1)),
        element_exponents=np.full((n, 2), 2.0),
    )


def law_of(kind: str) -> list:
    """Return effects with every kind of memory, a few for each kind of grains: compiling them all for all takes minutes."""
    if kind == "superquadric":
        return effects(restitution=0.7, friction=0.3, rolling=0.1, gravity=(0.0, 0.0, -9.81))
    sliding = [TangentialMindlin(static_friction=0.3), BodyGravity()]
    if kind == "multisphere":
        return [NormalHertz(restitution=0.7), WET, *sliding]
    yielding = NormalElastoplastic(modulus_over_yield_pressure=60.0, restitution=0.7)
    return [yielding, RollingSpringDashpot(rolling_friction=0.1), WET, *sliding]


def crowd(kind: str, seed: int) -> Scene:
    """Return one world: grains of a kind fall onto a turning disc, a folded mesh but for superquadrics, and a lid on them."""
    make = {"sphere": two_ways.spheres, "multisphere": two_ways.dumbbells, "superquadric": ellipsoids}[kind]
    bodies = make(seed)
    weight = 10 * float(bodies.mass.sum())
    press = Motion(load=(0.0, 0.0, -weight), mass=weight / 10)
    height = float(bodies.position[:, 2].max()) + 1.2 * RADIUS
    mesh, *others = two_ways.walls()
    floor = Plane(material="wall", point=(0, 0, 0), normal=(0, 0, 1)) if kind == "superquadric" else mesh
    lid = Plane(material="wall", point=(0, 0, height), normal=(0, 0, -1), name="lid", motion=press)
    side = Plane(material="wall", point=(0.05, 0, 0), normal=(-1, 0, 0), name="side")
    return Scene(
        model=Model((two_ways.GRAIN, two_ways.WALL), law_of(kind)),
        walls=[floor, *others, lid, side],
        bodies=bodies,
        domain=((-0.01, -0.01, -0.01), (0.07, 0.06, 0.2)),
        grain_materials=("grain",),
        skin=4e-4,
        room=330,
    )
