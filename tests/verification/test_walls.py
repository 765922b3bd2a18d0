"""Walls: every kind by its geometry, meshes against planes and boxes, motion, removal, and that nothing gets out."""

import math

import numpy as np
import pytest

from taichidem.simulation import Simulation
from taichidem.walls import Cone, Cylinder, Disc, Mesh, Motion, Plane
from tests.apparatus import BOX, FLOOR, SOFT, ball, effective_modulus, effects, frames, scene

R = 0.01
DELTA = 1e-4
FORCE = 4 / 3 * effective_modulus(SOFT) * math.sqrt(R) * DELTA**1.5
FINE, SLIGHT = 0.002, 2e-5  # radius and overlap [m] of the small balls that probe every feature of a mesh
GRAVITY = (0, 0, -9.81)


def force(radius=R, overlap=DELTA):
    """Return Hertz's force [N] of a ball on a rigid wall."""
    return 4 / 3 * effective_modulus(SOFT) * math.sqrt(radius) * overlap**1.5


def forces(cases, radius=R, **law):
    """Return the force [N] on a resting ball for each (walls, position); balls that do not meet share a world."""
    worlds: list[tuple[list, list[int]]] = []
    for k, (walls, x) in enumerate(cases):
        for other, members in worlds:
            if all(a is b for a, b in zip(walls, other, strict=False)) and len(walls) == len(other):
                apart = np.linalg.norm(np.array([cases[m][1] for m in members]) - x, axis=1)
                if apart.min() > 2.1 * radius:
                    members.append(k)
                    break
        else:
            worlds.append((walls, [k]))
    out = np.zeros((len(cases), 3))
    for first in range(0, len(worlds), 60):
        part = worlds[first : first + 60]
        scenes = [
            scene(
                ball([cases[m][1] for m in members], radius),
                walls=walls,
                law=effects(**law),
                time_step=1e-9,
                partners=60,
                skin=0.02,
            )
            for walls, members in part
        ]
        simulation = Simulation(scenes)
        simulation.run_steps(1)
        simulation.check()
        for k, (_, members) in enumerate(part):
            out[members] = simulation.snapshot(k).force
    return out


def check_push(cases):
    """Cases of (wall, foot point, direction out of the wall): one Hertz force along the direction, none further off."""
    feet = [(np.asarray(foot, float), np.asarray(out, float) / np.linalg.norm(out)) for _, foot, out in cases]
    touching = [([wall], foot + (R - DELTA) * out) for (wall, _, _), (foot, out) in zip(cases, feet, strict=True)]
    for (wall, foot, _), f, (_, out) in zip(cases, forces(touching), feet, strict=True):
        assert f == pytest.approx(FORCE * out, abs=1e-9 * FORCE), (type(wall).__name__, foot)
    apart = [([wall], foot + (R + 1e-7) * out) for (wall, _, _), (foot, out) in zip(cases, feet, strict=True)]
    assert not np.any(forces(apart))


def test_plane_and_disc():
    tilted = np.array([1.0, 2, 3]) / math.sqrt(14)
    plane = Plane(material="rigid", point=(0.1, 0, 0), normal=tuple(tilted))
    disc = Disc(material="rigid", centre=(0, 0, 0.2), radius=0.05)
    ring = Disc(material="rigid", centre=(0, 0, 0), radius=0.05, inner_radius=0.02)
    check_push(
        [
            (plane, [0.1, 0, 0] + 0.7 * np.cross(tilted, [1, 0, 0]), tilted),
            (disc, [0.01, 0.02, 0.2], [0, 0, 1]),
            (disc, [0, 0, 0.2], [0, 0, 1]),  # on the axis
            (disc, [0.01, 0.02, 0.2], [0, 0, -1]),  # two-sided
            (disc, [0.03, 0.04, 0.2], [0.6, 0.8, 0]),  # rim, from the side
            (disc, [0.03, 0.04, 0.2], [0.6, 0.8, 1.0]),  # rim, from above and outside
            (disc, [0.03, 0.04, 0.2], [0, 0, 1]),  # exactly over the rim
            (ring, [0.035, 0, 0], [0, 0, 1]),
            (ring, [0.02, 0, 0], [-1, 0, 1]),  # inner rim
        ]
    )
    assert not np.any(forces([([ring], np.array([0, 0, 0.001]))]))  # the hole is open


