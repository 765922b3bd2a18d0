"""What every registered effect must obey; a new one is on trial here as soon as it stands in the registry."""

import math

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.effects.base import BodyEffect, ContactEffect, SetupEffect, Stage
from taichidem.errors import CompositionError, InputError
from taichidem.materials import Material, MaterialPair
from taichidem.scene import Model
from taichidem.shapes import Superquadric
from tests.clump import Row
from tests.conformance.registered import BODY, CONTACT, EVERY, SETUP, named
from tests.effect_bench import PAIR, RADIUS, SOFT, beneath, body_bench, middle


@named(EVERY)
def test_declaration_is_complete(kind):
    assert kind.name == kind.name.lower()
    assert " " not in kind.name
    assert kind.title
    assert kind.source
    assert kind.visible_as
    assert "Expected behaviour" in kind.__doc__
    assert kind.parameters
    for p in kind.parameters:
        assert p.unit
        assert p.meaning.endswith(".")
        assert p.low <= p.plausible[0] < p.plausible[1] <= p.high
        assert p.vanishing is None or p.low <= p.vanishing <= p.high
        assert p.default is None or p.low <= p.default <= p.high
    names = [p.name for p in kind.parameters]
    assert len(set(names)) == len(names)
    assert issubclass(kind, (ContactEffect, BodyEffect, SetupEffect))
    effect = middle(kind)
    if not issubclass(kind, SetupEffect):
        assert kind.similarity is not None
        assert kind.similarity.kept
    if issubclass(kind, ContactEffect):
        assert kind.stage in Stage
        given = effect.kernel_coefficients(PAIR)
        assert set(given) == set(kind.coefficients)
        assert all(math.isfinite(v) for v in given.values())
        assert len({m.name for m in kind.memory}) == len(kind.memory)
        assert 0 <= effect.reach(PAIR, RADIUS) < 10 * RADIUS
    elif issubclass(kind, BodyEffect):
        assert set(effect.kernel_coefficients()) == set(effect.coefficients)


def test_names_are_unique():
    assert len({k.name for k in EVERY}) == len(EVERY)


@named([k for k in EVERY if k.name not in ("normal_hertz", "body_gravity")])
def test_every_effect_can_vanish(kind):
    """It is a hypothesis of the diagnosis only if there is a value at which it does nothing."""
    assert any(p.vanishing is not None for p in kind.parameters)


@named(EVERY)
def test_a_vanished_effect_keeps_its_other_values(kind):
    effect = middle(kind)
    vanished = effect.vanished()
    assert vanished.composition == effect.composition
    for p in kind.parameters:
        assert vanished.value(p.name) == (effect.value(p.name) if p.vanishing is None else p.vanishing)


@named(BODY)
def test_body_effects_vanish_and_scale(kind):
    made = body_bench(middle(kind).vanished())
    alone = np.zeros(3) if kind.family == "gravity" else np.array([0.0, 0.0, -9.81])
    assert made.push([0.3, -0.2, 0.1]) == pytest.approx(alone, abs=1e-12)

    rule, effect, s = kind.similarity, middle(kind), 3.0
    mass = 4 / 3 * np.pi * RADIUS**3 * SOFT.density
    velocity = np.array([0.3, -0.2, 0.1])
    small = body_bench(effect).push(velocity, RADIUS, mass)
    assert np.any(small - mass * alone)
    big = body_bench(effect.coarse_grained(s)).push(velocity * s**rule.speed, s * RADIUS, s**3 * mass)
    assert big / s**rule.force == pytest.approx(small, rel=1e-9)


@named(SETUP)
def test_set_up_effects_vanish(kind):
    none = middle(kind).vanished()
    field = np.array([0.0, 0.0, -9.81])
    assert np.array_equal(none.gravity(field), field)
    assert none.relative_sizes() == (1.0,)
    assert none.grain_shape() is None
    bodies = Bodies.spheres(np.zeros((2, 3)), [0.1, 0.2], 1.0)
    assert none.grains(bodies) is bodies
    effect = middle(kind)
    acts = [not np.allclose(effect.gravity(field), field), effect.relative_sizes() != (1.0,)]
    assert any([*acts, effect.grain_shape() is not None, effect.grains(bodies) is not bodies])


@named(EVERY)
def test_the_kinds_of_grains_it_acts_on_are_declared(kind):
    known = ("sphere", "multisphere", "superquadric")
    assert "sphere" in kind.shapes
    assert set(kind.shapes) <= set(known)
    assert bool(kind.shapes_reason) == (kind.shapes != known)
    for shape in (Row(2), Superquadric.spheroid(1.5)):
        if shape.kind not in kind.shapes:
            with pytest.raises(CompositionError, match=rf"{kind.name!r} can't act .* {shape.kind!r}, since .*leave"):
                Model([SOFT], [*beneath(middle(kind)), middle(kind)], shape)


@named(EVERY)
def test_errors_of_parameters(kind):
    values = {p.name: sum(p.plausible) / 2 for p in kind.parameters}
    first = kind.parameters[0]
    misspelt = first.name[:-1] + "q" if len(first.name) > 1 else "xx"
    with pytest.raises(InputError, match=r"Unknown parameter") as caught:
        kind(**values, **{misspelt: 1.0})
    assert first.name in str(caught.value)
    for p in kind.parameters:
        for bad in (p.high * 1.01 + 1, p.low - 1, math.nan, math.inf, "much", None if p.default is None else "x"):
            with pytest.raises(InputError) as caught:
                kind(**{**values, p.name: bad})
            assert f"{kind.name}.{p.name}" in str(caught.value)
        if p.default is None:
            with pytest.raises(InputError, match="missing"):
                kind(**{k: v for k, v in values.items() if k != p.name})


@named([k for k in CONTACT if k.family != "normal"])
def test_an_effect_without_what_it_needs_is_refused(kind):
    with pytest.raises(CompositionError, match="normal"):
        Model([SOFT], [middle(kind)])
    for family in kind.needs:
        if family != "normal":
            from taichidem.effects import NormalHertz

            with pytest.raises(CompositionError, match=rf"'{kind.name}' needs .*{family}"):
                Model([SOFT], [NormalHertz(restitution=0.5), middle(kind)])


@pytest.mark.parametrize("family", sorted({k.family for k in EVERY if k.family}))
def test_two_of_a_family_are_refused(family):
    kinds = [k for k in EVERY if k.family == family]
    pair = [middle(kinds[0]), middle(kinds[-1])]
    with pytest.raises(CompositionError, match=rf"both of family '{family}'"):
        Model([SOFT], [*beneath(pair[0]), *pair] if family not in ("normal", "tangential") else pair)


def test_no_classes_instead_of_effects():
    with pytest.raises(CompositionError, match="instances"):
        Model([SOFT], [EVERY[0]])


def test_moduli_of_unlike_materials():
    """E 400 and 600 with ν 0.2 must give 250 (known defect elsewhere), and G* by its own formula."""
    pair = MaterialPair(Material("a", 1.0, 400.0, 0.2), Material("b", 1.0, 600.0, 0.2))
    assert pair.youngs_modulus == pytest.approx(250.0)
    assert pair.shear_modulus == pytest.approx(1 / (1.8 * 2.4 / 400 + 1.8 * 2.4 / 600))
