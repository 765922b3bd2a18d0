"""The page in a real browser without a screen: on a phone, on a desktop, on paper."""

import pytest

from taichidem.study import write_report
from tests.study.report import browser, documents

PHONE, DESKTOP = 360, 1280

pytestmark = pytest.mark.skipif(
    browser.find() is None,
    reason="no browser: install chromium (apt-get install chromium) or name one in the variable CHROMIUM",
)


def everything(kind: str = "one_of") -> dict:
    return {
        "comparison": documents.comparison(),
        "verdict": documents.verdict(kind),
        "addition": documents.addition(),
        "discovery": documents.discovery(),
    }


STUDIES = {
    "everything": everything(),
    "hostile": {kind: documents.hostile(document) for kind, document in everything().items()},
    "long words": {k: documents.hostile(d, "w" * 90) for k, d in everything("something_else").items()},
    "verdict only": {"verdict": documents.verdict("cannot_tell")},
    "comparison only": {"comparison": documents.comparison()},
}


@pytest.mark.parametrize("name", STUDIES)
def test_the_page_fits_phone_and_desktop_and_asks_for_nothing(tmp_path, name):
    folder = documents.lay_out(tmp_path / "granules", STUDIES[name])
    phone, desktop = seen = browser.measure(write_report(folder, tmp_path / "page.html"), (PHONE, DESKTOP))[0]
    assert [view["width"] for view in seen] == [PHONE, DESKTOP]
    for view in seen:
        assert view["scroll"] <= view["width"]
        assert view["requests"] == []
        assert view["scripts"] == 0
        assert all(width > 0 for width in view["images"])
        assert all(200 < width <= view["width"] for width in view["charts"])
        assert view["headings"].count(1) == 1
    assert len(phone["images"]) == len(desktop["images"])


def test_the_console_stays_silent(tmp_path):
    folder = documents.lay_out(tmp_path / "granules", everything())
    assert browser.measure(write_report(folder, tmp_path / "page.html"), (PHONE,))[1] == []


def test_it_prints(tmp_path):
    folder = documents.lay_out(tmp_path / "granules", everything())
    assert 3 <= browser.pdf_pages(write_report(folder, tmp_path / "page.html")) <= 12


def test_these_checks_would_notice(tmp_path):
    """A page that is too wide, asks for a picture that isn't there, and complains."""
    page = tmp_path / "bad.html"
    page.write_text(
        '<!DOCTYPE html><title>bad</title><h1>bad</h1><div style="width:2000px">wide</div><img src="/gone.png">'
        '<script>console.error("a complaint")</script>'
    )
    (seen,), console = browser.measure(page, (PHONE,))
    assert seen["scroll"] > seen["width"]
    assert seen["images"] == [0]
    assert seen["scripts"] == 1
    assert any(name.endswith("/gone.png") for name in seen["requests"])
    assert any("a complaint" in line for line in console)
