"""Settings of experiments that may be re-calibrated, and a study at other values of them."""

from __future__ import annotations

import dataclasses
import pickle

import pytest

from taichidem.errors import InputError
from taichidem.study import FileError, ParameterKey, SettingKey, read_study
from taichidem.study.study_file import Study
from tests.study.test_study_file import value

FIRST = '"granule-granule.restitution" = { low = 0.3, high = 0.9 }'
OPTIONAL = '\n[experiments.ball]\ntype = "free_fall"\n'


def calibrating(write, entry, end="", *changes) -> Study:
    return read_study(write((FIRST, f"{FIRST}\n{entry}"), *changes, end=end))


def problems_of(write, entry, end="", *changes):
    with pytest.raises(FileError) as error:
        calibrating(write, entry, end, *changes)
    return error.value.problems


@pytest.mark.parametrize("key", ['"wide.depth"', "wide.depth"])
def test_a_setting_with_its_unit_and_measurement(write, key):
    study = calibrating(write, f'{key} = {{ low = "10 mm", high = 0.03, value = "2 cm", u = "1 mm" }}')
    parameter, setting, _ = study.calibrate
    assert setting.names == SettingKey("wide", "depth")
    assert (setting.key, setting.low, setting.high, setting.value, setting.u, setting.unit) == (
        *("wide.depth", 0.01, 0.03, 0.02, 0.001, "m"),
    )
    assert (parameter.is_setting, setting.is_setting) == (False, True)


def test_a_setting_that_may_be_left_out_but_is_given(write):
    entry = '"ball.mass" = { low = "90 g", high = "110 g" }'
    study = calibrating(write, entry, OPTIONAL + 'mass = "100 g"\n')
    assert study.calibrate[1].names == SettingKey("ball", "mass")
    (problem,) = problems_of(write, entry, OPTIONAL)
    assert "ball.mass has no value to start from; give mass in [experiments.ball]" in problem


def test_names_of_experiments_may_hold_dots(write):
    study = calibrating(
        write, '"wide.2-b.depth" = { low = 0.01, high = 0.03 }', "", ("[experiments.wide]", '[experiments."wide.2-b"]')
    )
    assert study.calibrate[1].names == SettingKey("wide.2-b", "depth")


@pytest.mark.parametrize(
    ("entry", "parts"),
    [
        ("wide.dept = {R}", ["calibrate.wide.dept", "Unknown setting of wide (quick) 'dept'", "Did you mean 'depth'"]),
        ("wid.depth = {R}", ["calibrate.wid.depth", "EXPERIMENT.setting", "narrow, wide", "Did you mean 'wide'"]),
        ("wide.failing_seed = {R}", ["no number that can be moved", "depth"]),
        ("wide.broken = {R}", ["no number that can be moved"]),
        ("wide.depth = { low = '5 kg', high = 0.04 }", ["calibrate.wide.depth.low", "kilogram", "converts to m"]),
        ("wide.depth = { low = 0.01, high = 0.06 }", ["calibrate.wide.depth.high", "must not exceed width"]),
        ("wide.depth = { low = -0.01, high = 0.04 }", ["calibrate.wide.depth.low", "greater than 0"]),
        ("wide.width = { low = '10 mm', high = '1 m' }", ["calibrate.wide.width.low", "must not exceed width"]),
        (
            "wide.diameter = { low = '5 mm', high = '30 mm' }",
            ["calibrate.wide.diameter.high", "less than three grains"],
        ),
        ("wide.depth = { low = 0.03, high = 0.02 }", ["calibrate.wide.depth.low", "not below high"]),
        ("wide.depth = { low = 0.01, high = 0.03, value = 0.2, u = 0.1 }", ["calibrate.wide.depth.value", "exceed"]),
        ("wide.depth = { low = 0.01 }", ["calibrate.wide.depth.high", "missing"]),
    ],
)
def test_what_is_refused(write, entry, parts):
    (problem,) = problems_of(write, entry.replace("{R}", "{ low = 0.01, high = 0.02 }"))
    for part in parts:
        assert part in problem


def test_an_experiment_that_is_faulty_is_told_once(write):
    problems = problems_of(write, '"wide.depth" = { low = 0.01, high = 0.02 }', "", ("width = 0.05", 'width = "5 kg"'))
    assert [p.split()[0] for p in problems] == ["experiments.wide.width"]


