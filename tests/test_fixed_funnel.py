"""The fixed-funnel experiment: its settings, its apparatus, and a small pour."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.repose_profile import ProfileSettings, measure_repose_profile
from analysis.repose_window import FitWindow
from taichidem.errors import EnvironmentProblem, InputError
from taichidem.experiments import FixedFunnel, fixed_funnel
from taichidem.experiments.base import Outcome
from taichidem.grains import Grains
from taichidem.heap_views import grains_on_base, measure_heap
from taichidem.library import PAPER_HEAP, polypropylene
from taichidem.procedure import World, play
from taichidem.simulation import Simulation, Snapshot
from taichidem.study import Run
from taichidem.study.execution import stored_run
from tests.analysis.conftest import cone_heap
from tests.experiments.planted import snapshot
from tests.small_heap import SMALL

SHARES: list[float] = []  # what the pour of `heaps` reported as done


@pytest.fixture(scope="module")
def heaps():
    """Two small heaps."""
    return FixedFunnel(**SMALL).run(polypropylene(), [1, 2], report=SHARES.append)


def test_defaults_are_the_heap_of_the_bench():
    s = FixedFunnel().settings
    assert (s.diameter, s.cup_radius, s.rim_height, s.particles) == (0.006, 0.042, 0.018, 900)
    assert (s.stream_radius, s.stream_bottom, s.stream_top, s.drop_velocity) == (0.015, 0.096, 0.18, 0.5)
    assert (s.stream_rate, s.batch_interval, s.settle_time, s.longest_settle_time) == (400.0, 0.06, 1.3, None)
    assert (s.method, s.fit_from, s.fit_to) == ("sectors", 0.15, 0.95)


def test_the_papers_heap():
    s = FixedFunnel(**PAPER_HEAP).settings
    assert (s.diameter, s.cup_radius, s.rim_height) == (0.006, 0.05, 0.03)
    assert (s.stream_radius, s.stream_bottom, s.stream_top, s.drop_velocity) == (0.015, 0.065, 0.105, 0.3)
    assert (s.particles, s.stream_rate, s.batch_interval, s.settle_time) == (2500, 600.0, 0.02, 0.6)
    assert (s.fit_from * s.cup_radius, s.fit_to * s.cup_radius) == pytest.approx((0.020, 0.046))


def test_settings_take_numbers_and_texts_with_units():
    s = FixedFunnel(diameter="6 mm", stream_rate="36000 1/minute", drop_velocity="30 cm/s", fit_from="0.15").settings
    assert s.diameter == pytest.approx(0.006)
    assert s.stream_rate == pytest.approx(600)
    assert s.drop_velocity == pytest.approx(0.3)
    assert s.fit_from == 0.15


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"cup_radus": 0.05}, r"Unknown setting of fixed_funnel 'cup_radus'\. Allowed: .*Did you mean 'cup_radius'\?"),
        ({"cup_radius": -1}, r"fixed_funnel\.cup_radius is -1\.0 \[m\]: Input should be greater than 0\."),
        ({"cup_radius": "50 kg"}, r"cup_radius is '50 kg'.* kilogram.*converts to m"),
        ({"particles": 0}, r"fixed_funnel\.particles is 0 .*greater than or equal to 1"),
        ({"stream_bottom": 0.01}, r"the stream must lie above the rim: rim_height < stream_bottom < stream_top"),
        ({"fit_from": 0.9, "fit_to": 0.5}, r"fit_from=0\.9, fit_to=0\.5\. Allowed: .*fit_to − fit_from ≥ 0\.15"),
        ({"fit_from": 0.5, "fit_to": 0.6}, r"fit_from=0\.5, fit_to=0\.6\. Allowed: .*fit_to − fit_from ≥ 0\.15"),
        ({"fit_from": 0.5, "fit_to": 1.3}, r"fit_from=0\.5, fit_to=1\.3\. Allowed: .*fit_to ≤ 1\.2"),
        ({"stream_radius": 0.06}, "stream_radius must not exceed cup_radius"),
        ({"method": "squares"}, r"fixed_funnel\.method is 'squares' .*'rings', 'sectors' or 'pictures'"),
    ],
)
def test_bad_settings_are_refused(settings, sentence):
    with pytest.raises(InputError, match=sentence):
        FixedFunnel(**settings)


@pytest.mark.parametrize("window", [(0.0, 0.15), (0.4, 1.2)])
def test_the_narrowest_and_the_widest_window_are_taken_and_measured(window):
    fit_from, fit_to = window
    heap = FixedFunnel(**PAPER_HEAP | {"fit_from": fit_from, "fit_to": fit_to, "method": "rings"})
    assert heap.measure(cone(30.0), {})[1]["profile"].window == FitWindow(fit_from, fit_to)


def test_bad_settings_that_need_the_model_are_refused():
    with pytest.raises(InputError, match=r"Unknown material 'steal'\. Allowed: polypropylene, steel\..*'steel'"):
        FixedFunnel(wall_material="steal").scene(polypropylene())
    with pytest.raises(InputError, match="less than three grains"):
        FixedFunnel(cup_radius=0.016, stream_radius=0.01).scene(polypropylene())
    with pytest.raises(InputError, match="2 models and 1 seeds"):
        FixedFunnel().run([polypropylene()] * 2, [1])
    with pytest.raises(InputError, match="0 seeds"):
        FixedFunnel().run(polypropylene(), [])


def test_a_pour_fills_the_cup_and_what_falls_off_leaves(heaps):
    for heap in heaps:
        assert heap.failure is None
        s = heap.snapshot
        assert np.all(np.isfinite(s.position))
        assert len(s.mass) + s.left == SMALL["particles"]
        assert s.left > 0
        in_cup = np.hypot(*s.position[:, :2].T) < SMALL["cup_radius"]
        assert heap.details["grains_in_cup"] == np.count_nonzero(in_cup & (s.position[:, 2] > 0)) > 400
        assert s.position[in_cup, 2].min() > 0.9 * s.radius[0]  # nothing sinks through the bottom
        assert 0 < heap.observables["angle_of_repose"] < 60


def test_it_ends_the_settling_time_after_the_last_batch():
    """40 grains at 400 a second in batches every 0.05 s: 20 at once, the others after one interval."""
    few = {"particles": 40, "stream_rate": 400.0, "batch_interval": 0.05, "cup_radius": 0.03, "settle_time": 0.11}
    funnel = FixedFunnel(**few)
    model = polypropylene()
    simulation = Simulation(funnel.scene(model))
    world = World(simulation, 0, np.random.default_rng(1))
    play(simulation, [funnel.procedure(world, model)], [world])
    assert world.time == pytest.approx(0.05 + 0.11, abs=2 * simulation.scenes[0].dt)

    later = FixedFunnel(**few, longest_settle_time=0.2)  # the grains still fly, so it waits as long as it may
    simulation = Simulation(later.scene(model))
    world = World(simulation, 0, np.random.default_rng(1))
    play(simulation, [later.procedure(world, model)], [world])
    assert world.time == pytest.approx(0.05 + 0.2, abs=2 * simulation.scenes[0].dt)


def test_the_seed_decides_the_heap_whether_alone_or_among_others(heaps):
    alone = FixedFunnel(**SMALL).run(polypropylene(), [2])[0]
    assert np.array_equal(alone.snapshot.position, heaps[1].snapshot.position)
    assert alone.observables == heaps[1].observables
    assert alone.observables != heaps[0].observables


@pytest.mark.usefixtures("heaps")
def test_progress_rises_to_the_end():
    assert sorted(SHARES) == SHARES
    assert SHARES[-1] == 1.0
    assert len(set(SHARES)) > 10


def cone(angle_deg: float) -> Snapshot:
    """Grains on the surface of a cone above a cup of the paper's size, packed densely."""
    grid = np.arange(-0.052, 0.052, 0.002)
    x, y = (axis.ravel() for axis in np.meshgrid(grid, grid))
    r = np.hypot(x, y)
    x, y, r = x[r < 0.05], y[r < 0.05], r[r < 0.05]
    z = 0.03 + (0.05 - r) * math.tan(math.radians(angle_deg))
    return snapshot(np.column_stack([x, y, z]), np.full(len(r), 0.003))


