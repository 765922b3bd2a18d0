"""What the pictures of a diagnosis show, and their way into files and pages."""

import re
from xml.etree import ElementTree

import pytest
from PIL import Image

from taichidem.study.report import write_look_alikes, write_standardised_errors, write_waterfall
from taichidem.study.report.chart_errors import describe_errors, errors_figure
from taichidem.study.report.chart_look_alikes import _channels, _luminance, cell_colour, cell_text, light_ink
from taichidem.study.report.chart_style import as_svg
from taichidem.study.report.chart_waterfall import describe_waterfall, waterfall_figure
from taichidem.study.report.series import look_alikes, test_errors, waterfall_steps
from tests.study.report import documents


def test_the_waterfall_of_a_verdict_gives_recalibration_a_step_of_its_own():
    believed, recalibrated, added = waterfall_steps(documents.verdict("effect"))
    assert [s.step for s in (believed, recalibrated, added)] == ["believed", "recalibrated", "with_effect"]
    assert (believed.chi2, added.chi2) == (462.0, 6.3)
    assert believed.dof == 9  # eight tests and a parameter measured directly; nothing is fitted yet
    assert (recalibrated.dof, added.dof) == (5, 4)
    assert recalibrated.fitted == pytest.approx((recalibrated.chi2 / 8) ** 0.5)
    assert [s.held_out for s in (believed, recalibrated, added)] == [None, 4.1, 1.2]
    assert added.label == "+ Rolling resistance, constant torque"


def test_the_waterfall_of_an_addition_takes_its_own_numbers():
    steps = waterfall_steps(documents.addition())
    assert [(s.chi2, s.fitted, s.held_out) for s in steps] == [(462.0, 7.6, None), (57.7, 2.8, 4.1), (6.3, 0.8, 1.2)]
    assert "6.3 at 4 degrees of freedom" in describe_waterfall(steps)


def test_where_nothing_was_added_there_are_two_steps():
    assert [s.step for s in waterfall_steps(documents.verdict("nothing_missing"))] == ["believed", "recalibrated"]


def bars(axes):
    return [p for p in axes.patches if p.get_width() > 0 and p.get_height() > 0]


def test_what_fell_is_an_empty_bar_between_before_and_after():
    figure = waterfall_figure(waterfall_steps(documents.addition()))
    upper, lower = figure.axes
    spans = [(round(b.get_y(), 1), round(b.get_y() + b.get_height(), 1)) for b in bars(upper)]
    assert spans == [(0, 462.0), (0, 57.7), (57.7, 462.0), (0, 6.3), (6.3, 57.7)]
    assert [round(b.get_height(), 1) for b in bars(lower)] == [7.6, 2.8, 4.1, 0.8, 1.2]
    assert len(waterfall_figure([s for s in waterfall_steps({"waterfall": [{"chi2": 3.0}], "effect": "e"})]).axes) == 1


def test_errors_of_each_step_stand_where_they_belong():
    tests = test_errors(documents.verdict("effect"))
    (axes,) = errors_figure(tests).axes
    lines = {line.get_label(): line for line in axes.lines}
    assert list(lines["with the effect"].get_xdata()) == [row[8] for row in documents.TESTS]
    assert list(lines["as believed"].get_ydata()) == list(range(8))
    assert [label.get_text() for label in axes.get_yticklabels()] == [row[0] for row in documents.TESTS]
    assert axes.get_ylim()[0] > axes.get_ylim()[1]  # the first test on top
    assert "heap: as believed −8.2, re-calibrated −2.2, with the effect +0.7" in describe_errors(tests)


def test_one_huge_error_does_not_hide_the_others():
    document = documents.comparison()
    document["rows"][0]["z"] = -4000.0
    (axes,) = errors_figure(test_errors(document)).axes
    assert axes.get_xscale() == "symlog"
    assert axes.get_xlim()[0] < -4000


def test_look_alikes_are_symmetric_also_where_one_row_lacks_a_number():
    matrix = look_alikes(documents.verdict("one_of"))
    size = len(matrix.effects)
    assert size == len(documents.CANDIDATES)
    assert all(matrix.rho[i][j] == matrix.rho[j][i] for i in range(size) for j in range(size))
    assert matrix.rho[0][1] == 0.97
    assert [matrix.rho[i][i] for i in range(size)] == [1.0] * size
    unknown = look_alikes({"verdict": "one_of", "table": [{"effect": "a"}, {"effect": "b"}]})
    assert unknown.rho == ((1.0, None), (None, 1.0))


def test_numbers_of_the_matrix_can_be_read_on_their_colour():
    for rho in (i / 100 for i in range(-100, 101)):
        letters = 1.0 if light_ink(rho) else _luminance((0x1F, 0x29, 0x33))
        high, low = sorted((letters, _luminance(_channels(rho))), reverse=True)
        assert (high + 0.05) / (low + 0.05) > 3.5, rho
    assert cell_colour(0.0) == "#ffffff"
    assert [cell_text(r) for r in (1.0, 0.97, -0.31, -0.001, None)] == ["1.00", ".97", "−.31", ".00", "–"]


def test_the_pictures_as_files(tmp_path):
    for write, document in (
        (write_waterfall, documents.addition()),
        (write_waterfall, documents.verdict("one_of")),
        (write_look_alikes, documents.verdict("one_of")),
        (write_standardised_errors, documents.addition()),
    ):
        with Image.open(write(document, tmp_path)) as image:
            assert image.width > 600
    assert {p.name for p in tmp_path.iterdir()} == {"waterfall.png", "look_alikes.png", "standardised_errors_after.png"}


def test_where_there_is_nothing_to_draw_there_is_no_file(tmp_path):
    empty = {"verdict": "cannot_tell"}
    assert [w(empty, tmp_path) for w in (write_waterfall, write_look_alikes, write_standardised_errors)] == [None] * 3
    assert not list(tmp_path.iterdir())


def test_hostile_texts_are_drawn_as_they_are(tmp_path):
    assert write_waterfall(documents.hostile(documents.addition()), tmp_path)
    assert write_look_alikes(documents.hostile(documents.verdict("one_of"), "$\\frac{$ \x00 _^{}"), tmp_path)
    assert write_standardised_errors(documents.hostile(documents.verdict("effect"), "$\\frac{1}$\n\n%s"), tmp_path)


def test_svg_stands_in_a_page_among_others():
    steps = waterfall_steps(documents.addition())
    one, two = (as_svg(waterfall_figure(steps), name, 'a "description" <b> & more') for name in ("one", "two"))
    ids = [set(re.findall(r'\bid="([^"]+)"', svg)) for svg in (one, two)]
    assert ids[0]
    assert not ids[0] & ids[1]
    used = set(re.findall(r'href="#([^"]+)"', one)) | set(re.findall(r"url\(#([^)]+)\)", one))
    assert used <= ids[0]
    root = ElementTree.fromstring(one)
    assert root.get("aria-label") == 'a "description" <b> & more'
    assert root.get("viewBox")
    assert root.get("width") is None
    assert "http" not in one
    assert one == as_svg(waterfall_figure(steps), "one", 'a "description" <b> & more')  # the same to the last byte
