"""What docs/missing_effect.md shows of its commands works: they exist with their options, its Python runs, its files exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from taichidem.cli.application import app
from taichidem.effects import CohesionArea
from taichidem.study import read_study
from taichidem.study.diagnosis_plan import plan
from tests.study import formula_bench as bench

PAGE = (Path(__file__).parents[2] / "docs" / "missing_effect.md").read_text(encoding="utf-8")
OPTIONS = re.findall(r"^\| `(-.*?)` \| (.*?) \|", PAGE, re.M) + [("`--base-rows`", "all")]


def shown(command):
    return CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).output


@pytest.mark.parametrize(("text", "commands"), OPTIONS)
def test_the_options_exist_where_the_page_says(text, commands):
    option = re.findall(r"--?[a-z-]+", text)[0]
    for command in ("diagnose", "add", "discover") if commands == "all" else commands.split(", "):
        assert option in shown(command)


def test_its_python_runs_and_leaves_the_files(tmp_path, monkeypatch, capsys):
    bench.register(monkeypatch.setitem)
    bench.write(tmp_path / "my_study", bench.changed(CohesionArea(energy_density=4e4)))
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.S | re.M)
    exec(compile(block, "missing_effect.md", "exec"), {})
    assert "cohesion_area was added" in capsys.readouterr().out
    for file in ("my_study/results/verdict.json", "with_effect/study.toml", "with_effect/results/addition.json"):
        assert Path(file).exists()


def test_a_diagnosis_makes_as_many_runs_as_the_page_says(tmp_path, monkeypatch):
    bench.register(monkeypatch.setitem)
    planned = plan(read_study(bench.write(tmp_path / "s", bench.changed())))
    if len(planned.hypotheses.tested) == 16:
        assert f"that is {len(planned.design) + 4} points" in PAGE
        assert f"tests make {len({run.key for run in planned.runs})} runs" in PAGE.replace("\n", " ")
