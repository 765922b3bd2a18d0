"""Studies to fill in: they are accepted as written, say where their numbers come from, and wait for measurements."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from taichidem import plugins
from taichidem.cli.application import app, main
from taichidem.errors import InputError
from taichidem.starting_materials import STARTING_MATERIALS, Sourced, starting_material
from taichidem.study import FileError, init_study, read_measurements, read_study
from taichidem.study.init_settings import quantity_text
from tests.study.fakes import Quick

REGISTERED = plugins.names("experiment")


@pytest.mark.parametrize("diameter", ["6 mm", "0.8 mm", "25 mm"])
def test_every_registered_experiment_is_accepted(tmp_path, diameter):
    study = init_study(tmp_path / "new", REGISTERED, diameter=diameter)
    assert list(study.experiments) == REGISTERED
    assert read_study(tmp_path / "new").title == study.title


def test_defaults_stay_where_the_grains_are_those_of_the_defaults(tmp_path):
    study = init_study(tmp_path, REGISTERED)
    for name in REGISTERED:
        ours, theirs = study.experiment(name).settings, plugins.get("experiment", name)().settings
        for setting in type(ours).model_fields:
            if isinstance(getattr(theirs, setting), (int, float, tuple)):
                assert getattr(ours, setting) == pytest.approx(getattr(theirs, setting), rel=1e-9), (name, setting)


def test_an_experiment_of_another_package_is_accepted(tmp_path):
    """It has a required length, which is guessed and said to be a guess."""
    study = init_study(tmp_path, ["quick"], diameter="4 mm")
    assert study.experiment("quick").settings.width == pytest.approx(0.04)
    assert "It has no default; this is a guess." in study.file.read_text()


def test_an_experiment_that_refuses_the_guesses_is_told(tmp_path, monkeypatch):
    def refuse(self, model):
        raise InputError("the width must be a prime number of grains")

    monkeypatch.setattr(Quick, "scene", refuse)
    with pytest.raises(InputError, match=r"can't be proposed.*\n.*experiments\.quick: the width must be a prime"):
        init_study(tmp_path / "new", ["quick"])
    assert not (tmp_path / "new").exists()


def test_lengths_grow_with_the_grains_and_times_with_their_root(tmp_path):
    study = init_study(tmp_path, ["rotating_drum", "rebound"], diameter="24 mm")
    drum = study.experiment("rotating_drum").settings
    assert (drum.radius, drum.length, drum.particles) == (pytest.approx(0.288), pytest.approx(0.144), 671)
    assert drum.settle_time == pytest.approx(1.2)
    assert drum.speed == pytest.approx(0.6283185 / 2)
    assert study.experiment("rebound").settings.speed == 1.0  # one grain alone needs no likeness
    assert study.materials["polypropylene"].youngs_modulus == pytest.approx(4e7)


@pytest.mark.parametrize("wall", STARTING_MATERIALS)
@pytest.mark.parametrize("grain", STARTING_MATERIALS)
def test_every_pair_of_starting_materials_is_accepted(tmp_path, grain, wall):
    study = init_study(tmp_path, ["rebound"], material=grain, wall=wall)
    assert study.particle.material == grain
    assert study.experiment("rebound").settings.wall_material == wall
    assert len(study.calibrate) == (2 if wall == grain else 4)
    for entry in study.calibrate:
        assert entry.low <= study.believed(entry.key) <= entry.high
    text = study.file.read_text()
    marks = {int(k) for k in re.findall(r"\[(\d)\]", text)}
    assert marks == set(range(1, len(marks) + 1))
    assert all(f"#   [{k}] " in text for k in marks)


def test_numbers_come_from_the_library_with_their_ranges(tmp_path):
    study = init_study(tmp_path, ["ledge"], material="PP")
    assert (study.materials["polypropylene"].density, study.materials["steel"].youngs_modulus) == (910, 1.98e11)
    entry = next(e for e in study.calibrate if e.key == "polypropylene-polypropylene.static_friction")
    assert (entry.low, entry.high, study.believed(entry.key)) == (0.1, 0.6, 0.52)
    assert "doi 10.21303/2461-4262.2023.002968" in study.file.read_text()


def numbers():
    for material in STARTING_MATERIALS.values():
        parts = [material.density, material.youngs_modulus, material.poissons_ratio]
        for contact in material.contacts.values():
            parts += [contact.restitution, contact.static_friction]
        yield from ((material.name, number) for number in parts if number is not None)


@pytest.mark.parametrize(("name", "number"), list(numbers()))
def test_every_starting_number_has_a_source_and_lies_in_its_range(name, number: Sourced):
    assert re.search(r"doi |\.\w+/|\d, \d", number.source), name
    if number.low is not None:
        assert number.low <= number.value <= number.high
        assert number.low < number.high


def test_names_of_materials():
    assert starting_material("Glass beads").name == "glass"
    assert starting_material("corn").name == "maize"
    with pytest.raises(InputError, match=r"Unknown starting material 'polypropilene'.*Did you mean 'polypropylene'"):
        starting_material("polypropilene")


def test_measurements_wait_to_be_filled_in(tmp_path):
    study = init_study(tmp_path, ["ledge", "shear_box"])
    with pytest.raises(FileError) as error:
        read_measurements(study)
    first, *others = error.value.problems
    assert first == (
        "line 2: ledge, angle_of_repose is not filled in; write value, its standard uncertainty u and the number n of repeats, "
        "or remove the line."
    )
    assert [text.split(" is")[0] for text in others] == [
        *("line 3: shear_box, friction_angle", "line 4: shear_box, cohesion", "line 5: shear_box, peak_friction_angle"),
    ]
    (tmp_path / "measurements.csv").write_text(
        "experiment,observable,value,u,unit,n\nledge,angle_of_repose,30,1,deg,4\n"
    )
    assert read_measurements(study)["value"].tolist() == [30]


def test_one_cell_that_is_missing_is_told_as_such(tmp_path):
    study = init_study(tmp_path, ["ledge"])
    (tmp_path / "measurements.csv").write_text(
        "experiment,observable,value,u,unit,n\nledge,angle_of_repose,30,,deg,4\n"
    )
    with pytest.raises(FileError, match="line 2: u is ''; give a finite number"):
        read_measurements(study)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"experiments": ["ledg"]}, "Unknown experiment 'ledg'.*Did you mean 'ledge'"),
        ({"experiments": []}, "No experiment was given; give one or more of: bulk_density"),
        ({"material": "stell"}, "Did you mean 'steel'"),
        ({"wall": "acryl"}, "Did you mean 'acrylic'"),
        ({"diameter": "6 kg"}, "diameter is '6 kg'"),
        ({"diameter": 0.0}, "diameter is 0.0; it must be above 0"),
    ],
)
def test_what_is_refused_leaves_nothing_behind(tmp_path, arguments, message):
    with pytest.raises(InputError, match=message):
        init_study(tmp_path / "new", **{"experiments": ["ledge"], **arguments})
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("name", ["study.toml", "measurements.csv"])
def test_nothing_is_overwritten(tmp_path, name):
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match=f"{name} exists and is left as it is. Choose another folder"):
        init_study(tmp_path, ["ledge"])
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "mine"


def test_what_was_killed_on_the_way_is_given_again(tmp_path, monkeypatch):
    class Killed(BaseException):
        pass

    def killed(path, target, replace=Path.replace):
        if target.name == "study.toml":
            raise Killed
        return replace(path, target)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", killed)
        with pytest.raises(Killed):
            init_study(tmp_path, ["ledge"])
    assert [p.name for p in tmp_path.iterdir()] == ["measurements.csv"]  # the study stands last
    assert list(init_study(tmp_path, ["ledge"]).experiments) == ["ledge"]


def test_each_file_is_whole_or_not_there(tmp_path, monkeypatch):
    def full(number):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"can't be written to .*No space left"):
        init_study(tmp_path, ["ledge"])
    assert not list(tmp_path.iterdir())


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "new").write_text("mine")
    with pytest.raises(InputError, match="is a file; give the name of a new folder"):
        init_study(tmp_path / "new", ["ledge"])


def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shown = CliRunner().invoke(app, ["init", "new", "--experiments", "quick, rebound", "--wall", "acrylic"])
    assert shown.exit_code == 0, shown.output
    assert "fill in value, u and n" in shown.output
    assert read_study("new").experiment("rebound").settings.wall_material == "acrylic"
    with pytest.raises(SystemExit) as stop:
        main(["init", "new", "--experiments", "rebound"])
    assert stop.value.code == 2
    assert "exists and is left as it is" in capsys.readouterr().err


def test_a_new_study_can_be_simulated_before_it_is_filled_in(tmp_path):
    init_study(tmp_path, ["quick"])
    assert CliRunner().invoke(app, ["simulate", str(tmp_path), "--seeds", "1"]).exit_code == 0


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.036, "m", '"36 mm"'),
        (0.0123456, "m", '"12.3 mm"'),
        (1.5, "m", '"1.5 m"'),
        (1.3e9, "Pa", '"1.3 GPa"'),
        (4e3, "Pa", '"4 kPa"'),
        (500, "Pa", '"500 Pa"'),
        (0.62831853, "rad/s", '"6 rpm"'),
        (1185.0, "kg/m^3", '"1185 kg/m^3"'),
        (400, "1/s", '"400 1/s"'),
        (0.3, "1", "0.3"),
    ],
)
def test_quantities_as_people_write_them(value, unit, text):
    assert quantity_text(value, unit) == text
