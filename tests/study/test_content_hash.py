"""Runs that mean the same have one key; any change of meaning changes it."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from taichidem.effects import BodyGravity, Elongation, NormalHertz, RollingConstantTorque, TangentialMindlin
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.shapes import Superquadric
from taichidem.study import Run, content_hash
from taichidem.study.content_hash import canonical_json, run_key
from tests.study.fakes import OtherNormal, Quick

SHARE = st.floats(0.01, 1.0)
SIZE = st.floats(0.01, 10.0)

QUICK = Quick(width=0.05, depth=0.001)


def model(e=0.5, mu=0.4, rolling=0.1, g=-9.81, density=1000.0, attraction=True, order=1, **materials):
    grain = replace(Material("grain", density, 1e7, 0.3), **materials)
    wall = Material("wall", 7800.0, 1e9, 0.3)
    effects = [
        NormalHertz(restitution=e, attraction=attraction),
        TangentialMindlin(static_friction=mu),
        RollingConstantTorque(rolling_friction=rolling),
        BodyGravity(z=g),
    ]
    return Model((grain, wall), effects[::order])


def key(made=None, seed=1, **settings):
    return run_key(Quick(**{"width": 0.05, "depth": 0.001, **settings}), made or model(), seed)


@given(SHARE, SHARE, SIZE, st.integers(0, 2**40))
def test_equal_runs_have_equal_keys(e, mu, width, seed):
    first = key(model(e, mu), seed, width=width)
    assert first == key(model(e, mu, order=-1), seed, width=width)  # effects have no order
    tables = {"e": {"grain-grain": e, "wall-grain": e}, "mu": {"grain-wall": mu, "grain-grain": mu, "wall-wall": mu}}
    assert first == key(model(tables["e"], tables["mu"]), seed, width=width)  # a table that says what the number says
    assert first == key(model(np.float64(e), mu), np.int64(seed), width=width)
    assert len(first) == 64


@given(SHARE, SHARE)
def test_pairs_have_no_order_and_their_values_count(a, b):
    first = key(model({"grain-grain": a, "grain-wall": b}))
    assert first == key(model({"wall-grain": b, "grain-grain": a}))
    assert (first == key(model({"grain-grain": b, "grain-wall": a}))) == (a == b)


@given(SHARE, st.data())
def test_the_smallest_change_of_a_number_changes_the_key(value, data):
    other = math.nextafter(value, 0.0)
    made = data.draw(
        st.sampled_from(
            [
                lambda x: key(model(e=x)),
                lambda x: key(model(mu={"grain-grain": x, "grain-wall": 0.2})),
                lambda x: key(model(rolling=x)),
                lambda x: key(model(g=-x)),
                lambda x: key(model(density=x)),
                lambda x: key(width=x),
            ]
        )
    )
    assert made(value) == made(value)
    assert made(value) != made(other)


CHANGES = {
    "seed": lambda: key(seed=2),
    "restitution": lambda: key(model(e=0.6)),
    "one pair": lambda: key(model(e={"grain-grain": 0.5, "grain-wall": 0.6})),
    "option": lambda: key(model(attraction=False)),
    "gravity": lambda: key(model(g=-9.8)),
    "density": lambda: key(model(density=1001.0)),
    "modulus": lambda: key(model(youngs_modulus=2e7)),
    "Poisson's ratio": lambda: key(model(poissons_ratio=0.31)),
    "name of a material": lambda: key(model(name="other")),
    "an effect less": lambda: key(Model(model().materials, model().effects[:3])),
    "another effect of the family": lambda: key(
        Model(model().materials, [OtherNormal(restitution=0.5), *model().effects[1:]])
    ),
    "order of materials": lambda: key(Model(model().materials[::-1], model().effects)),
    "form of the grains": lambda: key(replace(model(), shape=Superquadric.spheroid(1.5))),
    "another form": lambda: key(replace(model(), shape=Superquadric.spheroid(1.6))),
    "form by an effect": lambda: key(Model(model().materials, [*model().effects, Elongation(aspect_ratio=1.5)])),
    "setting": lambda: key(width=0.051),
    "setting with a default": lambda: key(diameter=0.0041),
    "text of a setting": lambda: key(wall_material="wall"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_everything_that_matters_changes_the_key(change):
    assert CHANGES[change]() != key()


def test_all_changes_differ_from_one_another():
    keys = [made() for made in CHANGES.values()]
    assert len(set(keys)) == len(keys)


def test_another_type_of_experiment_with_the_same_settings_has_another_key():
    class Quicker(Quick):
        name = "quicker"

    assert run_key(Quicker(width=0.05, depth=0.001), model(), 1) != key()


def test_a_default_that_is_written_out_and_units_change_nothing():
    assert key(depth=0.001) == key(depth="1 mm", width="50 mm") == key(failing_seed=-1, diameter=0.004)


def test_names_of_experiments_are_no_part_of_it():
    assert Run(QUICK, model(), 1, "a").key == Run(QUICK, model(), 1, "b").key == key()


def test_the_version_of_physics_counts(monkeypatch):
    before = key()
    monkeypatch.setattr(content_hash, "PHYSICS_VERSION", "another")
    assert key() != before


def test_an_outside_plugin_may_state_its_version(monkeypatch):
    before = key()
    monkeypatch.setattr(Quick, "version", "2", raising=False)
    changed = key()
    monkeypatch.setattr(NormalHertz, "version", "2", raising=False)
    assert len({before, changed, key()}) == 3


def test_a_table_that_leaves_a_touching_pair_out_is_not_its_one_number():
    """It can't be simulated, and its failure must not stand in the way of the model that can."""
    assert key(model({"grain-grain": 0.5})) != key(model(0.5))


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**60), 2**60) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)


@given(VALUES)
def test_canonical_json_is_json_and_stable(value):
    text = canonical_json(value)
    assert canonical_json(json.loads(text)) == text


@given(st.dictionaries(st.text(max_size=4), st.integers(), max_size=5))
def test_keys_have_no_order(value):
    assert canonical_json(value) == canonical_json(dict(reversed(value.items())))


FINITE = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=False)


@given(FINITE, FINITE | st.just(-0.0))
def test_numbers_are_equal_exactly_when_their_texts_are(a, b):
    assert (canonical_json(a) == canonical_json(b)) == (a == b)


def test_numbers_of_any_type_are_one():
    same = [2, 2.0, np.float64(2), np.int32(2), np.float32(2)]
    assert {canonical_json(value) for value in same} == {"2.0"}
    assert canonical_json([True, np.bool_(True), 1, 0.0, -0.0]) == "[true,true,1.0,0.0,0.0]"
    assert canonical_json([5e-324, -5e-324]) == "[0.0,0.0]"
    assert canonical_json(2**53 + 1) != canonical_json(2**53)
    assert canonical_json(np.arange(2)) == canonical_json((0, 1)) == "[0.0,1.0]"
    with pytest.raises(TypeError, match="can't be written"):
        canonical_json(object())


def test_the_key_stays_what_it_is():
    """A store outlives its program: if this changes without a reason, every stored run is computed again."""
    assert canonical_json({"b": [1, 0.1], "a": None}) == '{"a":null,"b":[1.0,0.1]}'
    content = json.dumps({"seed": 1.0, "width": 0.05}, sort_keys=True, separators=(",", ":"))
    assert canonical_json({"width": 0.05, "seed": 1}) == content
