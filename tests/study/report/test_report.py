"""taichidem report: what the page says for each verdict, with pieces missing, with hostile texts."""

from __future__ import annotations

import base64
import io
import json
import re
import sys
from fnmatch import fnmatch
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from taichidem.cli import main
from taichidem.errors import InputError
from taichidem.study import write_report
from tests.study.report import documents

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[3]
VOID = {"meta", "link", "br", "img", "wbr", "input", "hr", "use", "path"}


class Page(HTMLParser):
    """A page taken apart: its text, headings, tables and attributes; refuses tags that don't match."""

    def __init__(self, text: str):
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(text)
        assert self.open == []
        self.text = " ".join(" ".join(self.words).split()).replace("\u00a0", " ")

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_endtag(self, tag):
        if tag not in VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            self.words.append(data)

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


def page_of(folder: Path, *pictures: str, **results) -> Page:
    documents.lay_out(folder, results, pictures)
    return Page(write_report(folder).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def full(tmp_path_factory) -> Page:
    """The page with everything there is."""
    folder = documents.lay_out(
        tmp_path_factory.mktemp("full") / "granules",
        {
            "comparison": documents.comparison(),
            "verdict": documents.verdict("one_of"),
            "addition": documents.addition(),
            "discovery": documents.discovery(),
        },
    )
    return Page(write_report(folder).read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("verdict", "badge", "sentence"),
    [
        ("nothing_missing", "Nothing missing", "agrees with the measurements (error 7.6 → 0.7 standard uncertainties)"),
        (
            "effect",
            "An effect is missing",
            "The model lacks rolling resistance, constant torque (rolling friction 0.124 ± 0.013). Adding it brings the error "
            "of tests held out from the fit from 4.1 to 1.2 standard uncertainties.",
        ),
        (
            "one_of",
            "One of several effects is missing",
            "rolling resistance, constant torque (rolling friction 0.124 ± 0.013) or rolling resistance, spring and dashpot "
            "(rolling friction 0.131 ± 0.016).",
        ),
        (
            "something_else",
            "Something else is missing",
            "no effect in the library explains, not even rolling resistance, constant torque (rolling friction 0.124 ± 0.013). "
            "With it the tests still fail (p < 0.001).",
        ),
        ("cannot_tell", "Can't tell", "can't tell whether an effect is missing"),
    ],
)
def test_each_verdict_has_its_sentence(tmp_path, verdict, badge, sentence):
    page = page_of(tmp_path / "granules", verdict=documents.verdict(verdict))
    assert f"{badge} " in page.text
    assert sentence in page.text
    assert documents.TEXTS[verdict] in page.text
    assert page.text.index(sentence) < page.text.index("Before and after")
    assert ("Measure next:" in page.text) == (verdict not in ("nothing_missing", "effect"))


def test_every_section_of_the_whole_page(full):
    for heading in (
        "The effect that was added",
        "Before and after",
        "What to measure next",
        "Candidate effects",
        "Look-alikes",
        "Parameters",
        "The model as believed, beside the measurements",
        "Pictures",
        "The search, step by step",
        "How it was computed",
        "Terms",
    ):
        assert heading in full.text
    assert "There is no" not in full.text
    for word in ("definitive_screening", "101, 102, 103, 104", "Effects add up", "the hopper arched", "46 min", "368"):
        assert word in full.text
    assert "drum at 2 rpm" in full.text
    assert "can't be told from the best" in full.text
    assert "at its highest value allowed" in full.text
    assert "no test of this study takes the charge into account" in full.text


def test_numbers_stand_in_their_tables(full):
    assert "Cohesion by contact area energy density [J/m³] 21300 ± 4100 21.5 < 0.001 0.21 1.8 7380" in full.text
    assert "granule- granule" not in full.text
    assert re.search(r"hopper_ ?40mm discharge rate \[g/s\] 118\.0 ± 1\.5", full.text)


def test_one_title_and_headings_in_order(full):
    levels = [int(tag[1]) for tag, _ in full.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(b - a <= 1 for a, b in pairwise(levels))


def test_it_can_be_read_without_seeing(full):
    assert full.all("html")[0]["lang"] == "en"
    assert all(svg["role"] == "img" and svg["aria-label"] for svg in full.all("svg"))
    assert len(full.all("img")) == 3
    assert all(image["alt"] for image in full.all("img"))
    assert all("scope" in th for th in full.all("th"))
    assert len(full.all("caption")) == len(full.all("table"))
    ids = [attributes["id"] for _, attributes in full.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    named = {attributes["aria-labelledby"] for _, attributes in full.tags if "aria-labelledby" in attributes}
    assert named <= set(ids)


def test_nothing_is_loaded_from_elsewhere(full):
    for tag, attributes in full.tags:
        for name in ("src", "href", "srcset", "data", "poster", "action"):
            value = attributes.get(name)
            assert value is None or value.startswith(("data:", "#")), (tag, value)
        assert "url(http" not in (attributes.get("style") or "")
        assert not any(name.startswith("on") for name in attributes)
    assert {"script", "iframe", "object", "embed"}.isdisjoint(tag for tag, _ in full.tags)
    policies = [m["content"] for m in full.all("meta") if m.get("http-equiv") == "Content-Security-Policy"]
    assert policies == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]


def test_the_style_loads_nothing_either():
    style = (ROOT / "taichidem/study/report/templates/page.css").read_text()
    assert "url(" not in style
    assert "@import" not in style


def test_hostile_texts_stay_texts(tmp_path):
    texts = {
        "comparison": documents.comparison(),
        "verdict": documents.verdict("one_of"),
        "addition": documents.addition(),
        "discovery": documents.discovery(),
    }
    folder = tmp_path / 'a "b" & <i>'
    page = page_of(folder, **{kind: documents.hostile(document) for kind, document in texts.items()})
    assert "script" not in {tag for tag, _ in page.tags}
    assert "i" not in {tag for tag, _ in page.tags}
    assert page.text.count("<script>alert(1)</script>") > 50
    assert "{{ 7 * 7 }}" in page.text
    assert " 49 " not in page.text
    assert "taichidem compare 'a \"b\" & <i>'" not in page.text  # it is there already
    assert "'a \"b\" & <i>'" in page.text  # quoted for a shell


@pytest.mark.parametrize(
    ("there", "commands"),
    [
        (
            {"comparison": documents.comparison()},
            ["diagnose granules", "add granules EFFECT -o NEW", "discover granules"],
        ),
        ({"verdict": documents.verdict("effect")}, ["compare granules", "add granules rolling_constant_torque -o"]),
        ({"verdict": documents.verdict("cannot_tell")}, ["compare granules", "add granules EFFECT -o NEW"]),
        ({"addition": documents.addition()}, ["compare granules", "diagnose granules"]),
        ({"discovery": documents.discovery()}, ["compare granules", "diagnose granules", "add granules EFFECT"]),
    ],
)
def test_what_is_missing_says_how_to_make_it(tmp_path, there, commands):
    page = page_of(tmp_path / "granules", **there)
    for command in commands:
        assert f"taichidem {command}" in page.text


def test_headline_without_a_verdict(tmp_path):
    compared = page_of(tmp_path / "a", comparison=documents.comparison())
    assert (
        "7 of 8 measured observables lie beyond what the uncertainties explain (p < 0.001 for all together)."
        in compared.text
    )
    added = page_of(tmp_path / "b", addition=documents.addition())
    assert "was added (rolling friction 0.124 ± 0.013). This brings the error of tests held out" in added.text


def test_results_with_almost_nothing_in_them(tmp_path):
    empty = {
        "comparison": {"schema": 1},
        "verdict": {
            "schema": 1,
            "verdict": "one_of",
            "table": None,
            "next_measurement": {},
            "chi2": {"believed": float("nan")},
        },
        "addition": {"schema": 1, "effect": "air_drag"},
        "discovery": {"schema": 1},
    }
    page = page_of(tmp_path / "granules", **empty)
    assert "granules" in page.text
    assert "nan" not in page.text.lower().replace("explanation", "")
    assert "None" not in page.text


def test_pictures_that_are_missing_broken_or_elsewhere_are_said_so(tmp_path):
    comparison = documents.comparison()
    comparison["pictures"] = {
        "heap_a": "gone.png",
        "heap_b": "text.png",
        "heap_c": "../study.toml",
        "series_d": "good.png",
    }
    folder = documents.lay_out(tmp_path / "granules", {"comparison": comparison}, ["good.png"])
    (folder / "results" / "text.png").write_text("no picture")
    page = Page(write_report(folder).read_text(encoding="utf-8"))
    assert len(page.all("img")) == 1
    assert "Heap: a: gone.png is not there" in page.text
    assert "Heap: b: text.png is no picture" in page.text
    assert "Heap: c: ../study.toml lies outside the folder of results." in page.text


def test_a_large_picture_is_made_small_enough_to_mail(tmp_path):
    from PIL import Image

    from taichidem.study.report.embedded import WIDEST, pictures

    speckled = np.random.default_rng(1).integers(0, 256, (1000, 3000, 3), dtype=np.uint8)
    Image.fromarray(speckled).save(tmp_path / "wide.png")
    (picture,) = pictures({"heap_wide": "wide.png"}, tmp_path)
    assert (picture.width, picture.height) == (WIDEST, round(WIDEST / 3))
    kind, _, content = picture.source.partition(",")
    assert kind == "data:image/webp;base64"
    shown = Image.open(io.BytesIO(base64.b64decode(content)))
    assert shown.size == (picture.width, picture.height)
    assert len(content) < (tmp_path / "wide.png").stat().st_size / 5
    assert not pictures({"standardised_errors": "wide.png", "waterfall": "wide.png"}, tmp_path)  # drawn by the page


def test_long_lists_of_failures_are_cut(tmp_path):
    comparison = documents.comparison()
    comparison["failures"] = [{"experiment": "heap", "seed": i, "reason": "overflow"} for i in range(100)]
    page = page_of(tmp_path / "granules", comparison=comparison)
    assert "heap, seed 29: overflow" in page.text
    assert "heap, seed 30: overflow" not in page.text
    assert "and 70 more" in page.text


def test_many_tests_become_several_charts(tmp_path):
    verdict = documents.verdict("effect")
    row = verdict["standardised_errors"][0]
    verdict["standardised_errors"] = [{**row, "label": f"fall at {i} s"} for i in range(60)]
    page = page_of(tmp_path / "granules", verdict=verdict)
    assert len(page.all("svg")) == 1 + 3


def test_no_results_is_an_error_that_names_the_commands(tmp_path):
    folder = documents.lay_out(tmp_path / "granules", {}, [])
    with pytest.raises(InputError, match=r"none of comparison.json.*taichidem compare granules.*--results"):
        write_report(folder)
    with pytest.raises(InputError, match=r"There is no study file .*study.toml"):
        write_report(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", r"verdict.json is not valid JSON .* Make it anew with `taichidem diagnose granules`"),
        (b"\xff\xfe", "is not valid JSON"),
        ("[]", "holds no JSON object"),
        ('{"verdict": "effect"}', "has schema None; this version reads 1"),
        ('{"schema": 2}', "has schema 2"),
        ('{"schema": 1, "verdict": "perhaps"}', "verdict is 'perhaps'"),
        (
            '{"schema": 1, "verdict": "effect", "table": [{"effect": "a", "strength": "much"}]}',
            "table.0.strength is 'much'",
        ),
    ],
)
def test_broken_results_are_told_in_words(tmp_path, content, said):
    folder = documents.lay_out(tmp_path / "granules", {}, [])
    file = folder / "results" / "verdict.json"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError, match=said):
        write_report(folder)


