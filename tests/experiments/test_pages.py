"""The page on experiments says what they declare, and shows each."""

from benchmarks.experiment_pages import DOCS, PAGE, page
from taichidem.experiments import BUILT_IN


def test_the_page_is_what_the_experiments_declare():
    assert PAGE.read_text() == page(), "run python -m benchmarks.experiment_pages"
    for name, kind in BUILT_IN.items():
        text = page().split(f"(`{name}`)")[1].split("\n## ")[0]
        for setting in kind.settings_type.model_fields:
            assert f"| `{setting}` |" in text
        for observable in kind().observables:
            assert f"| `{observable.name}` | {observable.unit} |" in text
        assert 3_000 < (DOCS / "pictures" / f"experiment_{name}.png").stat().st_size < 150_000


def test_the_page_says_what_is_allowed():
    rows = {line for line in page().splitlines() if line.startswith("| `")}
    assert "| `half_angle` | 30 | deg | > 0, < 90 | Angle of the cone to the vertical. |" in rows
    assert "| `fit_from` | 0.15 | 1 | ≥ 0, < 1 | Start of the fitted flank, share of the cup radius. |" in rows
    assert "| `fit_to` | 0.95 | 1 | > 0 | End of the fitted flank, share of the cup radius. |" in rows
    assert sum("| `rain_top` |  | m | > 0 |" in row for row in rows) == 2
