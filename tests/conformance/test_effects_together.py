"""Every registered effect in the engine: a world behaves alone as among others, and both schedules give the same bits."""

from __future__ import annotations

from itertools import groupby

import numpy as np
import pytest

from taichidem import plugins
from taichidem.effects.base import SetupEffect
from taichidem.errors import CompositionError
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from tests.effect_bench import beneath
from tests.verification.test_schedules import COLUMNS, GRAIN, WALL, spheres, walls

KINDS = [k for name in plugins.names("effect") if not issubclass(k := plugins.get("effect", name), SetupEffect)]


def little(kind, share):
    """Return an effect that is weak enough for the soft grains here."""
    values = {p.name: p.plausible[0] + share * (p.plausible[1] - p.plausible[0]) for p in kind.parameters}
    return kind(x=0.0, y=0.0, z=-9.81) if kind.family == "gravity" else kind(**values)


def compositions():
    """Return lists of effects, one of each family, in which every effect stands at least once.

    The families with several members set the number of lists; the others take their turn in one list each, since every
    effect in a law adds seconds of compilation.
    """
    ordered = sorted(KINDS, key=lambda k: k.family or k.name)
    families = [list(members) for _, members in groupby(ordered, key=lambda k: k.family or k.name)]
    always = ("normal", "tangential", "gravity")
    turns = max(map(len, families))
    made = []
    for turn in range(turns):
        chosen = [
            members[turn % len(members)]
            for number, members in enumerate(families)
            if members[0].family in always or len(members) > 1 or number % turns == turn
        ]
        try:
            Model([GRAIN, WALL], [little(kind, 0.1) for kind in chosen])
        except CompositionError:  # a cohesion that stands on one normal law only
            hertz = plugins.get("effect", "normal_hertz")
            chosen = [hertz if kind.family == "normal" else kind for kind in chosen]
        made.append(chosen)
    for kind in set(KINDS) - {kind for chosen in made for kind in chosen}:
        made.append([*map(type, beneath(kind(**{p.name: p.plausible[1] for p in kind.parameters}))), kind])
    return made


COMPOSITIONS = compositions()


def test_every_effect_stands_in_a_composition():
    assert {kind for chosen in COMPOSITIONS for kind in chosen} == set(KINDS)


def scene(chosen, seed, share):
    return Scene(
        model=Model([GRAIN, WALL], [little(kind, share) for kind in chosen]),
        walls=walls(),
        bodies=spheres(seed),
        domain=((-0.01, -0.01, -0.01), (0.07, 0.06, 0.1)),
        grain_materials=("grain",),
        skin=4e-4,
    )


@pytest.mark.parametrize("chosen", COMPOSITIONS, ids=lambda chosen: "+".join(k.name.split("_")[-1] for k in chosen))
def test_worlds_are_independent_and_schedules_alike(chosen):
    scenes = [scene(chosen, 1, 0.05), scene(chosen, 2, 0.2)]
    simulation = Simulation(scenes)
    simulation.run_steps(300)
    simulation.check()
    together = [simulation.snapshot(world) for world in range(2)]
    assert all(snapshot.rebuilds > 3 for snapshot in together)
    swapped = Simulation(scenes[::-1])  # other neighbours in other rows; the same compiled law
    swapped.run_steps(300)
    exchanged = [swapped.snapshot(world) for world in (1, 0)]
    over_particles = Simulation(scenes, schedule="particles")
    over_particles.run_steps(100)
    over_particles.run_steps(200)
    for column in (*COLUMNS, "carried"):
        expected = [getattr(snapshot, column) for snapshot in together]
        for world in range(2):
            assert np.array_equal(getattr(exchanged[world], column), expected[world]), f"{column} {world} exchanged"
            assert np.array_equal(getattr(over_particles.snapshot(world), column), expected[world]), f"{column} {world}"
