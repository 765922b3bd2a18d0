"""Reading a study: everything that can be wrong with its file, and all of it at once."""

from __future__ import annotations

import pickle

import pytest

from taichidem.errors import InputError
from taichidem.study import FileError, read_study
from taichidem.units import Length, quantity
from tests.study.fakes import STUDY, Quick, QuickSettings

CALIBRATE = '"granule-granule.restitution" = { low = 0.3, high = 0.9 }'
ROLLING = 'rolling_friction = { "granule-granule" = 0.12, "wall-granule" = 0.11 }'
NARROW = 'type = "quick"\nwidth = "40 mm"'


def calibrate(text):
    return (CALIBRATE, text)


def in_effects(text):
    return ("[calibrate]", f"{text}\n[calibrate]")


# name → (replacement, key that the problem begins with, parts of its sentence)
CASES = {
    "wrong schema": (("schema = 1", "schema = 2"), "schema", ["is 2", "reads schema = 1"]),
    "schema true": (("schema = 1", "schema = true"), "schema", ["is True"]),
    "schema missing": (("schema = 1\n", ""), "schema", ["is missing", "schema = 1"]),
    "title no text": (('"A study"', "3"), "title", ["is 3", "text"]),
    "unknown section": (
        ("[calibrate]", "[calibrat]"),
        "calibrat",
        ["Unknown section 'calibrat'", "Allowed: calibrate, contacts", "Did you mean 'calibrate'?"],
    ),
    "section no table": (
        ('[particle]\nshape = "sphere"\ndiameter = "6 mm"\nmaterial = "granule"', "particle = 3"),
        "particle",
        ["is 3", "must be a table"],
    ),
    "unknown shape": (('"sphere"', '"spere"'), "particle.shape", ["'spere'", "allowed: sphere"]),
    "unknown key of particle": (
        ('diameter = "6 mm"', 'diametre = 1\ndiameter = "6 mm"'),
        "particle.diametre",
        ["Did you mean 'diameter'"],
    ),
    "diameter missing": (('diameter = "6 mm"\n', ""), "particle.diameter", ["missing", "6 mm"]),
    "diameter of another dimension": (
        ('"6 mm"', '"6 kg"'),
        "particle.diameter",
        ["'6 kg'", "kilogram", "converts to m"],
    ),
    "diameter zero": (('"6 mm"', '"0 mm"'), "particle.diameter", ["'0 mm'", "above 0"]),
    "diameter no quantity": (('"6 mm"', '"wide"'), "particle.diameter", ["'wide'", "no quantity"]),
    "diameter not finite": (('"6 mm"', "inf"), "particle.diameter", ["inf", "finite"]),
    "diameter a boolean": (('"6 mm"', "true"), "particle.diameter", ["True", "give a number"]),
    "particle's material missing": (('material = "granule"\n', ""), "particle.material", ["missing", "granule, wall"]),
    "particle's material unknown": (
        ('material = "granule"', 'material = "granul"'),
        "particle.material",
        ["'granul'", "Allowed: granule, wall", "Did you mean 'granule'?"],
    ),
    "unknown property": (
        ('density = "910 kg/m^3"', 'densty = 3\ndensity = "910 kg/m^3"'),
        "materials.granule.densty",
        ["Allowed: density, poissons_ratio, youngs_modulus", "Did you mean 'density'?"],
    ),
    "property missing": (('density = "910 kg/m^3"\n', ""), "materials.granule.density", ["missing", "kg/m^3"]),
    "property of another dimension": (
        ('"5 MPa"', '"5 m"'),
        "materials.granule.youngs_modulus",
        ["'5 m'", "converts to Pa"],
    ),
    "unit of a pure number": (("0.36", '"0.36 m"'), "materials.granule.poissons_ratio", ["'0.36 m'", "converts to 1"]),
    "negative density": (('"910 kg/m^3"', "-910"), "materials.granule.density", ["-910", "above 0"]),
    "zero modulus": (('"5 MPa"', "0"), "materials.granule.youngs_modulus", ["0.0", "above 0"]),
    "Poisson's ratio too large": (("0.36", "0.6"), "materials.granule.poissons_ratio", ["0.6", "≤ 0.5"]),
    "material no table": (
        (
            '[materials.wall]\ndensity = "7.8 g/cm^3"\nyoungs_modulus = "50 MPa"\npoissons_ratio = 0.3',
            "[materials]\nwall = 3",
        ),
        "materials.wall",
        ["is 3", "must be a table"],
    ),
    "dot in a material's name": (("[materials.wall]", '[materials."wall.1"]'), "materials.wall.1", ["can't hold '.'"]),
    "dash in a material's name": (
        ("[materials.wall]", "[materials.steel-wall]"),
        "materials.steel-wall",
        ["without '-'"],
    ),
    "pair of an unknown material": (
        ("[contacts.granule-wall]", "[contacts.granule-wal]"),
        "contacts.granule-wal",
        ["'wal'", "Allowed: granule, wall", "Did you mean 'wall'?"],
    ),
    "pair of one": (
        ("[contacts.granule-wall]", "[contacts.granule]"),
        "contacts.granule",
        ["no pair", "joined by '-'"],
    ),
    "pair missing": (
        ("[contacts.granule-wall]\nrestitution = 0.7\nstatic_friction = 0.3\n", ""),
        "contacts.granule-wall.restitution",
        ["missing", "Rebound speed", "Plausible: 0.2 to 0.97", "[contacts.granule-wall]"],
    ),
    "value of a pair missing": (("static_friction = 0.3\n", ""), "contacts.granule-wall.static_friction", ["missing"]),
    "pair missing in an effect's table": (
        (ROLLING, 'rolling_friction = { "granule-granule" = 0.12 }'),
        "contacts.granule-wall.rolling_constant_torque.rolling_friction",
        ["missing", "[effects.rolling_constant_torque] for all pairs"],
    ),
    "unknown short name": (
        ("restitution = 0.7", "restitutio = 0.7\nrestitution = 0.7"),
        "contacts.granule-wall.restitutio",
        ["Unknown parameter 'restitutio'", "static_friction", "Did you mean 'restitution'?"],
    ),
    "value out of bounds": (
        ("restitution = 0.7", "restitution = 1.7"),
        "contacts.granule-wall.restitution",
        ["1.7", "to 1"],
    ),
    "value with a wrong unit": (
        ("restitution = 0.7", 'restitution = "7 m"'),
        "contacts.granule-wall.restitution",
        ["'7 m'"],
    ),
    "effect that is not in the model": (
        ("restitution = 0.7", 'restitution = 0.7\n"rolling_spring_dashpot.rolling_friction" = 0.1'),
        "contacts.granule-wall.rolling_spring_dashpot.rolling_friction",
        ["Unknown effect of the model", "Add [effects.rolling_spring_dashpot]"],
    ),
    "one number for the whole model, given to a pair": (
        ("restitution = 0.7", 'restitution = 0.7\n"body_gravity.z" = 1'),
        "contacts.granule-wall.body_gravity.z",
        ["one number for the whole model", "[effects.body_gravity]"],
    ),
    "a pair in either order": (
        in_effects("[contacts.wall-granule]\nrestitution = 0.5"),
        "contacts.wall-granule.restitution",
        ["given twice"],
    ),
    "given as effect and as contact": (
        in_effects("[effects.normal_hertz]\nrestitution = 0.5"),
        "contacts.granule-wall.restitution",
        ["given twice"],
    ),
    "unknown effect": (
        in_effects("[effects.rolling_constant_torqe]"),
        "effects.rolling_constant_torqe",
        ["Allowed: ", "Did you mean 'rolling_constant_torque'?"],
    ),
    "unknown effect, also under contacts": (
        (
            "restitution = 0.7\nstatic_friction = 0.3",
            'restitution = 0.7\nstatic_friction = 0.3\n"nonesuch.x" = 1\n[effects.nonesuch]',
        ),
        "effects.nonesuch",
        ["Unknown effect 'nonesuch'"],
    ),
    "effect no table": (in_effects("[effects]\nbody_gravity = 3"), "effects.body_gravity", ["is 3", "must be a table"]),
    "two of a family": (
        in_effects("[effects.rolling_spring_dashpot]\nrolling_friction = 0.1"),
        "effects.rolling_spring_dashpot",
        ["family 'rolling'", "effects.rolling_constant_torque", "Leave one out"],
    ),
    "unknown parameter or option": (
        in_effects("[effects.normal_hertz]\natraction = true"),
        "effects.normal_hertz.atraction",
        ["Allowed: attraction, restitution", "Did you mean 'attraction'?"],
    ),
    "option of a wrong type": (
        in_effects('[effects.normal_hertz]\nattraction = "no"'),
        "effects.normal_hertz.attraction",
        ["'no'", "bool such as True"],
    ),
    "table for one number": (
        in_effects("[effects.body_gravity]\nz = { granule-wall = 3 }"),
        "effects.body_gravity.z",
        ["one number for the whole model"],
    ),
    "effect's value out of bounds": (
        (ROLLING, "rolling_friction = -0.2"),
        "effects.rolling_constant_torque.rolling_friction",
        ["-0.2", "from 0"],
    ),
    "effect's pair of an unknown material": (
        ("wall-granule", "wal-granule"),
        "effects.rolling_constant_torque.rolling_friction.wal-granule",
        ["'wal'", "Did you mean 'wall'?"],
    ),
    "value that an effect itself refuses": (
        (
            "restitution = 0.6\nstatic_friction = 0.4",
            "restitution = 1e-9\nstatic_friction = 0.4\n[effects.normal_hertz]\nattraction = false",
        ),
        "contacts.granule-granule",
        ["without attraction"],
    ),
    "calibrate names no effect of the model": (
        calibrate('"cohesion_area.energy" = { low = 0.3, high = 0.9 }'),
        "calibrate.cohesion_area.energy",
        ["Unknown effect of the model 'cohesion_area'"],
    ),
    "calibrate names no parameter": (
        calibrate('"granule-granule.restituton" = { low = 0.3, high = 0.9 }'),
        "calibrate.granule-granule.restituton",
        ["Did you mean 'restitution'?"],
    ),
    "calibrate names a pair that can't touch": (
        calibrate('"wall-wall.restitution" = { low = 0.3, high = 0.9 }'),
        "calibrate.wall-wall.restitution",
        ["Unknown pair of materials that touch 'wall-wall'", "Allowed: granule-granule, granule-wall"],
    ),
    "calibrate gives a pair to a number of the whole model": (
        calibrate('"granule-wall.body_gravity.z" = { low = -10, high = -9 }'),
        "calibrate.granule-wall.body_gravity.z",
        ["one number for the whole model", "leave the pair out"],
    ),
    "calibrate no table": (
        calibrate('"granule-granule.restitution" = 3'),
        "calibrate.granule-granule.restitution",
        ["low"],
    ),
    "unknown key of calibrate": (
        calibrate('"granule-granule.restitution" = { low = 0.3, high = 0.9, hgh = 1 }'),
        "calibrate.granule-granule.restitution.hgh",
        ["Allowed: high, low, u, value", "Did you mean 'high'?"],
    ),
    "low missing": (
        calibrate('"granule-granule.restitution" = { high = 0.9 }'),
        "calibrate.granule-granule.restitution.low",
        ["missing", "both ends"],
    ),
    "high missing": (
        calibrate('"granule-granule.restitution" = { low = 0.3 }'),
        "calibrate.granule-granule.restitution.high",
        ["missing", "both ends"],
    ),
    "low above high": (
        calibrate('"granule-granule.restitution" = { low = 0.9, high = 0.3 }'),
        "calibrate.granule-granule.restitution.low",
        ["0.9", "not below high = 0.3"],
    ),
    "low equals high": (
        calibrate('"granule-granule.restitution" = { low = 0.9, high = 0.9 }'),
        "calibrate.granule-granule.restitution.low",
        ["not below"],
    ),
    "range out of bounds": (
        calibrate('"granule-granule.restitution" = { low = 0.3, high = 1.1 }'),
        "calibrate.granule-granule.restitution.high",
        ["1.1", "to 1"],
    ),
    "range of a wrong unit": (
        calibrate('"body_gravity.z" = { low = "3 m", high = "9 m/s^2" }'),
        "calibrate.body_gravity.z.low",
        ["'3 m'", "converts to m/s^2"],
    ),
    "value without u": (
        calibrate('"granule-granule.restitution" = { low = 0.3, high = 0.9, value = 0.5 }'),
        "calibrate.granule-granule.restitution.u",
        ["missing", "standard uncertainty"],
    ),
    "u without value": (
        calibrate('"granule-granule.restitution" = { low = 0.3, high = 0.9, u = 0.5 }'),
        "calibrate.granule-granule.restitution.value",
        ["missing"],
    ),
    "u zero": (
        calibrate('"granule-granule.restitution" = { low = 0.3, high = 0.9, value = 0.5, u = 0 }'),
        "calibrate.granule-granule.restitution.u",
        ["is 0", "above 0"],
    ),
    "u negative": (
        calibrate('"granule-granule.restitution" = { low = 0.3, high = 0.9, value = 0.5, u = -0.1 }'),
        "calibrate.granule-granule.restitution.u",
        ["-0.1", "above 0"],
    ),
    "calibrate names one number twice": (
        calibrate(f'{CALIBRATE}\n"normal_hertz.restitution" = {{ low = 0.3, high = 0.9 }}'),
        "calibrate.normal_hertz.restitution",
        ["same number as calibrate.granule-granule.restitution"],
    ),
    "type missing": (
        (NARROW, 'width = "40 mm"'),
        "experiments.narrow.type",
        ["missing", "give one of: ", "fixed_funnel", "quick"],
    ),
    "unknown type": (
        (NARROW, 'type = "quik"\nwidth = "40 mm"'),
        "experiments.narrow.type",
        ["Unknown experiment 'quik'", "Allowed: ", "fixed_funnel", "Did you mean 'quick'?"],
    ),
    "experiment no table": (
        ('[experiments.narrow]\ntype = "quick"\nwidth = "40 mm"', "[experiments]\nnarrow = 3"),
        "experiments.narrow",
        ["is 3", "must be a table"],
    ),
    "strange name": (("[experiments.narrow]", '[experiments."nar,row"]'), "experiments.nar,row", ["no name"]),
    "unknown setting": (
        (NARROW, f"{NARROW}\nwidht = 3"),
        "experiments.narrow.widht",
        ["Unknown setting of quick 'widht'", "Allowed: ", "Did you mean 'width'?"],
    ),
    "setting missing": ((NARROW, 'type = "quick"'), "experiments.narrow.width", ["missing", "Width of the box."]),
    "setting of a wrong unit": (
        (NARROW, 'type = "quick"\nwidth = "40 kg"'),
        "experiments.narrow.width",
        ["'40 kg'", "[m]"],
    ),
    "setting out of bounds": (
        (NARROW, 'type = "quick"\nwidth = -1'),
        "experiments.narrow.width",
        ["-1", "greater than 0"],
    ),
    "settings that don't fit together": (
        (NARROW, f"{NARROW}\ndepth = 1"),
        "experiments.narrow",
        ["must not exceed width"],
    ),
    "apparatus that can't be built": (
        ('width = "40 mm"', 'width = "4 mm"\ndepth = "1 mm"'),
        "experiments.narrow",
        ["less than three grains"],
    ),
    "unknown material of a setting": (
        (NARROW, f'{NARROW}\nwall_material = "wal"'),
        "experiments.narrow.wall_material",
        ["'wal'", "Allowed: granule, wall", "Did you mean 'wall'?"],
    ),
}


