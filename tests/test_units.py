"""Numbers are SI, texts are converted, and what is no quantity of the right kind is refused."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from taichidem.errors import InputError
from taichidem.units import AngularSpeed, Durations, to_si


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
        ("910 kg/m3", "kg/m^3", 910.0),
        ("38 kJ/m3", "J/m^3", 38e3),
        ("38 kJ/m³", "J/m^3", 38e3),
        ("4 mm2", "m^2", 4e-6),
        ("910 kg m^-3", "kg/m^3", 910.0),
        ("9.81 m/s**2", "m/s^2", 9.81),
        ("600 s-1", "1/s", 600.0),
        ("3 W/(m^2 K)", "W/m^2/K", 3.0),
        ("50 %", "1", 0.5),
        ("30°", "deg", 30.0),
        ("-.5e-3 m", "m", -5e-4),
        ("0.5 turn/s", "rad/s", math.pi),
        ("180 deg/s", "rad/s", math.pi),
        ("5 Hz", "1/s", 5.0),
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
    needed = r"cup_radius is '50 kg': this is in kilogram; it needs a unit that converts to m\."
    with pytest.raises(InputError, match=needed):
        to_si("50 kg", "m", "cup_radius")


@pytest.mark.parametrize(
    "value",
    [
        "fifty",
        "50 foobars",
        "",
        "6 mm mm",
        "3 + 4 mm",
        "3 mm + 4 mm",
        "import os",
        "6 mm 10",
        "6 5 mm",
        "1_0 mm",
        "2*3 mm",
    ],
)
def test_what_is_no_quantity_is_refused(value):
    with pytest.raises(InputError, match=f"width is {re.escape(repr(value))}: "):
        to_si(value, "m", "width")


@pytest.mark.parametrize("value", ["6,5 mm", "6,5", "1,000.5 mm", "3 mm,4"])
def test_a_decimal_comma_is_refused(value):
    with pytest.raises(InputError, match=r"width is .* this is no quantity"):
        to_si(value, "m", "width")
    if value.startswith("6"):
        with pytest.raises(InputError, match=r"write a decimal with a point, 6\.5 and not 6,5"):
            to_si(value, "m", "width")


@pytest.mark.parametrize(
    ("value", "unit"), [("0.1 Hz", "Hz"), ("2 kHz", "kHz"), ("20 1/min", "1/min"), ("3 s^-1", "s^-1")]
)
def test_a_speed_of_rotation_says_what_it_counts(value, unit):
    with pytest.raises(
        InputError, match=re.escape(f"{unit} leaves open whether turns or radians are counted; give rpm")
    ):
        to_si(value, "rad/s", "speed")


def test_the_advice_for_a_pure_number_has_no_unit():
    for value in ("half", True):
        with pytest.raises(InputError, match=r"give a number, such as 0\.5\."):
            to_si(value, "1", "ratio")
    with pytest.raises(InputError, match=r"give a number in m or a text such as '6 m'\."):
        to_si("half", "m", "width")


class Turning(BaseModel):
    speed: AngularSpeed = 1.0
    times: Durations = (1.0,)


def test_a_setting_says_its_value_once():
    with pytest.raises(ValidationError) as error:
        Turning(speed="3 mm")
    assert (
        error.value.errors()[0]["msg"] == "Value error, this is in millimeter; it needs a unit that converts to rad/s."
    )


@pytest.mark.parametrize(
    ("given", "times"), [("0 s, 500 ms", (0.0, 0.5)), ("1,2.5", (1.0, 2.5)), ("3 s", (3.0,)), ([1, "2 s"], (1.0, 2.0))]
)
def test_several_quantities(given, times):
    assert Turning(times=given).times == times


def test_a_comma_between_one_number_and_its_unit_is_no_list():
    with pytest.raises(ValidationError, match=r"write 6\.5 and not 6,5"):
        Turning(times="6,5 s")


@pytest.mark.parametrize("value", [True, None, [1.0], math.nan, math.inf, "nan m", "inf"])
def test_what_is_no_finite_number_is_refused(value):
    with pytest.raises(InputError, match="width is"):
        to_si(value, "m", "width")
