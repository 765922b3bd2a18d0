"""No liquid is lost or made: grains and bridges together hold what was given, whatever happens to grains and walls."""

import math

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.effects import BodyGravity, LiquidBridge, NormalHertz, TangentialMindlin
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from taichidem.walls import Disc, Mesh, Plane
from tests.apparatus import SOFT, ball, scene
from tests.verification import test_schedules as two_ways

FRACTION = 0.03
SMALL = ((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))
ROUND_OFF = 1e-13  # of the liquid there is, after thousands of exchanges


def wet(**values):
    given = {"surface_tension": 0.05, "liquid_fraction": FRACTION, "contact_angle": 20.0, "viscosity": 0.002}
    return LiquidBridge(**{**given, **values})


def bridges(simulation, world=0):
    """Return the volumes [m³] of the living bridges of a world, by slot."""
    engine = simulation._engine
    row = engine.access["worlds"].read(world)
    mine = slice(int(row["slot_base"]), int(row["slot_base"] + row["slots"]))
    (past,) = [b.past for b in engine.law.contact_bound if b.effect.carries]
    volume = past.volume.to_numpy()[mine]
    alive = (engine.state.slots.stamp.to_numpy()[mine] == row["evaluation"]) & (volume > 0)
    return volume[alive]


def held(simulation, world=0):
    return simulation.snapshot(world).carried.sum() + bridges(simulation, world).sum()


def film(radius):
    return FRACTION * 4 / 3 * math.pi * np.asarray(radius) ** 3


def box_of(make, seed, forms="touch", room=0):
    """Return a lively wet crowd between a folded mesh, planes and a turning disc."""
    law = [NormalHertz(restitution=0.9), TangentialMindlin(static_friction=0.3), BodyGravity(), wet(forms=forms)]
    return Scene(
        model=Model((two_ways.GRAIN, two_ways.WALL), law),
        walls=[*two_ways.walls(), Plane(material="wall", point=(0.05, 0, 0), normal=(-1, 0, 0))],
        bodies=make(seed),
        domain=((-0.01, -0.01, -0.01), (0.07, 0.06, 0.1)),
        grain_materials=("grain",),
        skin=4e-4,
        room=room,
    )


@pytest.mark.parametrize(("make", "forms"), [(two_ways.spheres, "reach"), (two_ways.dumbbells, "touch")])
def test_liquid_is_kept_in_both_schedules_with_the_same_bits(make, forms):
    scenes = [box_of(make, seed, forms, room=400) for seed in (1, 2)]
    late = ball([[0.025, 0.025, 0.095], [0.035, 0.025, 0.095]], scenes[0].largest_radius, two_ways.GRAIN)
    found = []
    for schedule, pieces in (("worlds", (200, 400)), ("particles", (200, 150, 250))):
        simulation = Simulation(scenes, schedule=schedule)
        first = [held(simulation, k) for k in range(2)]
        assert first[0] == pytest.approx(film(scenes[0].bodies.radius).sum(), rel=1e-14)
        for number, piece in enumerate(pieces):
            simulation.run_steps(piece)
            simulation.check()
            if number == 0:
                simulation.insert(late, world=1)
                first[1] += film(late.radius).sum()
            for k in range(2):
                now = simulation.snapshot(k)
                assert now.left == 0
                assert held(simulation, k) == pytest.approx(first[k], rel=ROUND_OFF)
        ends = [simulation.snapshot(k) for k in range(2)]
        assert all(now.rebuilds > 5 for now in ends)
        assert len(bridges(simulation, 0)) > 10
        found.append([(now, np.sort(bridges(simulation, k))) for k, now in enumerate(ends)])
    for (one, first_bridges), (two, second_bridges) in zip(*found, strict=True):
        assert np.array_equal(first_bridges, second_bridges)
        for column in (*two_ways.COLUMNS, "carried"):
            assert np.array_equal(getattr(one, column), getattr(two, column)), column


