"""Clumps in motion: restitution with several spheres touching at once, room in the lists, and the spheres' own memory."""

import numpy as np
import pytest

from taichidem.shapes import Multisphere, Superquadric
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, effects, scene
from tests.verification.test_bodies import MASS, body

R, SPEED = 0.01, 0.2
OWN = 0.4 * MASS * R**2  # moment of inertia of one sphere

# offsets of the spheres, mass, moments of inertia
COINCIDENT = [(np.zeros((k, 3)) + 1e-9 * np.arange(k)[:, None], MASS, (OWN, OWN, 1.01 * OWN)) for k in (1, 2, 5)]
FLAT_RODS = [
    (np.array([[-half, 0, 0], [half, 0, 0]]), 2 * MASS, (2 * OWN, *[2 * OWN + 2 * MASS * half**2] * 2))
    for half in (R, 2 * R)
]
LYING = [(np.array([[-R, 0, 0], [0, 0, 0], [R, 0, 0]]), 2 * MASS, (2 * OWN, *[2 * OWN + MASS * R**2] * 2))]
FORMS = COINCIDENT + FLAT_RODS + LYING
NAMES = ["one sphere", "two in one place", "five in one place", "short rod", "long rod", "row of three"]


def rebound(form, restitution, skin=None, schedule="worlds"):
    """Return rebound over approach speed of a clump that lands flat on a plane, and how often its lists were built."""
    offsets, mass, inertia = form
    clump = body([0, 0, 1.01 * R], offsets, [R] * len(offsets), mass=mass, inertia=inertia, velocity=(0, 0, -SPEED))
    simulation = Simulation(scene(clump, law=effects(restitution), time_step=2e-6, skin=skin), schedule)
    simulation.run(0.01)
    now = simulation.snapshot()
    assert not np.any(now.force)
    return now.velocity[0, 2] / SPEED, now.rebuilds


@pytest.mark.parametrize("form", FORMS, ids=NAMES)
@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.9])
def test_restitution_is_on_target_however_many_spheres_touch(form, restitution):
    assert rebound(form, restitution)[0] == pytest.approx(restitution, abs=2e-3)


@pytest.mark.parametrize("form", FORMS[2:], ids=NAMES[2:])
def test_lists_built_anew_within_the_impact_change_nothing(form):
    """The mass that a lasting contact has to stop goes over into the new lists."""
    seldom, few = rebound(form, 0.5)
    often, many = rebound(form, 0.5, skin=2e-6)
    assert many > few + 50
    assert often == pytest.approx(seldom, abs=1e-3)


def test_both_schedules_share_the_mass_alike():
    assert rebound(FORMS[-1], 0.5) == rebound(FORMS[-1], 0.5, schedule="particles")


def test_a_tilted_rod_rebounds_as_a_rigid_body():
    """One end hits: J = (1 + e) v/(1/m + (r × n)·I⁻¹ (r × n))."""
    half, tilt, mass = R, 0.5, 2 * MASS
    inertia = np.array([2 * OWN + 2 * MASS * half**2] * 2 + [2 * OWN])
    q = (np.cos(tilt / 2), 0, np.sin(tilt / 2), 0)
    clump = body(
        [0, 0, half * np.cos(tilt) + 1.0001 * R],
        [[0, 0, -half], [0, 0, half]],
        [R, R],
        mass=mass,
        inertia=inertia,
        orientation=q,
        velocity=(0, 0, -0.02),
    )
    simulation = Simulation(scene(clump, law=effects(0.5), time_step=2e-6))
    simulation.run(0.02)
    now = simulation.snapshot()
    assert not np.any(now.force)
    impulse = 1.5 * 0.02 / (1 / mass + (half * np.sin(tilt)) ** 2 / inertia[1])
    assert now.velocity[0, 2] == pytest.approx(-0.02 + impulse / mass, abs=2e-4)


@pytest.mark.parametrize(
    "shape",
    [
        Superquadric.spheroid(3.0),
        Superquadric.spheroid(5.0),
        Superquadric.spheroid(0.25),
        Multisphere.spheroid(1.5, 21),
    ],
    ids=["3 long", "5 long", "flat", "21 spheres"],
)
def test_dense_beds_of_any_form_find_room_in_the_lists(shape):
    """Side by side in a lattice, as dense as parallel grains get, with the usual settings of a scene."""
    parts = shape.elements
    half = parts.axes[0] if parts.axes is not None else (np.abs(parts.offset) + parts.radius[:, None]).max(0)
    places = np.stack(np.meshgrid(*[np.arange(6)] * 3, indexing="ij"), -1).reshape(-1, 3)
    bodies = shape.bodies(places * 2.001 * half, SOFT.density)
    simulation = Simulation(scene(bodies, walls=(), domain=((-50,) * 3, (50,) * 3)))
    simulation.run_steps(2)
    simulation.check()
