"""The effects on trial: every one in the registry, those of outside packages included."""

import pytest

from taichidem import plugins
from taichidem.effects.base import BodyEffect, ContactEffect, SetupEffect
from tests.effect_bench import history, reach_of

EVERY = [plugins.get("effect", name) for name in plugins.names("effect")]
CONTACT = [e for e in EVERY if issubclass(e, ContactEffect)]
BODY = [e for e in EVERY if issubclass(e, BodyEffect)]
SETUP = [e for e in EVERY if issubclass(e, SetupEffect)]

with_grains_and_walls = pytest.mark.parametrize("wall", [0, 1], ids=["grains", "wall"])


def named(kinds):
    return pytest.mark.parametrize("kind", kinds, ids=lambda k: k.name)


def motion(kind, seed):
    """Return a history that reaches into the gap where the effect can act before touch."""
    return history(seed, deepest_gap=0.8 * reach_of(kind))