def test_cylinder():
    tube = Cylinder(material="rigid", base=(0, 0, 0), radius=0.05, height=0.2)
    lying = Cylinder(material="rigid", base=(-0.1, 0, 0.3), axis=(2, 0, 0), radius=0.05, height=0.2)
    check_push(
        [
            (tube, [0.03, 0.04, 0.1], [-0.6, -0.8, 0]),
            (tube, [0.03, 0.04, 0.1], [0.6, 0.8, 0]),
            (tube, [0.03, 0.04, 0.2], [0, 0, 1]),
            (tube, [0.03, 0.04, 0.2], [0.6, 0.8, 0.7]),
            (tube, [0.03, 0.04, 0.2], [-0.6, -0.8, 0.7]),
            (tube, [0.03, 0.04, 0.0], [0, 0, -1]),
            (lying, [0.03, 0, 0.25], [0, 0, 1]),
            (lying, [0.03, 0.03, 0.34], [0, 3, 4]),
            (lying, [0.1, 0, 0.25], [1, 0, 0.3]),
        ]
    )
    assert not np.any(forces([([tube], np.array([0, 0, 0.1])), ([tube], np.array([0, 0, 0.2]))]))


def test_cone():
    # A funnel of 45°: radius 0.1 at the top, 0.02 at the outlet.
    funnel = Cone(material="rigid", base=(0, 0, 0), base_radius=0.02, top_radius=0.1, height=0.08)
    full = Cone(material="rigid", base=(0, 0, 0), base_radius=0.06, top_radius=0.0, height=0.08)
    check_push(
        [
            (funnel, [0.06, 0, 0.04], [-1, 0, 1]),
            (funnel, [0, 0.06, 0.04], [0, 1, -1]),
            (funnel, [0.1, 0, 0.08], [1, 0, 1]),
            (funnel, [0.02, 0, 0], [-1, 0, -1]),
            (full, [0.03, 0, 0.04], [0.08, 0, 0.06]),
            (full, [0, 0, 0.08], [0, 0, 1]),
            (full, [0, 0, 0.08], [0.1, 0.2, 1]),
        ]
    )


def floor_mesh(n=6, size=0.1, jitter=0.25, seed=0, **wall):
    """Return a flat square of triangles about the origin, its inner vertices moved about in the plane."""
    rng = np.random.default_rng(seed)
    x = np.linspace(-size, size, n + 1)
    points = np.stack(np.meshgrid(x, x, [0.0], indexing="ij"), -1).reshape(-1, 3)
    inner = (np.abs(points[:, :2]) < size * 0.999).all(1)
    points[inner, :2] += rng.uniform(-jitter, jitter, (inner.sum(), 2)) * 2 * size / n
    facets = []
    for a in range(n):
        for b in range(n):
            k = a * (n + 1) + b
            right, up, both = k + n + 1, k + 1, k + n + 2
            pair = [[k, right, both], [k, both, up]] if (a + b) % 2 else [[k, right, up], [right, both, up]]
            facets += pair
    facets = np.array(facets)
    turned = rng.random(len(facets)) < 0.5
    facets[turned] = facets[turned][:, ::-1]  # either winding: the surface is two-sided
    return Mesh(material="rigid", vertices=points, facets=facets[rng.permutation(len(facets))], **wall)


