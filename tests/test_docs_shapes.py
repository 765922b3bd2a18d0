"""What docs/shapes.md shows works."""

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from taichidem.cli.application import app
from taichidem.cli.shape import parse_shape
from taichidem.effects import Elongation
from taichidem.shapes import Superquadric
from taichidem.study import read_study
from tests.study import fakes

PAGE = (Path(__file__).parents[1] / "docs" / "shapes.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


@pytest.fixture(autouse=True)
def _fakes(monkeypatch):
    fakes.register(monkeypatch.setitem)


def read(folder, *changes):
    text = fakes.STUDY
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return read_study(folder)


PARTICLE = fakes.STUDY[fakes.STUDY.index("[particle]") : fakes.STUDY.index("[materials.granule]")]


def test_the_sections_are_read(tmp_path):
    spheroid, superquadric, multisphere = blocks("toml")[:3]
    assert read(tmp_path, (PARTICLE, spheroid)).model().shape == Superquadric.spheroid(1.5)
    assert read(tmp_path, (PARTICLE, superquadric)).model().shape == Superquadric(1, 1, 1.5, 4, 2)
    pytest.importorskip("taichidem.shapes.multisphere")
    (tmp_path / "grain.csv").write_text("x,y,z,radius\n0,0,-0.5,1\n0,0,0.5,1\n")
    assert read(tmp_path, (PARTICLE, multisphere)).model().grain_kind == "multisphere"


def test_the_effect_is_read(tmp_path):
    study = read(tmp_path, ("[calibrate]", f"{blocks('toml')[3]}\n[calibrate]"))
    (effect,) = [e for e in study.model().effects if isinstance(e, Elongation)]
    assert effect.value("aspect_ratio") == 1.3
    assert study.model().grain_shape == Superquadric.spheroid(1.3)


def test_the_python_block_runs(capsys):
    exec(compile(blocks("python")[0], "shapes.md", "exec"), {})
    shown = capsys.readouterr().out.splitlines()
    assert len(shown) == 2
    assert all("bulk_density" in line for line in shown)
    assert shown[0] != shown[1]


def test_the_commands_exist():
    commands = re.findall(r"^\$ taichidem (.*?)(?:\s+#.*)?$", "\n".join(blocks("console")), re.M)
    shown = CliRunner().invoke(app, ["simulate", "--help"], env={"COLUMNS": "200"}).output
    assert "--shape" in shown
    for command in commands:
        text = shlex.split(command)[3]
        if not text.startswith("multisphere"):
            assert parse_shape(text) is not None
