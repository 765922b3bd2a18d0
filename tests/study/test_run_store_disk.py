"""The run store on disks that are full, locked, read-only or lose their power."""

from __future__ import annotations

import os
import sqlite3
import stat
import tempfile
from contextlib import contextmanager
from pathlib import Path

import pytest

from taichidem.errors import InputError
from taichidem.study import RunStore
from taichidem.study import run_store as module
from tests.study.test_run_store import a_run


def test_what_is_committed_survives_a_power_cut(store):
    """As far as SQLite can see to it: in rollback mode EXTRA alone also syncs the folder that held the journal."""
    assert store._connection.execute("PRAGMA synchronous").fetchone() == (3,)


def test_a_full_disk_is_told_and_nothing_is_lost(store):
    store.add(a_run())
    pages = store._connection.execute("PRAGMA page_count").fetchone()[0]
    store._connection.execute(f"PRAGMA max_page_count = {pages}")
    many = [a_run(f"n{k}", model="x" * 4000, seed=k) for k in range(100)]
    with pytest.raises(InputError, match=r"runs\.sqlite: database or disk is full\. Make room on the disk"):
        store.add(*many)
    assert store.runs() == [a_run()]
    store._connection.execute("PRAGMA max_page_count = 100000")
    assert store.add(*many) == 100


def test_a_commit_that_fails_leaves_no_transaction_open(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PATIENCE", 0.1)
    with RunStore(tmp_path / "runs.sqlite") as store:
        store.add(a_run())
        other = sqlite3.connect(store.path, isolation_level=None)
        other.execute("BEGIN")
        other.execute("SELECT * FROM runs").fetchall()  # who reads lets others prepare a change and not commit it
        with pytest.raises(InputError, match="locked"):
            store.add(a_run("k2"))
        other.close()
        assert store.add(a_run("k3")) == 1
        assert store.runs() == [a_run(), a_run("k3")]


@contextmanager
def nobody():
    """Be a user without rights for a while; a root may write everywhere."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def test_a_folder_that_cannot_be_written():
    with tempfile.TemporaryDirectory() as folder:
        with RunStore(Path(folder) / "old.sqlite") as store:
            store.add(a_run())
        os.chmod(folder, stat.S_IRUSR | stat.S_IXUSR | stat.S_IROTH | stat.S_IXOTH)
        os.chmod(Path(folder) / "old.sqlite", 0o444)
        try:
            for name in ("new.sqlite", "old.sqlite"):
                with (
                    nobody(),
                    pytest.raises(InputError, match=f"{name}: .*Check that the folder exists and can be written"),
                ):
                    RunStore(Path(folder) / name)
        finally:
            os.chmod(folder, 0o700)


def test_a_store_that_another_process_holds(store, monkeypatch):
    other = sqlite3.connect(store.path, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    monkeypatch.setattr(module, "PATIENCE", 0.1)
    with pytest.raises(InputError, match=r"locked. Another process has held it for 0.1 s"):
        RunStore(store.path)
    other.execute("ROLLBACK")
    other.close()