def test_a_world_among_others_equals_the_same_alone():
    scenes = [box_of(two_ways.spheres, seed, "reach", room=400) for seed in (3, 4)]
    together = Simulation(scenes)
    together.run_steps(300)
    one, drops = together.snapshot(1), bridges(together, 1)
    alone = Simulation(scenes[1])
    alone.run_steps(300)
    two = alone.snapshot()
    assert len(drops) > 10
    assert np.array_equal(drops, bridges(alone))
    for column in (*two_ways.COLUMNS, "carried"):
        assert np.array_equal(getattr(one, column), getattr(two, column)), column


def test_thousands_of_bridges_come_and_go():
    """A wet gas of grains of three sizes in a box: every exchange shows in `carried`."""
    rng = np.random.default_rng(1)
    side = 0.026 * np.arange(6)
    x = 0.013 + np.stack(np.meshgrid(side, side, side, indexing="ij"), -1).reshape(-1, 3)
    radius = rng.choice([0.005, 0.008, 0.010], len(x))
    grains = ball(x, radius, velocity=rng.normal(0, 0.7, x.shape))
    planes = [
        Plane(material="rigid", point=tuple(0.156 * (sign < 0) * np.eye(3)[k]), normal=tuple(sign * np.eye(3)[k]))
        for k in range(3)
        for sign in (1, -1)
    ]
    law = [NormalHertz(restitution=1.0), wet(surface_tension=0.02, viscosity=0.0, bridge_share=0.3)]
    simulation = Simulation(scene(grains, walls=planes, law=law, time_step=2e-5))
    total, before, changes = film(radius).sum(), simulation.snapshot().carried, 0
    for _ in range(160):
        simulation.run_steps(75)
        now = simulation.snapshot().carried
        changes += int(np.sum(now != before))
        before = now
        assert held(simulation) == pytest.approx(total, rel=ROUND_OFF)
    simulation.check()
    assert changes > 4000
    assert simulation.snapshot().rebuilds > 50


@pytest.mark.parametrize("schedule", ["worlds", "particles"])
@pytest.mark.parametrize("speed", [2.0, 3.0])
def test_grains_that_outrun_thin_lists_keep_their_liquid(schedule, speed):
    """Apart by more than the skin in one step: no list holds the pair, and the bridge's liquid goes back all the same."""
    grains = ball([[-0.0101, 0, 0], [0.0101, 0, 0]], velocity=[[speed, 0, 0], [-speed, 0, 0]])
    law = [NormalHertz(restitution=0.9), wet(surface_tension=1e-6, viscosity=0.0)]
    simulation = Simulation(scene(grains, walls=(), law=law, skin=1e-5), schedule)
    first = held(simulation)
    formed = 0
    for _ in range(120):
        simulation.run_steps(1)
        simulation.check()
        formed = max(formed, len(bridges(simulation)))
        assert held(simulation) == pytest.approx(first, rel=ROUND_OFF)
    assert formed == 1
    assert len(bridges(simulation)) == 0
    assert simulation.snapshot().carried.sum() == pytest.approx(first, rel=ROUND_OFF)


def flat_mesh(size=0.1, pieces=5):
    """Return a floor of many coplanar triangles."""
    line = np.linspace(-size, size, pieces + 1)
    vertices = [(x, y, 0.0) for x in line for y in line]
    n = pieces + 1
    corners = [i * n + j for i in range(pieces) for j in range(pieces)]
    facets = [f for k in corners for f in ((k, k + n, k + n + 1), (k, k + n + 1, k + 1))]
    return Mesh(material="rigid", vertices=np.array(vertices), facets=np.array(facets))


def test_a_flat_mesh_has_one_bridge_with_a_grain():
    """Falling on it, then rolling over edges and corners of coplanar facets, as on a plane."""
    law = [NormalHertz(restitution=0.8), TangentialMindlin(static_friction=0.4), BodyGravity(), wet()]
    grains = ball([[-0.08, -0.0371, 0.0102]], velocity=(1.0, 0.31, 0.0))
    floors = (flat_mesh(), Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1)))
    simulation = Simulation([scene(grains, walls=[wall], law=law, time_step=1e-5) for wall in floors])
    for _ in range(60):
        simulation.run(0.002)
        for k in range(2):
            assert len(bridges(simulation, k)) == (1 if simulation.time() > 0.007 else 0)
            assert held(simulation, k) == pytest.approx(film(0.01), rel=1e-14)
    ends = [simulation.snapshot(k) for k in range(2)]
    assert ends[0].position[0, 0] > 0.01
    assert ends[0].rebuilds > 5
    assert ends[0].position == pytest.approx(ends[1].position, abs=1e-9)
    assert ends[0].carried == pytest.approx(film(0.01) * 5 / 6)


