"""Numbers are SI, texts are converted, and what is no quantity of the right kind is refused."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichidem.errors import InputError
from taichidem.units import to_si


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (3, "m", 3.0),
        (0.25, "kg/m^3", 0.25),
        ("6 mm", "m", 0.006),
        ("6mm", "m", 0.006),
        ("1e-3", "m", 1e-3),
        (" 0.05 ", "m", 0.05),
        ("0.91 g/cm^3", "kg/m^3", 910.0),
        ("20 rpm", "rad/s", 20 * 2 * math.pi / 60),
        ("10 MPa", "Pa", 1e7),
        ("600 1/s", "1/s", 600.0),
        ("36 km/h", "m/s", 10.0),
        ("30 deg", "deg", 30.0),
        ("0.52", "1", 0.52),
    ],
)
def test_quantities_become_si(value, unit, expected):
    assert to_si(value, unit) == pytest.approx(expected, rel=1e-12)


@given(st.floats(min_value=1e-6, max_value=1e6))
def test_a_thousandth_is_a_thousandth(number):
    assert to_si(f"{number!r} mm", "m") == pytest.approx(number / 1000, rel=1e-12)
    assert to_si(number, "m") == number


@given(st.integers(1, 10**6))
def test_a_quantity_is_the_same_number_however_it_is_written(number):
    assert to_si(f"{number} mm", "m") == to_si(number / 1000, "m")
    assert to_si(f"{number / 1000} MPa", "Pa") == to_si(number * 1000, "Pa")


def test_a_mismatch_names_what_was_given_and_what_is_needed():
    with pytest.raises(InputError, match=r"cup_radius is '50 kg', in kilogram; it needs a unit that converts to m\."):
        to_si("50 kg", "m", "cup_radius")


@pytest.mark.parametrize("value", ["fifty", "50 foobars", "", "6 mm mm", "3 + 4 mm", "import os"])
def test_what_is_no_quantity_is_refused(value):
    with pytest.raises(InputError, match="width is"):
        to_si(value, "m", "width")


@pytest.mark.parametrize("value", [True, None, [1.0], math.nan, math.inf, "nan m", "inf"])
def test_what_is_no_finite_number_is_refused(value):
    with pytest.raises(InputError, match="width is"):
        to_si(value, "m", "width")
