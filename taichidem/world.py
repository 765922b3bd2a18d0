"""One world as the procedure of a test sees it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from taichidem.bodies import Bodies
from taichidem.checkpoints.journal import Journal
from taichidem.insertion import Region
from taichidem.shapes.outlines import Outlines
from taichidem.simulation import Simulation
from taichidem.snapshot import Frame, Snapshot, WallState

Answer = TypeVar("Answer")

Search = Callable[[np.random.Generator, Region, Outlines, np.ndarray, Outlines], np.ndarray]


@dataclass
class World:
    """One world as its procedure sees it.

    With a journal, every answer is written down, so that the procedure can be played again from a checkpoint.
    """

    simulation: Simulation
    number: int
    rng: np.random.Generator
    record: dict[str, list] = field(default_factory=dict)  # what the procedure wrote down, by name
    progress: float = 0.0  # share of the procedure that is done
    failure: str | None = None  # why its procedure ended early
    frames: list[Frame] = field(default_factory=list)  # taken on the way, where asked for
    journal: Journal | None = None

    def _ask(self, question: str, answer: Callable[[], Answer], *, draws: bool = False) -> Answer:
        return answer() if self.journal is None else self.journal.asked(question, answer, draws=draws)

    def _to_do(self, act: str, *details: Any) -> bool:
        return self.journal is None or self.journal.told(act, *details)

    def insert(self, bodies: Bodies) -> None:
        """Add bodies."""
        if self._to_do("insert", bodies.position, bodies.velocity, bodies.orientation, bodies.mass, bodies.radius):
            self.simulation.insert(bodies, world=self.number)

    def snapshot(self) -> Snapshot:
        """Return the bodies now; where a part of them will do, `look` keeps checkpoints small."""
        return self._ask("snapshot", self.present)

    def present(self) -> Snapshot:
        """Return the bodies now, for those who watch; procedures ask for `snapshot` or `look`."""
        return self.simulation.snapshot(self.number)

    def look(self, reading: Callable[[Snapshot], Answer]) -> Answer:
        """Return what a function reads off the bodies now: numbers, texts, arrays, or lists, tuples or mappings of these."""
        return self._ask("look", lambda: reading(self.present()))

    def find_places(self, search: Search, region: Region, grains: Outlines) -> np.ndarray:
        """Return the centres that a search finds for new grains beside those that are there, (n, 3) [m].

        Args:
            search: `place_at_random` or `fill_at_random`.
            region: where they appear.
            grains: outlines of the new grains.
        """

        def find() -> np.ndarray:
            present = self.present()
            return search(self.rng, region, grains, present.position, Outlines.of(present))

        return self._ask("places", find, draws=True)

    def note(self, **values: object) -> None:
        """Write values down, each at the end of the list of its name."""
        for name, value in values.items():
            self.record.setdefault(name, []).append(value)

    def wall(self, name: str) -> WallState:
        """Return where a wall is and what the grains do to it."""
        return self._ask(f"wall {name}", lambda: self.simulation.wall(name, self.number))

    def move_wall(self, name: str, **changes: Any) -> None:
        """Give a wall another velocity, spin or load; see `Simulation.move_wall`."""
        if self._to_do(f"move_wall {name}", changes):
            self.simulation.move_wall(name, **changes, world=self.number)

    def remove_wall(self, name: str) -> None:
        """Take a wall away now."""
        if self._to_do(f"remove_wall {name}"):
            self.simulation.remove_wall(name, world=self.number)

    def frame(self) -> Frame:
        """Return what one would see now, for the procedure."""
        return self._ask("frame", self.seen)

    def seen(self) -> Frame:
        """Return what one would see now, for those who watch; procedures ask for `frame`."""
        names = self.simulation.standing_walls(self.number)
        centres = {name: self.simulation.wall(name, self.number).centre for name in names}
        return Frame(self.present(), centres)

    @property
    def time(self) -> float:
        """The time [s]."""
        return self._ask("time", lambda: self.simulation.time(self.number))

    @property
    def kinetic_energy(self) -> float:
        """The kinetic energy [J]."""
        return self._ask("kinetic_energy", lambda: self.simulation.kinetic_energy(self.number))
