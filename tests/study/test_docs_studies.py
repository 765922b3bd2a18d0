"""What docs/studies.md shows works."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from taichidem.experiments import FixedFunnel
from taichidem.experiments.base import Outcome
from taichidem.study import read_measurements, read_study
from taichidem.study.parameter_key import ParameterKey

PAGE = (Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")


def block(language):
    return blocks(language)[0]


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "my_study").mkdir()
    (tmp_path / "my_study" / "study.toml").write_text(block("toml"), encoding="utf-8")
    (tmp_path / "my_study" / "measurements.csv").write_text(block("csv"), encoding="utf-8")
    return tmp_path


def test_the_example_is_a_study(folder):
    study = read_study(folder / "my_study")
    rolling = next(e for e in study.model().effects if e.name == "rolling_constant_torque")
    assert rolling.values["rolling_friction"] == {"granule-granule": 0.12, "granule-wall": 0.10}
    assert study.calibrate[2].names == ParameterKey("rolling_constant_torque", "rolling_friction", "granule-granule")
    assert study.experiment("heap").settings.cup_radius == 0.042
    assert read_measurements(study)["value"].tolist() == [12.22]


def test_the_heights_of_a_fall_are_measurements(folder):
    fall = '[experiments.fall]\ntype = "free_fall"\ntime = [1.0, 2.0]\nrelease_height = 47\n'
    (folder / "my_study" / "study.toml").write_text(block("toml") + fall, encoding="utf-8")
    (folder / "my_study" / "measurements.csv").write_text(blocks("csv")[1], encoding="utf-8")
    measured = read_measurements(read_study(folder / "my_study"))
    assert measured["observable"].tolist() == ["height_at_1_s", "height_at_2_s"]
    assert measured["time"].tolist() == ["1.0", "2 s"]


def test_the_python_example_runs(folder, monkeypatch, capsys):
    def quickly(self, models, seeds, **_):
        return [Outcome({"angle_of_repose": 12.0 + seed}, seed) for seed in seeds]

    monkeypatch.setattr(FixedFunnel, "run", quickly)
    monkeypatch.chdir(folder)
    exec(compile(blocks("python")[1], "studies.md", "exec"), {})
    assert "13.5" in capsys.readouterr().out
    assert len((folder / "runs.csv").read_text().splitlines()) == 5


def test_the_example_of_settings_runs(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    exec(compile(block("python"), "studies.md", "exec"), {})
    shown = capsys.readouterr().out
    assert shown.startswith("0.5\n")
    assert "drop_velocity=0.55" in shown


def test_invented_measurements_are_said_to_be_invented():
    """No row of examples/ may pass for a laboratory's or for a result of this program, which would age with it."""
    example = Path(__file__).parents[2] / "examples" / "study" / "study.toml"
    assert re.search(r"^# Its measurements.* are invented", example.read_text(encoding="utf-8"), re.M)
    assert "its measurements are invented" in PAGE
