"""What larger grains move in the tests of a study, and a study written with larger grains."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import ClassVar

import numpy as np
import pandas as pd
import pytest

import taichidem.experiments
from taichidem import plugins
from taichidem.coarse_graining import CoarseGraining
from taichidem.effects import BodyGravity, CohesionJkr, NormalHertz, TangentialMindlin
from taichidem.errors import InputError
from taichidem.experiments import Rebound
from taichidem.experiments.base import Experiment, Observable, Outcome, Settings
from taichidem.library import polypropylene
from taichidem.materials import Material
from taichidem.model import Model
from taichidem.scene import Scene
from taichidem.study import RunStore, check_coarse_graining, check_study, read_study, write_coarse_grained
from taichidem.study.coarse_graining_check import study_plan
from taichidem.study.coarse_graining_rows import limit, shift
from taichidem.study.content_hash import experiment_as_dict, model_as_dict
from taichidem.units import Length, PerSecond, quantity
from tests.study.fakes import STUDY


class GrainySettings(Settings):
    diameter: Length = quantity("m", "Diameter.", 0.004, coarse_graining=1, gt=0)
    width: Length = quantity("m", "Width of the box.", 0.05, gt=0)
    particles: int = quantity("1", "Grains.", 640, coarse_graining=-3, ge=1)
    rate: PerSecond = quantity("1/s", "Grains per second.", 80.0, coarse_graining=-3, gt=0)
    grain_material: str = quantity("1", "Material of the grains.", "")
    wall_material: str = quantity("1", "Material of the walls.", "")
    failing_diameter: float = quantity("1", "Size at which runs fail.", -1.0)


class Grainy(Experiment):
    """One observable that the size of grains can't move, one that follows it, one that never scatters."""

    name: ClassVar[str] = "grainy"
    title: ClassVar[str] = "Grainy"
    observables: tuple[Observable, ...] = (
        Observable("still", "deg", "Scatters alike for every size."),
        Observable("following", "deg", "Follows the size."),
        Observable("work", "J/m^2", "Work of adhesion over the square of the size: kept."),
    )
    settings_type: ClassVar[type[Settings]] = GrainySettings
    simulated: ClassVar[list[tuple[float, int]]] = []

    def scene(self, model):
        s = self.settings
        if s.width < 3 * s.diameter:
            raise InputError(f"width is {s.width:g} m, less than three grains")
        return Scene(
            model=model,
            domain=((-1,) * 3, (1,) * 3),
            room=5,
            largest_radius=s.diameter / 2,
            grain_materials=("granule",),
        )

    def run(self, models, seeds, *, schedule="worlds", report=None, frames=None):
        models = models if isinstance(models, list) else [models] * len(seeds)
        Grainy.simulated.extend((self.settings.diameter, seed) for seed in seeds)
        return [self._one(model, seed) for model, seed in zip(models, seeds, strict=True)]

    def _one(self, model, seed):
        s = self.settings
        if s.diameter == s.failing_diameter:
            return Outcome({}, seed, "it diverged")
        noise = np.random.default_rng([seed, round(1e6 * s.diameter)]).normal(0, 0.3, 2)
        work = next(e for e in model.effects if e.name == "cohesion_jkr").value(
            "work_of_adhesion", next(iter(model.pairs()))
        )
        size = s.diameter / 0.004
        return Outcome({"still": 30 + noise[0], "following": 28 + 2 * size + noise[1], "work": work / size**2}, seed)


@pytest.fixture(autouse=True)
def _grainy(monkeypatch):
    monkeypatch.setitem(taichidem.experiments.BUILT_IN, "grainy", Grainy)
    plugins.refresh()
    Grainy.simulated.clear()


TESTS = """\

[experiments.heap]                # a heap
type = "grainy"
particles = 641                   # many

[experiments.tight]
type = "grainy"
width = "30 mm"
rate = 160
"""
HEAD = STUDY.partition("[experiments.narrow]")[0].replace('diameter = "6 mm"', 'diameter = "4 mm"       # sieved')
STICKY = """
[effects.cohesion_jkr]
work_of_adhesion = 0.05           # [J/m²], guessed
"""


RANGES = """\
"cohesion_jkr.work_of_adhesion" = { low = 0.01, high = 0.1 }
"heap.rate" = { low = 40, high = 100, value = 80, u = 8 }
"""


