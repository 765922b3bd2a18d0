"""Numbers and units as people read them."""

import math

import pytest

from taichidem.study.report import wording


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (12.0, "12"),
        (-0.25, "−0.25"),
        (1234.5678, "1235"),
        (0.000123456, "0.0001235"),
        (9.99996, "10"),
        (2.1e-12, "2.100 × 10⁻¹²"),
        (-3.4e8, "−3.400 × 10⁸"),
        (None, "–"),
        (math.nan, "–"),
        (math.inf, "–"),
    ],
)
def test_numbers(value, text):
    assert wording.number(value).replace("\u00a0", " ") == text


@pytest.mark.parametrize(
    ("value", "u", "text"),
    [
        (0.12345, 0.0132, "0.123 ± 0.013"),
        (31.4, 0.6, "31.40 ± 0.60"),
        (21300.0, 4100.0, "21300 ± 4100"),
        (21345.0, 4123.0, "21300 ± 4100"),
        (-0.004, 0.02, "−0.004 ± 0.020"),
        (0.0, 0.4, "0.00 ± 0.40"),
        (2.1e-12, 9e-13, "(2.10 ± 0.90) × 10⁻¹²"),
        (5e7, 2e6, "(5.00 ± 0.20) × 10⁷"),
        (0.5, 0.0996, "0.50 ± 0.10"),
        (0.3, None, "0.3"),
        (0.3, 0.0, "0.3"),
        (None, 0.1, "–"),
    ],
)
def test_the_uncertainty_has_two_digits_and_sets_the_place(value, u, text):
    assert wording.plus_minus(value, u).replace("\u00a0", " ") == text


def test_errors_carry_their_sign():
    assert [wording.standardised(z) for z in (3.14, -0.04, -2.5, None)] == ["+3.1", "0.0", "−2.5", "–"]


def test_small_probabilities_are_only_called_small():
    assert [wording.probability(p) for p in (1e-9, 0.0123, 0.456, None)] == ["< 0.001", "0.012", "0.46", "–"]


def test_units():
    assert [wording.unit(u) for u in ("1", "deg", "kg/m^3", "J/m^2")] == ["", "°", "kg/m³", "J/m²"]
    assert wording.with_unit("0.12", "1") == "0.12"
    assert wording.with_unit("31.4\u00a0±\u00a00.6", "deg") == "(31.4\u00a0±\u00a00.6)°"
    assert wording.with_unit("541", "kg/m^3") == "541\u00a0kg/m³"


def test_wall_times():
    assert [wording.duration(s) for s in (3.21, 45, 312.4, 9000, None)] == ["3.2 s", "45 s", "5 min", "2 h 30 min", "–"]


def test_lists_and_settings():
    assert wording.listed(["a", "b", "c"], "or") == "a, b or c"
    assert wording.listed([]) == ""
    assert wording.plain({"seeds": [1, 2], "centre_points": True, "x": None}) == "seeds 1, 2, centre points yes, x –"
