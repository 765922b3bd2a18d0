"""Which compiled engine a scene gets."""

from collections import OrderedDict
from dataclasses import replace

import pytest

from taichidem import pool
from taichidem.effects import NormalHertz
from taichidem.experiments import Rebound
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.state import Sizes
from taichidem.walls import FacetKind, PlaneKind, RevolvedKind

LAW = ("law", True, "worlds")
PLAIN, ALL = (PlaneKind, RevolvedKind), (PlaneKind, RevolvedKind, FacetKind)
SMALL = Sizes(**dict.fromkeys(Sizes.__dataclass_fields__, 1)).rounded()


@pytest.fixture
def engines(monkeypatch):
    """An empty pool, in which entries may be put that are no engines."""
    held = OrderedDict()
    monkeypatch.setattr(pool, "_engines", held)
    return held


def test_one_engine_serves_scenes_that_are_smaller_and_know_fewer_walls(engines):
    larger = replace(SMALL, bodies=2 * SMALL.bodies, slots=2 * SMALL.slots)
    engines[LAW, larger, ALL] = None
    assert pool._fitting(LAW, SMALL, (PlaneKind,)) == (LAW, larger, ALL)
    assert pool._fitting(LAW, replace(larger, cells=2 * larger.cells), (PlaneKind,)) is None
    assert pool._fitting(("other law", True, "worlds"), SMALL, (PlaneKind,)) is None


def test_the_smallest_engine_that_fits_is_taken(engines):
    larger = replace(SMALL, slots=2 * SMALL.slots)
    engines[LAW, larger, PLAIN] = engines[LAW, SMALL, PLAIN] = engines[LAW, SMALL, ALL] = None
    assert pool._fitting(LAW, SMALL, (RevolvedKind,)) == (LAW, SMALL, PLAIN)
    assert pool._fitting(LAW, SMALL, (FacetKind,)) == (LAW, SMALL, ALL)


def test_meshes_are_compiled_only_where_there_are_some():
    assert pool._usual((PlaneKind,)) == pool._usual((RevolvedKind,)) == PLAIN
    assert pool._usual((PlaneKind, FacetKind)) == ALL


def test_a_roomy_engine_with_all_walls_gives_the_same_bits(engines):
    material = Material("ball", 910.0, 1e7, 0.36)
    model = Model((material,), (NormalHertz(restitution=0.6),))
    test = Rebound(speed=0.5)
    own = test.run(model, [1])[0].observables
    ((law, sizes, kinds),) = engines
    engines.clear()
    roomy = Sizes(**{name: 2 * rows for name, rows in vars(sizes).items()})
    key = pool._compile(law, roomy, ALL, test.scene(model))
    shared = test.run(model, [1])[0].observables
    assert kinds == PLAIN
    assert list(engines) == [key]
    assert shared == own
