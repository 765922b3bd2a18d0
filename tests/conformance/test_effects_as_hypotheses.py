"""Every registered effect can be put to the test: from nothing to plainly strong, within its bounds, at any size of grain."""

import pytest

from taichidem.effects import BodyGravity, NormalHertz, TangentialMindlin
from taichidem.effects.base import ContactEffect
from taichidem.effects.probe import ProbeScale
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.study.hypothesis import Hypothesis
from tests.conformance.registered import EVERY, named

GRAIN, WALL = Material("grain", 1500, 5e6, 0.3), Material("wall", 7800, 5e7, 0.3)
HYPOTHESES = [k for k in EVERY if k.name not in ("normal_hertz", "tangential_mindlin", "body_gravity")]
PRESENT = [NormalHertz(restitution=0.6), TangentialMindlin(static_friction=0.4), BodyGravity()]


def scale(radius=0.003):
    return ProbeScale(radius, (GRAIN, WALL))


@named(HYPOTHESES)
@pytest.mark.parametrize("radius", [1e-4, 3e-3, 3e-2])
def test_the_strongest_setting_is_allowed_and_joins_a_model(kind, radius):
    joined = Hypothesis(kind, scale(radius)).joined(Model([GRAIN, WALL], PRESENT), 1.0)
    assert kind.name in {e.name for e in joined.effects}


@named([k for k in HYPOTHESES if not k.all_or_nothing])
def test_it_vanishes_where_its_share_does(kind):
    effect = kind.at_strength(0.0, scale(), PRESENT)
    vanishing = {p.name: p.vanishing for p in kind.parameters}
    for name in kind.growing(scale()):
        held = effect.values[name]
        assert all(v == vanishing[name] for v in (held.values() if isinstance(held, dict) else [held]))


@named(HYPOTHESES)
def test_its_strength_is_told_by_its_measuring_parameter(kind):
    hypothesis, model = Hypothesis(kind, scale()), Model([GRAIN, WALL], PRESENT)
    weak, strong = hypothesis.strength(0.5, model), hypothesis.strength(1.0, model)
    vanishing = hypothesis.parameter.vanishing
    assert strong != vanishing
    assert weak - vanishing == pytest.approx((strong - vanishing) / 2)
    if kind.two_sided:
        assert hypothesis.strength(-1.0, model) == pytest.approx(-strong)


@named([k for k in HYPOTHESES if issubclass(k, ContactEffect)])
def test_every_pair_that_can_touch_has_a_value(kind):
    effect = kind.at_strength(1.0, scale(), PRESENT)
    model = Model([GRAIN, WALL], [e for e in PRESENT if e.family != effect.family] + [effect])
    for pair in model.pairs():
        if pair.first is GRAIN:
            effect.kernel_coefficients(pair)