def features(mesh):
    """Return points of a mesh's faces, edges and vertices."""
    v, f = mesh.vertices, mesh.facets
    corners = v[f]
    edges = (corners + np.roll(corners, 1, axis=1)) / 2
    thirds = (corners * 2 + np.roll(corners, 1, axis=1)) / 3
    return np.concatenate([v, edges.reshape(-1, 3), thirds.reshape(-1, 3), corners.mean(1)])


def test_flat_mesh_pushes_like_a_plane_over_every_feature():
    mesh = floor_mesh()
    points = features(mesh)
    rng = np.random.default_rng(1)
    points = np.concatenate(
        [points, points + rng.normal(0, 1e-12, points.shape), points + rng.normal(0, 1e-9, points.shape)]
    )
    inner = points[(np.abs(points[:, :2]) < 0.0999).all(1)] * [1, 1, 0]
    assert len(inner) > 500
    walls, full = [mesh], force(FINE, SLIGHT)
    for side in (1.0, -1.0):
        got = forces([(walls, p + [0, 0, side * (FINE - SLIGHT)]) for p in inner], FINE)
        # The plane itself, at the same height: to the last digits.
        plane = forces(
            [([Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, side))], [0, 0, side * (FINE - SLIGHT)])], FINE
        )
        assert got == pytest.approx(np.tile(plane, (len(inner), 1)), abs=1e-12 * full)
        assert plane[0, 2] == pytest.approx(side * full, rel=1e-9)


def test_rolling_over_a_flat_mesh_equals_rolling_over_a_plane():
    """With friction, rolling resistance and their memory, over diagonals, edges and exactly through vertices."""
    mesh = floor_mesh(jitter=0.2)
    regular = floor_mesh(jitter=0.0)
    law = {"restitution": 0.6, "friction": 0.5, "rolling": 0.05, "gravity": (0.3, 0.2, -9.81)}
    starts = [
        ((-0.07, -0.06), (0.4, 0.3)),
        ((-0.08, 0.0), (0.5, 0.0)),
        ((-0.08, -0.08), (0.4, 0.4)),
        ((0.0, 0.08), (0, -0.5)),
    ]
    worlds = []
    for (x, y), (vx, vy) in starts:
        for wall in (FLOOR, mesh, regular):
            one = ball([x, y, R - 1e-6], velocity=(vx, vy, 0), spin=(0, 0, 30.0))
            worlds.append(scene(one, walls=[wall], law=effects(**law), skin=3e-4))
    simulation = Simulation(worlds)
    for _ in range(10):
        simulation.run(0.025)
        for k in range(len(starts)):
            plane, *meshes = (simulation.snapshot(3 * k + m) for m in range(3))
            assert np.abs(plane.position[0, :2]).max() < 0.1
            for other in meshes:
                for name in ("position", "velocity", "spin", "force", "torque"):
                    expected = getattr(plane, name)
                    assert getattr(other, name) == pytest.approx(expected, abs=1e-12 * max(1.0, np.abs(expected).max()))
    assert min(simulation.snapshot(k).rebuilds for k in range(len(worlds))) > 100


def test_resting_on_a_flat_mesh():
    """Exactly on a vertex, a diagonal and an edge, held by friction and rolling springs against a slope."""
    mesh = floor_mesh(jitter=0.0)
    law = {"restitution": 0.5, "friction": 0.6, "rolling": 0.4, "gravity": (1.0, 0.5, -9.81)}
    step = 0.2 / 6
    spots = [(0, 0), (step, -step), (step / 2, step / 2), (step / 2, 0), (0, step / 3)]
    worlds = [scene(ball([x, y, R]), walls=[wall], law=effects(**law)) for x, y in spots for wall in (FLOOR, mesh)]
    simulation = Simulation(worlds)
    simulation.run(1.0)
    for k in range(len(spots)):
        plane, other = simulation.snapshot(2 * k), simulation.snapshot(2 * k + 1)
        assert simulation.kinetic_energy(2 * k + 1) < 1e-20
        assert other.position == pytest.approx(plane.position, abs=1e-13)
        assert other.force[0] == pytest.approx([0, 0, 0], abs=1e-6)


