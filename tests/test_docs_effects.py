"""docs/effects.md says what the effects declare."""

from pathlib import Path

from taichidem.effects.catalogue import as_markdown

PAGE = Path(__file__).resolve().parents[1] / "docs" / "effects.md"


def test_the_page_is_what_the_effects_declare():
    assert PAGE.read_text(encoding="utf-8") == as_markdown(), (
        "run: python -m taichidem.effects.catalogue > docs/effects.md"
    )
