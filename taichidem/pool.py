"""Keep compiled engines and hand them out again; compiling costs more than many a small simulation."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

from taichidem import runtime
from taichidem.engine import CPU_LANES, Engine
from taichidem.engine_io import Exchange
from taichidem.errors import CompositionError
from taichidem.loading import Loader, check_alike, composition, kinds_present, lay_out, total_sizes
from taichidem.scene import Scene
from taichidem.stepper import Stepper

MOST_ENGINES = 24  # far below Taichi's 512 trees per process

_engines: OrderedDict[tuple, tuple[Engine, Exchange, Stepper]] = OrderedDict()


def engine_for(scenes: Sequence[Scene], schedule: str) -> tuple[Engine, Exchange, Stepper]:
    """Return an engine loaded with the scenes, a fitting compiled one where there is one."""
    check_alike(scenes)
    layouts = [lay_out(scene) for scene in scenes]
    sizes = total_sizes(layouts).rounded()
    kinds_of_bodies = {scene.bodies is None or scene.bodies.single for scene in scenes}
    if len(kinds_of_bodies) > 1:
        raise CompositionError(
            "Some scenes hold composed bodies and some single spheres only; a world would not behave to the last bit as it "
            "does alone. Put them into two simulations."
        )
    single = kinds_of_bodies.pop()
    kinds = kinds_present(layouts)
    key = (composition(scenes[0]), sizes, single, schedule, kinds)
    if key not in _engines:
        while len(_engines) >= MOST_ENGINES:
            _, (oldest, _, _) = _engines.popitem(last=False)
            oldest.user = None
            oldest.arena.destroy()
        lanes = CPU_LANES if runtime.start().arch == "cpu" else 1
        engine = Engine(
            tuple(scenes[0].model.acting().effects),
            sizes,
            single,
            kinds,
            schedule,
            lanes,
        )
        _engines[key] = (engine, Exchange(engine), Stepper(engine))
    _engines.move_to_end(key)
    _engines[key][0].user = None  # from here on its tables are nobody's until the new owner has them all
    loader = Loader(_engines[key][0])
    for world, layout in enumerate(layouts):
        loader.load(world, layout)
    return _engines[key]