@pytest.fixture
def folder(tmp_path):
    """A study whose tests cost nothing."""
    path = tmp_path / "study"
    path.mkdir()
    text = HEAD.replace("[calibrate]", STICKY + "\n[calibrate]").rstrip() + "\n" + RANGES + TESTS
    (path / "study.toml").write_text(text, encoding="utf-8")
    return path


def rows(result, experiment, observable):
    table = result.table
    return table[(table["experiment"] == experiment) & (table["observable"] == observable)]


def test_it_flags_what_follows_the_size_and_nothing_else(folder):
    result = check_study(folder, (1, 2, 4), range(1, 7), ["heap"])
    assert rows(result, "heap", "still")["moved"].tolist() == [None, False, False]
    assert rows(result, "heap", "following")["moved"].tolist() == [None, True, True]
    assert rows(result, "heap", "work")["moved"].tolist() == [None, False, False]
    assert rows(result, "heap", "work")["mean"].tolist() == pytest.approx([0.05] * 3)
    following = rows(result, "heap", "following").iloc[2]
    assert following["shift"] == pytest.approx(6, abs=0.6)
    assert following["mass_kept"] == pytest.approx(10 * 64 / 641)
    assert following["grains"] == 10
    assert "2 of 3 observables stayed within their uncertainty" in result.text
    assert "following of heap by +" in result.text
    assert "still of heap" not in result.text
    assert set(result.moved()["observable"]) == {"following"}


def test_results_are_files_and_come_again_from_the_store(folder):
    first = check_study(folder, (1, 2), (1, 2, 3), ["heap"])
    assert Grainy.simulated == [(0.004, 1), (0.004, 2), (0.004, 3), (0.008, 1), (0.008, 2), (0.008, 3)]
    again = check_study(folder, (1, 2, 4), (1, 2, 3), ["heap"])
    assert Grainy.simulated[6:] == [(0.016, 1), (0.016, 2), (0.016, 3)]
    assert again.runs == {"stored": 6, "new": 3, "failed": 0, "repeated": 0}
    kept = first.table.drop(columns=["wall_time", "time_ratio"])
    same = again.table[again.table["factor"] < 4].drop(columns=["wall_time", "time_ratio"])
    pd.testing.assert_frame_equal(kept.reset_index(drop=True), same.reset_index(drop=True))
    held = json.loads((folder / "results" / "coarse_graining.json").read_text())
    assert held["schema"] == 1
    assert held["factors"] == [1, 2, 4]
    assert [row["mean"] for row in held["rows"]] == again.table["mean"].tolist()
    assert held["pictures"] == {"coarse_graining": "coarse_graining.png"}
    assert (folder / "results" / "coarse_graining.png").stat().st_size > 10_000


def test_a_factor_that_does_not_fit_is_a_row_of_failures(folder):
    result = check_study(folder, (1, 2, 4), (1, 2))
    (refused,) = result.failures
    assert (refused["experiment"], refused["factor"], refused["seed"]) == ("tight", 4, None)
    assert "factor of 4: width is 0.03 m, less than three grains" in refused["reason"]
    assert rows(result, "tight", "still")["factor"].tolist() == [1, 2]
    assert rows(result, "heap", "still")["factor"].tolist() == [1, 2, 4]
    assert "1 set-ups or runs failed" in result.text


def test_failed_runs_are_told_and_nothing_is_claimed_of_them():
    test = Grainy(failing_diameter=0.008)
    model = sticky()
    result = check_coarse_graining({"heap": test}, model, (1, 2), (1, 2))
    assert {(f["factor"], f["seed"], f["reason"]) for f in result.failures} == {
        (2, 1, "it diverged"),
        (2, 2, "it diverged"),
    }
    assert rows(result, "heap", "still")["moved"].tolist() == [None, None]
    assert "No observable can be compared" in result.text


def sticky():
    """Return sticky granules."""
    effects = [NormalHertz(restitution=0.6), TangentialMindlin(static_friction=0.5), BodyGravity()]
    granule = Material("granule", 910.0, 5e6, 0.36)
    return Model([granule], [*effects, CohesionJkr(work_of_adhesion=0.05)])


def test_one_seed_can_not_tell():
    result = check_coarse_graining(Grainy(), sticky(), (1, 2), (1,))
    assert result.table["moved"].tolist() == [None] * 6
    assert rows(result, "grainy", "still")["u"].isna().all()


