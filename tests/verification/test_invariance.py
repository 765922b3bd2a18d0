"""What must not matter: the observer, the order of grains, other worlds, cuts in a run, reading, and list rebuilds."""

import dataclasses

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.materials import MaterialPair
from taichidem.simulation import Simulation
from taichidem.walls import Plane
from tests.apparatus import FLOOR, SOFT, ball, effects, scene

STATE = ("position", "velocity", "spin", "force", "torque")
LAW = {"restitution": 0.7, "friction": 0.5, "rolling": 0.1}


def heap(seed=0, n=24, spread=0.035, radii=(0.008, 0.012)):
    """Return spheres of several sizes that fly into each other."""
    rng = np.random.default_rng(seed)
    position, radius = [], []
    while len(radius) < n:
        r = rng.uniform(*radii)
        x = rng.uniform(-spread, spread, 3)
        if all(np.linalg.norm(x - p) > r + q + 1e-4 for p, q in zip(position, radius, strict=True)):
            position.append(x)
            radius.append(r)
    position, radius = np.array(position), np.array(radius)
    velocity = -position / spread + rng.normal(0, 0.2, (n, 3))
    return Bodies.spheres(position, radius, SOFT.density, velocity=velocity, spin=rng.normal(0, 20, (n, 3)))


def world(bodies, walls=(), **options):
    gravity = options.pop("gravity", (0, 0, 0))
    return scene(
        bodies, walls=walls, law=effects(gravity=gravity, **LAW), time_step=options.pop("time_step", 2e-5), **options
    )


