"""What docs/designs_and_analysers.md shows works."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from analysis import BUILT_IN as ANALYSERS
from designs import BUILT_IN as DESIGNS
from designs import CentralComposite, Factor, FactorSpace

PAGE = (Path(__file__).parents[1] / "docs" / "designs_and_analysers.md").read_text(encoding="utf-8")


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


@pytest.mark.parametrize("name", [*DESIGNS, *ANALYSERS])
def test_every_built_in_plugin_is_on_the_page(name):
    assert f"`{name}`" in PAGE
