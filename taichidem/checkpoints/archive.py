"""Read every row that a simulation's future depends on out of an engine's tables, and write them back, bit by bit.

Left out are what is written when scenes are loaded (coefficients, the geometry of walls), what each rebuild or each
evaluation makes anew before it reads it (cells, pairs, reactions), and flows, which are 0 between evaluations. Of tables with two
halves only the one in use is kept.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import taichi as ti

Array = ti.types.ndarray()

ROWS_OF = {  # by what rows of a table there is one: an attribute of `State` each
    "world": ("worlds",),
    "wall": ("walls",),
    "body": ("bodies", "rotors", "forms", "labels", "amounts"),
    "element": ("loads", "elements", "owned", "inbound"),
    "slot": ("slots", "axes", "pair_of", "incoming"),
    "push": ("pushes",),
}


def kept_tables(engine) -> dict[str, tuple[ti.StructField, str]]:
    """Return the tables to keep by name, each with what its rows stand for; contact memories by their effect's name."""
    named = {name: (getattr(engine.state, name, None), rows) for rows, names in ROWS_OF.items() for name in names}
    for bound in engine.law.contact_bound:
        named[f"memory of {bound.effect.name}"] = (bound.past, "slot")
    return {name: held for name, held in named.items() if held[0] is not None}


def spans(world: int, row: Mapping[str, float]) -> dict[str, tuple[int, int]]:
    """Return first row and number of rows that a world uses now, by what the rows stand for.

    Args:
        row: of the table of worlds.
    """
    first_slot, slots = int(row["slot_base"]), int(row["slots"])
    return {
        "world": (world, 1),
        "wall": (int(row["first_wall"]), int(row["walls"])),
        "body": (int(row["body_base"]), int(row["bodies"])),
        "element": (int(row["element_base"]), int(row["elements"])),
        "slot": (first_slot, slots),
        "push": (2 * first_slot, 2 * slots),  # of the last two evaluations
    }


@ti.data_oriented
class RowAccess:
    """Rows of one table as two arrays, its floating-point numbers and its whole numbers, vectors and structs in pieces."""

    def __init__(self, table) -> None:
        columns = _columns("", table)
        self.names = [name for name, _ in columns]
        self.floats = [column for _, column in columns if column.dtype == ti.f64]
        self.integers = [column for _, column in columns if column.dtype == ti.i32]
        if len(self.floats) + len(self.integers) < len(columns):
            raise TypeError(f"A table has columns that are neither f64 nor i32: {self.names}.")

    def empty(self, rows: int) -> tuple[np.ndarray, np.ndarray]:
        """Return arrays for so many rows; a table without columns of a type keeps an unused one."""
        return np.zeros((rows, max(1, len(self.floats)))), np.zeros((rows, max(1, len(self.integers))), np.int32)

    @ti.kernel
    def read(self, first: ti.i32, floats: Array, integers: Array):
        for k in range(floats.shape[0]):
            for c in ti.static(range(len(self.floats))):
                floats[k, c] = self.floats[c][first + k]
            for c in ti.static(range(len(self.integers))):
                integers[k, c] = self.integers[c][first + k]

    @ti.kernel
    def write(self, first: ti.i32, floats: Array, integers: Array):
        for k in range(floats.shape[0]):
            for c in ti.static(range(len(self.floats))):
                self.floats[c][first + k] = floats[k, c]
            for c in ti.static(range(len(self.integers))):
                self.integers[c][first + k] = integers[k, c]


def _columns(name: str, field) -> list[tuple[str, Any]]:
    """Return the columns of a table that hold one number each, with their names."""
    if isinstance(field, ti.StructField):
        parts = [(f"{name}.{key}" if name else key, field.get_member_field(key)) for key in field.keys]
    elif isinstance(field, ti.MatrixField):
        places = [(i, j) for i in range(field.n) for j in range(field.m)]
        parts = [(f"{name}[{i},{j}]", field.get_scalar_field(i, j)) for i, j in places]
    else:
        return [(name, field)]
    return [column for part in parts for column in _columns(*part)]


class Archive:
    """The kept tables of one engine."""

    def __init__(self, engine) -> None:
        self.worlds = engine.access["worlds"]
        kept = kept_tables(engine)
        self.rows_of = {name: rows for name, (_, rows) in kept.items()}
        self.access = {name: RowAccess(table) for name, (table, _) in kept.items()}

    def columns(self) -> dict[str, list[str]]:
        """Return the columns of each kept table; a state fits an engine whose tables have the same ones."""
        return {name: access.names for name, access in self.access.items()}

    def read(self, worlds: int) -> list[dict[str, tuple[np.ndarray, np.ndarray]]]:
        """Return, for each world, the rows in use of each table."""
        return [self._read_world(world) for world in range(worlds)]

    def _read_world(self, world: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        held = {}
        span = spans(world, self.worlds.read(world))
        for name, access in self.access.items():
            first, count = span[self.rows_of[name]]
            held[name] = access.empty(count)
            if count:
                access.read(first, *held[name])
        return held

    def write(self, states: list[dict[str, tuple[np.ndarray, np.ndarray]]]) -> None:
        """Put the rows of all worlds back; the row of each world comes first, since it says where the others lie."""
        for world, held in enumerate(states):
            self.access["worlds"].write(world, *held["worlds"])
            span = spans(world, self.worlds.read(world))
            for name, access in self.access.items():
                first, count = span[self.rows_of[name]]
                if count:
                    access.write(first, *held[name])
