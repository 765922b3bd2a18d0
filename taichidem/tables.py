"""Write and read rows of a table as one NumPy array, by one small kernel per table.

Setting single entries from Python would compile an accessor for every column; that takes seconds per engine.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import taichi as ti


@ti.data_oriented
class TableAccess:
    """Rows of one struct table as arrays; vectors take several columns."""

    def __init__(self, table, members: Mapping[str, object]) -> None:
        self.names = list(members)
        self.widths = [getattr(kind, "n", 1) for kind in members.values()]
        self.columns = [table.get_member_field(name) for name in self.names]
        starts = np.concatenate([[0], np.cumsum(self.widths)]).astype(int)
        self.starts = starts[:-1].tolist()
        self.width = int(starts[-1])

    def write(self, first: int, rows: Sequence[Mapping[str, Any]]) -> None:
        """Write rows from row number `first`; a column that a row leaves out becomes 0."""
        if not rows:
            return
        array = np.zeros((len(rows), self.width))
        for k, row in enumerate(rows):
            for name, start, width in zip(self.names, self.starts, self.widths, strict=True):
                array[k, start : start + width] = row.get(name, 0.0)
        self._write(first, array)

    def write_column(self, first: int, name: str, values: np.ndarray) -> None:
        """Write one column of a table that has no other, from row number `first`."""
        if self.names != [name]:
            raise ValueError(f"The table has the columns {self.names}, not {name!r} alone.")
        if len(values):
            self._write(first, np.ascontiguousarray(values, dtype=float).reshape(-1, 1))

    def read(self, row: int) -> dict[str, float]:
        """Return the one-number columns of a row."""
        array = np.zeros((1, self.width))
        self._read(row, array)
        return {n: array[0, s] for n, s, w in zip(self.names, self.starts, self.widths, strict=True) if w == 1}

    def read_row(self, row: int) -> dict[str, Any]:
        """Return every column of a row, vectors as arrays; `write` takes it back."""
        array = np.zeros((1, self.width))
        self._read(row, array)
        spans = zip(self.names, self.starts, self.widths, strict=True)
        return {n: array[0, s] if w == 1 else array[0, s : s + w].copy() for n, s, w in spans}

    def read_all(self, rows: int) -> dict[str, np.ndarray]:
        """Return the one-number columns of the first rows."""
        array = np.zeros((rows, self.width))
        self._read(0, array)
        return {n: array[:, s] for n, s, w in zip(self.names, self.starts, self.widths, strict=True) if w == 1}

    @ti.kernel
    def _write(self, first: ti.i32, array: ti.types.ndarray()):
        for k in range(array.shape[0]):
            for c in ti.static(range(len(self.columns))):
                if ti.static(self.widths[c] == 1):
                    self.columns[c][first + k] = ti.cast(array[k, self.starts[c]], self.columns[c].dtype)
                else:
                    for axis in ti.static(range(self.widths[c])):
                        self.columns[c][first + k][axis] = array[k, self.starts[c] + axis]

    @ti.kernel
    def _read(self, first: ti.i32, array: ti.types.ndarray()):
        for k in range(array.shape[0]):
            for c in ti.static(range(len(self.columns))):
                if ti.static(self.widths[c] == 1):
                    array[k, self.starts[c]] = ti.cast(self.columns[c][first + k], ti.f64)
                else:
                    for axis in ti.static(range(self.widths[c])):
                        array[k, self.starts[c] + axis] = self.columns[c][first + k][axis]
