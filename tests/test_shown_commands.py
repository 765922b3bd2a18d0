"""Every command that README and docs show is one that the command line takes, and every file of examples/ is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.shown_commands import check_command, shown_commands

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("**/*.md"))]
SHOWN = [
    pytest.param(line, id=f"{page.name}: {line}")
    for page in PAGES
    for line in shown_commands(page.read_text(encoding="utf-8"))
]


@pytest.mark.parametrize("line", SHOWN)
def test_a_shown_command_is_taken(line):
    check_command(line)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_of_examples_that_a_page_names_are_there(page):
    for name in re.findall(r"\bexamples/[\w./-]*\w", page.read_text(encoding="utf-8")):
        assert (ROOT / name).exists(), name


def test_lines_with_and_without_a_prompt_are_found_in_blocks_alone():
    page = "taichidem is a simulator\n```console\n$ taichidem plugins   # all\n```\n```\ntaichidem repose a.jpg\n  text\n```\n"
    assert shown_commands(page) == ["taichidem plugins", "taichidem repose a.jpg"]


@pytest.mark.parametrize(
    "line",
    [
        "taichidem --arhc cuda compare my_study",
        "taichidem --arch",
        "taichidem comapre my_study",
        "taichidem compare my_study --sedes 4",
        "taichidem compare",
        "taichidem reproduce papers",
    ],
)
def test_a_mistaken_line_is_refused(line):
    with pytest.raises(AssertionError, match="is refused"):
        check_command(line)


def test_a_line_with_an_option_before_the_command_is_taken():
    check_command("taichidem --arch cuda compare my_study --seeds 4")
