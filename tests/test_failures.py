"""A world that fails stops with its reason; the others go on and come out the same to the last bit."""

import numpy as np
import pytest

from taichidem.errors import SimulationError
from taichidem.simulation import Simulation
from tests.apparatus import FLOOR, ball, effects, scene

LAW = {"restitution": 0.5, "friction": 0.4, "rolling": 0.1, "gravity": (0, 0, -9.81)}


def well(n=4):
    grains = ball([[0.021 * k, 0.001 * k, 0.012 + 0.003 * k] for k in range(n)], velocity=(-0.5, 0, 0))
    return scene(grains, law=effects(**LAW))


def overlapping():
    return scene(ball([[0, 0, 0.05], [0.008, 0, 0.05]]), law=effects(**LAW))


def crashing():
    return scene(ball([0, 0, 0.05], velocity=(0, 0, -40.0)), law=effects(**LAW))


def racing():
    """More than its radius in a step: it could pass through anything."""
    return scene(ball([0, 0, 0.5], velocity=(0, 0, 9e3)), law=effects(**LAW), walls=())


def diverging():
    """A speed that overflows: the position is infinite after a step."""
    return scene(ball([0, 0, 0.5], velocity=(0, 1e308, 1e308)), law=effects(**LAW), walls=())


def crowded():
    grains = ball([[0.019 * a, 0.019 * b, 0.019 * c + 0.01] for a in range(5) for b in range(5) for c in range(5)])
    return scene(grains, law=effects(**LAW), partners=1.0)


BAD = {
    "overlaps": overlapping,
    "passed half": crashing,
    "moved more than its radius": racing,
    "diverged": diverging,
    "lists": crowded,
}


@pytest.mark.parametrize("reason", list(BAD))
def test_a_failing_world_stops_and_the_others_finish(reason):
    alone = Simulation([well(), well(2)])
    alone.run(0.1)
    expected = [alone.snapshot(k) for k in range(2)]

    simulation = Simulation([well(), BAD[reason](), well(2)])
    simulation.run(0.1)
    assert simulation.failure(0) is None
    assert simulation.failure(2) is None
    said = simulation.failure(1)
    assert reason in said
    assert "World 1" in said
    with pytest.raises(SimulationError, match=reason):
        simulation.check()
    stopped = simulation.time(1)
    assert stopped < 0.1 * 0.99
    for k, world in enumerate((0, 2)):
        now = simulation.snapshot(world)
        for name in ("position", "velocity", "spin", "force"):
            assert np.array_equal(getattr(now, name), getattr(expected[k], name))
    simulation.run(0.1)
    assert simulation.time(1) == stopped  # it stays where it stopped
    assert simulation.failure(1) == said


def test_overlap_is_judged_by_the_smaller_of_two():
    """A small grain swallowed by a large one is too far in, whichever comes first."""
    radii = np.array([0.02, 0.002])
    x = np.array([[0, 0, 0], [0.0185, 0, 0]])
    worlds = [scene(ball(x[order], radii[order]), walls=(), law=effects(**LAW)) for order in ([0, 1], [1, 0])]
    simulation = Simulation(worlds)
    simulation.run_steps(1)
    for k in range(2):
        assert "half a radius" in (simulation.failure(k) or "")


def test_a_grain_that_leaves_is_counted_and_the_rest_goes_on():
    grains = ball([[0, 0, 0.01], [0.3, 0, 0.5]], velocity=[[0, 0, 0], [5.0, 0, 0]])
    world = scene(grains, law=effects(**LAW), domain=((-1, -1, -1), (1, 1, 1)))
    simulation = Simulation(world)
    simulation.run(0.3)
    simulation.check()
    now = simulation.snapshot()
    assert now.left == 1
    assert now.identity.tolist() == [0]
    assert now.position[0, 2] == pytest.approx(0.01, abs=1e-4)


def test_an_engine_that_was_handed_on_says_so():
    first = Simulation(well())
    second = Simulation(well())
    second.run_steps(1)
    with pytest.raises(SimulationError, match="newer"):
        first.snapshot()


def test_no_output_is_ever_not_a_number():
    simulation = Simulation([well(), scene(ball([0, 0, 0.01]), walls=[FLOOR], law=effects(**LAW))])
    for _ in range(20):
        simulation.run_steps(50)
        for k in range(2):
            now = simulation.snapshot(k)
            for name in ("position", "velocity", "spin", "force", "torque", "orientation", "mass"):
                assert np.all(np.isfinite(getattr(now, name)))
            assert len(now.mass) == (4 if k == 0 else 1)