@pytest.mark.parametrize(
    ("factors", "seeds", "coverage", "message"),
    [
        ((1,), (1,), 2, "two or more different ones"),
        ((2, 2), (1,), 2, "two or more different ones"),
        ((0.5, 1), (1,), 2, "factor of coarse graining is 0.5"),
        ((1, 2), (), 2, "no seed"),
        ((1, 2), (1,), 0, "coverage is 0"),
        ((1, 20), (1,), 2, "No test can be set up at two of the factors.*factor of 20"),
    ],
)
def test_bad_input(factors, seeds, coverage, message):
    with pytest.raises(InputError, match=message):
        check_coarse_graining(Grainy(), sticky(), factors, seeds, coverage=coverage)
    assert not Grainy.simulated


def part(mean, scatter, n):
    return {"mean": mean, "scatter": scatter, "u": scatter, "n": n, "wall_time": 1.0}


def test_few_seeds_widen_the_limit():
    """Two means of three seeds with equal scatter have 4 degrees of freedom: t(97.72 %) = 2.869."""
    base, other = part(10.0, 0.1, 3), part(10.0 + 2.8 * math.hypot(0.1, 0.1), 0.1, 3)
    assert limit(base, other, math.hypot(0.1, 0.1), 2.0) == pytest.approx(2.869, abs=1e-3)
    assert shift(base, other, 2.0)["moved"] is False
    assert shift(base, part(10.0 + 2.9 * math.hypot(0.1, 0.1), 0.1, 3), 2.0)["moved"] is True
    assert shift(part(10.0, 0.1, 1000), part(10.0 + 2.8 * math.hypot(0.1, 0.1), 0.1, 1000), 2.0)["moved"] is True
    assert shift(part(0.0, 0.0, 1), part(0.0, 0.0, 1), 2.0)["moved"] is False
    assert shift(None, base, 2.0)["moved"] is None


def test_a_rebound_keeps_its_restitution_unless_grains_are_sticky():
    """In the engine: dry, e doesn't know s; with adhesion, kept beside weight, slow grains lose V_s² ∝ s^(5/3) more."""
    dry = polypropylene()
    wet = Model(dry.materials, [*dry.effects, CohesionJkr(work_of_adhesion=0.05)])
    slow = Rebound(speed=0.05)
    still = check_coarse_graining(slow, dry, (1, 2, 4), (1,)).table
    assert still["moved"].tolist() == [None, False, False]
    assert still["shift"].tolist() == pytest.approx([0] * 3, abs=1e-6)
    moved = check_coarse_graining(slow, wet, (1, 4), (1,)).table.iloc[1]
    assert moved["moved"]
    assert moved["shift"] < -0.02


def test_command_simulates_on_a_cluster(folder, command, elsewhere):
    arguments = ("--factors", "1,2", "--seeds", "2", "--tests", "heap", "--cluster", "tcp://node1:8786")
    assert command("coarse-grain", folder, *arguments)[0] == 0
    assert elsewhere == ["tcp://node1:8786"]
    assert len(Grainy.simulated) == 4


def test_command_prints_a_table_and_json(folder, command):
    arguments = ("coarse-grain", folder, "--factors", "1,2", "--seeds", "4", "--tests", "heap", "-o", folder / "out")
    code, out, _ = command(*arguments)
    assert code == 0
    assert "heap: following" in out
    assert "moved" in out
    assert (folder / "out" / "coarse_graining.png").exists()
    code, out, _ = command(*arguments, "--json")
    assert code == 0
    assert json.loads(out) == json.loads((folder / "out" / "coarse_graining.json").read_text())
    assert json.loads(out)["runs"] == {"stored": 8, "new": 0, "failed": 0, "repeated": 0}
    with RunStore(folder / "runs.sqlite") as store:
        assert len(store) == 8


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--factors", "1,x"), "factors is '1,x'; give numbers from 1"),
        (("--factors", "0.5,1"), "allowed is a finite number from 1"),
        (("--tests", "heep"), "Did you mean 'heap'"),
        (("--factor", "2"), "--factor and --write belong together"),
    ],
)
def test_command_refuses(folder, command, arguments, message):
    code, _, err = command("coarse-grain", folder, *arguments)
    assert code == 2
    assert message in err
    assert not (folder / "runs.sqlite").exists()


def _flat(held, path=""):
    """Return the numbers in nested mappings by their path."""
    if not isinstance(held, dict):
        return {path: held} if isinstance(held, float) else {}
    return {k: v for name, inner in held.items() for k, v in _flat(inner, f"{path}/{name}").items()}


