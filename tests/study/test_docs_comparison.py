"""What docs/comparison.md shows works: its study is run by the engine, its commands exist."""

from __future__ import annotations

import re
from pathlib import Path

from taichidem.study import compare

PAGE = (Path(__file__).parents[2] / "docs" / "comparison.md").read_text(encoding="utf-8")


def block(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)[0]


def test_the_example_fails_as_shown(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "my_study"
    folder.mkdir()
    (folder / "study.toml").write_text(block("toml"), encoding="utf-8")
    (folder / "measurements.csv").write_text(block("csv"), encoding="utf-8")
    result = compare(folder, seeds=[1])
    shown = " ".join(PAGE.split())
    assert " ".join(result.text.split()) in shown
    assert result.advice[0] in shown
    assert result.failing == ("fall at 1.5 s", "fall at 2 s", "fall at 2.5 s")
    assert set(result.pictures) == {"standardised_errors", "series_fall", "series_rebound_speed"}
    monkeypatch.chdir(tmp_path)
    exec(compile(block("python"), "comparison.md", "exec"), {})
    assert "fall at 2.5 s" in capsys.readouterr().out
