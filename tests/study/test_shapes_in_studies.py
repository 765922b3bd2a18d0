"""The form of the grains in study files: read, refused, written on, part of a run's key, and on trial as a hypothesis."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from types import ModuleType

import numpy as np
import pytest

from taichidem.effects import ElectrostaticCharge, Elongation
from taichidem.errors import InputError
from taichidem.scene import Model
from taichidem.shapes import Superquadric
from taichidem.study import FileError, diagnose, read_study
from taichidem.study.content_hash import model_as_dict, shape_as_dict
from taichidem.study.hypothesis import hypotheses
from taichidem.study.study_writer import write_study
from tests.clump import Row
from tests.study import fakes
from tests.study import formula_bench as bench

SPHERE = 'shape = "sphere"'
SPHEROID = 'shape = "spheroid"\naspect_ratio = 1.5'


@pytest.fixture
def multisphere(monkeypatch):
    """Stand in for the class, and return what it was made of."""
    made = []

    @dataclass(frozen=True)
    class Multisphere(Row):
        said: tuple = ()

        def __init__(self, centres=(), radii=(), said=()):
            super().__init__(2)
            made.append(said or (centres, radii))

        @classmethod
        def spheroid(cls, aspect_ratio, spheres, radius=1.0):
            return cls(said=(aspect_ratio, spheres))

        @classmethod
        def from_file(cls, path, unit=None):
            if not path.is_file():
                raise InputError(f"There is no file {path}.")
            return cls(said=(path.name, unit))

    module = ModuleType("taichidem.shapes.multisphere")
    module.Multisphere = Multisphere
    monkeypatch.setitem(sys.modules, module.__name__, module)
    return made


def test_a_spheroid_keeps_the_volume_of_its_diameter(write):
    study = read_study(write((SPHERE, SPHEROID)))
    assert study.model().shape == study.particle.form == Superquadric.spheroid(1.5)
    assert study.particle.shape == "spheroid"
    assert study.model_with({"granule-granule.restitution": 0.5}).shape == study.particle.form
    assert study.at({}).model.shape == study.particle.form


def test_without_a_shape_grains_are_spheres(write):
    assert read_study(write()).model().shape is None
    assert read_study(write((SPHERE + "\n", ""))).model().shape is None
    assert read_study(write((SPHERE, SPHEROID.replace("1.5", "1.0")))).model().shape is None


def test_superquadrics(write):
    study = read_study(write((SPHERE, 'shape = "superquadric"\naxes = [1, 1, 1.5]\nexponents = [4, 2]')))
    assert study.model().shape == Superquadric(1, 1, 1.5, 4, 2)
    study = read_study(write((SPHERE, 'shape = "superquadric"\naxes = [1, "2", 3]')))
    assert study.model().shape == Superquadric(1, 2, 3)


def test_multispheres(write, multisphere):
    read_study(write((SPHERE, 'shape = "spheroid"\naspect_ratio = 2\nform = "multisphere"\nspheres = 5')))
    folder = write((SPHERE, 'shape = "multisphere"\nfile = "grain.csv"\nunit = "mm"'))
    (folder / "grain.csv").write_text("x")
    study = read_study(folder)
    read_study(write((SPHERE, 'shape = "multisphere"\ncentres = [[0, 0, 0], [0, 0, 1]]\nradii = [1, 0.8]')))
    assert multisphere == [(2.0, 5), ("grain.csv", "mm"), ([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]], [1.0, 0.8])]
    assert study.model().grain_kind == "multisphere"


CASES = {
    "ratio missing": ('shape = "spheroid"', "particle.aspect_ratio", ["missing", "such as 1.5"]),
    "ratio below 0": (SPHEROID.replace("1.5", "-1"), "particle.shape", ["-1.0", "above 0"]),
    "ratio of a sphere": (f"{SPHERE}\naspect_ratio = 1.5", "particle.aspect_ratio", ["key of a sphere"]),
    "unknown form": (f'{SPHEROID}\nform = "egg"', "particle.form", ["'egg'", "superquadric, multisphere"]),
    "spheres of a smooth form": (f"{SPHEROID}\nspheres = 4", "particle.spheres", ['form = "multisphere"']),
    "number of spheres": (f"{SPHEROID}\nspheres = 2.5", "particle.spheres", ["2.5", "whole number"]),
    "misspelt key": (f"{SPHEROID}\nfrom = 3", "particle.from", ["Did you mean 'form'?"]),
    "axes missing": ('shape = "superquadric"', "particle.axes", ["missing", "ratios"]),
    "two axes": ('shape = "superquadric"\naxes = [1, 2]', "particle.axes", ["[1, 2]", "3 numbers"]),
    "exponent of a star": (
        'shape = "superquadric"\naxes = [1, 1, 1]\nexponents = [1, 2]',
        "particle.shape",
        ["n1", "allowed is 2"],
    ),
    "axis no number": ('shape = "superquadric"\naxes = [1, 1, "wide"]', "particle.axes", ["'wide'"]),
    "nothing of a multisphere": ('shape = "multisphere"', "particle.file", ["missing", "centres and radii"]),
    "two ways at once": ('shape = "multisphere"\nfile = "a.csv"\nradii = [1]', "particle.radii", ["Leave one out"]),
    "no such file": ('shape = "multisphere"\nfile = "none.csv"', "particle.file", ["none.csv"]),
    "file no name": ('shape = "multisphere"\nfile = 3', "particle.file", ["is 3", "name of a file"]),
    "shape no name": ("shape = 3", "particle.shape", ["is 3", "sphere, spheroid, superquadric, multisphere"]),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_wrong_is_told_with_its_key(case, write, multisphere):
    text, key, parts = CASES[case]
    with pytest.raises(FileError) as caught:
        read_study(write((SPHERE, text)))
    (line,) = [line for line in caught.value.problems if line.startswith(key)]
    for part in parts:
        assert part in line


def test_an_effect_that_cannot_act_on_the_form_is_a_problem(write):
    charge = "[effects.electrostatic_charge]\nsurface_charge_density = 1e-6\n\n[calibrate]"
    with pytest.raises(FileError, match="'electrostatic_charge' can't act on grains of kind 'superquadric'"):
        read_study(write((SPHERE, SPHEROID), ("[calibrate]", charge)))
    both = "[effects.elongation]\naspect_ratio = 1.2\n\n[calibrate]"
    with pytest.raises(FileError, match="'elongation' and the model's shape"):
        read_study(write((SPHERE, SPHEROID), ("[calibrate]", both)))
    options = '[effects.elongation]\naspect_ratio = 1.2\nform = "superquadric"\nspheres = 3\n\n[calibrate]'
    assert read_study(write(("[calibrate]", options))).model().grain_kind == "superquadric"


def test_a_study_that_is_written_on_keeps_form_comments_and_file(write, tmp_path, multisphere):
    text = 'shape = "multisphere"           # scanned\nfile = "grain.csv"'
    folder = write((SPHERE, text), measurements=fakes.MEASUREMENTS)
    (folder / "grain.csv").write_text("the grain")
    study = read_study(folder)
    new = write_study(study, tmp_path / "new", {}, ElectrostaticLike(strength=0.5), [], "new")
    assert (tmp_path / "new" / "grain.csv").read_text() == "the grain"
    assert "# scanned" in new.file.read_text()
    assert new.particle == study.particle


class ElectrostaticLike(fakes.RollingWithDefault):
    """Any effect that may be added."""

    def __new__(cls, strength):
        return fakes.RollingWithDefault(rolling_friction=strength)


def test_keys_of_spheres_stay_what_they_were(study):
    assert set(model_as_dict(study.model())) == {"materials", "effects"}


def test_the_form_is_part_of_the_key_and_its_size_is_not():
    one = shape_as_dict(Superquadric(1, 1, 1.5))
    assert one == shape_as_dict(Superquadric(0.7, 0.7, 1.05))
    others = [Superquadric(1, 1, 1.5001), Superquadric(1, 1.5, 1), Superquadric(1, 1, 1.5, 2.1), Row(2), Row(3)]
    assert all(shape_as_dict(other) != one for other in others)
    assert len({str(shape_as_dict(other)) for other in others}) == len(others)


@pytest.fixture
def formulas(monkeypatch):
    bench.register(monkeypatch.setitem)


def test_what_cannot_act_on_the_form_is_not_tested_and_named(formulas, tmp_path):
    folder = bench.write(tmp_path / "s", bench.changed())
    file = folder / "study.toml"
    assert {"elongation", "electrostatic_charge"} <= {h.name for h in hypotheses(read_study(folder)).tested}
    file.write_text(file.read_text().replace("[particle]", f"[particle]\n{SPHEROID}"))
    found = hypotheses(read_study(folder))
    assert "can't act on grains of kind 'superquadric'" in found.not_tested["electrostatic_charge"]
    assert "both say what form" in found.not_tested["elongation"]
    assert {"size_spread", "rolling_constant_torque"} <= {h.name for h in found.tested}


def test_charge_beside_elongation_is_not_tested(formulas, tmp_path):
    def charged(model):
        return Model(model.materials, [*model.effects, ElectrostaticCharge(surface_charge_density=1e-6)])

    folder = bench.write(tmp_path / "s", charged)
    file = folder / "study.toml"
    charge = "[effects.electrostatic_charge]\nsurface_charge_density = 1e-6\n\n[calibrate]"
    file.write_text(file.read_text().replace("[calibrate]", charge))
    assert "can't act" in hypotheses(read_study(folder)).not_tested["elongation"]


def test_planted_elongation_is_found(formulas, tmp_path):
    folder = bench.write(tmp_path / "s", bench.changed(Elongation(aspect_ratio=1.4)))
    result = diagnose(folder, ["elongation", *bench.TESTED[2:]])
    assert result.verdict == "effect"
    assert result.effects == ("elongation",)
    row = result.table[0]
    assert row["strength"] == pytest.approx(1.4, abs=3 * row["u_strength"])
    assert np.isfinite(row["strength"])
