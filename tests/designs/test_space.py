"""Factors and factor spaces: coding there and back, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from designs import DesignError, Factor, FactorSpace


@settings(deadline=None)
@given(
    low=st.floats(-1e6, 1e6),
    span=st.floats(1e-3, 1e6),
    coded=st.lists(st.floats(-2, 2), min_size=1, max_size=8),
)
def test_coding_goes_there_and_back(low, span, coded):
    factor = Factor("x", low, low + span)
    points = np.array(coded)
    np.testing.assert_allclose(factor.to_coded(factor.to_natural(points)), points, atol=1e-6)
    assert list(factor.to_natural(np.array([-1.0, 1.0]))) == [low, low + span]


@settings(deadline=None)
@given(exponent=st.floats(-5, 9), decades=st.floats(0.1, 6), coded=st.floats(-1.5, 1.5))
def test_log_coding_goes_there_and_back(exponent, decades, coded):
    low = 10.0**exponent
    factor = Factor("x", low, low * 10**decades, log=True)
    natural = factor.to_natural(np.array([-1.0, 0.0, coded]))
    assert natural[0] == pytest.approx(low, rel=1e-9)
    assert natural[1] == pytest.approx(np.sqrt(factor.low * factor.high), rel=1e-9)
    assert factor.to_coded(natural)[2] == pytest.approx(coded, abs=1e-6)


def test_natural_values_print_clean():
    assert Factor("x", 0.1, 0.6).to_natural(np.array([0.0]))[0] == 0.35
    assert Factor("x", 0.3, 0.97).to_natural(np.array([0.0]))[0] == 0.635


def test_levels_are_hit_equally_often():
    factor = Factor("sieve", 1, 4, levels=(1, 2, 4))
    coded = factor.from_unit((np.arange(30) + 0.5) / 30)
    assert sorted(np.unique(factor.to_natural(coded), return_counts=True)[1]) == [10, 10, 10]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"name": "x", "low": 2, "high": 1}, ["low = 2", "high = 1", "Swap"]),
        ({"name": "x", "low": 1, "high": 1}, ["low must be below high"]),
        ({"name": "x", "low": float("nan"), "high": 1}, ["low = nan", "finite number"]),
        ({"name": "x", "low": "a", "high": 1}, ["low = 'a'"]),
        ({"name": "seed", "low": 0, "high": 1}, ["'seed'", "Rename"]),
        ({"name": "a*b", "low": 0, "high": 1}, ["'a*b'", "products"]),
        ({"name": " x", "low": 0, "high": 1}, ["' x'", "blanks"]),
        ({"name": "x", "low": 0, "high": 1, "log": True}, ["log = true", "low > 0"]),
        ({"name": "e", "low": 0.5, "high": 1.2, "highest": 1}, ["physical bounds", "−∞ … 1"]),
        ({"name": "x", "low": 0, "high": 3, "levels": (0, 1)}, ["levels", "end at high = 3"]),
    ],
)
def test_bad_factors_are_refused_with_reasons(arguments, words):
    with pytest.raises(DesignError) as caught:
        Factor(**arguments)
    for word in words:
        assert word in str(caught.value)


def test_duplicate_names_are_refused_also_when_only_capitals_differ():
    with pytest.raises(DesignError, match="'Friction' is given twice"):
        FactorSpace([Factor("friction", 0, 1), Factor("Friction", 0, 1)])


def test_an_empty_space_is_refused():
    with pytest.raises(DesignError, match="at least one factor"):
        FactorSpace([])


def test_unknown_factor_names_the_nearest():
    with pytest.raises(DesignError, match="Did you mean 'friction'"):
        FactorSpace([Factor("friction", 0, 1)])["fricton"]


def test_toml(tmp_path):
    path = tmp_path / "factors.toml"
    path.write_text(
        '[factors.friction]\nlow = 0.1\nhigh = 0.6\n[factors."cohesion_jkr.energy"]\nlow = 1e-3\nhigh = 1\nlog = true\n'
        'unit = "J/m²"\n[factors.sieve]\nlevels = [1, 2, 4]\n',
        encoding="utf-8",
    )
    space = FactorSpace.from_toml(path)
    assert space.names == ("friction", "cohesion_jkr.energy", "sieve")
    assert space["cohesion_jkr.energy"].log
    assert space["cohesion_jkr.energy"].unit == "J/m²"
    assert (space["sieve"].low, space["sieve"].high) == (1, 4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[factors.x]\nlow = 1\n", "no high"),
        ("[factors.x]\nlow = 1\nhihg = 2\n", "Did you mean 'high'"),
        ("x = 1\n", r"\[factors.NAME\]"),
        ("[factors.x\n", "not valid TOML"),
        ("[factors]\nx = 3\n", "write a table"),
    ],
)
def test_bad_toml_is_refused(tmp_path, text, words):
    path = tmp_path / "factors.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DesignError, match=words):
        FactorSpace.from_toml(path)


def test_missing_toml_is_refused(tmp_path):
    with pytest.raises(DesignError, match="There is no file"):
        FactorSpace.from_toml(tmp_path / "no.toml")