def test_where_it_is_written(tmp_path):
    folder = documents.lay_out(tmp_path / "granules", {"comparison": documents.comparison()})
    assert write_report(folder / "study.toml") == folder / "results" / "report.html"
    assert write_report(folder, tmp_path / "mail" / "page.html") == tmp_path / "mail" / "page.html"
    assert write_report(folder, tmp_path) == tmp_path / "report.html"
    (folder / "results").rename(tmp_path / "elsewhere")
    assert write_report(folder, results=tmp_path / "elsewhere") == tmp_path / "elsewhere" / "report.html"
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"can't be written .* -o"):
        write_report(folder, tmp_path / "file" / "page.html", results=tmp_path / "elsewhere")


def test_the_command(tmp_path, capsys):
    folder = documents.lay_out(tmp_path / "granules", {"verdict": documents.verdict("effect")})
    with pytest.raises(SystemExit) as end:
        main(["report", str(folder)])
    assert end.value.code == 0
    assert capsys.readouterr().out.split() == ["wrote", str(folder / "results" / "report.html")]
    with pytest.raises(SystemExit):
        main(["report", str(folder), "-o", str(tmp_path / "a.html"), "--json"])
    assert json.loads(capsys.readouterr().out) == {"report": str(tmp_path / "a.html")}
    with pytest.raises(SystemExit) as end:
        main(["report", str(tmp_path)])
    assert end.value.code == 2
    assert "Error: There is no study file" in capsys.readouterr().err


def test_templates_are_installed_with_the_package():
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]
    room = ROOT / "taichidem" / "study" / "report"
    files = [p.relative_to(room).as_posix() for p in (room / "templates").iterdir()]
    assert len(files) > 5
    assert all(any(fnmatch(f, pattern) for pattern in patterns["taichidem.study.report"]) for f in files)
