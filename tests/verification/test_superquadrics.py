"""Superquadrics in motion: impacts by their closed forms, spheres as a special case, rotation, conservation."""

import math

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.materials import Material
from taichidem.shapes import Superquadric
from taichidem.simulation import Simulation
from tests.apparatus import FLOOR, SOFT, ball, effects, reference, scene
from tests.shapes.pair_search import random_quaternions, rotated

SPEED = 0.01
STIFF = Material("grain", 2500.0, 1e9, 0.25)


def about_y(angle):
    """Return the quaternion of a turn about y [rad]."""
    return np.array([math.cos(angle / 2), 0.0, math.sin(angle / 2), 0.0])


def support(q, axes, normal):
    """Return the point of an ellipsoid farthest along a direction, A n/√(n·A n), A = R diag(a², b², c²) Rᵀ."""
    frame = np.column_stack([rotated(q[None], np.eye(3)[k : k + 1])[0] for k in range(3)])
    spread = frame @ np.diag(np.square(axes)) @ frame.T
    return spread @ normal / math.sqrt(normal @ spread @ normal)


def momenta(now, inertia):
    """Return momentum and angular momentum about the origin of all bodies, given their principal moments (n, 3)."""
    back = now.orientation * [1, -1, -1, -1]
    own = rotated(now.orientation, inertia * rotated(back, now.spin))
    linear = (now.mass[:, None] * now.velocity).sum(0)
    return linear, (own + now.mass[:, None] * np.cross(now.position, now.velocity)).sum(0)


@pytest.mark.parametrize("tilt", [0, 10, 30, 45, 60, 80, 90])
@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_frictionless_impact_of_an_ellipsoid_on_a_plane(tilt, restitution):
    """J = (1 + e) v/(1/m + (r × n)·I⁻¹ (r × n)): rebound and spin of a = b = 1, c = 2 (cm), per unit speed."""
    a, c = 0.01, 0.02
    shape = Superquadric(a, a, c)
    q = about_y(math.radians(tilt))
    down = support(q, (a, a, c), np.array([0, 0, -1.0]))
    body = shape.bodies([[0, 0, -down[2] + 1e-7]], STIFF.density, orientation=q, velocity=(0, 0, -SPEED))
    simulation = Simulation(scene(body, material=STIFF, law=effects(restitution, attraction=True), time_step=1e-7))
    simulation.run(1.5e-3)
    now = simulation.snapshot()
    assert not np.any(now.force)
    lever = down[0]
    inverse = 1 / body.mass[0] + lever**2 / body.inertia[0, 1]
    impulse = (1 + restitution) * SPEED / inverse
    assert now.velocity[0, 2] == pytest.approx(-SPEED + impulse / body.mass[0], abs=0.005 * SPEED)
    assert now.spin[0, 1] == pytest.approx(-lever * impulse / body.inertia[0, 1], abs=0.005 * SPEED / a)
    if tilt == 45 and restitution == 1.0:
        assert now.velocity[0, 2] / SPEED == pytest.approx(0.05263, rel=5e-3)
        assert abs(now.spin[0, 1]) * a / SPEED == pytest.approx(0.99861, rel=5e-3)


def test_the_reference_file_of_impacts_agrees_with_the_closed_form():
    for row in reference("ellipsoid_plane_frictionless_impact.csv"):
        r = {name: float(value) for name, value in row.items()}
        a, c, tilt = r["a_eq_b_m"], r["c_m"], math.radians(r["tilt_of_c_axis_from_normal_deg"])
        down = support(about_y(tilt), (a, a, c), np.array([0, 0, -1.0]))
        assert -down[2] == pytest.approx(r["centre_height_at_touch_m"], rel=1e-4)
        assert abs(down[0]) == pytest.approx(abs(r["contact_x_offset_m"]), abs=1e-4)


def test_spheres_as_superquadrics_move_as_spheres():
    """Through friction, rolling resistance and collisions with a wall and each other, at any orientation."""
    rng = np.random.default_rng(2)
    position = np.array(
        [[0.025 * a, 0.025 * b, 0.012 + 0.025 * c] for a in range(2) for b in range(2) for c in range(3)]
    )
    motion = {"velocity": rng.normal(0, 0.5, (12, 3)), "spin": rng.normal(0, 20, (12, 3))}
    law = effects(0.6, 0.5, 0.1, gravity=(0, 0, -9.81))
    shape = Superquadric.sphere(0.01)
    forms = shape.bodies(position, SOFT.density, orientation=random_quaternions(rng, 12), **motion)
    taken = []
    for bodies in (ball(position, **motion), forms):
        simulation = Simulation(scene(bodies, law=law))
        simulation.run(0.1)
        taken.append(simulation.snapshot())
    one, two = taken
    assert one.rebuilds > 3
    for name in ("position", "velocity", "spin", "force", "torque"):
        expected = getattr(one, name)
        assert getattr(two, name) == pytest.approx(expected, abs=1e-10 * np.abs(expected).max()), name


