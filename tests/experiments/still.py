"""Play an experiment's procedure without physics: grains stay where they appear, and every act is written down with its time."""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

from taichidem.procedure import World, play
from tests.experiments.planted import granules, snapshot


@dataclass(frozen=True)
class Act:
    """What a procedure did at a time [s]."""

    time: float
    name: str
    bodies: object = None
    wall: str = ""
    changes: dict = field(default_factory=dict)


class StillSimulation:
    """One world in the place of a simulation, in which only walls move.

    Args:
        scene: of the experiment.
        grains_vanish: as soon as time passes, as in a stream whose place must be free again.
    """

    def __init__(self, scene, grains_vanish=False):
        self.scenes, self.acts, self.walls = [scene], [], {wall.name: wall for wall in scene.walls}
        self.now, self.grains_vanish, self.looks = 0.0, grains_vanish, []
        self.position, self.radius, self.mass = np.empty((0, 3)), np.empty(0), np.empty(0)
        self.velocity = {name: np.zeros(3) for name in self.walls}
        self.centre = {name: np.zeros(3) for name in self.walls}
        if scene.bodies is not None:
            self._add(scene.bodies)

    def _add(self, bodies):
        self.position = np.concatenate([self.position, bodies.position])
        self.radius = np.concatenate([self.radius, bodies.radius])
        self.mass = np.concatenate([self.mass, bodies.mass])

    def insert(self, bodies, *, world):
        self.acts.append(Act(self.now, "insert", bodies))
        self._add(bodies)

    def run(self, duration):
        self.now += float(duration[0])
        self.looks.append(self.now)
        for name, velocity in self.velocity.items():
            self.centre[name] = self.centre[name] + velocity * float(duration[0])
        if self.grains_vanish:
            self.position, self.radius, self.mass = np.empty((0, 3)), np.empty(0), np.empty(0)

    def move_wall(self, name, *, world, **changes):
        self.acts.append(Act(self.now, "move", wall=self.walls[name].name, changes=changes))
        self.velocity[name] = np.asarray(changes.get("velocity", self.velocity[name]), float)

    def remove_wall(self, name, *, world):
        del self.walls[name]
        self.acts.append(Act(self.now, "remove", wall=name))

    def wall(self, name, world):
        return SimpleNamespace(centre=self.centre[name], force=np.zeros(3))

    def snapshot(self, world):
        return snapshot(self.position, self.radius, self.mass, time=self.now)

    def time(self, world):
        return self.now

    def kinetic_energy(self, world):
        return 0.0

    def failure(self, world):
        return None


@dataclass(frozen=True)
class Played:
    """What a procedure did.

    Attributes:
        acts: in order.
        record: what it noted.
        looks: times at which it went on [s], its end last.
    """

    acts: list[Act]
    record: dict[str, list]
    looks: list[float]

    @property
    def end(self):
        """The time at which it ended [s]."""
        return self.looks[-1]

    def told(self, *names):
        """Return the acts of these names."""
        return [act for act in self.acts if act.name in names]


def play_still(experiment, grains_vanish=False, seed=1):
    """Play the procedure of an experiment with the granules of the bench."""
    model = granules()
    simulation = StillSimulation(experiment.scene(model), grains_vanish)
    world = World(simulation, 0, np.random.default_rng(seed))
    play(simulation, [experiment.procedure(world, model)], [world])
    return Played(simulation.acts, world.record, simulation.looks)