def final(scenes, steps, pieces=1):
    """Return the snapshots of all worlds after so many steps."""
    simulation = Simulation(scenes)
    for _ in range(pieces):
        simulation.run_steps(steps // pieces)
    simulation.check()
    return [simulation.snapshot(k) for k in range(len(simulation))]


def same_bits(one, two):
    return all(np.array_equal(getattr(one, name), getattr(two, name)) for name in STATE)


def collided(snapshot, bodies):
    return np.abs(snapshot.velocity - bodies.velocity).max() > 0.3


def moved(bodies, **changes):
    return dataclasses.replace(bodies, **changes)


def test_galilean():
    """A common velocity changes no force; the walls fly along."""
    bodies = heap()
    drift = np.array([0.3, -0.2, 0.1])
    still, flying = final([world(bodies), world(moved(bodies, velocity=bodies.velocity + drift))], 1500)
    assert collided(still, bodies)
    assert flying.velocity - drift == pytest.approx(still.velocity, abs=1e-9)
    assert flying.position - drift * flying.time == pytest.approx(still.position, abs=1e-11)
    assert flying.spin == pytest.approx(still.spin, abs=1e-7)


def rotation(seed):
    matrix, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return matrix * np.sign(np.linalg.det(matrix))


@pytest.mark.parametrize("seed", range(3))
def test_rotation(seed):
    """The whole scene turned, gravity and floor too: the same result, turned."""
    matrix = rotation(seed)
    bodies = heap()
    pull = np.array([1.0, 0.5, -9.81])
    low = np.array([0, 0, -0.05])
    plain = world(bodies, [Plane(material="rigid", point=tuple(low), normal=(0, 0, 1))], gravity=tuple(pull))
    floor = Plane(material="rigid", point=tuple(matrix @ low), normal=tuple(matrix @ [0, 0, 1]))
    vectors = {n: getattr(bodies, n) @ matrix.T for n in ("position", "velocity", "spin")}
    turned = world(moved(bodies, **vectors), [floor], gravity=tuple(matrix @ pull))
    one, two = final([plain, turned], 1500)
    assert collided(one, bodies)
    assert two.position == pytest.approx(one.position @ matrix.T, abs=1e-10)
    assert two.velocity == pytest.approx(one.velocity @ matrix.T, abs=1e-8)
    assert two.spin == pytest.approx(one.spin @ matrix.T, abs=1e-6)


def test_translation():
    bodies = heap()
    shift = np.array([1.234, -0.567, 2.5])
    one, two = final([world(bodies), world(moved(bodies, position=bodies.position + shift))], 1500)
    assert two.position - shift == pytest.approx(one.position, abs=1e-9)
    assert two.velocity == pytest.approx(one.velocity, abs=1e-7)


def permuted(bodies, order):
    held = {f.name: getattr(bodies, f.name) for f in dataclasses.fields(bodies) if f.name != "element_body"}
    arrays = {name: array[order] for name, array in held.items() if array is not None}
    return dataclasses.replace(bodies, **arrays)


@pytest.mark.parametrize("seed", range(3))
def test_permutation(seed):
    """Forces of the first steps to round-off, and the trajectory through many collisions to 1e-12 of its size."""
    bodies = heap()
    order = np.random.default_rng(seed).permutation(len(bodies))
    one, two = final([world(bodies), world(permuted(bodies, order))], 400)
    assert collided(one, bodies)
    assert two.position == pytest.approx(one.position[order], abs=1e-12 * 0.035)
    assert two.velocity == pytest.approx(one.velocity[order], abs=1e-12 * 1e2)


def test_swapping_the_two_of_a_pair():
    """Unequal spheres, in either order: the same motion."""
    radii = np.array([0.01, 0.002])
    position = np.array([[0, 0, 0], [0.0119, 0.001, 0.0005]])
    velocity = np.array([[0, 0, 0], [-1.0, 0.6, 0.1]])
    spin = np.array([[5.0, 1, 7], [30, -20, 10]])
    bodies = Bodies.spheres(position, radii, SOFT.density, velocity=velocity, spin=spin)
    one, two = final([world(bodies, time_step=2e-6), world(permuted(bodies, [1, 0]), time_step=2e-6)], 2000)
    assert collided(one, bodies)
    for name in STATE:
        a, b = getattr(one, name), getattr(two, name)[::-1]
        assert b == pytest.approx(a, abs=1e-12 * max(1.0, np.abs(a).max()))


def test_a_world_among_others_equals_itself_alone():
    """Ragged sizes, different steps, lengths and walls; bitwise, also for the world that stops early."""
    scenes = [
        world(heap(0, 24)),
        world(heap(1, 3), [FLOOR], gravity=(0, 0, -9.81), time_step=1e-5),
        world(heap(2, 11), room=20, time_step=1.7e-5, skin=1e-4),
        world(heap(3, 1), [FLOOR], gravity=(0, 0, -9.81)),
        world(heap(4, 40, 0.05)),
    ]
    durations = [0.02, 0.01, 0.03, 0.005, 0.0]

    def run(which):
        simulation = Simulation([scenes[k] for k in which])
        simulation.run([durations[k] for k in which])
        simulation.run_steps(100)
        return [simulation.snapshot(k) for k in range(len(which))]

    together = run(range(5))
    turned_round = run([4, 3, 2, 1, 0])
    for k in range(5):
        (alone,) = run([k])
        assert alone.time == together[k].time
        assert same_bits(alone, together[k])
        assert same_bits(alone, turned_round[4 - k])


@pytest.mark.parametrize("pieces", [2, 7, 100])
def test_a_run_cut_into_pieces_equals_an_uncut_one(pieces):
    bodies = heap()
    options = {"walls": [FLOOR], "gravity": (0, 0, -9.81), "skin": 5e-4}
    bodies = moved(bodies, position=bodies.position + [0, 0, 0.06])
    (whole,) = final([world(bodies, **options)], 1400)
    (cut,) = final([world(bodies, **options)], 1400, pieces)
    assert collided(whole, bodies)
    assert whole.rebuilds > 10
    assert same_bits(whole, cut)


def test_reading_does_not_change_the_trajectory():
    bodies = heap()
    (unread,) = final([world(bodies)], 1000, 20)
    simulation = Simulation([world(bodies)])
    for _ in range(20):
        simulation.run_steps(50)
        for _ in range(3):
            simulation.snapshot()
            simulation.kinetic_energy()
            simulation.failure()
            simulation.time()
    assert same_bits(unread, simulation.snapshot())


def test_the_same_scene_twice_gives_the_same_bits():
    """Also in an engine that held something else meanwhile: nothing of the old scene is left behind."""
    bodies = heap()
    (first,) = final([world(bodies)], 800)
    final([world(heap(9, 60, 0.06), gravity=(0, 0, -9.81))] * 3, 300)
    (second,) = final([world(bodies)], 800)
    assert same_bits(first, second)


@pytest.mark.parametrize("sides", ["sphere on plane", "spheres"])
def test_rebuilding_the_lists_keeps_contact_memory(sides):
    """Sticking, sliding and rolling contacts through hundreds of rebuilds equal those of one list."""
    if sides == "sphere on plane":
        bodies = ball(
            [[0, 0, 0.00998], [0.03, 0.001, 0.00999]],
            velocity=[[0.3, 0.1, 0], [0.02, 0, 0]],
            spin=[[0, 0, 0], [0, 2, 9]],
        )
        walls = [FLOOR]
    else:
        # A row of three between two walls, and one dragged over it: the sort order of the pair changes on its way.
        bodies = ball(
            [[0.02 * k, 0, 0.00998] for k in range(5)] + [[0.01, 0.001, 0.0272]],
            velocity=[[0, 0, 0]] * 5 + [[0.3, 0.02, 0]],
            spin=[[0, 0, 0]] * 5 + [[0, 3, 5]],
        )
        walls = [
            FLOOR,
            Plane(material="rigid", point=(-0.0099, 0, 0), normal=(1, 0, 0)),
            Plane(material="rigid", point=(0.0899, 0, 0), normal=(-1, 0, 0)),
        ]
    options = {"walls": walls, "gravity": (0.5, 0.2, -9.81), "time_step": 2e-5}
    tight, loose = final([world(bodies, skin=2e-6, **options), world(bodies, skin=0.1, **options)], 6000)
    assert tight.rebuilds > 500
    assert loose.rebuilds < 5
    scale = np.abs(loose.velocity).max()
    assert np.abs(loose.torque).max() > 0
    assert tight.position == pytest.approx(loose.position, abs=1e-9)
    assert tight.velocity == pytest.approx(loose.velocity, abs=1e-6 * max(scale, 1.0))
    assert tight.force == pytest.approx(loose.force, abs=1e-6)


def test_rebuilding_while_the_sides_swap():
    """Pairs that fly through many cells while they touch: the leading grain changes places in the lists at each.

    The pair is then listed from its other side, where tangential force and rolling couple have the opposite sign. The
    same pairs at rest in the middle of a cell are never listed anew and are what the flying ones must agree with.
    """
    worlds = []
    for order in ([0, 1], [1, 0]):
        bodies = ball(
            np.array([[0.0008, 0, 0], [-0.0190, 0.0020, 0.001]])[order],
            velocity=np.array([[-0.4, 0.3, 0.1], [0, 0, 0]])[order],
            spin=np.array([[3.0, 5, 40.0], [0, -4, 20.0]])[order],
        )
        for drift in ([0, 0, 0], [20.0, 0, 0], [0, -20.0, 0], [12.0, 13.0, 14.0]):
            flying = moved(bodies, velocity=bodies.velocity + drift)
            options = {"time_step": 2e-6, "domain": ((-1, -1, -1), (1, 1, 1)), "skin": 1e-3}
            worlds.append(world(flying, **options))
    for steps in (1000, 2000, 5000):
        taken = final(worlds, steps)
        for k, now in enumerate(taken):
            still = taken[k - k % 4]
            first = worlds[k].bodies.velocity - worlds[k - k % 4].bodies.velocity
            assert now.velocity - first == pytest.approx(still.velocity, abs=1e-9)
            assert now.spin == pytest.approx(still.spin, abs=1e-7)
            assert now.force == pytest.approx(still.force, abs=1e-5 * max(1.0, np.abs(still.force).max()))
            if k % 4:
                assert now.rebuilds > 10
        if steps == 1000:
            assert np.abs(taken[0].torque).max() > 1e-3


def test_neighbour_lists_against_all_pairs():
    """Forces of a dense random packing, against a sum over all pairs written here."""
    rng = np.random.default_rng(5)
    n = 400
    radius = rng.uniform(0.004, 0.01, n)
    # a packing that overlaps slightly everywhere: points on a jittered grid
    side = 8
    grid = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:n]
    position = (grid - side / 2) * 0.0165 + rng.uniform(-0.0015, 0.0015, (n, 3))
    bodies = Bodies.spheres(position, radius, SOFT.density)
    modulus = MaterialPair(SOFT, SOFT).youngs_modulus
    expected = np.zeros((n, 3))
    touching = 0
    for i in range(n):
        apart = position[i] - position
        distance = np.linalg.norm(apart, axis=1)
        overlap = radius[i] + radius - distance
        overlap[i] = 0
        hit = overlap > 0
        touching += hit.sum()
        reduced = radius[i] * radius[hit] / (radius[i] + radius[hit])
        size = 4 / 3 * modulus * np.sqrt(reduced) * overlap[hit] ** 1.5
        expected[i] = ((size / distance[hit])[:, None] * apart[hit]).sum(0)
    assert touching > 200
    # Domains of other sizes give other grids of cells: one cell, a few, many, and bodies at its very border.
    tight = (tuple(position.min(0) - 1e-6), tuple(position.max(0) + 1e-6))
    for domain in (tight, ((-0.1, -0.1, -0.1), (0.1, 0.2, 0.4)), ((-9, -9, -9), (9, 9, 9))):
        simulation = Simulation(scene(bodies, walls=(), domain=domain, law=effects(**LAW), time_step=1e-9, partners=40))
        simulation.run_steps(1)
        now = simulation.snapshot()
        assert now.left == 0
        assert now.force == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())
