"""Composed bodies: one sphere as a body, torque-free rotation, and impacts of a dumbbell."""

import math

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.simulation import Simulation
from tests.apparatus import FLOOR, SOFT, ball, effects, frames, scene


def body(position, offsets, radii, *, mass, inertia, orientation=(1.0, 0, 0, 0), velocity=(0, 0, 0), spin=(0, 0, 0)):
    """Return one rigid body of spheres."""
    m = len(radii)
    volume = (3 * mass / (4 * math.pi * SOFT.density)) ** (1 / 3)
    return Bodies(
        position=np.array([position], float),
        velocity=np.array([velocity], float),
        spin=np.array([spin], float),
        orientation=np.array([orientation], float) / np.linalg.norm(orientation),
        mass=np.array([mass], float),
        inertia=np.array([inertia], float),
        radius=np.array([volume]),
        element_body=np.zeros(m, int),
        element_offset=np.array(offsets, float),
        element_radius=np.array(radii, float),
        element_material=np.zeros(m, int),
    )


MASS = SOFT.density * 4 / 3 * math.pi * 1e-6
# A far-away dumbbell makes the engine treat all bodies of a world as composed.
FAR = body([5, 5, 5], [[0, 0, -0.01], [0, 0, 0.01]], [0.01, 0.01], mass=2 * MASS, inertia=(3e-6, 3e-6, 1e-6))


def test_a_body_of_one_sphere_equals_a_sphere():
    """Through friction, rolling resistance and collisions with a wall and each other."""
    rng = np.random.default_rng(2)
    position = np.array(
        [[0.025 * a, 0.025 * b, 0.012 + 0.025 * c] for a in range(2) for b in range(2) for c in range(3)]
    )
    grains = ball(position, velocity=rng.normal(0, 0.5, (12, 3)), spin=rng.normal(0, 20, (12, 3)))
    law = effects(0.6, 0.5, 0.1, gravity=(0, 0, -9.81))
    spheres = Simulation(scene(grains, law=law))
    spheres.run(0.1)
    one = spheres.snapshot()
    composed = Simulation(scene(Bodies.joined([grains, FAR]), law=law))
    composed.run(0.1)
    two = composed.snapshot()
    assert np.abs(one.velocity - grains.velocity).max() > 0.5
    assert one.rebuilds > 3
    assert two.position[:12] == pytest.approx(one.position, abs=1e-9)
    assert two.velocity[:12] == pytest.approx(one.velocity, abs=1e-6)
    assert two.spin[:12] == pytest.approx(one.spin, abs=1e-4)
    assert composed.kinetic_energy() == pytest.approx(
        spheres.kinetic_energy() + 0.5 * 2 * MASS * np.sum(two.velocity[12] ** 2), rel=1e-6
    )


