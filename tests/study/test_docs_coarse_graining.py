"""What docs/coarse_graining.md shows works."""

from __future__ import annotations

import re
from pathlib import Path

from taichidem.study import read_study

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "coarse_graining.md").read_text(encoding="utf-8")


def test_the_python_block_runs(capsys):
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.S)
    names = {}
    exec(compile(block, "coarse_graining.md", "exec"), names)
    assert (names["test"].settings.diameter, names["test"].settings.particles) == (0.006, 800)
    assert "1 of 1 observables stayed within their uncertainty" in capsys.readouterr().out


def test_it_shows_every_test_of_the_example_and_its_numbers_of_grains():
    study = read_study(ROOT / "examples" / "coarse_graining")
    rows = re.findall(r"^\| .* \| ([\d, ]+) \|$", PAGE, flags=re.M)
    assert len(rows) == len(study.experiments)
    assert [int(row.split(",")[0]) for row in rows] == [
        study.experiment(n).particles_needed() for n in study.experiments
    ]
    assert (ROOT / "docs" / "pictures" / "coarse_graining.png").exists()
