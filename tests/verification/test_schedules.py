"""The schedule over worlds and that over particles give the same bits, whatever a scene holds."""

from __future__ import annotations

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.effects import (
    BodyGravity,
    NormalHertz,
    RollingConstantTorque,
    RollingSpringDashpot,
    TangentialMindlin,
)
from taichidem.materials import Material
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from taichidem.walls import Disc, Mesh, Motion, Plane

GRAIN = Material("grain", 1000.0, 1e6, 0.3)
WALL = Material("wall", 7800.0, 1e9, 0.3)
RADIUS = 0.003
COLUMNS = ("position", "velocity", "spin", "force", "torque", "orientation")


def rolling(kind):
    return kind(rolling_friction=0.1)


def model(resistance):
    return Model(
        (GRAIN, WALL),
        (NormalHertz(restitution=0.6), TangentialMindlin(static_friction=0.4), rolling(resistance), BodyGravity()),
    )


def walls():
    """A floor of two triangles with a fold, a plane, and a disc that turns."""
    vertices = [(0, 0, 0), (0.05, 0, 0), (0.05, 0.05, 0), (0, 0.05, 0), (0.05, 0, 0.03), (0.05, 0.05, 0.03)]
    facets = [(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)]
    planes = [((0, 0, 0), (1, 0, 0)), ((0, 0, 0), (0, 1, 0)), ((0, 0.05, 0), (0, -1, 0))]
    turning = Motion(spin=(0, 0, 20.0), centre=(0.025, 0.025, 0.0))
    return [
        Mesh(material="wall", vertices=np.array(vertices, float), facets=np.array(facets)),
        *(Plane(material="wall", point=point, normal=normal) for point, normal in planes),
        Disc(material="wall", centre=(0.025, 0.025, 0.002), radius=0.015, motion=turning),
    ]


def grains(seed, count=8):
    rng = np.random.default_rng(seed)
    side = np.arange(count)
    lattice = np.stack(np.meshgrid(side[:6], side[:6], side, indexing="ij"), -1).reshape(-1, 3)
    position = 0.006 + 0.0072 * lattice + rng.uniform(-2e-4, 2e-4, (len(lattice), 3))
    return position, rng.normal(0, 0.3, position.shape)


def spheres(seed):
    position, velocity = grains(seed)
    return Bodies.spheres(position, RADIUS, GRAIN.density, velocity=velocity)


def dumbbells(seed):
    """Two spheres a body, three different moments."""
    position, velocity = grains(seed, 4)
    n = len(position)
    mass = 2 * GRAIN.density * 4 / 3 * np.pi * (RADIUS / 2) ** 3
    rng = np.random.default_rng(seed)
    orientation = rng.normal(size=(n, 4))
    return Bodies(
        position=position,
        velocity=velocity,
        spin=rng.normal(0, 5.0, (n, 3)),
        orientation=orientation / np.linalg.norm(orientation, axis=1, keepdims=True),
        mass=np.full(n, mass),
        inertia=np.tile(mass * RADIUS**2 * np.array([0.1, 0.4, 0.45]), (n, 1)),
        radius=np.full(n, RADIUS / 2),
        element_body=np.repeat(np.arange(n), 2),
        element_offset=np.tile([[-RADIUS / 3, 0, 0], [RADIUS / 3, 0, 0]], (n, 1)),
        element_radius=np.full(2 * n, RADIUS / 2),
        element_material=np.zeros(2 * n, int),
    )


@pytest.mark.parametrize("resistance", [RollingConstantTorque, RollingSpringDashpot])
@pytest.mark.parametrize("make", [spheres, dumbbells])
def test_both_schedules_give_the_same_bits(make, resistance):
    scenes = [
        Scene(
            model=model(resistance),
            walls=walls(),
            bodies=make(seed),
            domain=((-0.01, -0.01, -0.01), (0.07, 0.06, 0.1)),
            grain_materials=("grain",),
            skin=4e-4,
        )
        for seed in (1, 2)
    ]
    simulation = Simulation(scenes)
    simulation.run_steps(400)
    simulation.check()
    over_worlds = [simulation.snapshot(k) for k in range(2)]
    simulation = Simulation(scenes, schedule="particles")
    simulation.run_steps(150)  # in two pieces, as chunks must not show either
    simulation.run_steps(250)
    simulation.check()
    for number, expected in enumerate(over_worlds):
        found = simulation.snapshot(number)
        assert found.rebuilds == expected.rebuilds > 5
        assert np.ptp(expected.force, axis=0).max() > 0
        for column in COLUMNS:
            assert np.array_equal(getattr(found, column), getattr(expected, column)), column