@pytest.mark.parametrize("factor", [1.5, 2])
def test_a_written_study_reads_back_as_the_coarse_one(folder, tmp_path, factor):
    (folder / "measurements.csv").write_text("experiment,observable,value,u,unit,n\nheap,still,30,1,deg,3\n")
    fine = read_study(folder)
    coarse = write_coarse_grained(fine, factor, tmp_path / "coarse")
    graining = CoarseGraining(factor)
    wanted, got = model_as_dict(graining.model(fine.model())), model_as_dict(coarse.model())
    assert got["materials"] == wanted["materials"]
    assert got["effects"].keys() == wanted["effects"].keys()
    for name in wanted["effects"]:
        assert _flat(got["effects"][name]) == pytest.approx(_flat(wanted["effects"][name]), rel=1e-11)
    for name in fine.experiments:
        test = experiment_as_dict(graining.experiment(fine.experiment(name)))
        assert _flat(experiment_as_dict(coarse.experiment(name))) == pytest.approx(_flat(test), rel=1e-11)
    text = coarse.file.read_text(encoding="utf-8")
    for comment in ("# sieved", "# [J/m²], guessed", "# a heap", "# many"):
        assert comment in text
    ranges = {entry.key: entry for entry in coarse.calibrate}
    assert ranges["cohesion_jkr.work_of_adhesion"].high == pytest.approx(0.1 * factor**2)
    assert ranges["heap.rate"].u == pytest.approx(8 / factor**3)
    assert ranges["granule-granule.restitution"].low == 0.3
    assert (coarse.path / "measurements.csv").read_text() == (folder / "measurements.csv").read_text()


def test_values_of_pairs_are_written_too(folder, tmp_path):
    text = (folder / "study.toml").read_text().replace("work_of_adhesion = 0.05", "# of each pair")
    text = "\n".join(line for line in text.splitlines() if not line.startswith('"cohesion_jkr'))
    text = text.replace("static_friction = 0.4\n", "static_friction = 0.4\ncohesion_jkr.work_of_adhesion = 0.04\n")
    text = text.replace("static_friction = 0.3\n", "static_friction = 0.3\ncohesion_jkr.work_of_adhesion = 0.01\n")
    (folder / "study.toml").write_text(text)
    fine = read_study(folder)
    coarse = write_coarse_grained(fine, 2, tmp_path / "coarse")
    values = next(e for e in coarse.model().effects if e.name == "cohesion_jkr").values["work_of_adhesion"]
    assert sorted(values.values()) == pytest.approx([0.04, 0.16])


def test_writing_refuses_what_does_not_fit_before_it_writes(folder, tmp_path, command):
    code, _, err = command("coarse-grain", folder, "--factor", "4", "--write", tmp_path / "coarse")
    assert code == 2
    assert "grainy can't be coarse-grained by a factor of 4" in err
    assert not (tmp_path / "coarse").exists()
    code, out, _ = command("coarse-grain", folder, "--factor", "2", "--write", tmp_path / "coarse")
    assert code == 0
    assert "work_of_adhesion" in out
    assert "of mass, by rounding to whole grains" in out
    code, _, err = command("coarse-grain", folder, "--factor", "2", "--write", tmp_path / "coarse")
    assert code == 2
    assert "holds a study already" in err


def test_the_example_holds_grains_of_four_times_the_size():
    study = read_study(Path(__file__).parents[2] / "examples" / "coarse_graining")
    plan = study_plan(study, (1, 2, 4), (1, 2), None)
    assert not plan.refused
    assert {name for name, _ in plan.masses} == set(study.experiments)
    assert all(mass == pytest.approx(1, abs=0.02) for _, mass in plan.masses.values())
    assert [grains for (name, _), (grains, _) in plan.masses.items() if name == "drum"] == [2200, 275, 34]


def test_a_form_in_a_file_comes_along_without_measurements(folder, tmp_path):
    (folder / "grain.csv").write_text("x,y,z,radius\n-1,0,0,1\n1,0,0,1\n")
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text.replace('shape = "sphere"', 'shape = "multisphere"\nfile = "grain.csv"'))
    fine = read_study(folder)
    coarse = write_coarse_grained(fine, 2, tmp_path / "coarse")
    assert coarse.model().shape == fine.model().shape
    assert coarse.model().shape is not None
    assert not (coarse.path / "measurements.csv").exists()
