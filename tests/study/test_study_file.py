"""Reading a study: what it means."""

from __future__ import annotations

import dataclasses
import pickle

import pytest

from taichidem.effects import BodyGravity, NormalHertz
from taichidem.effects.base import Effect
from taichidem.errors import InputError
from taichidem.experiments.base import Settings
from taichidem.materials import MaterialPair
from taichidem.study import read_study, with_values
from taichidem.study.parameter_key import ParameterKey, short_name
from taichidem.units import Length, quantity
from tests.study.fakes import Quick


def value(model, name, first, second):
    """Return the value of "effect.parameter" between two materials."""
    effect_name, _, parameter = name.partition(".")
    effect = next(e for e in model.effects if e.name == effect_name)
    pair = MaterialPair(*(model.materials[model.material_number(m)] for m in (first, second)))
    return effect.value(parameter, pair)


def test_a_study_says_what_its_file_says(study, tmp_path):
    assert (study.path, study.file, study.title, study.schema) == (tmp_path, tmp_path / "study.toml", "A study", 1)
    assert dataclasses.astuple(study.particle) == ("sphere", 0.006, "granule", None)
    assert study.materials["wall"].density == pytest.approx(7800)
    assert study.materials["granule"].youngs_modulus == 5e6
    assert study.materials["granule"].poissons_ratio == 0.36
    assert list(study.experiments) == ["narrow", "wide"]
    assert study.experiments["wide"].type == "quick"
    assert study.experiments["wide"].settings == {"width": 0.05, "diameter": "5 mm"}


def test_folder_and_file_mean_the_same(write):
    folder = write()
    assert read_study(folder / "study.toml").model().materials == read_study(folder).model().materials
    assert read_study(str(folder)).path == folder


def test_a_study_is_frozen_and_travels_between_processes(study):
    with pytest.raises(dataclasses.FrozenInstanceError):
        study.title = "another"
    assert pickle.loads(pickle.dumps(study)).experiment("wide").settings == study.experiment("wide").settings


def test_the_model_holds_hertz_friction_gravity_and_what_is_added(study):
    model = study.model()
    names = {"normal_hertz", "tangential_mindlin", "body_gravity", "rolling_constant_torque"}
    assert {e.name for e in model.effects} == names
    assert next(e for e in model.effects if e.name == "body_gravity").values == {"x": 0.0, "y": 0.0, "z": -9.81}
    assert value(model, "normal_hertz.restitution", "granule", "granule") == 0.6
    assert value(model, "normal_hertz.restitution", "wall", "granule") == 0.7
    assert value(model, "tangential_mindlin.static_friction", "granule", "granule") == 0.4
    assert value(model, "tangential_mindlin.static_friction", "granule", "wall") == 0.3
    assert value(model, "rolling_constant_torque.rolling_friction", "granule", "granule") == 0.12
    assert value(model, "rolling_constant_torque.rolling_friction", "granule", "wall") == 0.11


def test_particle_and_materials_are_filled_in_and_an_explicit_setting_wins(study):
    narrow, wide = study.experiment("narrow").settings, study.experiment("wide").settings
    assert (narrow.diameter, narrow.grain_material, narrow.wall_material) == (0.006, "granule", "wall")
    assert wide.diameter == 0.005
    assert study.experiment("narrow") is study.experiment("narrow")
    with pytest.raises(InputError, match=r"narow.*Allowed: narrow, wide.*Did you mean 'narrow'"):
        study.experiment("narow")


class NoWallSettings(Settings):
    width: Length = quantity("m", "Width.")
    diameter: Length = quantity("m", "Diameter.")
    grain_material: str = quantity("1", "Material.")


def test_what_an_experiment_has_no_setting_for_is_not_filled_in(write, monkeypatch):
    monkeypatch.setattr(Quick, "settings_type", NoWallSettings)
    settings = read_study(write()).experiment("narrow").settings
    assert settings.model_dump() == {"width": 0.04, "diameter": 0.006, "grain_material": "granule"}


def test_a_registered_test_is_filled_in_likewise(write):
    heap = '\n[experiments.heap]\ntype = "fixed_funnel"\n'
    settings = read_study(write(end=heap)).experiment("heap").settings
    assert (settings.diameter, settings.grain_material, settings.wall_material) == (0.006, "granule", "wall")
    assert not hasattr(settings, "width")


def section(text, name, end):
    """Return a part of a study's text, from the heading [name] to before [end]."""
    return text[text.index(f"[{name}]") : text.index(f"[{end}]")]


