"""The README's Python blocks run as they stand, and the cups that it names are the code's."""

import re
from pathlib import Path

import pytest

from taichidem.experiments import FixedFunnel
from taichidem.library import PAPER_HEAP

README = (Path(__file__).parents[1] / "README.md").read_text()
PYTHON = re.findall(r"```python\n(.*?)```", README, flags=re.S)


@pytest.mark.parametrize("block", PYTHON, ids=range(len(PYTHON)))
def test_python_blocks_run(block, capsys):
    exec(compile(block, "README.md", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_the_cups_it_names_are_those_of_the_code():
    ours, paper = re.search(r"left out: a cup of (\d+) mm; .*the paper's of (\d+) mm", PYTHON[0]).groups()
    assert 2000 * FixedFunnel().settings.cup_radius == pytest.approx(float(ours))
    assert 2000 * FixedFunnel(**PAPER_HEAP).settings.cup_radius == pytest.approx(float(paper))


def test_the_api_is_shown_in_under_20_lines():
    assert len(PYTHON[0].splitlines()) < 20
