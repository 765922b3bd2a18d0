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

from taichidem.arena import Arena
from taichidem.bodies import Kind
from taichidem.contact import Symmetric, mat3, vec2, vec3, vec4
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


_WORLD = {
    # bodies, elements and slots: first row of the region, rows of one half, active first row, rows in use
    "first_body": ti.i32,
    "body_capacity": ti.i32,
    "body_base": ti.i32,
    "bodies": ti.i32,
    "first_element": ti.i32,
    "element_capacity": ti.i32,
    "element_base": ti.i32,
    "elements": ti.i32,
    "elements_before": ti.i32,  # of the last rebuild
    "first_slot": ti.i32,
    "slot_capacity": ti.i32,
    "slot_base": ti.i32,
    "slots": ti.i32,
    # cells
    "lower": vec3,
    "upper": vec3,
    "cell_size": ti.f64,
    "first_cell": ti.i32,
    "cells_x": ti.i32,
    "cells_y": ti.i32,
    "cells_z": ti.i32,
    # walls and coefficients
    "first_wall": ti.i32,
    "walls": ti.i32,
    "first_wall_element": ti.i32,
    "wall_elements": ti.i32,
    "plain_elements": ti.i32,
    "first_mesh": ti.i32,
    "meshes": ti.i32,
    "first_row": ti.i32,
    "materials": ti.i32,
    # time
    "step": ti.i32,
    "target": ti.i32,
    "dt": ti.f64,
    "evaluation": ti.i32,
    "fresh": ti.i32,
    "stale": ti.i32,
    # lists
    "skin": ti.f64,
    "reach": ti.f64,
    "largest_radius": ti.f64,
    "wall_travel": ti.f64,
    "rebuilds": ti.i32,
    "left": ti.i32,
    # health
    "status": ti.i32,
    "largest_overlap": ti.f64,
}

_BODY = {"position": vec3, "velocity": vec3, "spin": vec3, "inverse_mass": ti.f64, "inverse_inertia": ti.f64}
_ROTOR = {
    "orientation": vec4,  # unit quaternion (w, x, y, z), body frame → world
    "momentum": vec3,  # angular momentum, world frame [kg m²/s]
    "inverse_inertia": vec3,  # one over the principal moments [1/(kg m²)]
    "force": vec3,
    "torque": vec3,
    "rotation": mat3,  # of the orientation, body frame → world
    "mobility": Symmetric,  # R I⁻¹ Rᵀ [1/(kg m²)]; contacts read it together with the form, so it lies beside it
}
_LOAD = {"force": vec3, "torque": vec3}
_ELEMENT = {
    "radius": ti.f64,
    "listed_at": vec3,  # position when the lists were built
    "slots_from": ti.i32,
    "slots_to": ti.i32,
    "material": ti.i32,
    "came_from": ti.i32,
    "cell": ti.i32,
}
_OWNED = {"body": ti.i32, "offset": vec3, "position": vec3}
_FORM = {  # of a superquadric
    "spread": Symmetric,  # R diag(a², b², c²) Rᵀ [m²]
    "ellipsoid": ti.i32,  # both exponents are 2
    "size": ti.f64,  # radius of the sphere of equal volume [m]
    "product": ti.f64,  # a b c [m³]
    "axes": vec3,  # [m]
    "dual": vec2,  # m₁ and m₂, m = n/(n − 1)
}
_LABEL = {"identity": ti.i32, "radius": ti.f64, "moved_to": ti.i32, "cell": ti.i32}
# Pairs of bodies that may touch at several points: a list for the body with the lower row, and what the contacts of the last
# two evaluations push together, each in a row of its own.
_LISTED_PAIRS = {"pairs_from": ti.i32}  # of a body, −1 for none
_PAIR = {"other": ti.i32, "next": ti.i32}  # a body or −1 − wall
_PAIR_OF = {"pair": ti.i32}
_PUSH = {
    "stamp": ti.i32,  # evaluation that it sums up
    "normal": vec3,  # sum of the normals, towards the body that lists the pair
    "turn_first": vec3,  # sum of r × n of that body, and of the other one [m]
    "turn_second": vec3,
}
_SLOT = {
    "partner": ti.i32,  # an element, or −1 − wall element
    "row": ti.i32,  # of the effects' coefficients
    "stamp": ti.i32,  # evaluation in which the pair last touched
    "radius": ti.f64,  # R* and m*, which don't change while a pair is listed
    "mass": ti.f64,
}
_AXIS = {
    "axis": vec3
}  # a superquadric's last contact normal, or a direction in which the pair is apart; 0 where none is known
_REACTION = {"force": vec3, "torque": vec3, "change": ti.f64}
_OWN_PUSH = {
    "kept": ti.i32,
    "normal": vec3,
    "turn_i": vec3,
    "turn_j": vec3,
}  # kept: slot of the memory, −1 where nothing touches
_WALL = {
    "origin": vec3,
    "velocity": vec3,
    "spin": vec3,
    "first_row": vec3,
    "second_row": vec3,
    "third_row": vec3,
    "extent": ti.f64,
    "removed_at": ti.f64,
    "force": vec3,  # [N] of the grains on the wall, as of the last evaluation
    "torque": vec3,  # [N m] about the centre of its motion
    "load": ti.f64,  # [N] along `guide`, for a wall that is pushed instead of told its speed
    "guide": vec3,
    "inverse_mass": ti.f64,  # [1/kg] 0 for a wall that moves as it is told
    "material": ti.i32,
    "moves": ti.i32,
    "turned": ti.i32,
}
# Elements of a world: first those that every grain looks at, then facets, then flat patches (row -1), which only
# keep the contact memory that the facets of one plane share.
_WALL_ELEMENT = {"kind": ti.i32, "row": ti.i32, "wall": ti.i32, "patch": ti.i32}