BRICK = np.array([0.04, 0.05, 0.06])


def brick_mesh(cut=1, matrix=None, hull=None, **wall):
    """Return a closed box of half-sides BRICK, each face cut into 2 cut² triangles, turned by a matrix."""
    vertices, facets = [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, w = [a for a in range(3) if a != axis]
            grid = np.linspace(-1, 1, cut + 1)
            first = len(vertices)
            for a in grid:
                for b in grid:
                    p = np.zeros(3)
                    p[axis], p[u], p[w] = sign, a, b
                    vertices.append(p * BRICK)
            for a in range(cut):
                for b in range(cut):
                    k = first + a * (cut + 1) + b
                    facets += [[k, k + cut + 1, k + cut + 2], [k, k + cut + 2, k + 1]]
    vertices = np.array(vertices)
    if matrix is not None:
        vertices = vertices @ matrix.T
    return Mesh(material="rigid", vertices=vertices, facets=np.array(facets), **wall)


def some_rotation(seed):
    matrix, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


@pytest.mark.parametrize("cut", [1, 2, 3])
@pytest.mark.parametrize("turned", [False, True])
def test_convex_edges_and_corners_count_once(cut, turned):
    """Outside a closed box: one Hertz contact at the nearest point, wherever that lies."""
    matrix = some_rotation(3) if turned else np.eye(3)
    mesh = brick_mesh(cut, matrix)
    rng = np.random.default_rng(cut)
    feet, out = [], []
    for _ in range(200):
        foot = rng.uniform(-1, 1, 3)
        side = rng.choice([0, 0, 1, -1], 3)
        if rng.random() < 0.4:
            foot = rng.integers(-cut, cut + 1, 3) / cut  # exactly on lines and vertices of the mesh
        if not side.any():
            side[0] = 1
        foot = np.where(side != 0, side, foot * 0.999 if rng.random() < 0.5 else foot)
        away = side * rng.uniform(0.01, 1, 3)
        if rng.random() < 0.3:
            away = side * (rng.integers(0, 2, 3) + 0.0)  # straight over an edge or a corner
        if not away.any():
            away = side.astype(float)
        feet.append(foot * BRICK)
        out.append(away / np.linalg.norm(away))
    feet, out = np.array(feet) @ matrix.T, np.array(out) @ matrix.T
    walls, full = [mesh], force(FINE, SLIGHT)
    got = forces([(walls, f + (FINE - SLIGHT) * o) for f, o in zip(feet, out, strict=True)], FINE)
    size = np.linalg.norm(got, axis=1) / full
    assert size == pytest.approx(np.ones(len(feet)), abs=1e-8)
    assert got == pytest.approx(full * out, abs=1e-8 * full)


def test_concave_edges_and_corners():
    """Inside the box: each face the ball touches pushes once, and edges and corners out of reach do not."""
    for cut in (1, 3):
        mesh = brick_mesh(cut)
        cases = []
        for side in ([1, 0, 0], [1, 1, 0], [-1, 1, 1], [0, -1, 1], [-1, -1, -1]):
            side = np.array(side, float)
            cases.append((side, side * (BRICK - (R - DELTA))))
        walls = [mesh]
        got = forces([(walls, x) for _, x in cases])
        for (side, _), f in zip(cases, got, strict=True):
            assert f == pytest.approx(-FORCE * side, abs=1e-9 * FORCE)


def test_free_edges_and_corners_of_a_single_triangle():
    mesh = Mesh(
        material="rigid", vertices=np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]), facets=np.array([[0, 1, 2]])
    )
    check_push(
        [
            (mesh, [0.02, 0.03, 0], [0, 0, 1]),
            (mesh, [0.02, 0.03, 0], [0, 0, -1]),
            (mesh, [0.05, 0, 0], [0, -1, 0]),
            (mesh, [0.05, 0, 0], [0, -1, 1]),
            (mesh, [0.05, 0, 0], [0, 0, 1]),
            (mesh, [0.05, 0.05, 0], [1, 1, -0.3]),
            (mesh, [0, 0, 0], [-1, -1, 0.5]),
            (mesh, [0, 0, 0], [0, 0, 1]),
            (mesh, [0.1, 0, 0], [1, -0.2, 0]),
        ]
    )
    # Just outside the edge no infinite plane may be felt.
    assert not np.any(forces([([mesh], np.array([0.05, -R - 1e-6, 0.0])), ([mesh], np.array([0.2, 0.2, 0.001]))]))


