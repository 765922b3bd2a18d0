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