# A mesh's facets by cell of a grid in its own frame, so that the lists hold however the mesh moves.
_MESH = {
    "wall": ti.i32,
    "lower": vec3,
    "cell_size": ti.f64,
    "cells_x": ti.i32,
    "cells_y": ti.i32,
    "cells_z": ti.i32,
    "first_cell": ti.i32,
}
_MESH_CELL = {"start": ti.i32}
_MESH_FACET = {"element": ti.i32}
_CORNER_EDGE = {"along": vec3}


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
        self.members = {"worlds": _WORLD, "walls": _WALL, "wall_elements": _WALL_ELEMENT, "corner_edges": _CORNER_EDGE}
        self.members |= {"sides": SIDE_COLUMNS, "meshes": _MESH, "mesh_cells": _MESH_CELL, "mesh_facets": _MESH_FACET}
        self.members |= {kind.name: kind.columns for kind in wall_kinds}
        self.worlds = arena.table(sizes.worlds, _WORLD)
        if single:
            self.bodies, self.loads, self.elements = arena.tables(2 * sizes.bodies, _BODY, _LOAD, _ELEMENT)
            self.owned: Any = None
            shaped: Any = [None, None] if self.round else arena.tables(2 * sizes.bodies, _ROTOR, _FORM)
            self.rotors, self.forms = shaped
        else:
            self.forms = None
            self.bodies, self.rotors = arena.tables(2 * sizes.bodies, _BODY, _ROTOR)
            self.loads, self.elements, self.owned = arena.tables(2 * sizes.elements, _LOAD, _ELEMENT, _OWNED)
        self.labels = arena.table(2 * sizes.bodies, _LABEL if single else _LABEL | _LISTED_PAIRS)
        more = {"superquadric": [_AXIS], "multisphere": [_PAIR_OF]}.get(kind, [])
        self.slots, *rest = arena.tables(2 * sizes.slots, _SLOT, *more, *memories)
        self.axes = rest[0] if kind == "superquadric" else None
        self.pair_of: Any = None if single else rest[0]
        self.past = rest[len(more) :]
        self.pairs: Any = None if single else arena.table(2 * sizes.slots, _PAIR)
        self.pushes: Any = None if single else arena.table(4 * sizes.slots, _PUSH)
        if gathering:  # the schedule over particles leaves reactions per slot and gathers them per partner
            self.reactions = arena.table(2 * sizes.slots, _REACTION if single else _REACTION | _OWN_PUSH)
            self.incoming = arena.table(2 * sizes.slots, {"slot": ti.i32})
            self.inbound = arena.table(2 * sizes.elements, {"start": ti.i32, "end": ti.i32})
        self.amounts = self.flows = None
        if carries:  # what bodies hold of an effect's amount, and what an evaluation changes of it by element
            self.amounts = arena.table(2 * sizes.bodies, {"held": ti.f64})
            self.flows = arena.table(2 * (sizes.bodies if single else sizes.elements), {"change": ti.f64})
        # One more row per world closes the last cell.
        self.cells = arena.table(sizes.cells + sizes.worlds, {"start": ti.i32, "cursor": ti.i32})
        self.walls = arena.table(sizes.walls, _WALL)
        self.wall_elements = arena.table(sizes.wall_elements, _WALL_ELEMENT)
        counts = {"plane": sizes.planes, "revolved": sizes.revolved, "facet": sizes.facets}
        tables = {kind.name: arena.table(counts[kind.name], kind.columns) for kind in wall_kinds}
        self.meshes = arena.table(sizes.meshes, _MESH)
        self.mesh_cells = arena.table(sizes.mesh_cells, _MESH_CELL)
        self.mesh_facets = arena.table(sizes.mesh_facets, _MESH_FACET)
        self.corner_edges = arena.table(sizes.corner_edges, _CORNER_EDGE)
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
