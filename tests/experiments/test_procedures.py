"""What each experiment does and when, by the numbers of the bench's protocol written out: d = 6 mm, R = 3 mm."""

from __future__ import annotations

import math

import numpy as np
import pytest

from taichidem.experiments import (
    BulkDensity,
    FixedFunnel,
    FreeFall,
    HopperDischarge,
    Ledge,
    LiftingCylinder,
    Rebound,
    RollingBall,
    RotatingDrum,
    ShearBox,
)
from taichidem.experiments.base import Experiment
from tests.experiments.planted import granules
from tests.experiments.still import play_still

R = 0.003


def rained(played, number, speed):
    """Return the centres of the grains of a rain that came at once, at the start, in a number and at a speed [m/s]."""
    (act,) = played.told("insert")
    assert act.time == 0
    assert act.bodies.position.shape == (number, 3)
    assert np.array_equal(act.bodies.velocity, np.tile([0.0, 0.0, -speed], (number, 1)))
    return act.bodies.position


def assert_fills(values, low, high):
    """Hold that values reach from low to high [m], short of each by at most 1 % of the range or half a millimetre."""
    short = max(0.01 * (high - low), 0.0005)
    assert low - 1e-12 <= values.min() < low + short
    assert high - short < values.max() <= high + 1e-12


def test_ledge():
    played = play_still(Ledge())
    x, y, z = rained(played, 800, 0.3).T
    assert_fills(x, 0.006 + R, 0.114 - R)
    assert_fills(y, 0.006 + R, 0.030 - R)
    assert_fills(z, 0.006 + R, 0.282 - R)
    (opened,) = played.told("remove", "move")
    assert (opened.name, opened.wall) == ("remove", "front")
    assert opened.time == pytest.approx(1.0)
    assert played.end == pytest.approx(3.0)


def test_bulk_density():
    played = play_still(BulkDensity())
    x, y, z = rained(played, 1184, 0.3).T
    assert np.hypot(x, y).max() == pytest.approx(0.030 - R, rel=0.01)
    assert np.hypot(x, y).max() <= 0.030 - R
    assert_fills(z, 0.006 + R, 0.174 - R)
    assert len(played.acts) == 1
    assert played.end == pytest.approx(1.2)


def test_fixed_funnel():
    played = play_still(FixedFunnel(), grains_vanish=True)
    batches = played.told("insert")
    assert len(batches) == len(played.acts) == 38
    assert [len(batch.bodies.mass) for batch in batches] == [24] * 37 + [12]  # 400 a second, every 0.06 s, 900 in all
    assert [batch.time for batch in batches] == pytest.approx([0.06 * k for k in range(38)])
    x, y, z = np.concatenate([batch.bodies.position for batch in batches]).T
    assert np.hypot(x, y).max() == pytest.approx(0.015 - R, rel=0.01)
    assert np.hypot(x, y).max() <= 0.015 - R
    assert_fills(z, 0.096 + R, 0.180 - R)
    for batch in batches:
        assert np.array_equal(batch.bodies.velocity, np.tile([0.0, 0.0, -0.5], (len(batch.bodies.mass), 1)))
    assert played.end == pytest.approx(37 * 0.06 + 1.3)


def test_hopper_discharge():
    played = play_still(HopperDischarge())
    x, y, z = rained(played, 1000, 0.3).T
    cone = (0.048 - 0.018) / math.tan(math.radians(30))
    assert np.hypot(x, y).max() == pytest.approx(0.042 - R, rel=0.01)
    assert np.hypot(x, y).max() <= 0.042 - R
    assert_fills(z, cone + R, cone + 0.114 - R)
    (opened,) = played.told("remove", "move")
    assert (opened.name, opened.wall) == ("remove", "slide")
    assert opened.time == pytest.approx(0.9)
    assert played.record["time"] == pytest.approx([0.9 + 0.01 * k for k in range(301)])
    assert played.record["count"] == [1000] * 301
    assert played.end == pytest.approx(3.9)


def test_a_hopper_that_runs_empty_is_not_watched_further():
    played = play_still(HopperDischarge(), grains_vanish=True)
    assert played.record["count"] == [0, 0]


def test_rotating_drum():
    played = play_still(RotatingDrum())
    x, y, z = rained(played, 671, 0.1).T
    assert_fills(x, -0.04896 + R, 0.04896 - R)
    assert_fills(y, 0.0036 + R, 0.0324 - R)
    assert_fills(z, -0.04896 + R, 0.04896 - R)
    turned = played.told("remove", "move")
    assert [act.wall for act in turned] == ["drum", "near end", "far end"]
    for act in turned:
        assert act.time == pytest.approx(0.6)
        assert act.changes == {"spin": pytest.approx((0.0, 2 * math.pi * 6 / 60, 0.0))}
    assert len(played.record["frame"]) == 40
    assert np.array_equal(played.record["frame"][0], np.column_stack([x, z]))
    assert played.looks[-40:] == pytest.approx([2.15 + 0.05 * k for k in range(40)])
    assert played.end == pytest.approx(0.6 + 1.5 + 2.0)