def problems_of(folder):
    with pytest.raises(FileError) as error:
        read_study(folder)
    for problem in error.value.problems:
        assert problem in str(error.value)
    return error.value.problems


@pytest.mark.parametrize("case", CASES)
def test_a_problem_is_told_with_its_key_and_what_is_allowed(write, case):
    change, key, parts = CASES[case]
    (problem, *others) = [p for p in problems_of(write(change)) if p.startswith((f"{key}:", f"{key} "))]
    assert not others
    for part in parts:
        assert part in problem


ALONE = [
    name
    for name in CASES
    if name
    not in (
        # problems that bring others: what hung on the name that is now wrong
        "section no table",
        "material no table",
        "dot in a material's name",
        "dash in a material's name",
        "pair of an unknown material",
        "given as effect and as contact",
        "pair of one",
        "pair missing",
        "unknown section",
        "effect's pair of an unknown material",
    )
]


@pytest.mark.parametrize("case", ALONE)
def test_one_fault_is_one_problem(write, case):
    assert len(problems_of(write(CASES[case][0]))) == 1


def test_all_problems_at_once(write):
    changes = [
        ("schema = 1", "schema = 7"),
        ('"6 mm"', '"6 kg"'),
        ("0.36", "0.66"),
        ('density = "7.8 g/cm^3"', "densty = 1"),
        ("restitution = 0.6", "restitution = 2"),
        ("static_friction = 0.3\n", "friction = 0.3\n"),
        (ROLLING, "rolling_friction = -1"),
        (CALIBRATE, '"granule-granule.bounce" = { low = 3 }'),
        ("u = 0.02", "u = 0"),
        (NARROW, 'type = "quik"'),
        ("width = 0.05", 'width = "5 s"\nlenght = 3'),
    ]
    problems = problems_of(write(*changes))
    wanted = [
        "schema",
        "particle.diameter",
        "materials.granule.poissons_ratio",
        "materials.wall.densty",
        "materials.wall.density",
        "contacts.granule-granule.restitution",
        "contacts.granule-wall.friction",
        "contacts.granule-wall.static_friction",
        "effects.rolling_constant_torque.rolling_friction",
        "calibrate.granule-granule.bounce",
        "calibrate.granule-granule.bounce.high",
        "calibrate.granule-wall.static_friction.u",
        "experiments.narrow.type",
        "experiments.wide.width",
        "experiments.wide.lenght",
    ]
    for key in wanted:
        assert any(p.startswith((f"{key} ", f"{key}:")) for p in problems), key
    assert len(problems) == len(wanted)


