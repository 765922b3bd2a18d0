"""What is copied from the paper agrees with itself and with our designs."""

from __future__ import annotations

import numpy as np
import pytest

from taichidem import plugins
from taichidem.library import polypropylene
from taichidem.paper import published
from taichidem.paper.effort import FULL, QUICK
from taichidem.paper.heaps import model_at
from taichidem.study.content_hash import model_as_dict


def test_table_3_is_a_plackett_burman_design_over_the_ranges_of_table_2():
    table = published.plackett_burman()
    coded = published.factor_space(published.SCREENED).to_coded(table)
    assert coded.shape == (12, 9)
    assert set(np.unique(np.round(coded, 9))) == {-1.0, 1.0}
    np.testing.assert_allclose(coded.T @ coded, 12 * np.eye(9), atol=1e-9)
    assert np.allclose(coded.sum(axis=0), 0)


def test_table_5_is_the_face_centred_design_of_the_registry():
    table = published.central_composite()
    space = published.factor_space(published.SURFACE)
    ours = plugins.get("design", "central_composite")(kind="face_centred").generate(space)
    names = list(space.names)
    assert sorted(map(tuple, table[names].to_numpy())) == sorted(map(tuple, ours.table[names].to_numpy()))


def test_fixed_values_lie_in_the_ranges_and_are_the_models_own():
    assert all(f.low <= f.fixed <= f.high for f in published.FACTORS)
    assert model_as_dict(model_at({}, stiffness=1e7 / 1.3e9)) == model_as_dict(polypropylene())


@pytest.mark.parametrize("factor", published.FACTORS, ids=lambda f: f.letter)
def test_each_factor_moves_one_number_of_the_model(factor):
    def numbers(value):
        model = model_at({factor.letter: value}, stiffness=1.0)
        held = {"grain": vars(model.materials[0]), **{effect.name: effect.values for effect in model.effects}}
        return dict(_flat(held))

    low, high = numbers(factor.low), numbers(factor.high)
    (moved,) = [name for name in low if low[name] != high[name]]
    scale = 1e9 if factor.unit == "GPa" else 1.0
    assert (low[moved], high[moved]) == (factor.low * scale, factor.high * scale)
    wall = "steel" in factor.meaning
    if "–" in factor.meaning:
        assert ("steel" in moved) == wall
        kind = factor.meaning.split(" PP")[0].replace(" ", "_")
        assert kind in moved


def _flat(value, name=""):
    if isinstance(value, dict):
        for key, held in value.items():
            yield from _flat(held, f"{name}/{key}")
    elif isinstance(value, list):
        for number, held in enumerate(value):
            yield from _flat(held, f"{name}/{number}")
    else:
        yield name, value


def test_softening_lowers_young_s_modulus_only_and_keeps_its_ratio():
    soft, hard = (
        [model_at({"C": c}, stiffness=effort.stiffness).materials[0].youngs_modulus for c in (1.3, 2.0)]
        for effort in (QUICK, FULL)
    )
    assert hard == [1.3e9, 2.0e9]
    assert soft == pytest.approx([1e7, 1e7 * 2.0 / 1.3])