NAMED_LIKE_AN_EFFECT = '\n[experiments.normal_hertz]\ntype = "quick"\nwidth = 0.05\n'
NAMED_LIKE_A_PAIR = '\n[experiments.granule-granule]\ntype = "quick"\nwidth = 0.05\n'


@pytest.mark.parametrize(
    ("entry", "end", "names"),
    [
        ("normal_hertz.depth", NAMED_LIKE_AN_EFFECT, SettingKey("normal_hertz", "depth")),
        ("granule-granule.depth", NAMED_LIKE_A_PAIR, SettingKey("granule-granule", "depth")),
        (
            "granule-granule.static_friction",
            NAMED_LIKE_A_PAIR,
            ParameterKey("tangential_mindlin", "static_friction", "granule-granule"),
        ),
    ],
)
def test_of_an_effect_and_an_experiment_of_one_name_the_setting_decides(write, entry, end, names):
    study = calibrating(write, f'"{entry}" = {{ low = 0.01, high = 0.02 }}', end)
    assert study.calibrate[1].names == names


def test_a_key_that_means_both_is_refused(write, monkeypatch):
    from tests.study.fakes import Quick, QuickSettings

    class Settings(QuickSettings):
        restitution: float = 0.5

    monkeypatch.setattr(Quick, "settings_type", Settings)
    (problem,) = problems_of(
        write,
        '"granule-wall.restitution" = { low = 0.1, high = 0.2 }',
        NAMED_LIKE_A_PAIR.replace("granule-granule", "granule-wall"),
    )
    assert "parameter of normal_hertz and a setting of the experiment 'granule-wall'" in problem
    assert "another name" in problem


def test_neither_of_two_of_one_name(write):
    (problem,) = problems_of(write, '"normal_hertz.dept" = { low = 0.1, high = 0.2 }', NAMED_LIKE_AN_EFFECT)
    assert "Unknown setting of normal_hertz (quick) 'dept'" in problem
    assert "Unknown parameter of normal_hertz 'dept'" in problem


def test_a_study_at_other_values(study):
    point = study.at({"wide.depth": "3 cm", "wide.width": 0.06, "wall-granule.restitution": 0.5})
    assert point.experiment("wide").settings.model_dump() == {
        **study.experiment("wide").settings.model_dump(),
        "depth": 0.03,
        "width": 0.06,
    }
    assert value(point.model, "normal_hertz.restitution", "granule", "wall") == 0.5
    assert point.experiment("narrow") is study.experiment("narrow")
    assert study.experiment("wide").settings.depth == 0.02  # the study's own stays
    assert study.at({}).model is study.model()
    assert study.at({"wide.depth": 0.03}).model is study.model()
    with pytest.raises(dataclasses.FrozenInstanceError):
        point.model = study.model()
    with pytest.raises(InputError, match=r"'wid'.*Did you mean 'wide'"):
        point.experiment("wid")
    assert pickle.loads(pickle.dumps(point)).experiment("wide").settings.depth == 0.03


@pytest.mark.parametrize(
    ("values", "parts"),
    [
        ({"wide.depth": "3 kg"}, ["wide.depth is '3 kg'", "converts to m"]),
        ({"wide.depth": 0.2}, ["must not exceed width"]),
        ({"wide.pause": -1}, ["pause", "greater than or equal to 0"]),
        ({"wide.dept": 1}, ["'dept'", "Did you mean 'depth'"]),
        ({"granule-wall.restitution": 3}, ["normal_hertz.restitution", "to 1"]),
        ({"granule-wall.restitution": 0.5, "wall-granule.restitution": 0.4}, ["both set normal_hertz.restitution"]),
    ],
)
def test_values_that_are_refused(study, values, parts):
    with pytest.raises(InputError) as error:
        study.at(values)
    for part in parts:
        assert part in str(error.value)


def test_what_a_study_believes(study):
    assert study.believed("wide.depth") == 0.02
    assert study.believed("wide.diameter") == 0.005
    assert study.believed("wall-granule.restitution") == 0.7
    with pytest.raises(InputError, match="its values differ"):
        study.believed("normal_hertz.restitution")
    assert study.believed("granule-wall.rolling_constant_torque.rolling_friction") == 0.11
    assert study.believed("body_gravity.z") == -9.81
    with pytest.raises(InputError, match="Did you mean 'depth'"):
        study.believed("wide.dept")