def test_a_property_is_told_by_its_key_alone(write):
    changes = [('"910 kg/m^3"', "-910"), ('"50 MPa"', "0"), ("0.36", "0.6")]
    assert problems_of(write(*changes)) == (
        "materials.granule.density is -910.0; it must be a finite number above 0 (SI).",
        "materials.granule.poissons_ratio is 0.6; a stable isotropic solid has -1 < ν ≤ 0.5.",
        "materials.wall.youngs_modulus is 0.0; it must be a finite number above 0 (SI).",
    )


def test_a_missing_property_is_asked_for_with_its_unit(write):
    changes = [("poissons_ratio = 0.36\n", ""), ('density = "910 kg/m^3"\n', "")]
    assert problems_of(write(*changes)) == (
        "materials.granule.density is missing; give a number in kg/m^3 or a text such as '6 kg/m^3'.",
        "materials.granule.poissons_ratio is missing; give a number, such as 0.5.",
    )


def test_a_setting_says_its_value_once(write):
    (problem,) = problems_of(write((NARROW, 'type = "quick"\nwidth = "3 rpm"')))
    assert problem.count("3 rpm") == 1
    assert "[m]: this is in revolutions_per_minute; it needs a unit that converts to m." in problem


@pytest.mark.parametrize("material", ['material = "granul"', 'material = "polymer"', ""])
def test_what_contacts_lack_is_told_although_the_grains_material_is_unknown(write, material):
    changes = [('material = "granule"', material), ("restitution = 0.6\nstatic_friction = 0.4", "restitution = 0.6")]
    keys = [problem.split()[0].rstrip(":") for problem in problems_of(write(*changes))]
    assert keys == ["particle.material", "contacts.granule-granule.static_friction"]


