"""Keep every run in one SQLite file, a row per run, so that none is computed twice and none is lost.

The file is kept in SQLite's rollback mode and not in WAL: a store is then really one file that can be copied, also after a
crash, it needs no shared memory, and what was committed is on the disk, whatever happens next. That holds with
`synchronous = EXTRA` only: a commit deletes the journal from the folder, and one that came back after a power cut, since the
folder was not yet on the disk, would undo it. A commit costs 1 to 20 ms, after how busy the disk is, a batch of runs seconds.
Runs that end together are one transaction; writers of several processes wait for one another. SQLite does not trust the locks
of network file systems: processes on several hosts must send their rows to one that writes.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import pandas as pd

from taichidem.errors import InputError
from taichidem.whole_file import whole_file

SCHEMA = 2  # 2: the column attempts
APPLICATION = 0x7444454D  # "tDEM", by which our files are told from other SQLite files
PATIENCE = 60.0  # [s] that a writer waits for others
AT_ONCE = 500  # keys per query; SQLite allows 999 placeholders everywhere
LARGEST_SEED = 2**63 - 1  # SQLite's whole numbers end there

_TABLE = """
CREATE TABLE IF NOT EXISTS runs (
    key TEXT PRIMARY KEY,
    experiment_type TEXT NOT NULL,
    experiment TEXT NOT NULL,
    seed INTEGER NOT NULL,
    model TEXT NOT NULL,
    settings TEXT NOT NULL,
    physics TEXT NOT NULL,
    status TEXT NOT NULL CHECK (status IN ('done', 'failed')),
    responses TEXT NOT NULL,
    reason TEXT NOT NULL,
    details TEXT NOT NULL,
    wall_time REAL NOT NULL,
    finished_at TEXT NOT NULL,
    attempts INTEGER NOT NULL DEFAULT 1
)
"""
# Version → what makes the next one of it, in place; a store is never left between two.
_MIGRATIONS = {1: "ALTER TABLE runs ADD COLUMN attempts INTEGER NOT NULL DEFAULT 1"}


@dataclass(frozen=True)
class StoredRun:
    """One run of the store.

    Attributes:
        key: hash of all that its outcome depends on.
        experiment_type: registered name of the experiment.
        experiment: what the study that ran it first calls the experiment.
        seed: of its random stream.
        model, settings: as canonical JSON.
        physics: PHYSICS_VERSION it was computed with.
        status: "done" or "failed".
        responses: observable → value, in the units the experiment declares; empty when it failed.
        reason: why it failed, or "".
        details: further numbers of the measurement, and why a first attempt failed.
        wall_time: [s] its batch took, divided among the batch's runs.
        finished_at: UTC, ISO 8601.
        attempts: 2 where the first one's world stopped and the row is of a second, with other random numbers.
    """

    key: str
    experiment_type: str
    experiment: str
    seed: int
    model: str
    settings: str
    physics: str
    status: str
    responses: Mapping[str, float]
    wall_time: float
    finished_at: str
    reason: str = ""
    details: Mapping[str, Any] = field(default_factory=dict)
    attempts: int = 1


_COLUMNS = tuple(f.name for f in fields(StoredRun))
_JSON = ("responses", "details")
# What a table takes from the file; models, settings and details are most of it.
_SHOWN = tuple(name for name in _COLUMNS if name not in ("model", "settings", "physics", "details"))
# A failed run may be replaced by a later attempt; a finished one never changes, whoever comes second.
_INSERT = (
    f"INSERT INTO runs ({', '.join(_COLUMNS)}) VALUES ({', '.join('?' * len(_COLUMNS))}) ON CONFLICT(key) DO UPDATE SET "
    + ", ".join(f"{name} = excluded.{name}" for name in _COLUMNS if name != "key")
    + " WHERE runs.status = 'failed'"
)


class RunStore:
    """The runs of one or more studies; open it with `with`.

    Args:
        path: of the SQLite file; it is made if it does not exist.

    Raises:
        InputError: no SQLite file, one of another program or of another version of this store, or it can't be written.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.parent.is_dir():
            raise InputError(
                f"Run store {self.path}: there is no folder {self.path.parent}. Make it, or give another file."
            )
        if os.path.isdir(self.path):  # Path.is_dir raises in a folder that may not be entered
            raise InputError(f"Run store {self.path} is a folder; give a file, such as {self.path / 'runs.sqlite'}.")
        with self._errors():
            self._connection = sqlite3.connect(self.path, timeout=PATIENCE, isolation_level=None)
        try:
            self._open()
        except BaseException:
            self._connection.close()
            raise

    def _open(self) -> None:
        with self._errors():
            self._connection.execute("PRAGMA synchronous = EXTRA")  # refused within a transaction
        with self._errors(), self._transaction():
            tables = self._connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall()
            application, version = (
                self._connection.execute(f"PRAGMA {name}").fetchone()[0] for name in ("application_id", "user_version")
            )
            if tables and application != APPLICATION:
                raise InputError(
                    f"Run store {self.path} is the SQLite file of another program. Give another file name; it will be made."
                )
            if tables:
                self._migrate(version)
            self._connection.execute(f"PRAGMA application_id = {APPLICATION}")
            self._connection.execute(f"PRAGMA user_version = {SCHEMA}")
            self._connection.execute(_TABLE)

    def _migrate(self, version: int) -> None:
        """Make a store of an earlier version one of this, within the transaction in which it is opened."""
        if version not in {*_MIGRATIONS, SCHEMA}:
            raise InputError(
                f"Run store {self.path} is of version {version}; this taichidem reads versions {min(_MIGRATIONS)} to {SCHEMA}. "
                "Use the taichidem that wrote it, or a newer one, or give another file name and run again."
            )
        for number in range(version, SCHEMA):
            self._connection.execute(_MIGRATIONS[number])

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        # IMMEDIATE: take the writer's lock first. Two readers who both want to become writers would wait for each other,
        # which SQLite ends at once with an error instead of waiting.
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._connection.execute("COMMIT")
        except BaseException:
            if self._connection.in_transaction:  # SQLite has ended it already where the disk was full
                self._connection.execute("ROLLBACK")
            raise

    @contextmanager
    def _errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.DatabaseError as error:
            raise InputError(f"Run store {self.path}: {error}. {_advice(error)}") from error

    def __enter__(self) -> RunStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __len__(self) -> int:
        with self._errors():
            return int(self._connection.execute("SELECT COUNT(*) FROM runs").fetchone()[0])

    def add(self, *runs: StoredRun) -> int:
        """Write runs, all of them at once or none; a finished run that is there already stays as it is.

        Returns:
            How many rows were written: fewer than were given where another process had finished some before.
        """
        rows = [
            [json.dumps(v) if n in _JSON else v for n, v in ((n, getattr(run, n)) for n in _COLUMNS)] for run in runs
        ]
        before = self._connection.total_changes
        with self._errors(), self._transaction():
            self._connection.executemany(_INSERT, rows)
        return self._connection.total_changes - before

    def runs(self, keys: Iterable[str] | None = None) -> list[StoredRun]:
        """Return the runs with these keys that are there, or all, in the order in which they were written."""
        return [self._stored(row) for row in self._select(_COLUMNS, keys)]

    def statuses(self, keys: Iterable[str]) -> dict[str, str]:
        """Return key → status of those keys that are there."""
        return {key: status for key, status in self._select(("key", "status"), keys)}

    def _select(self, columns: Sequence[str], keys: Iterable[str] | None) -> Iterator[tuple]:
        query = f"SELECT {', '.join(columns)} FROM runs"
        with self._errors():
            if keys is None:
                yield from self._connection.execute(f"{query} ORDER BY rowid")
                return
            wanted = list(dict.fromkeys(keys))
            for first in range(0, len(wanted), AT_ONCE):
                part = wanted[first : first + AT_ONCE]
                marks = ", ".join("?" * len(part))
                yield from self._connection.execute(f"{query} WHERE key IN ({marks}) ORDER BY rowid", part)

    @staticmethod
    def _stored(row: tuple) -> StoredRun:
        return StoredRun(**{n: json.loads(v) if n in _JSON else v for n, v in zip(_COLUMNS, row, strict=True)})

    def copy_to(self, path: Path) -> None:
        """Write all rows into another file, whole also while others write this one; what was there is replaced."""
        with self._errors(), whole_file(path) as fresh:
            other = sqlite3.connect(fresh)
            try:
                self._connection.backup(other)
            finally:
                other.close()

    def table(self, keys: Iterable[str] | None = None) -> pd.DataFrame:
        """Return runs as a table: key, experiment, type, seed, a column per response, status, reason, attempts, wall time."""
        return as_table(self._shown(keys))

    def named(self, keys: Sequence[str], names: Sequence[str]) -> pd.DataFrame:
        """Return the table of runs that are there, in the order of the keys, each under a name of the caller's."""
        found = {row["key"]: row for row in self._shown(keys)}
        pairs = zip(keys, names, strict=True)
        return as_table({**found[key], "experiment": name or found[key]["experiment"]} for key, name in pairs)

    def _shown(self, keys: Iterable[str] | None) -> Iterator[dict[str, Any]]:
        for row in self._select(_SHOWN, keys):
            held = dict(zip(_SHOWN, row, strict=True))
            yield held | {"responses": json.loads(held["responses"])}


def as_table(rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Return rows as a table with a column per response (empty where a run has none)."""
    rows = list(rows)
    responses = list(dict.fromkeys(name for row in rows for name in row["responses"]))
    columns = [
        "key",
        "experiment",
        "type",
        "seed",
        *responses,
        "status",
        "reason",
        "attempts",
        "wall_time",
        "finished_at",
    ]
    held: dict[str, list] = {name: [] for name in columns}
    for row in rows:
        values = {**row["responses"], **row, "type": row["experiment_type"]}
        for name, column in held.items():
            column.append(values.get(name))
    return pd.DataFrame(held, columns=columns).astype(dict.fromkeys(responses, float))


def _advice(error: sqlite3.DatabaseError) -> str:
    text = str(error)
    if "not a database" in text or "malformed" in text:
        return "Give another file name; a new store will be made."
    if "locked" in text:
        return f"Another process has held it for {PATIENCE:g} s. Wait until that has ended, or give another file."
    if "full" in text:
        return "Make room on the disk; what was finished before is kept, and the same command goes on."
    return "Check that the folder exists and can be written, and that the disk has room; or give another file."