def test_both_schedules_give_the_same_bits():
    rng = np.random.default_rng(3)
    position = 0.03 * np.array([[a, b, c + 1.0] for a in range(3) for b in range(3) for c in range(2)])
    shapes = [Superquadric(0.008, 0.01, 0.014), Superquadric(0.01, 0.01, 0.01, 4.0, 4.0)]
    parts = [
        shape.bodies(position[k::2], SOFT.density, orientation=random_quaternions(rng, 9), velocity=(0, 0, -0.5))
        for k, shape in enumerate(shapes)
    ]
    bodies = Bodies.joined(parts)
    taken = []
    for schedule in ("worlds", "particles"):
        simulation = Simulation(scene(bodies, law=effects(0.5, 0.5, 0.1, gravity=(0, 0, -9.81))), schedule)
        simulation.run(0.1)
        taken.append(simulation.snapshot())
    for name in ("position", "velocity", "spin", "orientation", "force", "torque"):
        assert np.array_equal(getattr(taken[0], name), getattr(taken[1], name)), name
    assert taken[0].position[:, 2].min() < 0.02


@pytest.mark.parametrize(
    ("shape", "loss"),
    [(Superquadric(0.01, 0.01, 0.02), 1e-4), (Superquadric(0.01, 0.01, 0.01, 4.0, 4 / 1.8), 1e-4)],
    ids=["ellipsoid", "rounded box"],
)
def test_an_oblique_elastic_collision_keeps_momentum_and_energy(shape, loss):
    """Two unequal bodies, tilted and off centre, frictionless; the energy is not kept to round-off, as R* changes."""
    rng = np.random.default_rng(5)
    q = random_quaternions(rng, 2)
    bodies = shape.bodies(
        [[0, 0, 0], [0.045, 0.008, 0.004]],
        STIFF.density,
        radius=[0.01, 0.014],
        orientation=q,
        velocity=[[0.01, 0, 0], [-0.01, 0, 0]],
        spin=rng.normal(0, 0.3, (2, 3)),
    )
    simulation = Simulation(scene(bodies, walls=(), material=STIFF, law=effects(1.0), time_step=5e-6))
    before, energy = momenta(simulation.snapshot(), bodies.inertia), simulation.kinetic_energy()
    simulation.run(2.0)
    now = simulation.snapshot()
    assert np.abs(now.velocity - bodies.velocity).max() > 0.005
    assert not np.any(now.force)
    after = momenta(now, bodies.inertia)
    for one, two in zip(before, after, strict=True):
        assert two == pytest.approx(one, abs=1e-10 * np.abs(one).max())
    assert simulation.kinetic_energy() == pytest.approx(energy, rel=loss)


@pytest.mark.parametrize("exponents", [(2.0, 2.0), (4.0, 3.0), (8.0, 2.0)])
def test_swapping_the_two_bodies_swaps_their_forces(exponents):
    rng = np.random.default_rng(11)
    shapes = [Superquadric(0.01, 0.012, 0.016, *exponents), Superquadric(0.011, 0.009, 0.01, 3.0, 2.0)]
    for _ in range(6):
        q, spin, velocity = random_quaternions(rng, 2), rng.normal(0, 20, (2, 3)), rng.normal(0, 0.1, (2, 3))
        place = [np.zeros(3), 0.018 * (d := rng.normal(size=3)) / np.linalg.norm(d)]
        forces = []
        for order in ((0, 1), (1, 0)):
            parts = [
                shapes[k].bodies(place[k], SOFT.density, orientation=q[k], spin=spin[k], velocity=velocity[k])
                for k in order
            ]
            simulation = Simulation(
                scene(Bodies.joined(parts), walls=(), law=effects(0.5, 0.5, 0.1, constant=None), time_step=1e-7)
            )
            simulation.run_steps(20)
            now = simulation.snapshot()
            forces.append((now.force[list(order)], now.torque[list(order)]))
        assert np.linalg.norm(forces[0][0][0]) > 0
        for one, two in zip(forces[0], forces[1], strict=True):
            assert two == pytest.approx(one, rel=1e-9, abs=1e-9 * np.abs(one).max())
        assert forces[0][0][0] == pytest.approx(-forces[0][0][1], rel=1e-12)