def test_a_misspelt_grain_material_is_taken_for_the_nearest(write):
    keys = {p.split()[0].rstrip(":") for p in problems_of(write(('material = "granule"', 'material = "wal"')))}
    assert {"particle.material", "contacts.wall-wall.restitution", "contacts.wall-wall.static_friction"} <= keys


def test_where_the_grains_material_is_unknown_any_pair_may_be_calibrated(write):
    changes = [
        ('material = "granule"', 'material = "granul"'),
        ("granule-granule.restitution", "wall-wall.restitution"),
    ]
    assert len(problems_of(write(*changes))) == 1


class SizedSettings(QuickSettings):
    diameter: Length = quantity("m", "Diameter of the grains, which has no default.", gt=0)


def test_what_a_faulty_particle_would_fill_in_is_not_missing_too(write, monkeypatch):
    monkeypatch.setattr(Quick, "settings_type", SizedSettings)
    (problem,) = problems_of(write(('"6 mm"', '"6 kg"')))
    assert problem.startswith("particle.diameter")


def test_problems_of_apparatus_come_with_those_of_calibrate(write):
    folder = write(('width = "40 mm"', 'width = "4 mm"\ndepth = "1 mm"'), ("u = 0.02", "u = 0"))
    assert len(problems_of(folder)) == 2