@pytest.mark.parametrize("angle", [15.0, 30.0, 40.0])
@pytest.mark.parametrize("method", ["rings", "sectors"])
def test_a_cone_of_known_slope_is_measured(angle, method):
    snapshot = cone(angle)
    observables, details = FixedFunnel(**{**PAPER_HEAP, "method": method}).measure(snapshot, {})
    assert observables["angle_of_repose"] == pytest.approx(angle, abs=1.0)
    direct = measure_repose_profile(
        snapshot.position, snapshot.radius, 0.05, ProfileSettings(method=method, fit_from=0.4, fit_to=0.92)
    )
    assert observables["angle_of_repose"] == direct.angle_deg
    assert details["grains_in_cup"] == len(snapshot.mass)


def test_pictures_measure_what_a_camera_would_see():
    test = FixedFunnel(**PAPER_HEAP | {"method": "pictures"})
    heap = snapshot(*cone_heap(30.0))
    observables, details = test.measure(heap, {})
    seen = measure_heap(grains_on_base(Grains.of(heap), 0.05), 0.05, 0.4, 0.92)
    assert observables["angle_of_repose"] == seen.angle_deg == pytest.approx(30.0, abs=1.5)
    assert details["profile"].method == "rings"
    assert details["profile"].angle_deg != seen.angle_deg
    assert (
        "pictures"
        in stored_run(Run(test, polypropylene(), 1), Outcome(observables, 1, None, heap, details), 0.0).details
    )


def test_pictures_are_refused_before_anything_is_poured_where_nothing_can_be_drawn(monkeypatch):
    def nothing():
        raise EnvironmentProblem("no OpenGL")

    monkeypatch.setattr(fixed_funnel, "require_graphics", nothing)
    with pytest.raises(EnvironmentProblem, match="no OpenGL"):
        FixedFunnel(**PAPER_HEAP | {"method": "pictures"}).scene(polypropylene())
    assert FixedFunnel(**PAPER_HEAP).scene(polypropylene())


def test_bins_are_one_nominal_diameter_wide_whatever_the_sizes_of_the_grains():
    heap = replace(cone(30.0), radius=np.where(np.arange(len(cone(30.0).mass)) % 3, 0.0021, 0.0039))
    _, details = FixedFunnel(cup_radius=0.05, rim_height=0.03).measure(heap, {})
    middles = details["profile"].profile["radius_m"].to_numpy()
    assert middles == pytest.approx(0.15 * 0.05 + 0.006 * (np.arange(7) + 0.5))


def test_an_end_state_without_heap_is_a_failure_not_a_number():
    class NothingPoured(FixedFunnel):
        def procedure(self, world, model):
            yield 0.001

    heap = NothingPoured(**SMALL).run(polypropylene(), [1])[0]
    assert heap.observables == {}
    assert heap.failure.startswith("The end state can't be measured: ")
    assert heap.snapshot is not None