def test_over_the_edge_of_a_table():
    """Face, edge, and away: what the face held is given back when the grain passes on, and nothing is lost."""
    square = np.array([(-0.1, -0.1, 0), (0, -0.1, 0), (0, 0.1, 0), (-0.1, 0.1, 0.0)])
    table = Mesh(material="rigid", vertices=square, facets=np.array([(0, 1, 2), (0, 2, 3)]))
    law = [NormalHertz(restitution=0.3), TangentialMindlin(static_friction=0.4), BodyGravity(), wet()]
    speeds = (0.05, 0.3, 1.0, 3.0)
    scenes = [
        scene(ball([[-0.02, 0, 0.00999]], velocity=(v, 0, 0)), walls=[table], law=law, time_step=1e-5) for v in speeds
    ]
    simulation = Simulation(scenes)
    counts = []
    for _ in range(60):
        simulation.run([0.0005 / v + 0.005 for v in speeds])
        counts.append([len(bridges(simulation, k)) for k in range(4)])
        for k in range(4):
            assert held(simulation, k) == pytest.approx(film(0.01), rel=1e-14)
    assert np.all(np.array(counts).max(axis=0) == 1)
    assert counts[-1] == [0] * 4  # all have fallen off
    assert [simulation.snapshot(k).carried[0] for k in range(4)] == pytest.approx([film(0.01)] * 4, rel=1e-14)


@pytest.mark.parametrize("by_hand", [False, True])
def test_a_wall_that_is_taken_away_gives_all_back(by_hand):
    """At any step, also where the lists are rebuilt in the same one."""
    law = [NormalHertz(restitution=0.3), BodyGravity(), wet()]
    grains = ball([[x, y, 0.00999] for x in (-0.015, 0.015) for y in (-0.015, 0.015)], velocity=(0.3, 0.0, 0.0))
    step = 1e-5
    times = step * np.arange(40, 60)

    def case(time):
        gate = Disc(
            material="rigid", centre=(0, 0, 0), radius=0.1, name="gate", removed_at=math.inf if by_hand else time
        )
        # With so thin a skin the lists are rebuilt every 17 steps or so.
        return scene(grains, walls=[gate], law=law, time_step=step, skin=1e-4)

    simulation = Simulation([case(t) for t in times])
    simulation.run(times - 2 * step)
    for k in range(len(times)):
        assert len(bridges(simulation, k)) == 4
    if by_hand:
        for k in range(len(times)):
            simulation.remove_wall("gate", world=k)
    simulation.run(3e-4)
    rebuilds = {simulation.snapshot(k).rebuilds for k in range(len(times))}
    assert max(rebuilds) > 3
    for k in range(len(times)):
        assert len(bridges(simulation, k)) == 0
        assert simulation.snapshot(k).carried == pytest.approx(film([0.01] * 4), rel=1e-14)


def test_a_bridge_survives_rebuilds_and_the_change_of_sides():
    """A pair held by its bridge flies and tumbles through many cells: the same bridge all the way, never formed anew."""
    gap, spin = 2e-4, 20.0
    middle, half = np.array([0.0, 0.0, 1.0]), 0.01 + gap / 2
    grains = ball(
        [middle - [half, 0, 0], middle + [half, 0, 0]], velocity=[[0.3, 0.2, -spin * half], [0.3, 0.2, spin * half]]
    )
    law = [NormalHertz(restitution=0.5), wet(forms="reach", viscosity=0.0, surface_tension=3.0)]
    near = (
        (-0.1, -0.1, 0.8),
        (0.2, 0.2, 1.2),
    )  # a small domain has small cells, so that the two change places in the lists
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=1e-5, skin=1e-3, domain=near))
    simulation.run_steps(1)
    taken = simulation.snapshot().carried
    assert taken == pytest.approx(film([0.01] * 2) * 5 / 6)
    sides = set()
    for _ in range(200):
        simulation.run_steps(200)
        now = simulation.snapshot()
        assert np.array_equal(now.carried, taken)
        assert len(bridges(simulation)) == 1
        engine = simulation._engine
        base = int(engine.access["worlds"].read(0)["body_base"])
        sides.add(int(engine.state.labels.identity.to_numpy()[base]))
    assert now.rebuilds > 100
    assert sides == {0, 1}  # either grain has been the owner of the pair


