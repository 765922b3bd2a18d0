"""What a simulation shows of a world at one time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from taichidem.shapes.forms import Forms


@dataclass(frozen=True)
class Snapshot:
    """The bodies of one world at one time, ordered by identity.

    Attributes:
        time: [s].
        position, velocity, spin, force, torque: (n, 3), SI.
        orientation: quaternions (w, x, y, z), (n, 4); identity for single spheres, which need none.
        mass, radius: (n,).
        identity: number given at insertion, (n,).
        forms: what each body looks like in its principal frame; a single sphere where nothing else was inserted.
        carried: what each body holds of an effect's amount, such as liquid [m³], (n,); zero where no effect has one.
        kinetic_energy: of motion and rotation [J].
        left: bodies that left the domain so far.
        rebuilds: neighbour lists built so far.
    """

    time: float
    position: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    orientation: np.ndarray
    mass: np.ndarray
    radius: np.ndarray
    identity: np.ndarray
    forms: Forms
    carried: np.ndarray
    kinetic_energy: float
    left: int
    rebuilds: int


@dataclass(frozen=True)
class WallState:
    """A wall now.

    Attributes:
        centre: of its motion [m].
        velocity: of that centre [m/s].
        spin: [rad/s].
        force: of the grains on the wall [N], (3,), as of the last step.
        torque: of the grains on the wall about its centre [N m], (3,).
    """

    centre: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray
    force: np.ndarray
    torque: np.ndarray


@dataclass(frozen=True)
class Frame:
    """What one would see at one time: the grains, and the walls that are there.

    Args:
        snapshot: the grains.
        walls: name → centre of its motion now [m], of every wall that has not been taken away.
    """

    snapshot: Snapshot
    walls: Mapping[str, np.ndarray]