def test_rebound():
    experiment = Rebound(speed=2.0)
    scene = experiment.scene(granules())
    assert scene.bodies.position == pytest.approx(np.array([[0.0, 0.0, R + 0.05 * R]]))
    assert scene.bodies.velocity == pytest.approx(np.array([[0.0, 0.0, -2.0]]))
    assert scene.bodies.radius == pytest.approx([R])
    crossing = 0.05 * R / 2.0
    assert play_still(experiment).end == pytest.approx(crossing * 101 + 100 * scene.rayleigh_time(), rel=0.02)


def test_free_fall():
    experiment = FreeFall(time="0.5 s, 0.2 s", release_height=3.0, release_speed=1.5)
    scene = experiment.scene(granules())
    assert scene.bodies.position == pytest.approx(np.array([[0.0, 0.0, 3.0 + R]]))
    assert scene.bodies.velocity == pytest.approx(np.array([[0.0, 0.0, -1.5]]))
    played = play_still(experiment)
    assert played.record["time"] == [0.2, 0.5]
    assert played.record["height"] == pytest.approx([3.0, 3.0])
    assert played.end == pytest.approx(0.5)


def test_rolling_ball():
    experiment = RollingBall(speed=0.2, time=0.7)
    scene = experiment.scene(granules())
    assert scene.bodies.position == pytest.approx(np.array([[0.0, 0.0, R]]))
    assert scene.bodies.velocity == pytest.approx(np.array([[0.2, 0.0, 0.0]]))
    assert scene.bodies.spin == pytest.approx(np.array([[0.0, 0.2 / R, 0.0]]))
    assert play_still(experiment).end == pytest.approx(0.7)


def test_lifting_cylinder():
    played = play_still(LiftingCylinder())
    x, y, z = rained(played, 600, 0.3).T
    assert np.hypot(x, y).max() == pytest.approx(0.024 - R, rel=0.01)
    assert np.hypot(x, y).max() <= 0.024 - R
    top = 0.006 + 600 * 4 / 3 * math.pi * R**3 / (0.15 * math.pi * 0.024**2) + 0.006
    assert_fills(z, 0.006 + R, top - R)
    lifted, stopped = played.told("remove", "move")
    assert (lifted.wall, lifted.changes) == ("tube", {"velocity": (0.0, 0.0, 0.05)})
    assert (stopped.wall, stopped.changes) == ("tube", {"velocity": (0.0, 0.0, 0.0)})
    assert lifted.time == pytest.approx(0.7)
    assert stopped.time - lifted.time == pytest.approx((z.max() + R) / 0.05)
    assert played.end - stopped.time == pytest.approx(0.6)


def test_shear_box():
    played = play_still(ShearBox(normal_stresses=2000.0))
    x, y, z = rained(played, 900, 0.3).T
    top = 0.006 + 900 * 4 / 3 * math.pi * R**3 / (0.15 * 0.06 * 0.06) + 0.006
    assert_fills(x, 0.0006 + R, 0.0594 - R)
    assert_fills(y, 0.0006 + R, 0.0594 - R)
    assert_fills(z, 0.0006 + R, top - R)
    lowered, loaded, sheared = played.told("remove", "move")
    assert [act.wall for act in (lowered, loaded, sheared)] == ["lid", "lid", "lower half"]
    assert [act.time for act in (lowered, loaded, sheared)] == pytest.approx([0.6, 0.8, 1.1])
    assert 0.2 * lowered.changes["velocity"][2] == pytest.approx(z.max() + R - (top + 0.006))  # down onto the grains
    assert loaded.changes["velocity"] == (0.0, 0.0, 0.0)
    assert loaded.changes["load"] == pytest.approx((0.0, 0.0, -2000.0 * 0.06 * 0.06))
    assert loaded.changes["mass"] == pytest.approx(900 * 910.0 * 4 / 3 * math.pi * R**3)
    assert sheared.changes == {"velocity": (0.02, 0.0, 0.0)}
    assert played.record["displacement"] == pytest.approx(np.linspace(0.009 / 500, 0.009, 500))
    assert played.end == pytest.approx(1.1 + 0.45)


@pytest.mark.parametrize(("method", "given"), [("scene", 1), ("procedure", 2), ("measure", 2)])
def test_an_experiment_that_lacks_a_method_says_which(method, given):
    class Halfway(FixedFunnel):
        pass

    with pytest.raises(NotImplementedError, match=f"Halfway must define {method}"):
        getattr(Experiment, method)(Halfway(), *[None] * given)
