"""The tutorial's road on a smaller bench: its commands, in its order, with fewer tests and fewer rivals."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
import tomlkit
from typer.testing import CliRunner

from taichidem.cli.application import app
from taichidem.missing_effect_demo import EXAMPLE

PAGE = (Path(__file__).parents[1] / "docs" / "tutorial.md").read_text(encoding="utf-8")
COMMANDS = [shlex.split(line) for line in re.findall(r"^\$ taichidem (.*?)(?:\s+#.*)?$", PAGE, re.M)]
KEPT = ("bulk", "rebound_0p3m_s", "rebound_1p2m_s", "rolling_ball")
FEWER = {
    "compare": ["--seeds", "2"],
    "diagnose": [
        "--seeds",
        "2",
        "--effects",
        "rolling_constant_torque,cohesion_dmt",
        "--base-rows",
        "3",
        "--new-tests",
        "none",
    ],
    "add": ["--base-rows", "3"],
}


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A copy of the example under the tutorial's name, most of its tests left out."""
    folder = tmp_path / "beads"
    folder.mkdir()
    document = tomlkit.parse((EXAMPLE / "study.toml").read_text(encoding="utf-8"))
    for name in [name for name in document["experiments"] if name not in KEPT]:
        del document["experiments"][name]
    (folder / "study.toml").write_text(tomlkit.dumps(document), encoding="utf-8")
    head, *rows = (EXAMPLE / "measurements.csv").read_text(encoding="utf-8").splitlines()
    kept = [head, *(row for row in rows if row.split(",")[0] in KEPT)]
    (folder / "measurements.csv").write_text("\n".join(kept) + "\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return folder


def command(name):
    """Return the last command of that name in the tutorial, and what makes it small."""
    return [*[c for c in COMMANDS if c[0] == name][-1], *FEWER.get(name, [])]


def test_the_road_of_the_tutorial(study):
    for name in ("compare", "diagnose", "add", "report"):
        answer = CliRunner().invoke(app, command(name))
        assert answer.exit_code == 0, answer.output
    verdict = json.loads((study / "results" / "verdict.json").read_text(encoding="utf-8"))
    assert verdict["verdict"] in ("effect", "one_of")
    assert verdict["effects"][0] == "rolling_constant_torque"
    addition = json.loads(next(study.parent.glob("*/results/addition.json")).read_text(encoding="utf-8"))
    chi2 = {step["step"]: step["chi2"] for step in addition["waterfall"]}
    assert chi2["with_effect"] < 0.3 * chi2["recalibrated"]
    assert next(study.parent.glob("*/results/report.html")).is_file()


@pytest.mark.parametrize("picture", re.findall(r"\]\((pictures/[^)]*)\)", PAGE))
def test_pictures_are_there(picture):
    assert (Path(__file__).parents[1] / "docs" / picture).is_file()
