"""What the tests of the engine build their scenes from; plain closed forms, no code of the engine in the formulas."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.effects import BodyGravity, NormalHertz, RollingConstantTorque, RollingSpringDashpot, TangentialMindlin
from taichidem.materials import Material
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from taichidem.walls import Plane

REFERENCE = Path(__file__).resolve().parents[2] / "shared" / "reference" / "verification"

SOFT = Material("grain", 2500.0, 1e7, 0.25)
RIGID = Material("rigid", 7800.0, 1e30, 0.3)
BOX = ((-10.0, -10.0, -10.0), (10.0, 10.0, 10.0))
FLOOR = Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1))


def effects(
    restitution=1.0, friction=0.0, rolling=0.0, gravity=(0.0, 0.0, 0.0), attraction=False, damping=0.3, constant=None
):
    """Return one composition for nearly every test, with strengths at their vanishing values unless given."""
    resistance = RollingSpringDashpot(rolling_friction=rolling, rolling_damping=damping)
    if constant is not None:
        resistance = RollingConstantTorque(rolling_friction=constant)
    return [
        NormalHertz(attraction=attraction, restitution=restitution),
        TangentialMindlin(static_friction=friction),
        resistance,
        BodyGravity(x=gravity[0], y=gravity[1], z=gravity[2]),
    ]


def scene(bodies, *, walls=(FLOOR,), material=SOFT, law=None, domain=BOX, **options):
    """Return a world of grains of one material between rigid walls."""
    model = Model([material, RIGID], effects() if law is None else law)
    return Scene(model=model, walls=walls, bodies=bodies, domain=domain, grain_materials=(material.name,), **options)


def ball(position, radius=0.01, material=SOFT, **motion):
    """Return one or more spheres of the first material."""
    return Bodies.spheres(position, radius, material.density, **motion)


def snapshots(scenes):
    """Return a simulation of several worlds and a function that reads them all."""
    simulation = Simulation(scenes)
    return simulation, lambda: [simulation.snapshot(world) for world in range(len(simulation))]


def frames(simulation, steps, every=1):
    """Return the snapshots of every world taken every few steps: frames[k][world]."""
    taken = []
    for _ in range(steps // every):
        simulation.run_steps(every)
        taken.append([simulation.snapshot(world) for world in range(len(simulation))])
    return taken


def run_until_apart(simulation, longest, pieces=40):
    """Run to a time [s] (one for all worlds or one each) and check that no world stopped."""
    simulation.run(np.asarray(longest))
    simulation.check()


def effective_modulus(first: Material, second: Material | None = None) -> float:
    """Return E* [Pa]; without a second material for a sphere on a rigid plane."""
    compliance = (1 - first.poissons_ratio**2) / first.youngs_modulus
    if second is not None:
        compliance += (1 - second.poissons_ratio**2) / second.youngs_modulus
    return 1 / compliance


def effective_shear_modulus(first: Material, second: Material | None = None) -> float:
    """Return G* [Pa]; without a second material for a sphere on a rigid plane."""
    compliance = 0.0
    for material in filter(None, (first, second)):
        compliance += (2 - material.poissons_ratio) * 2 * (1 + material.poissons_ratio) / material.youngs_modulus
    return 1 / compliance


def hertz_impact(modulus, radius, mass, speed):
    """Return largest overlap [m], largest force [N] and duration [s] of an elastic head-on impact (Hertz)."""
    overlap = (15 * mass * speed**2 / (16 * modulus * math.sqrt(radius))) ** 0.4
    # 2.94327… = 2 ∫₀¹ dx / √(1 − x^(5/2))
    return overlap, 4 / 3 * modulus * math.sqrt(radius) * overlap**1.5, 2.943275 * overlap / speed


def impact_duration(material, radius, speed, partner=None):
    """Return the duration [s] of an elastic impact of a sphere on a rigid plane."""
    mass = material.density * 4 / 3 * math.pi * radius**3
    return hertz_impact(effective_modulus(material, partner), radius, mass, speed)[2]


def reference(name: str) -> list[dict[str, str]]:
    """Return the rows of a reference file, or skip the test where the data is not at hand."""
    path = REFERENCE / name
    if not path.is_file():
        pytest.skip(f"reference data {name} is not at hand (looked in ../shared/reference/verification)")
    with path.open() as file:
        return list(csv.DictReader(file))
