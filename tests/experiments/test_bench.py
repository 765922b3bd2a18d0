"""What holds for every experiment of the bench: declaration, a small run, the same alone as among others, spread sizes."""

from __future__ import annotations

import numpy as np
import pytest

from taichidem.effects import BaseTilt, SizeSpread
from taichidem.errors import InputError
from taichidem.experiments import BUILT_IN
from tests.experiments.planted import SMALL, granules
from tests.experiments.still import play_still

SHARES: dict[str, list[float]] = {}


@pytest.fixture(scope="module")
def runs():
    """Two worlds of each small experiment."""
    done = {}

    def run(name):
        if name not in done:
            SHARES[name] = []
            done[name] = BUILT_IN[name](**SMALL[name]).run(granules(), [1, 2], report=SHARES[name].append)
        return done[name]

    return run


@pytest.mark.parametrize("name", BUILT_IN)
def test_declaration_is_complete(name):
    experiment = BUILT_IN[name]()
    assert experiment.name == name
    assert experiment.title
    assert len(experiment.imitates) > 10
    assert experiment.particles_needed() >= 1
    assert len({o.name for o in experiment.observables}) == len(experiment.observables) >= 1
    assert all(o.unit and o.meaning.endswith(".") for o in experiment.observables)
    for setting in experiment.settings_type.model_fields.values():
        assert setting.description.endswith(".")
        assert setting.json_schema_extra["unit"]
    assert isinstance(experiment.walls(granules()), tuple)


@pytest.mark.parametrize("name", SMALL)
def test_a_small_run_gives_what_it_declares(name, runs):
    experiment = BUILT_IN[name](**SMALL[name])
    for outcome in runs(name):
        assert outcome.failure is None
        assert set(outcome.observables) == {o.name for o in experiment.observables}
        assert all(np.isfinite(v) and (v > 0 or k == "cohesion") for k, v in outcome.observables.items())
    assert SHARES[name] == sorted(SHARES[name])
    assert SHARES[name][-1] == 1.0


@pytest.mark.parametrize("name", SMALL)
def test_a_world_alone_is_that_among_others(name, runs):
    alone = BUILT_IN[name](**SMALL[name]).run(granules(), [2])[0]
    assert np.array_equal(alone.snapshot.position, runs(name)[1].snapshot.position)
    assert alone.observables == runs(name)[1].observables


@pytest.mark.parametrize("name", ["ledge", "bulk_density", "hopper_discharge", "rotating_drum", "shear_box"])
def test_the_seed_decides_and_sizes_spread(name, runs):
    first, second = runs(name)
    assert first.observables != second.observables
    assert np.ptp(first.snapshot.radius) == 0 if len(first.snapshot.radius) else True
    spread = BUILT_IN[name](**SMALL[name]).run(granules(SizeSpread(half_width=0.3)), [1])[0]
    assert spread.failure is None
    assert spread.observables != first.observables
    sizes = np.unique(np.round(spread.snapshot.radius, 9))
    assert len(sizes) == 5 or len(spread.snapshot.radius) < 20


@pytest.mark.parametrize("name", ["ledge", "rotating_drum"])
def test_an_apparatus_out_of_level_reads_its_tilt(name, runs):
    """Towards +x the ledge runs off, more than one to one; the drum, with its contents at −x, reads ten degrees less."""
    tilted = BUILT_IN[name](**SMALL[name]).run(granules(BaseTilt(angle=10.0)), [1, 2])
    change = [
        next(iter(a.observables.values())) - next(iter(b.observables.values()))
        for a, b in zip(tilted, runs(name), strict=True)
    ]
    low, high = {"ledge": (-30.0, -8.0), "rotating_drum": (-15.0, -5.0)}[name]
    assert low < np.mean(change) < high


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_study_may_not_misspell_a_setting(name):
    with pytest.raises(InputError, match=f"Unknown setting of {name} 'diametre'.*Did you mean 'diameter'"):
        BUILT_IN[name](diametre=0.006)


