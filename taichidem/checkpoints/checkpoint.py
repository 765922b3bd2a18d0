"""The complete state of a simulation as plain arrays, and what it belongs to."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from taichidem.bodies import Bodies
from taichidem.checkpoints.archive import Archive
from taichidem.checkpoints.file import HASH, TYPES
from taichidem.checkpoints.packing import Packer
from taichidem.effects.base import BodyEffect, ContactEffect
from taichidem.errors import InputError
from taichidem.loading import composition, wall_row
from taichidem.scene import Scene
from taichidem.world_layout import lay_out


def archive_of(engine: Any) -> Archive:
    """Return the access to all kept tables of an engine, made once."""
    if engine.archive is None:
        engine.archive = Archive(engine)
    return engine.archive


def state_of(simulation: Any) -> dict[str, Any]:
    """Return all that the future of a `Simulation` depends on beside its scenes."""
    archive = archive_of(simulation._engine)
    return {
        "columns": archive.columns(),
        "tables": archive.read(len(simulation)),
        "asked": list(simulation._asked),
        "inserted": [Bodies.joined(parts) if parts else None for parts in simulation._inserted],
    }


def restore(simulation: Any, state: Mapping[str, Any]) -> None:
    """Put a state back into a `Simulation` of the same scenes and schedule.

    Raises:
        InputError: it comes from an engine with other tables.
    """
    archive = archive_of(simulation._engine)
    if state["columns"] != archive.columns():
        raise InputError(
            "The checkpoint holds other tables than this version's engine. Finish it with the program that wrote it, or "
            "delete it to start from the beginning."
        )
    archive.write(state["tables"])
    simulation._asked = list(state["asked"])
    simulation._inserted = [[] if bodies is None else [bodies] for bodies in state["inserted"]]


def about_scenes(scenes: Sequence[Scene], schedule: str) -> dict[str, Any]:
    """Return what a state belongs to: the schedule, the number of worlds, and a hash of each part of the scenes."""
    parts = [_parts(scene) for scene in scenes]
    hashes = {name: _hash([part[name] for part in parts]) for name in parts[0]}
    return {"schedule": schedule, "number of worlds": len(scenes), **hashes}


def _parts(scene: Scene) -> dict[str, Any]:
    """Return the numbers that the engine gets of a scene, by what a user calls them."""
    layout = lay_out(scene)
    names = [material.name for material in scene.model.materials]
    return {
        "model": [names, sorted(map(repr, composition(scene))), _coefficients(scene)],
        "walls": [[wall.name, wall_row(names.index(wall.material), wall)] for wall in scene.walls]
        + [list(row) for row in layout.wall_rows],
        "grains": [scene.bodies, scene.grains_like, scene.largest_radius, scene.smallest_radius, scene.room],
        "time step": scene.dt,
        "domain": np.asarray(scene.domain, float),
        "neighbour lists": [layout.cell_size, layout.cells, layout.skin, scene.reach(), layout.slots, layout.elements],
    }


def _coefficients(scene: Scene) -> list[Any]:
    found = []
    for effect in sorted(scene.model.acting().effects, key=lambda e: e.name):
        if isinstance(effect, ContactEffect):
            found += [[effect.name, effect.kernel_coefficients(p)] for p in scene.model.pairs() if scene.can_touch(p)]
        elif isinstance(effect, BodyEffect):
            found.append([effect.name, effect.kernel_coefficients()])
    return found


def _hash(value: Any) -> str:
    packer = Packer(TYPES)
    text = json.dumps(packer.pack(value), sort_keys=True)
    return HASH + hashlib.sha256(text.encode() + bytes(packer.data)).hexdigest()[:16]