def test_a_film_that_is_asked_for_too_much_at_once_owes_the_rest():
    """Eight neighbours in one step, each taking a quarter: the film goes below zero, gives no more, and is paid back."""
    around = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) / math.sqrt(3)
    reach = 0.02 - 1e-7
    grains = ball(np.vstack([[0, 0, 0], reach * around]), velocity=np.vstack([[0, 0, 0], around]))
    law = [NormalHertz(restitution=0.5), wet(bridge_share=0.25, surface_tension=1e-4, viscosity=0.0)]
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=1e-5, room=10, domain=SMALL))
    simulation.run_steps(1)
    now = simulation.snapshot()
    assert now.carried[0] == pytest.approx(-film(0.01))
    assert held(simulation) == pytest.approx(9 * film(0.01), rel=1e-14)
    simulation.insert(
        ball([[0.0, 0.0, reach]], velocity=[[0, 0, 1.0]])
    )  # touches the one in the middle and four others
    simulation.run_steps(1)
    assert len(bridges(simulation)) == 13
    now = simulation.snapshot()
    assert now.carried[[0, 9]] == pytest.approx([-film(0.01), -film(0.01) / 4])
    simulation.run(0.01)
    now = simulation.snapshot()
    assert now.left == 0
    assert len(bridges(simulation)) == 0
    assert held(simulation) == pytest.approx(10 * film(0.01), rel=1e-12)
    assert np.all(now.carried > 0)


def test_the_liquid_goes_with_the_grain_that_leaves():
    """A grain that leaves the domain takes its film with it; the others keep theirs."""
    grains = ball([[0, 0, 0.0], [0.05, 0, 0]], velocity=[[0, 0, 0], [1.0, 0, 0]])
    law = [NormalHertz(restitution=0.5), wet()]
    simulation = Simulation(scene(grains, walls=(), law=law, room=10, domain=SMALL))
    simulation.run(0.1)
    now = simulation.snapshot()
    assert now.left == 1
    assert now.carried == pytest.approx([film(0.01)], rel=1e-15)


def test_what_moves_on_is_bodies_not_elements():
    """Two elements of one dumbbell draw on one film, and both bridges give back to it."""
    volume = 2 * 4 / 3 * math.pi * 1e-6
    dumbbell = Bodies(
        position=np.array([[0, 0, 0.01 - 1e-7]]),
        velocity=np.zeros((1, 3)),
        spin=np.zeros((1, 3)),
        orientation=np.array([[1.0, 0, 0, 0]]),
        mass=np.array([SOFT.density * volume]),
        inertia=np.array([[2e-6, 5e-6, 6e-6]]),
        radius=np.array([(3 * volume / (4 * math.pi)) ** (1 / 3)]),
        element_body=np.zeros(2, int),
        element_offset=np.array([[-0.015, 0, 0], [0.015, 0, 0]]),
        element_radius=np.full(2, 0.01),
        element_material=np.zeros(2, int),
    )
    floor = Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1), name="floor")
    law = [NormalHertz(restitution=0.5), BodyGravity(), wet()]
    simulation = Simulation(scene(dumbbell, walls=[floor], law=law, time_step=1e-5))
    assert simulation.snapshot().carried == pytest.approx([2 * film(0.01)])
    simulation.run_steps(20)
    assert bridges(simulation) == pytest.approx(2 * film([0.01] * 2) / 6)  # a sixth of what the dumbbell had, each
    assert simulation.snapshot().carried == pytest.approx([(2 - 4 / 6) * film(0.01)])
    simulation.remove_wall("floor")
    simulation.run_steps(1)
    assert len(bridges(simulation)) == 0
    assert simulation.snapshot().carried == pytest.approx([2 * film(0.01)], rel=1e-14)