def ascii_stl(mesh):
    lines = ["solid brick"]
    for corners in mesh.vertices[mesh.facets] * 1000:  # in millimetres
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(f"{x:.9e}" for x in p) for p in corners]
        lines += ["endloop", "endfacet"]
    return "\n".join(lines + ["endsolid brick", ""])


def test_mesh_from_stl(tmp_path):
    path = tmp_path / "brick.stl"
    path.write_text(ascii_stl(brick_mesh(2)))
    mesh = Mesh.from_stl(path, scale=1e-3, material="rigid")
    assert len(mesh.facets) == 48
    assert len(mesh.vertices) == 26
    check_push([(mesh, [0.04, 0.01, 0.02], [1, 0, 0]), (mesh, [0.04, 0.05, 0.01], [1, 1, 0]), (mesh, BRICK, [1, 2, 1])])


@pytest.mark.parametrize("kind", ["mesh", "planes", "tube"])
def test_a_ball_cannot_leave_a_closed_box(kind):
    """Fast balls in a closed box without losses: inside for ever, and their energy stays."""
    if kind == "mesh":
        walls = [brick_mesh(2)]
    elif kind == "planes":
        walls = []
        for axis in range(3):
            for sign in (1.0, -1.0):
                normal = np.zeros(3)
                normal[axis] = sign
                walls.append(Plane(material="rigid", point=tuple(-normal * BRICK), normal=tuple(normal)))
    else:
        walls = [
            Cylinder(material="rigid", base=(0, 0, -0.06), radius=0.05, height=0.12),
            Disc(material="rigid", centre=(0, 0, -0.06), radius=0.05),
            Disc(material="rigid", centre=(0, 0, 0.06), radius=0.05),
        ]
    rng = np.random.default_rng(0)
    speeds = rng.normal(0, 1, (8, 3))
    speeds[0] = [3, 0, 0]
    speeds[1] = [1, 1.25, 1.5]  # straight into a corner
    worlds = [scene(ball([0, 0, 0], velocity=v), walls=walls, time_step=2e-5) for v in speeds]
    simulation = Simulation(worlds)
    before = [simulation.kinetic_energy(k) for k in range(8)]
    for _ in range(40):
        simulation.run(0.0501)
        for k in range(8):
            assert np.all(np.abs(simulation.snapshot(k).position) < 0.06)
    simulation.check()
    for k in range(8):
        # Elastic energy is stored while a ball happens to touch; it never exceeds what it had.
        assert simulation.kinetic_energy(k) < before[k] * 1.001
        now = simulation.snapshot(k)
        if not np.any(now.force):
            assert simulation.kinetic_energy(k) == pytest.approx(before[k], rel=1e-3)


def test_a_plate_lifts_a_ball():
    """A rising plate carries a ball with its speed; from below a falling one lets it behind."""
    for plate in (
        Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1), motion=Motion(velocity=(0, 0, 0.2))),
        Disc(material="rigid", centre=(0, 0, 0), radius=0.05, motion=Motion(velocity=(0, 0, 0.2))),
        floor_mesh(motion=Motion(velocity=(0, 0, 0.2))),
    ):
        simulation = Simulation(scene(ball([0, 0, R]), walls=[plate], law=effects(0.3, gravity=GRAVITY)))
        simulation.run(1.0)
        now = simulation.snapshot()
        assert now.velocity[0] == pytest.approx([0, 0, 0.2], abs=1e-5)
        assert now.position[0, 2] == pytest.approx(0.2 * now.time + R, abs=2e-5)


