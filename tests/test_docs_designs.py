"""What docs/designs_and_analysers.md shows works."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from analysis import BUILT_IN as ANALYSERS
from designs import BUILT_IN as DESIGNS
from designs import CentralComposite, Factor, FactorSpace
from taichidem.cli.application import app
from taichidem.paper.published import DATA

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "designs_and_analysers.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_factors_file_is_valid(tmp_path):
    (text,) = blocks("toml")
    (tmp_path / "factors.toml").write_text(text, encoding="utf-8")
    space = FactorSpace.from_toml(tmp_path / "factors.toml")
    assert space["restitution"].highest == 1.0
    assert space["young_modulus"].log
    assert space["sieve"].levels == (1, 2, 4)


def test_the_python_example_runs(tmp_path, monkeypatch, capsys):
    (code,) = blocks("python")
    monkeypatch.chdir(tmp_path)
    space = FactorSpace([Factor("friction", 0.1, 0.6), Factor("restitution", 0.3, 0.97)])
    table = CentralComposite(kind="face_centred").generate(space).table
    table["aor_deg"] = 20 + 15 * table["friction"] - 9 * table["restitution"] ** 2 + table["seed"] % 7 / 7
    table.to_csv("results.csv", index=False)
    exec(compile(code, "designs_and_analysers.md", "exec"), {})
    assert "response_surface: aor_deg" in capsys.readouterr().out
    assert (tmp_path / "report" / "report.json").exists()


def test_the_worked_example_gives_the_numbers_of_the_page(monkeypatch):
    monkeypatch.chdir(ROOT)
    lines = re.findall(r"^\$ taichidem (analyse .*)$", PAGE, re.M)
    said = [CliRunner().invoke(app, shlex.split(line)).output for line in lines]
    effects, surface, best = said
    assert re.search(r"F_static_friction_pp_pp +11\.4", effects)
    assert "static friction 11.43 (65.70 %)" in PAGE
    assert "R² is 88.66 %, adjusted 85.64 %" in surface
    assert "F_static_friction_pp_pp = 0.5211, D_restitution_pp_pp = 0.5485" in best
    assert "Held as asked: B_density_pp = 910" in best


@pytest.mark.parametrize(
    ("example", "table"),
    [
        ("plackett_burman.csv", "table3_plackett_burman.csv"),
        ("central_composite.csv", "table5_central_composite.csv"),
    ],
)
def test_the_examples_are_the_papers_tables(example, table):
    assert (ROOT / "examples" / example).read_bytes() == (DATA / table).read_bytes()


@pytest.mark.parametrize("name", [*DESIGNS, *ANALYSERS])
def test_every_built_in_plugin_is_on_the_page(name):
    assert f"`{name}`" in PAGE
