"""Keep compiled engines and hand them out again; compiling costs more than many a small simulation."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import astuple

from taichidem import runtime
from taichidem.engine import CPU_LANES, Engine
from taichidem.engine_io import Exchange
from taichidem.errors import CompositionError
from taichidem.loading import Loader, check_alike, composition
from taichidem.scene import Scene
from taichidem.state import Sizes
from taichidem.stepper import Stepper
from taichidem.walls import FacetKind, PlaneKind, RevolvedKind
from taichidem.world_layout import kinds_present, lay_out, total_sizes

MOST_ENGINES = 24  # far below Taichi's 512 trees per process

Key = tuple[tuple, Sizes, tuple[type, ...]]  # law with shape and schedule, sizes, kinds of walls

_engines: OrderedDict[Key, tuple[Engine, Exchange, Stepper]] = OrderedDict()


def engine_for(scenes: Sequence[Scene], schedule: str) -> tuple[Engine, Exchange, Stepper]:
    """Return an engine loaded with the scenes, a fitting compiled one where there is one."""
    check_alike(scenes)
    layouts = [lay_out(scene) for scene in scenes]
    sizes = total_sizes(layouts).rounded()
    kinds_of_bodies = {scene.kind for scene in scenes}
    if len(kinds_of_bodies) > 1:
        raise CompositionError(
            f"The scenes hold grains of different kinds ({', '.join(sorted(kinds_of_bodies))}); a world would not behave to the "
            "last bit as it does alone. Put them into one simulation per kind."
        )
    law = (composition(scenes[0]), kinds_of_bodies.pop(), schedule)
    kinds = kinds_present(layouts)
    key = _fitting(law, sizes, kinds) or _compile(law, sizes, _usual(kinds), scenes[0])
    _engines.move_to_end(key)
    _engines[key][0].user = None  # from here on its tables are nobody's until the new owner has them all
    loader = Loader(_engines[key][0])
    for world, layout in enumerate(layouts):
        loader.load(world, layout)
    return _engines[key]


def _usual(kinds: tuple[type, ...]) -> tuple[type, ...]:
    """Return the wall kinds to compile: the plain ones, since most benches have both; meshes, which take long, only if asked."""
    return (PlaneKind, RevolvedKind, FacetKind) if FacetKind in kinds else (PlaneKind, RevolvedKind)


def _fitting(law: tuple, sizes: Sizes, kinds: tuple[type, ...]) -> Key | None:
    """Return the smallest engine of a law that has room for the sizes and knows the kinds of walls."""
    fitting = [key for key in _engines if key[0] == law and key[1].hold(sizes) and set(kinds) <= set(key[2])]
    # To the last field, so that which engine is chosen doesn't depend on which was used last.
    return min(fitting, key=lambda key: (key[1].slots, len(key[2]), astuple(key[1])), default=None)


def _compile(law: tuple, sizes: Sizes, kinds: tuple[type, ...], scene: Scene) -> Key:
    while len(_engines) >= MOST_ENGINES:
        _, (oldest, _, _) = _engines.popitem(last=False)
        oldest.user = None
        oldest.arena.destroy()
    _, kind, schedule = law
    lanes = CPU_LANES if runtime.start().arch == "cpu" else 1
    engine = Engine(tuple(scene.model.acting().effects), sizes, kind, kinds, schedule, lanes)
    _engines[law, sizes, kinds] = (engine, Exchange(engine), Stepper(engine))
    return law, sizes, kinds