def test_a_belt_drags_and_rolls_a_ball():
    """A plane that slides under a ball at rest: it slips with a = μ g, and the belt's speed is the end of slip."""
    belt = Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1), motion=Motion(velocity=(1.0, 0, 0)))
    simulation = Simulation(
        scene(ball([0, 0, R]), walls=[belt], law=effects(0.3, 0.3, gravity=GRAVITY), time_step=1e-5)
    )
    simulation.run(0.05)
    one = simulation.snapshot()
    simulation.run(0.02)
    two = simulation.snapshot()
    assert (two.velocity[0, 0] - one.velocity[0, 0]) / 0.02 == pytest.approx(0.3 * 9.81, rel=2e-3)
    simulation.run(0.5)
    now = simulation.snapshot()
    surface = now.velocity[0, 0] - now.position[0, 2] * now.spin[0, 1]
    assert surface == pytest.approx(1.0, rel=1e-4)
    # I Δω = a m Δv with the lever a = R − δ: v = u/(1 + 5/2 (a/R)²), which is 2/7 u for a stiff ball.
    assert now.velocity[0, 0] == pytest.approx(1 / (1 + 2.5 * (now.position[0, 2] / R) ** 2), rel=1e-4)


def turntables(spin):
    """Return a spinning floor of each kind that turns about the z axis through the origin."""
    motion = Motion(spin=(0, 0, spin))
    return [
        Disc(material="rigid", centre=(0, 0, 0), radius=0.09, motion=motion),
        Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1), motion=motion),
        floor_mesh(motion=motion),
    ]


def test_turntable():
    """A ball that slips on a spinning floor is pushed along the floor's motion, μ m g; all kinds agree."""
    worlds = [
        scene(ball([0.05, 0, R - 2e-7]), walls=[w], law=effects(0.3, 0.2, gravity=GRAVITY), time_step=1e-5)
        for w in turntables(20.0)
    ]
    simulation = Simulation(worlds)
    simulation.run(0.02)
    first = simulation.snapshot(0)
    assert first.velocity[0, 1] == pytest.approx(0.2 * 9.81 * 0.02, rel=0.02)
    for k in (1, 2):
        assert simulation.snapshot(k).velocity == pytest.approx(first.velocity, abs=1e-9)
        assert simulation.snapshot(k).spin == pytest.approx(first.spin, abs=1e-7)


def test_a_ball_that_turns_with_a_drum_feels_no_rolling_couple():
    """Rolling resistance acts on rotation relative to the wall: glued to a spinning wall, there is none."""
    for law in ({"rolling": 0.3}, {"constant": 0.3}):
        rate = 5.0
        drum = Cylinder(
            material="rigid",
            base=(-0.1, 0, 0),
            axis=(1, 0, 0),
            radius=0.1,
            height=0.2,
            motion=Motion(spin=(rate, 0, 0)),
        )
        still = Cylinder(material="rigid", base=(-0.1, 0, 0), axis=(1, 0, 0), radius=0.1, height=0.2)
        low = 0.1 - R + 1e-5
        together = ball([0, 0, -low], velocity=(0, rate * low, 0), spin=(rate, 0, 0))
        resting = ball([0, 0, -low], spin=(-rate, 0, 0))
        worlds = [
            scene(one, walls=[wall], law=effects(1.0, 0.0, **law), time_step=1e-6)
            for one, wall in ((together, drum), (resting, drum), (resting, still))
        ]
        simulation = Simulation(worlds)
        simulation.run_steps(20)
        torque = [simulation.snapshot(k).torque[0] for k in range(3)]
        assert np.abs(torque[2][0]) > 0
        assert np.abs(torque[0]).max() < 1e-6 * np.abs(torque[2]).max()
        # Turning against the drum, the relative rotation is twice as fast.
        assert abs(torque[1][0]) >= abs(torque[2][0]) * (1 - 1e-3)