@pytest.mark.parametrize(
    ("name", "settings", "sentence"),
    [
        ("ledge", {"length": 0.03}, "length must be at least 6 diameters"),
        ("ledge", {"width": "15 mm"}, "width must be at least 3 diameters"),
        ("ledge", {"rain_top": "15 mm"}, "rain_top must be at least 3 diameters"),
        ("bulk_density", {"cup_radius": "10 mm"}, "cup_radius must be at least 2 diameters"),
        ("bulk_density", {"rain_top": "10 mm"}, "rain_top must be at least 3 diameters"),
        ("hopper_discharge", {"outlet_diameter": "96 mm"}, "below twice the bin_radius"),
        ("hopper_discharge", {"outlet_diameter": "6 mm"}, "or none can pass"),
        ("hopper_discharge", {"bin_radius": "11 mm", "outlet_diameter": "20 mm"}, "bin_radius must be at least 2"),
        ("hopper_discharge", {"rain_height": "11 mm"}, "rain_height must be at least 2 diameters"),
        ("hopper_discharge", {"half_angle": "90 deg"}, r"half_angle is 90\.0 \[deg\]: Input should be less than 90"),
        ("rotating_drum", {"speed": "6 m/s"}, r"speed is '6 m/s'.*converts to rad/s"),
        ("rotating_drum", {"radius": "20 mm"}, "radius must be at least 4 diameters"),
        ("rotating_drum", {"length": "12 mm"}, "length must be at least 2.5 diameters"),
        ("rebound", {"speed": 0}, r"rebound\.speed is 0\.0 \[m/s\]: Input should be greater than 0"),
        ("shear_box", {"length": "25 mm"}, "length and width must be at least 5 diameters"),
        ("shear_box", {"lower_height": "10 mm"}, "lower_height must be at least 2 diameters"),
        ("shear_box", {"shear_displacement": "16 mm"}, "at most a quarter of the length"),
        ("shear_box", {"normal_stresses": [1.0, 1.0]}, "one or more different stresses above 0"),
        ("shear_box", {"normal_stresses": "1 kPa, 0 Pa"}, "one or more different stresses above 0"),
        ("lifting_cylinder", {"cylinder_radius": "14 mm"}, "cylinder_radius must be at least 2.5 diameters"),
        ("lifting_cylinder", {"plate_radius": "30 mm"}, "plate_radius must be above cylinder_radius"),
        ("lifting_cylinder", {"fit_from": 0.5, "fit_to": 0.6}, r"fit_to must be above fit_from by 0\.15"),
        ("free_fall", {"time": []}, "time must be one or more different times from 0"),
        ("free_fall", {"time": [1.0, 1.0]}, "time must be one or more different times from 0"),
        ("free_fall", {"time": "1 kg"}, r"time is '1 kg'|value is '1 kg'.*converts to s"),
        ("free_fall", {"time": [1.0, 1.0 + 1e-9]}, "differ in their first six digits"),
        ("free_fall", {"floor": True, "release_height": -1}, "release_height must be above the floor"),
    ],
)
def test_settings_that_make_no_test_are_refused(name, settings, sentence):
    with pytest.raises(InputError, match=sentence):
        BUILT_IN[name](**settings)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("ledge", {"length": 0.036, "width": 0.018}),
        ("bulk_density", {"cup_radius": 0.012, "rain_top": 0.018}),
        ("hopper_discharge", {"outlet_diameter": 0.0061, "bin_radius": 0.012, "rain_height": 0.012}),
        ("rotating_drum", {"radius": 0.024, "length": 0.015}),
        ("shear_box", {"length": 0.036, "width": 0.03, "lower_height": 0.012, "shear_displacement": 0.009}),
    ],
)
def test_settings_at_the_edge_of_what_is_allowed_are_taken_and_filled(name, settings):
    filled = play_still(BUILT_IN[name](**settings, particles=1))
    assert len(filled.told("insert")[0].bodies.mass) == 1


def test_defaults_are_the_bench():
    held = {name: experiment().settings for name, experiment in BUILT_IN.items()}
    s = held["ledge"]
    assert (s.length, s.width, s.particles, s.settle_time, s.flow_time) == (0.12, 0.036, 800, 1.0, 2.0)
    s = held["bulk_density"]
    assert (s.cup_radius, s.cup_height, s.particles, s.settle_time) == (0.036, 0.048, 1184, 1.2)
    s = held["hopper_discharge"]
    assert (s.outlet_diameter, s.bin_radius, s.half_angle, s.particles) == (0.036, 0.048, 30.0, 1000)
    assert (s.settle_time, s.flow_time) == (0.9, 3.0)
    s = held["rotating_drum"]
    assert (s.radius, s.length, s.particles, s.settle_time) == (0.072, 0.036, 671, 0.6)
    assert (s.spin_up_time, s.averaging_time) == (1.5, 2.0)
    assert s.speed == pytest.approx(BUILT_IN["rotating_drum"](speed="6 rpm").settings.speed, rel=1e-14)
