"""The tables of an engine: worlds, bodies, contact elements, pair slots, cells and walls.

Bodies (what moves) and contact elements (what touches) are different things. Where every body is one sphere about its
own centre they share their row number and lie side by side in memory; otherwise an element points to its body.

Bodies, elements and slots keep two halves per world: a rebuild of the neighbour lists writes the new order into the
idle half and then changes sides, so nothing is copied back and the old lists stay readable while memory is carried over.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import taichi as ti

from taichidem import state_columns as columns
from taichidem.arena import Arena
from taichidem.bodies import Kind
from taichidem.walls.facet import SIDE_COLUMNS, FacetKind


class Status(IntEnum):
    """What a world is doing, or why it stopped."""

    RUNNING = 0
    DIVERGED = 1
    LIST_FULL = 2
    OVERLAP = 3


# Rows that no engine has less of. They cost some megabytes, compiling another engine costs seconds.
SMALL = {
    "worlds": 8,
    "bodies": 4096,
    "elements": 4096,
    "slots": 65536,
    "cells": 32768,
    "walls": 32,
    "wall_elements": 32,
    "planes": 32,
    "revolved": 32,
    "pair_rows": 64,
}


@dataclass(frozen=True)
class Sizes:
    """Rows of each table, summed over worlds (before halves are doubled)."""

    worlds: int
    bodies: int
    elements: int
    slots: int
    cells: int
    meshes: int
    mesh_cells: int
    mesh_facets: int
    walls: int
    wall_elements: int
    planes: int
    revolved: int
    facets: int
    corner_edges: int
    pair_rows: int

    def rounded(self) -> "Sizes":
        """Return sizes rounded up to a power of two and to those of a small bulk test, so that similar scenes share an engine."""
        least = {name: SMALL.get(name, 1) for name in self.__dataclass_fields__}
        return Sizes(**{n: max(least[n], 1 << max(0, getattr(self, n) - 1).bit_length()) for n in least})

    def hold(self, other: "Sizes") -> bool:
        """Return whether every table has at least the rows of another's."""
        return all(getattr(self, name) >= getattr(other, name) for name in self.__dataclass_fields__)


class State:
    """All tables but those of the effects.

    `kind` says what bodies are (spheres and superquadrics are one element, multispheres many), `carries` that bodies hold an
    amount that contacts exchange, `gathering` that reactions are left in a table of their own.
    """

    def __init__(
        self,
        arena: Arena,
        sizes: Sizes,
        kind: Kind,
        memories: list[dict],
        wall_kinds: tuple,
        gathering: bool,
        carries: bool,
    ) -> None:
        self.sizes = sizes
        self.kind = kind
        self.round = kind == "sphere"  # no body shows its orientation, and its inertia is one number
        self.single = single = kind != "multisphere"  # every body is one element about its own centre
        self.carries = carries
        self.members = {
            "worlds": columns.WORLD,
            "walls": columns.WALL,
            "wall_elements": columns.WALL_ELEMENT,
            "corner_edges": columns.CORNER_EDGE,
        }
        self.members |= {
            "sides": SIDE_COLUMNS,
            "meshes": columns.MESH,
            "mesh_cells": columns.MESH_CELL,
            "mesh_facets": columns.MESH_FACET,
        }
        self.members |= {kind.name: kind.columns for kind in wall_kinds}
        self.worlds = arena.table(sizes.worlds, columns.WORLD)
        if single:
            self.bodies, self.loads, self.elements = arena.tables(
                2 * sizes.bodies, columns.BODY, columns.LOAD, columns.ELEMENT
            )
            self.owned: Any = None
            shaped: Any = [None, None] if self.round else arena.tables(2 * sizes.bodies, columns.ROTOR, columns.FORM)
            self.rotors, self.forms = shaped
        else:
            self.forms = None
            self.bodies, self.rotors = arena.tables(2 * sizes.bodies, columns.BODY, columns.ROTOR)
            self.loads, self.elements, self.owned = arena.tables(
                2 * sizes.elements, columns.LOAD, columns.ELEMENT, columns.OWNED
            )
        self.labels = arena.table(2 * sizes.bodies, columns.LABEL if single else columns.LABEL | columns.LISTED_PAIRS)
        more = {"superquadric": [columns.AXIS], "multisphere": [columns.PAIR_OF]}.get(kind, [])
        self.slots, *rest = arena.tables(2 * sizes.slots, columns.SLOT, *more, *memories)
        self.axes = rest[0] if kind == "superquadric" else None
        self.pair_of: Any = None if single else rest[0]
        self.past = rest[len(more) :]
        self.pairs: Any = None if single else arena.table(2 * sizes.slots, columns.PAIR)
        self.pushes: Any = None if single else arena.table(4 * sizes.slots, columns.PUSH)
        if gathering:  # the schedule over particles leaves reactions per slot and gathers them per partner
            self.reactions = arena.table(
                2 * sizes.slots, columns.REACTION if single else columns.REACTION | columns.OWN_PUSH
            )
            self.incoming = arena.table(2 * sizes.slots, {"slot": ti.i32})
            self.inbound = arena.table(2 * sizes.elements, {"start": ti.i32, "end": ti.i32})
        self.amounts = self.flows = None
        if carries:  # what bodies hold of an effect's amount, and what an evaluation changes of it by element
            self.amounts = arena.table(2 * sizes.bodies, {"held": ti.f64})
            self.flows = arena.table(2 * (sizes.bodies if single else sizes.elements), {"change": ti.f64})
        # One more row per world closes the last cell.
        self.cells = arena.table(sizes.cells + sizes.worlds, {"start": ti.i32, "cursor": ti.i32})
        self.walls = arena.table(sizes.walls, columns.WALL)
        self.wall_elements = arena.table(sizes.wall_elements, columns.WALL_ELEMENT)
        counts = {"plane": sizes.planes, "revolved": sizes.revolved, "facet": sizes.facets}
        tables = {kind.name: arena.table(counts[kind.name], kind.columns) for kind in wall_kinds}
        self.meshes = arena.table(sizes.meshes, columns.MESH)
        self.mesh_cells = arena.table(sizes.mesh_cells, columns.MESH_CELL)
        self.mesh_facets = arena.table(sizes.mesh_facets, columns.MESH_FACET)
        self.corner_edges = arena.table(sizes.corner_edges, columns.CORNER_EDGE)
        self.sides = arena.table(3 * sizes.facets, SIDE_COLUMNS)
        self.geometry = tables
        self.wall_kinds = tuple(
            kind(tables[kind.name], self.sides, self.corner_edges) if kind is FacetKind else kind(tables[kind.name])
            for kind in wall_kinds
        )


class OnTables:
    """Base of kernel code: the tables of a state under its own name."""

    def __init__(self, state: State) -> None:
        self.kind, self.single, self.round, self.carries = state.kind, state.single, state.round, state.carries
        self.forms, self.axes = state.forms, state.axes
        self.amounts, self.flows = state.amounts, state.flows
        self.worlds, self.bodies, self.rotors, self.labels = state.worlds, state.bodies, state.rotors, state.labels
        self.loads, self.elements, self.owned, self.slots = state.loads, state.elements, state.owned, state.slots
        self.walls, self.wall_elements = state.walls, state.wall_elements