def test_a_drum_drags_a_ball_up():
    """In a slow drum a ball stays low; with rolling resistance it climbs to where the couples balance, tan θ = μ_r."""
    drum = Cylinder(
        material="rigid", base=(-0.1, 0, 0), axis=(1, 0, 0), radius=0.1, height=0.2, motion=Motion(spin=(1.0, 0, 0))
    )
    worlds = [
        scene(ball([0, 0, -0.1 + R]), walls=[drum], law=effects(0.3, 0.8, rolling=mu, gravity=GRAVITY))
        for mu in (0.0, 0.2)
    ]
    simulation = Simulation(worlds)
    slope = np.zeros(2)
    for _ in range(400):  # it swings about its place, for nothing but the mean is fixed by the couples
        simulation.run(0.02)
        for k in range(2):
            _, y, z = simulation.snapshot(k).position[0]
            slope[k] += math.tan(math.atan2(y, -z)) / 400
    assert slope[0] < 0.02
    assert slope[1] == pytest.approx(0.2, rel=0.05)


def test_a_wall_that_turns_about_another_point():
    """A flap: a mesh plate hinged along an edge pushes a ball ahead of it with the speed of the point it touches."""
    rate = 2.0
    mesh = floor_mesh(size=0.1, motion=Motion(spin=(0, -rate, 0), centre=(-0.1, 0, 0)))
    simulation = Simulation(
        scene(ball([0.05, 0, R + 1e-4]), walls=[mesh], law=effects(0.05, gravity=GRAVITY), time_step=2e-5)
    )
    simulation.run(0.06)
    now = simulation.snapshot()
    tilt = rate * now.time
    along = np.array([math.cos(tilt), 0, math.sin(tilt)])
    normal = np.array([-math.sin(tilt), 0, math.cos(tilt)])
    away = now.position[0] - [-0.1, 0, 0]
    assert away @ normal == pytest.approx(R, abs=2e-4)
    assert now.velocity[0] @ normal == pytest.approx(rate * (away @ along), rel=0.05)


@pytest.mark.parametrize("wall", ["plane", "mesh", "disc"])
def test_a_wall_is_removed_at_its_time(wall):
    kinds = {
        "plane": Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1), removed_at=0.1),
        "mesh": floor_mesh(removed_at=0.1),
        "disc": Disc(material="rigid", centre=(0, 0, 0), radius=0.05, removed_at=0.1),
    }
    simulation = Simulation(
        scene(ball([0, 0, R]), walls=[kinds[wall]], law=effects(0.3, gravity=GRAVITY), time_step=5e-5)
    )
    simulation.run(0.1)
    mass = SOFT.density * 4 / 3 * math.pi * R**3
    sunk = (mass * 9.81 / (4 / 3 * effective_modulus(SOFT) * math.sqrt(R))) ** (2 / 3)
    assert simulation.snapshot().position[0, 2] == pytest.approx(R - sunk, abs=1e-7)
    simulation.run(0.1)
    assert simulation.snapshot().velocity[0, 2] == pytest.approx(-0.981, rel=2e-3)


def test_a_fast_ball_finds_every_wall_in_time():
    """A ball that crosses its skin within few steps is still seen by mesh and plane (no late candidates)."""
    mesh = floor_mesh()
    for wall in (mesh, FLOOR):
        worlds = [
            scene(ball([x, x / 2, 0.1], velocity=(0, 0, -5.0)), walls=[wall], time_step=5e-6, skin=skin, domain=BOX)
            for x in (0.0, 0.01, 0.033)
            for skin in (1e-5, 1e-3)
        ]
        simulation = Simulation(worlds)
        taken = frames(simulation, 5000, every=1000)
        for now in taken[-1]:
            assert now.velocity[0, 2] == pytest.approx(5.0, rel=1e-3)