def test_tumbling_flips_about_the_middle_axis_and_keeps_momentum_and_energy():
    """a < b < c turning about b: the axis flips to and fro, L stays as a vector, the energy within a bound."""
    shape = Superquadric(0.006, 0.01, 0.016, 3.0, 3.0)
    body = shape.bodies([[0, 0, 0]], SOFT.density, spin=[[1e-3, 50.0, 1e-3]])
    simulation = Simulation(scene(body, walls=(), time_step=1e-4, force_time_step=True))
    energy = simulation.kinetic_energy()
    momentum = body.inertia[0] * [1e-3, 50.0, 1e-3]
    along = []
    for _ in range(400):
        simulation.run(0.02)
        now = simulation.snapshot()
        assert momenta(now, body.inertia)[1] == pytest.approx(momentum, abs=1e-12 * np.linalg.norm(momentum))
        assert simulation.kinetic_energy() == pytest.approx(energy, rel=1e-5)
        along.append(rotated(now.orientation, np.array([[0, 1.0, 0]]))[0, 1])
    along = np.array(along)
    assert along.min() < -0.95
    assert along.max() > 0.95
    assert np.abs(np.diff(np.sign(along))).sum() >= 4


def test_a_spheroid_tumbles_exactly_whatever_the_step():
    """The axis of a symmetric body precesses about L at |L|/I: exact for any step."""
    shape = Superquadric.spheroid(1.5, 0.01)
    taken = []
    for step in (1e-3, 1e-5):
        body = shape.bodies([[0, 0, 0]], SOFT.density, spin=[[20.0, 0, 50.0]])
        simulation = Simulation(scene(body, walls=(), time_step=step, force_time_step=True))
        simulation.run(0.2)
        taken.append(simulation.snapshot())
    assert taken[0].orientation == pytest.approx(taken[1].orientation, abs=1e-10)
    momentum = body.inertia[0] * [20.0, 0, 50.0]
    along, start = momentum / np.linalg.norm(momentum), np.array([0, 0, 1.0])
    angle = np.linalg.norm(momentum) / body.inertia[0, 0] * 0.2
    turned = start * math.cos(angle) + np.cross(along, start) * math.sin(angle)
    turned += along * (along @ start) * (1 - math.cos(angle))
    assert rotated(taken[0].orientation, np.array([[0, 0, 1.0]]))[0] == pytest.approx(turned, abs=1e-9)


def test_friction_and_rolling_never_give_energy():
    rng = np.random.default_rng(8)
    shape = Superquadric(0.008, 0.01, 0.014)
    position = 0.032 * np.array([[a, b, c + 0.6] for a in range(2) for b in range(2) for c in range(3)])
    bodies = shape.bodies(
        position,
        SOFT.density,
        orientation=random_quaternions(rng, 12),
        velocity=rng.normal(0, 0.5, (12, 3)),
        spin=rng.normal(0, 30, (12, 3)),
    )
    simulation = Simulation(scene(bodies, law=effects(0.7, 0.5, 0.1, gravity=(0, 0, -9.81))))

    def energy():
        now = simulation.snapshot()
        return simulation.kinetic_energy() + float((now.mass * now.position[:, 2]).sum()) * 9.81

    last = energy()
    start = last
    for _ in range(40):
        simulation.run(0.02)
        assert energy() < last + 1e-3 * start  # a contact may hold some of it elastically
        last = energy()
    assert last < 0.6 * start
    assert simulation.snapshot().position[:, 2].min() > 0.0079


@pytest.mark.parametrize(
    ("shape", "height"),
    [
        (Superquadric(0.01, 0.012, 0.006), 0.006),
        (Superquadric(0.01, 0.01, 0.008, 10.0, 2.0), 0.008),
        (Superquadric(0.01, 0.012, 0.008, 6.0, 6.0), 0.008),
    ],
    ids=["ellipsoid", "cylinder-like", "box-like"],
)
def test_bodies_come_to_rest_on_their_flattest_side(shape, height):
    body = shape.bodies([[0, 0, 0.012]], SOFT.density, orientation=about_y(0.2))
    law = effects(0.3, 0.5, 0.01, gravity=(0, 0, -9.81))
    simulation = Simulation(scene(body, walls=[FLOOR], law=law, domain=((-1,) * 3, (1,) * 3)))
    simulation.run(3.0)
    simulation.check()
    now = simulation.snapshot()
    assert now.position[0, 2] == pytest.approx(height, rel=0.01)
    assert abs(rotated(now.orientation, np.array([[0, 0, 1.0]]))[0, 2]) == pytest.approx(1.0, abs=0.01)
    assert simulation.kinetic_energy() < 1e-8


def test_the_curvature_is_followed_by_time_not_by_steps():
    """Half the step takes over half the share, so that a finer step converges to the same motion."""
    body = Superquadric.spheroid(2.0, 0.01).bodies([[0, 0, 1.0]], SOFT.density)
    shares = []
    for step in (2e-5, 1e-5):
        simulation = Simulation(scene(body, time_step=step))
        shares.append(simulation._engine.access["worlds"].read(0)["curvature_share"])
    assert shares[0] == pytest.approx(2 * shares[1], rel=1e-2)
    assert shares[0] < 0.01