def matrix_of(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def free(spin, inertia=(1e-6, 2e-6, 3e-6), orientation=(1.0, 0, 0, 0)):
    return body(
        [0, 0, 0],
        [[0, 0, -0.01], [0, 0, 0.01]],
        [0.01, 0.01],
        mass=MASS,
        inertia=inertia,
        spin=spin,
        orientation=orientation,
    )


def test_torque_free_rotation():
    """Three different moments: L is constant as a vector, the energy oscillates by second order and does not drift."""
    inertia = np.array([1e-6, 2e-6, 3e-6])
    orientation = np.array([0.5, 0.5, -0.1, 0.7]) / np.linalg.norm([0.5, 0.5, -0.1, 0.7])
    spin = np.array([40.0, 60.0, 25.0])
    steps = [4e-4, 2e-4, 1e-4]
    worlds = [scene(free(spin, inertia, orientation), walls=(), time_step=h, force_time_step=True) for h in steps]
    simulation = Simulation(worlds)
    turn = matrix_of(orientation)
    momentum = turn @ (inertia * (turn.T @ spin))
    energy = 0.5 * momentum @ spin
    worst = np.zeros(3)
    late = np.zeros(3)
    for block in range(200):
        simulation.run(0.02)
        for k in range(3):
            now = simulation.snapshot(k)
            turn = matrix_of(now.orientation[0])
            assert np.linalg.norm(now.orientation[0]) == pytest.approx(1, abs=1e-14)
            local = turn.T @ now.spin[0]
            assert turn @ (inertia * local) == pytest.approx(momentum, abs=1e-12 * np.linalg.norm(momentum))
            error = abs(0.5 * inertia @ local**2 / energy - 1)
            worst[k] = max(worst[k], error)
            late[k] = max(late[k], error) if block > 150 else late[k]
    assert worst[0] < 1e-3
    assert np.all(np.log2(worst[:-1] / worst[1:]) > 1.8)
    assert np.all(late <= worst)


def test_rotation_about_a_principal_axis_by_its_closed_form():
    """A steady spin about one axis turns the orientation by ω t."""
    for axis in range(3):
        spin = np.zeros(3)
        spin[axis] = 30.0
        simulation = Simulation(scene(free(spin), walls=(), time_step=1e-4, force_time_step=True))
        simulation.run(0.05)
        now = simulation.snapshot()
        expected = np.zeros(4)
        expected[0], expected[axis + 1] = math.cos(0.75), math.sin(0.75)
        assert now.orientation[0] == pytest.approx(expected, abs=1e-12)


def test_precession_of_a_symmetric_top():
    """With two equal moments the axis precesses about L at |L|/I₁."""
    simulation = Simulation(
        scene(free([20.0, 0, 50.0], (2e-6, 2e-6, 1e-6)), walls=(), time_step=2e-5, force_time_step=True)
    )
    momentum = np.array([4e-5, 0, 5e-5])
    simulation.run(0.1)
    axis = matrix_of(simulation.snapshot().orientation[0])[:, 2]
    along = momentum / np.linalg.norm(momentum)
    angle = np.linalg.norm(momentum) / 2e-6 * 0.1
    start = np.array([0, 0, 1.0])
    expected = (
        start * math.cos(angle)
        + np.cross(along, start) * math.sin(angle)
        + along * (along @ start) * (1 - math.cos(angle))
    )
    assert axis == pytest.approx(expected, abs=1e-5)


def test_rotation_about_the_middle_axis_flips():
    simulation = Simulation(scene(free([1e-3, 50.0, 1e-3]), walls=(), time_step=1e-4, force_time_step=True))
    directions = []
    for now in frames(simulation, 30000, every=50):
        directions.append(matrix_of(now[0].orientation[0])[:, 1] @ [0, 1, 0])
    directions = np.array(directions)
    assert directions.min() < -0.95
    assert directions.max() > 0.95
    assert np.abs(np.diff(np.sign(directions))).sum() >= 4  # to and fro


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_dumbbell_that_hits_a_plane(friction):
    """Frictionless and elastic: the impulse of a tilted rigid body by its closed form, and its energy returns."""
    inertia = np.array([2.5e-6, 2.5e-6, 8e-7])
    tilt = 0.6
    stiff = body(
        [0, 0, 0.01 * math.cos(tilt) + 0.01],
        [[0, 0, -0.01], [0, 0, 0.01]],
        [0.01, 0.01],
        mass=2 * MASS,
        inertia=inertia,
        orientation=(math.cos(tilt / 2), 0, math.sin(tilt / 2), 0),
        velocity=(0, 0, -0.05),
    )
    simulation = Simulation(scene(stiff, law=effects(1.0, friction), time_step=2e-6))
    before = simulation.kinetic_energy()
    assert before == pytest.approx(MASS * 0.05**2)
    simulation.run(0.012)
    now = simulation.snapshot()
    assert not np.any(now.force)
    if friction:
        assert simulation.kinetic_energy() <= before * (1 + 1e-6)
        return
    assert simulation.kinetic_energy() == pytest.approx(before, rel=1e-5)
    lever = -0.01 * math.sin(tilt)  # x of the lower sphere; the impulse acts along z
    impulse = 2 * 0.05 / (1 / (2 * MASS) + lever**2 / 2.5e-6)
    assert now.velocity[0, 2] == pytest.approx(-0.05 + impulse / (2 * MASS), rel=2e-2, abs=1e-4)
    assert now.spin[0, 1] == pytest.approx(-lever * impulse / 2.5e-6, rel=2e-2)


def test_momentum_of_colliding_dumbbells():
    inertia = (2.5e-6, 2.5e-6, 8e-7)
    rng = np.random.default_rng(3)
    parts = [
        body(
            x,
            [[0, 0, -0.008], [0, 0, 0.008]],
            [0.01, 0.01],
            mass=2 * MASS,
            inertia=inertia,
            orientation=rng.normal(size=4),
            velocity=-np.array(x) * 20,
            spin=rng.normal(0, 20, 3),
        )
        for x in ([0.03, 0, 0], [-0.03, 0.01, 0], [0, 0.045, 0.005], [0, -0.04, 0], [0, 0, 0.06])
    ]
    bodies = Bodies.joined(parts)
    simulation = Simulation(scene(bodies, walls=(), law=effects(0.7, 0.5, 0.1), time_step=5e-6, skin=1e-3))

    def totals(now):
        linear = (now.mass[:, None] * now.velocity).sum(0)
        angular = (now.mass[:, None] * np.cross(now.position, now.velocity)).sum(0)
        for q, w in zip(now.orientation, now.spin, strict=True):
            turn = matrix_of(q)
            angular = angular + turn @ (np.array(inertia) * (turn.T @ w))
        return linear, angular

    before = totals(simulation.snapshot())
    energy = simulation.kinetic_energy()
    simulation.run(0.06)
    now = simulation.snapshot()
    after = totals(now)
    assert np.abs(now.velocity - bodies.velocity).max() > 0.3
    assert simulation.kinetic_energy() < 0.95 * energy
    assert after[0] == pytest.approx(before[0], abs=1e-13)
    assert after[1] == pytest.approx(before[1], abs=1e-9 * np.abs(before[1]).max())


def test_a_floor_carries_a_resting_dumbbell():
    lying = body(
        [0, 0, 0.00999],
        [[0, 0, -0.01], [0, 0, 0.01]],
        [0.01, 0.01],
        mass=2 * MASS,
        inertia=(2.5e-6, 2.5e-6, 8e-7),
        orientation=(math.cos(math.pi / 4), math.sin(math.pi / 4), 0, 0),
    )
    simulation = Simulation(scene(lying, walls=[FLOOR], law=effects(0.3, 0.5, 0.1, gravity=(0, 0, -9.81))))
    simulation.run(1.0)
    now = simulation.snapshot()
    assert simulation.kinetic_energy() < 1e-20
    assert now.force[0] == pytest.approx([0, 0, 0], abs=1e-9)