def test_the_text_counts_and_numbers_them(write):
    folder = write(("schema = 1", "schema = 7"), ("u = 0.02", "u = 0"))
    with pytest.raises(InputError) as error:
        read_study(folder)
    lines = str(error.value).splitlines()
    assert lines[0] == f"{folder / 'study.toml'} has 2 problems:"
    assert [line[:5] for line in lines[1:]] == ["  1. ", "  2. "]
    copy = pickle.loads(pickle.dumps(error.value))
    assert (str(copy), copy.problems) == (str(error.value), error.value.problems)


def test_not_toml_names_the_line(write):
    (problem,) = problems_of(write(("title = ", "title ")))
    assert "not valid TOML" in problem
    assert "line 2" in problem


def test_not_utf8(tmp_path):
    (tmp_path / "study.toml").write_bytes(STUDY.replace("A study", "Körner").encode("latin-1"))
    (problem,) = problems_of(tmp_path)
    assert "UTF-8" in problem


def test_an_empty_file_lists_what_is_missing(tmp_path):
    (tmp_path / "study.toml").write_text("")
    keys = [problem.split()[0] for problem in problems_of(tmp_path)]
    assert keys == ["schema", "materials", "particle.diameter", "particle.material", "experiments"]


@pytest.mark.parametrize("name", ["", "nowhere", "study.toml"])
def test_no_study_there(tmp_path, name):
    with pytest.raises(InputError, match=r"There is no study file .*(study\.toml|nowhere)\. Give a folder"):
        read_study(tmp_path / name)


def test_walls_of_two_materials_must_be_named(write):
    """Without a material called "wall" nobody can know which of two it is."""
    more = """
[materials.belt]
density = 1200
youngs_modulus = 1e8
poissons_ratio = 0.4
[contacts.granule-belt]
restitution = 0.2
static_friction = 0.9
rolling_constant_torque.rolling_friction = 0.1
"""
    renamed = STUDY.replace("materials.wall", "materials.steel").replace("granule-wall", "granule-steel")
    folder = write((STUDY, renamed.replace("wall-granule", "granule-steel")), end=more)
    assert [p.split()[0] for p in problems_of(folder)] == [
        "experiments.narrow.wall_material",
        "experiments.wide.wall_material",
    ]
    assert "granule, steel, belt" in problems_of(folder)[0]


def test_grains_of_a_second_material_need_their_pairs(write):
    problems = problems_of(write((NARROW, f'{NARROW}\ngrain_material = "wall"')))
    assert {p.split()[0] for p in problems} == {
        "contacts.wall-wall.restitution",
        "contacts.wall-wall.static_friction",
        "contacts.wall-wall.rolling_constant_torque.rolling_friction",
    }
