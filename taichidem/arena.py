"""Own all Taichi memory of one engine; the only module that allocates it.

Every `ti.field` made by itself is a tree of its own, and a process dies at the 513th. One builder per engine keeps it to
one tree, and `destroy` gives the memory back.
"""

import taichi as ti


class Arena:
    """Tables (arrays of structs) that live in one tree and are freed together."""

    def __init__(self) -> None:
        self._builder = ti.FieldsBuilder()
        self._tree = None

    def table(self, rows: int, members: dict) -> ti.StructField:
        """Return a table of `rows` structs; `members` maps a name to its Taichi type."""
        return self.tables(rows, members)[0]

    def tables(self, rows: int, *groups: dict) -> list[ti.StructField]:
        """Return one table per group; row k of all of them lies together in memory."""
        fields = [ti.types.struct(**members).field() for members in groups]
        self._builder.dense(ti.i, max(1, rows)).place(*fields)
        return fields

    def seal(self) -> None:
        """Allocate every table declared so far; none can be added afterwards."""
        self._tree = self._builder.finalize()

    def destroy(self) -> None:
        """Free the memory; the tables must not be touched again."""
        if self._tree is not None:
            self._tree.destroy()
            self._tree = None