def test_the_order_of_materials_in_the_file_means_nothing(write):
    text = (write() / "study.toml").read_text()
    granule = section(text, "materials.granule", "materials.wall")
    wall = section(text, "materials.wall", "contacts.granule-granule")
    study = read_study(write((granule + wall, wall + granule)))
    assert list(study.materials) == ["wall", "granule"]
    assert [m.name for m in study.model().materials] == ["granule", "wall"]


BELT = """
[materials.belt]
density = 1200
youngs_modulus = 1e8
poissons_ratio = 0.4
[contacts.granule-belt]
restitution = 0.2
static_friction = 0.9
"""
ROLLING = '"wall-granule" = 0.11'


def test_of_several_other_materials_walls_are_of_the_one_called_wall(write):
    more = (ROLLING, f'{ROLLING}, "granule-belt" = 0.2')
    study = read_study(write(more, end=BELT))
    assert [m.name for m in study.model().materials] == ["granule", "belt", "wall"]
    assert study.experiment("narrow").settings.wall_material == "wall"
    assert value(study.model(), "tangential_mindlin.static_friction", "belt", "granule") == 0.9


def test_without_a_wall_material_walls_are_of_the_grains(write):
    text = (write() / "study.toml").read_text()
    changes = [
        (section(text, "materials.wall", "contacts.granule-granule"), ""),
        (section(text, "contacts.granule-wall", "effects.rolling_constant_torque"), ""),
        (f", {ROLLING}", ""),
        (section(text, "calibrate", "experiments.narrow"), ""),
    ]
    study = read_study(write(*changes))
    assert study.experiment("narrow").settings.wall_material == "granule"
    assert study.calibrate == ()


def test_parameters_by_their_full_name_options_and_gravity(write):
    changes = [
        ("restitution = 0.7", '"normal_hertz.restitution" = 0.7'),
        ("static_friction = 0.3\n", "tangential_mindlin.static_friction = 0.3\n"),  # unquoted: an inner table
        ("[calibrate]", "[effects.normal_hertz]\nattraction = false\n[effects.body_gravity]\nz = -1.62\n[calibrate]"),
    ]
    model = read_study(write(*changes)).model()
    assert value(model, "normal_hertz.restitution", "wall", "granule") == 0.7
    assert value(model, "tangential_mindlin.static_friction", "wall", "granule") == 0.3
    effects = {e.name: e for e in model.effects}
    assert effects["normal_hertz"].attraction is False
    assert effects["body_gravity"].values["z"] == -1.62


def test_an_effect_replaces_the_usual_one_of_its_family(write):
    model = read_study(write(("[calibrate]", "[effects.normal_other]\n[calibrate]"))).model()
    assert "normal_hertz" not in {e.name for e in model.effects}
    assert value(model, "normal_other.restitution", "wall", "granule") == 0.7  # the short name follows the family


def test_one_number_for_every_pair(write):
    table = 'rolling_friction = { "granule-granule" = 0.12, "wall-granule" = 0.11 }'
    model = read_study(write((table, "rolling_friction = 0.2"))).model()
    assert value(model, "rolling_constant_torque.rolling_friction", "wall", "granule") == 0.2


def test_pairs_left_out_of_a_table_get_the_default(write):
    changes = [(", " + ROLLING, ""), ("rolling_constant_torque", "rolling_default")]
    model = read_study(write(*changes)).model()
    assert value(model, "rolling_default.rolling_friction", "granule", "granule") == 0.12
    assert value(model, "rolling_default.rolling_friction", "granule", "wall") == 0.01
    none = ('rolling_friction = { "granule-granule" = 0.12 }', "")
    model = read_study(write(*changes, none)).model()
    assert value(model, "rolling_default.rolling_friction", "granule", "granule") == 0.01


def test_calibrate_entries(study):
    first, second = study.calibrate
    assert (first.key, first.low, first.high, first.value, first.u) == (
        "granule-granule.restitution",
        0.3,
        0.9,
        None,
        None,
    )
    assert first.names == ParameterKey("normal_hertz", "restitution", "granule-granule")
    assert (second.value, second.u, second.unit) == (0.3, 0.02, "1")


