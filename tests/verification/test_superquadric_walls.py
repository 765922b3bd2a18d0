"""Superquadrics at walls of every kind: planes, tubes, cones, discs with their rims, and meshes with edges and corners."""

import math

import numpy as np
import pytest

from taichidem.shapes import Superquadric
from taichidem.simulation import Simulation
from taichidem.walls import Cone, Cylinder, Disc, Mesh, Plane
from tests.apparatus import FLOOR, SOFT, ball, effects, scene
from tests.shapes.pair_search import random_quaternions, rotated
from tests.verification.test_superquadrics import about_y, support
from tests.verification.test_walls import floor_mesh

R, DELTA = 0.01, 1e-4
SHAPES = {
    "ellipsoid": Superquadric(0.008, 0.01, 0.014),
    "cylinder-like": Superquadric(0.009, 0.009, 0.012, 8.0, 2.0),
    "box-like": Superquadric(0.008, 0.01, 0.012, 6.0, 6.0),
}
every_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES.keys())


def box_mesh(half):
    """Return a closed box of triangles about the origin."""
    corners = np.array([[x, y, z] for x in (-half, half) for y in (-half, half) for z in (-half, half)], float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    facets = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return Mesh(material="rigid", vertices=corners, facets=np.array(facets))


WALLS = {
    "plane": FLOOR,
    "disc": Disc(material="rigid", centre=(0, 0, 0), radius=0.05),
    "ring": Disc(material="rigid", centre=(0, 0, 0), radius=0.05, inner_radius=0.005),
    "tube": Cylinder(material="rigid", base=(0, 0, 0), radius=0.05, height=0.2),
    "lying tube": Cylinder(material="rigid", base=(-0.1, 0, 0.03), axis=(1, 0, 0), radius=0.05, height=0.2),
    "funnel": Cone(material="rigid", base=(0, 0, 0), base_radius=0.02, top_radius=0.1, height=0.08),
    "point": Cone(material="rigid", base=(0, 0, -0.08), base_radius=0.06, top_radius=0.0, height=0.08),
    "flat mesh": floor_mesh(),
    "box": box_mesh(0.03),
}


def pushes(bodies, wall):
    """Return force [N] and torque [N m] on bodies at rest that do not meet, at one wall."""
    law = effects()
    simulation = Simulation(scene(bodies, walls=[wall], law=law, time_step=1e-9, partners=80, force_time_step=True))
    simulation.run_steps(1)
    now = simulation.snapshot()
    return now.force, now.torque


@pytest.mark.parametrize("name", WALLS)
def test_a_sphere_feels_the_same_whatever_it_is_called(name):
    """At random places around the wall, over faces, rims, edges and corners."""
    rng = np.random.default_rng(1)
    wall = WALLS[name]
    points, triangles = wall.surface()
    chosen = points[triangles[rng.integers(len(triangles), size=300)]]
    feet = np.einsum("nk,nkd->nd", rng.dirichlet(0.4 * np.ones(3), 300), chosen)
    away = rng.normal(size=(300, 3))
    places = feet + (R - DELTA) * away / np.linalg.norm(away, axis=1)[:, None]
    taken = []
    for place in places:
        if all(np.linalg.norm(place - other) > 2.2 * R for other in taken):
            taken.append(place)
    position = np.array(taken)
    turned = random_quaternions(rng, len(position))
    expected, _ = pushes(ball(position), wall)
    meant = np.linalg.norm(expected, axis=1) < 200  # not those that lie deep in another part of the wall
    position, turned, expected = position[meant], turned[meant], expected[meant]
    force, torque = pushes(Superquadric.sphere(R).bodies(position, SOFT.density, orientation=turned), wall)
    assert np.count_nonzero(np.any(expected, axis=1)) > 3
    size = np.abs(expected).max()
    assert force == pytest.approx(expected, abs=1e-9 * size)
    assert torque == pytest.approx(np.zeros_like(torque), abs=1e-9 * size * R)


@every_shape
def test_a_flat_mesh_pushes_like_a_plane(shape):
    """Over faces, edges and corners, at any orientation: which feature counts is decided where the body touches."""
    rng = np.random.default_rng(2)
    n = 40
    turned = random_quaternions(rng, n)
    down = np.array([0, 0, -1.0])
    low = rotated(turned, shape.support(rotated(turned * [1, -1, -1, -1], np.tile(down, (n, 1)))))
    mesh, plane = floor_mesh(n=8, size=0.2), FLOOR
    grid = 0.06 * np.array([[a - 2, b - 2.5] for a in range(5) for b in range(6)])
    position = np.column_stack([grid[:n] + rng.uniform(-0.01, 0.01, grid[:n].shape), -low[: len(grid), 2] - DELTA])
    bodies = shape.bodies(position, SOFT.density, orientation=turned[: len(grid)])
    expected, torque = pushes(bodies, plane)
    force, turning = pushes(bodies, mesh)
    assert np.all(expected[:, 2] > 0)
    assert force == pytest.approx(expected, rel=1e-7, abs=1e-9 * expected.max())
    assert turning == pytest.approx(torque, abs=1e-5 * expected.max() * R)


def test_an_ellipsoid_that_rolls_over_a_flat_mesh_rolls_as_on_a_plane():
    shape = Superquadric.spheroid(1.3, R)
    law = {"restitution": 0.6, "friction": 0.5, "rolling": 0.02, "gravity": (0.3, 0.2, -9.81)}
    worlds = []
    for wall in (FLOOR, floor_mesh(jitter=0.2)):
        body = shape.bodies([[-0.06, -0.05, 0.0116]], SOFT.density, orientation=about_y(1.2), velocity=(0.3, 0.2, 0))
        worlds.append(scene(body, walls=[wall], law=effects(**law), skin=3e-4))
    simulation = Simulation(worlds)
    for _ in range(6):
        simulation.run(0.03)
        plane, mesh = (simulation.snapshot(k) for k in (0, 1))
        assert np.abs(plane.position[0, :2]).max() < 0.1
        for name in ("position", "velocity", "spin"):
            expected = getattr(plane, name)
            assert getattr(mesh, name) == pytest.approx(expected, abs=1e-6 * max(1.0, np.abs(expected).max()))


def test_an_ellipsoid_in_a_tube_overlaps_by_its_closed_form():
    """Lying along the axis the tube is touched by its section; a tilt about the axis turns that section."""
    a, b, c = 0.008, 0.01, 0.014
    tube = Cylinder(material="rigid", base=(0, 0, -0.1), radius=0.05, height=0.2)
    plane = Plane(material="rigid", point=(-0.05, 0, 0), normal=(1, 0, 0))
    bodies = Superquadric(a, b, c).bodies([[-0.05 + a - DELTA, 0, 0]], SOFT.density)
    force, torque = pushes(bodies, tube)
    flat, _ = pushes(bodies, plane)
    assert force[0] == pytest.approx(flat[0], rel=1e-9)
    assert torque[0] == pytest.approx(np.zeros(3), abs=1e-12)
    # Turned, the body touches beside the plane's foot: the lowest radius of the section seen from the tube's axis.
    angle = 0.5
    q = np.array([math.cos(angle / 2), 0, 0, math.sin(angle / 2)])
    body = Superquadric(a, b, c).bodies([[-0.042, 0, 0]], SOFT.density, orientation=q)
    azimuth = np.linspace(0, 2 * np.pi, 2_000_001)
    x, y = a * np.cos(azimuth), b * np.sin(azimuth)
    farthest = np.hypot(-0.042 + math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y)
    k = int(np.argmax(farthest))
    force, _ = pushes(body, tube)
    place = np.array(
        [
            -0.042 + math.cos(angle) * x[k] - math.sin(angle) * y[k],
            math.sin(angle) * x[k] + math.cos(angle) * y[k],
        ]
    )
    assert farthest[k] > 0.05
    assert force[0, :2] / np.linalg.norm(force[0]) == pytest.approx(-place / np.linalg.norm(place), abs=1e-5)


@every_shape
@pytest.mark.parametrize("name", WALLS)
def test_elastic_bounces_off_every_wall_keep_the_energy(name, shape):
    """Thrown at faces, rims, edges and corners from all sides, without friction: kinetic energy returns, nothing gets in."""
    rng = np.random.default_rng(3)
    wall = WALLS[name]
    worlds: list = []
    points, triangles = wall.surface()
    while len(worlds) < 12:
        foot = rng.dirichlet(0.5 * np.ones(3)) @ points[triangles[rng.integers(len(triangles))]]
        away = rng.normal(size=3)
        away /= np.linalg.norm(away)
        place = foot + 0.03 * away
        if (name == "plane" and place[2] < 0) or np.any(pushes(ball([place], shape.bounding_radius), wall)[0]):
            continue  # behind the plane, or not clear of the wall yet
        turned = random_quaternions(rng, 1)[0]
        motion = {"velocity": -0.02 * away, "spin": rng.normal(0, 1.0, 3)}
        body = shape.bodies([place], SOFT.density, orientation=turned, **motion)
        worlds.append(scene(body, walls=[wall], law=effects(), time_step=2e-5, skin=5e-3))
    simulation = Simulation(worlds)
    start = np.array([simulation.kinetic_energy(k) for k in range(12)])
    before = [simulation.snapshot(k).velocity[0] for k in range(12)]
    simulation.run(3.0)
    simulation.check()
    bounced = 0
    for k in range(12):
        now = simulation.snapshot(k)
        bounced += np.linalg.norm(now.velocity[0] - before[k]) > 1e-3
        if not np.any(now.force):
            assert simulation.kinetic_energy(k) == pytest.approx(start[k], rel=0.05)
    assert bounced >= 4


def test_a_cylinder_like_grain_stands_on_its_end():
    """A flat end on a flat floor: the support point may wander over the face, but the body stays where it is."""
    shape = Superquadric(0.008, 0.008, 0.012, 12.0, 2.0)
    law = effects(0.3, 0.5, 0.01, gravity=(0, 0, -9.81))
    body = shape.bodies([[0, 0, 0.01201]], SOFT.density, orientation=about_y(0.02))
    simulation = Simulation(scene(body, walls=[FLOOR], law=law))
    simulation.run(1.5)
    now = simulation.snapshot()
    assert now.position[0, 2] == pytest.approx(0.012, rel=0.01)
    assert rotated(now.orientation, np.array([[0, 0, 1.0]]))[0, 2] > 0.999
    assert simulation.kinetic_energy() < 1e-9


def test_the_support_point_on_a_plane_is_exact():
    rng = np.random.default_rng(6)
    axes = (0.008, 0.01, 0.014)
    for q in random_quaternions(rng, 8):
        down = support(q, axes, np.array([0, 0, -1.0]))
        body = Superquadric(*axes).bodies([[0, 0, -down[2] - DELTA]], SOFT.density, orientation=q)
        force, torque = pushes(body, FLOOR)
        point = np.array([down[0], down[1], down[2] + DELTA])  # on the wall, which does not deform
        assert torque[0] == pytest.approx(np.cross(point, force[0]), abs=1e-10 * force[0, 2] * R)
