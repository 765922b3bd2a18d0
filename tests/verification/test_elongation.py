"""Elongated grains: volume, mass, aspect and inertia by the formulas of a spheroid, and spheres where it vanishes."""

import math
import sys
from dataclasses import fields
from types import ModuleType

import numpy as np
import pytest

from taichidem.effects import BodyGravity, Elongation, NormalHertz, SizeSpread
from taichidem.errors import InputError
from taichidem.experiments import BulkDensity
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.shapes import Superquadric
from tests.clump import Row

GRAIN = Material("grain", 1200.0, 1e7, 0.3)
RADIUS = 0.003


def grain(*effects):
    model = Model([GRAIN], [NormalHertz(restitution=0.5), BodyGravity(), *effects])
    return BulkDensity(diameter=2 * RADIUS).grain(model)


@pytest.mark.parametrize("ratio", [0.4, 1.5, 3.0])
def test_bodies_are_spheroids_of_the_volume_of_the_spheres(ratio):
    made = grain(Elongation(aspect_ratio=ratio))
    bodies = made.bodies(made.draw(np.random.default_rng(1), 5))
    a, b, c = bodies.element_axes.T
    assert c / a == pytest.approx(ratio)
    assert np.array_equal(a, b)
    assert 4 / 3 * math.pi * a * b * c == pytest.approx(4 / 3 * math.pi * RADIUS**3)
    mass = 1200.0 * 4 / 3 * math.pi * RADIUS**3
    assert bodies.mass == pytest.approx(mass) == made.mass
    assert bodies.radius == pytest.approx(RADIUS)
    assert bodies.inertia[:, 0] == pytest.approx(mass * (a**2 + c**2) / 5)
    assert bodies.inertia[:, 1] == pytest.approx(mass * (a**2 + c**2) / 5)
    assert bodies.inertia[:, 2] == pytest.approx(0.4 * mass * a**2)
    assert bodies.element_exponents == pytest.approx(2.0)


def test_at_its_vanishing_value_the_very_same_spheres_come():
    drawn, made = [], []
    for more in ([], [Elongation(aspect_ratio=1.0)]):
        rng, grains = np.random.default_rng(3), grain(SizeSpread(half_width=0.3), *more)
        drawn.append(grains.draw(rng, 7))
        made.append(grains.bodies(drawn[-1]))
        assert rng.random() == _after(7)
    for field in fields(made[0]):
        one, other = (getattr(bodies, field.name) for bodies in made)
        assert (one is None and other is None) or np.array_equal(one, other)
    assert made[1].kind == "sphere"


def _after(count):
    """Return the next random number after the sizes of so many grains were put in order."""
    rng = np.random.default_rng(3)
    rng.permutation(count)
    return rng.random()


def test_sizes_and_form_go_together():
    made = grain(SizeSpread(half_width=0.3), Elongation(aspect_ratio=2.0))
    bodies = made.bodies(made.draw(np.random.default_rng(1), 10))
    assert len(set(np.round(bodies.radius, 9))) == 5
    assert bodies.element_axes[:, 2] / bodies.element_axes[:, 0] == pytest.approx(2.0)
    assert np.mean(bodies.mass) == pytest.approx(made.mass)
    sample = made.sample()
    assert sample.radius == pytest.approx([bodies.radius.max(), bodies.radius.min()])


def test_a_row_of_spheres_takes_the_place_of_a_spheroid(monkeypatch):
    asked = []

    class Multisphere(Row):
        @classmethod
        def spheroid(cls, aspect_ratio, spheres, radius=1.0):
            asked.append((aspect_ratio, spheres))
            return cls(spheres, radius)

    module = ModuleType("taichidem.shapes.multisphere")
    module.Multisphere = Multisphere
    monkeypatch.setitem(sys.modules, module.__name__, module)
    model = Model([GRAIN], [NormalHertz(restitution=0.5), Elongation(form="multisphere", spheres=4, aspect_ratio=1.8)])
    assert model.grain_kind == "multisphere"
    assert set(asked) == {(1.8, 4)}
    assert Elongation(form="multisphere", aspect_ratio=1.0).grain_shape() is None


def test_its_options_are_checked():
    for options, said in (
        ({"form": "ellipsoid"}, "allowed: superquadric, multisphere"),
        ({"spheres": 1}, "whole number from 2"),
        ({"spheres": True}, "whole number from 2"),
    ):
        with pytest.raises(InputError, match=said):
            Elongation(aspect_ratio=1.5, **options)
    assert Elongation(aspect_ratio=1.5).grain_shape() == Superquadric.spheroid(1.5)