@pytest.mark.parametrize(
    ("key", "names"),
    [
        ("granule-granule.restitution", ("normal_hertz", "restitution", "granule-granule")),
        ("wall-granule.static_friction", ("tangential_mindlin", "static_friction", "granule-wall")),
        ("rolling_constant_torque.rolling_friction", ("rolling_constant_torque", "rolling_friction", None)),
        (
            "granule-wall.rolling_constant_torque.rolling_friction",
            ("rolling_constant_torque", "rolling_friction", "granule-wall"),
        ),
        ("body_gravity.z", ("body_gravity", "z", None)),
    ],
)
@pytest.mark.parametrize("quoted", [True, False])
def test_every_form_of_a_calibrate_key(write, key, names, quoted):
    written = f'"{key}"' if quoted else key
    entry = f"{written} = {{ low = 0.01, high = 0.8 }}"
    change = ('"granule-granule.restitution" = { low = 0.3, high = 0.9 }', entry)
    other = ('"granule-wall.static_friction" = { low = 0.1, high = 0.6, value = 0.3, u = 0.02 }', "")
    (found,) = read_study(write(change, other)).calibrate
    assert (found.key, found.names, found.low, found.high) == (key, ParameterKey(*names), 0.01, 0.8)


def test_model_with_changes_what_its_keys_name(study):
    model = study.model_with(
        {"wall-granule.restitution": 0.5, "tangential_mindlin.static_friction": 0.2, "body_gravity.z": "-500 cm/s^2"}
    )
    assert value(model, "normal_hertz.restitution", "granule", "wall") == 0.5
    assert value(model, "normal_hertz.restitution", "granule", "granule") == 0.6
    assert value(model, "tangential_mindlin.static_friction", "granule", "granule") == 0.2
    assert value(model, "tangential_mindlin.static_friction", "granule", "wall") == 0.2
    assert next(e for e in model.effects if e.name == "body_gravity").values["z"] == -5.0
    assert value(study.model(), "normal_hertz.restitution", "granule", "wall") == 0.7  # the study's own stays


def test_with_values_splits_one_number_over_pairs_and_keeps_options(study):
    effects = [NormalHertz(restitution=0.5, attraction=False), BodyGravity()]  # one number for all pairs
    model = dataclasses.replace(study.model(), effects=effects)
    changed = with_values(model, {"granule-granule.restitution": 0.8})
    assert value(changed, "normal_hertz.restitution", "granule", "granule") == 0.8
    assert value(changed, "normal_hertz.restitution", "granule", "wall") == 0.5
    assert changed.effects[0].attraction is False
    assert changed.effects[1] is effects[1]
    effects = [NormalHertz(restitution={"granule-granule": 0.5, "wall-granule": 0.6})]  # a pair in its other order
    changed = with_values(dataclasses.replace(model, effects=effects), {"granule-wall.restitution": 0.8})
    assert value(changed, "normal_hertz.restitution", "granule", "wall") == 0.8


def test_a_short_name_belongs_to_its_family_alone():
    effects = {"a": type("A", (Effect,), {"family": "normal"}), "b": type("B", (Effect,), {"family": "other"})}
    assert short_name("a", "restitution", effects) == "restitution"
    assert short_name("b", "restitution", effects) == "b.restitution"
    assert short_name("a", "stiffness", effects) == "a.stiffness"


@pytest.mark.parametrize(
    ("values", "parts"),
    [
        ({"granule-granule.restitution": 1.5}, ["normal_hertz.restitution", "1.5", "to 1"]),
        ({"granule-granul.restitution": 0.5}, ["granule-granul", "Allowed: granule-granule, granule-wall"]),
        ({"granule.restitution": 0.5}, ["Unknown effect", "'granule'"]),
        ({"restitution": 0.5}, ["Unknown parameter 'restitution'", "normal_hertz.restitution"]),
        ({"granule-wall.restitutio": 0.5}, ["'restitutio'", "Did you mean 'restitution'?"]),
        ({"granule-wall.body_gravity.z": 1.0}, ["one number for the whole model"]),
        ({"normal_hertz.bounce": 0.5}, ["'bounce'", "Allowed: restitution"]),
        ({"granule-granule.restitution": 0.5, "normal_hertz.restitution": 0.4}, ["both set normal_hertz.restitution"]),
        ({"granule-wall.restitution": 0.5, "wall-granule.restitution": 0.4}, ["both set normal_hertz.restitution"]),
    ],
)
def test_model_with_refuses_what_names_nothing(study, values, parts):
    with pytest.raises(InputError) as error:
        study.model_with(values)
    for part in parts:
        assert part in str(error.value)
