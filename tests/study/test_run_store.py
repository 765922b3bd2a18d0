"""The run store: a row per run, each whole, none twice, none lost."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from taichidem.errors import InputError
from taichidem.study import RunStore, StoredRun
from taichidem.study import run_store as module

ROOT = Path(__file__).resolve().parents[2]


def a_run(key="k1", **changes):
    run = StoredRun(
        key=key,
        experiment_type="quick",
        experiment="narrow",
        seed=3,
        model='{"materials":[]}',
        settings='{"width":0.04}',
        physics="1",
        status="done",
        responses={"angle": 0.1 + 0.2, "flow": 1e-300},
        wall_time=1.25,
        finished_at="2026-11-22T08:00:00+00:00",
        details={"grains": 5},
    )
    return replace(run, **changes)


FAILED = {"status": "failed", "responses": {}, "reason": "it diverged"}


def test_a_run_comes_back_as_it_went_in(store):
    runs = [a_run(), a_run("k2", **FAILED)]
    for run in runs:
        store.add(run)
    assert store.runs() == runs  # to the last bit of a number
    assert store.runs(["k2", "nowhere"]) == runs[1:]
    assert store.statuses(["k1", "k2", "nowhere"]) == {"k1": "done", "k2": "failed"}
    assert len(store) == 2


def test_rows_are_there_for_whoever_opens_the_file_next(store):
    store.add(a_run())
    with RunStore(store.path) as other:
        assert other.runs() == [a_run()]
        other.add(a_run("k2"))
    assert len(store) == 2


def test_a_finished_run_never_changes_and_is_never_there_twice(store):
    store.add(a_run())
    store.add(a_run(responses={"angle": 99.0}))
    store.add(a_run(**FAILED))
    assert store.runs() == [a_run()]


def test_a_failed_run_gives_way_to_a_later_attempt(store):
    store.add(a_run(**FAILED))
    store.add(a_run(**(FAILED | {"reason": "again"})))
    assert [run.reason for run in store.runs()] == ["again"]
    store.add(a_run())
    assert store.runs() == [a_run()]


def test_runs_written_together_are_there_all_or_none(store):
    with pytest.raises(InputError, match="CHECK constraint"):
        store.add(a_run(), a_run("k2", status="perhaps"))
    assert len(store) == 0
    store.add(a_run(), a_run("k2"))
    assert store.runs() == [a_run(), a_run("k2")]
    store.add()
    assert len(store) == 2


def test_more_keys_than_one_query_takes(store, monkeypatch):
    monkeypatch.setattr(module, "AT_ONCE", 3)
    for k in range(8):
        store.add(a_run(f"k{k}"))
    keys = [f"k{k}" for k in range(10)]
    assert list(store.statuses(keys)) == keys[:8]
    assert [run.key for run in store.runs(keys)] == keys[:8]
    assert store.statuses([]) == {}
    assert [run.key for run in store.runs(["k1"] * 5)] == ["k1"]  # though they are spread over two queries


def test_the_table_has_a_column_per_response(store):
    store.add(a_run())
    store.add(a_run("k2", experiment="other", responses={"mass": 2.0}))
    store.add(a_run("k3", **FAILED))
    table = store.table()
    assert list(table["key"]) == ["k1", "k2", "k3"]
    assert list(table["experiment"]) == ["narrow", "other", "narrow"]
    assert list(table["type"]) == ["quick"] * 3
    assert list(table["seed"]) == [3] * 3
    assert table["angle"].tolist()[0] == 0.1 + 0.2
    assert table["angle"].isna().tolist() == [False, True, True]
    assert table["mass"].isna().tolist() == [True, False, True]
    assert list(table["status"]) == ["done", "done", "failed"]
    assert list(table["reason"]) == ["", "", "it diverged"]
    assert list(table["wall_time"]) == [1.25] * 3
    assert list(store.table(["k2"])["mass"]) == [2.0]
    assert len(store.table(["nowhere"])) == 0


def test_only_known_statuses_are_written(store):
    with pytest.raises(InputError, match="CHECK constraint"):
        store.add(a_run(status="perhaps"))
    assert len(store) == 0
    store.add(a_run())  # the failed transaction is over
    assert len(store) == 1


def test_adding_tells_how_many_rows_were_written(store):
    assert store.add(a_run(), a_run("k2", **FAILED)) == 2
    assert store.add(a_run(), a_run("k2"), a_run("k3")) == 2  # the first was finished before
    assert store.add(a_run(), a_run("k2")) == store.add() == 0


def test_it_is_one_file_in_rollback_mode(store):
    store.add(a_run())
    assert [path.name for path in store.path.parent.iterdir()] == ["runs.sqlite"]
    assert sqlite3.connect(store.path).execute("PRAGMA journal_mode").fetchone() == ("delete",)


def test_a_file_that_is_no_sqlite(tmp_path):
    (tmp_path / "runs.sqlite").write_text(
        "a text that is no data base at all, and longer than a header of hundred bytes " * 3
    )
    with pytest.raises(InputError, match=r"runs.sqlite: file is not a database. Give another file name"):
        RunStore(tmp_path / "runs.sqlite")


def test_the_file_of_another_program(tmp_path):
    with sqlite3.connect(tmp_path / "other.sqlite") as other:
        other.execute("CREATE TABLE songs (name TEXT)")
    before = (tmp_path / "other.sqlite").read_bytes()
    with pytest.raises(InputError, match=r"other.sqlite is the SQLite file of another program"):
        RunStore(tmp_path / "other.sqlite")
    assert (tmp_path / "other.sqlite").read_bytes() == before


def test_a_store_of_another_version(store):
    with sqlite3.connect(store.path) as other:
        other.execute("PRAGMA user_version = 7")
    with pytest.raises(
        InputError,
        match=r"is of version 7; this taichidem reads versions 1 to 2\. Use .* that wrote it",
    ):
        RunStore(store.path)


OLD = """
CREATE TABLE runs (key TEXT PRIMARY KEY, experiment_type TEXT NOT NULL, experiment TEXT NOT NULL, seed INTEGER NOT NULL,
model TEXT NOT NULL, settings TEXT NOT NULL, physics TEXT NOT NULL, status TEXT NOT NULL CHECK (status IN ('done', 'failed')),
responses TEXT NOT NULL, reason TEXT NOT NULL, details TEXT NOT NULL, wall_time REAL NOT NULL, finished_at TEXT NOT NULL)
"""


def an_old_store(path):
    """Write the file that version 1 of the store made."""
    old = [name for name in module._COLUMNS if name != "attempts"]
    values = [getattr(a_run(), name) for name in old]
    with sqlite3.connect(path) as file:
        file.execute(OLD)
        row = [json.dumps(v) if isinstance(v, dict) else v for v in values]
        file.execute(f"INSERT INTO runs ({', '.join(old)}) VALUES ({', '.join('?' * len(old))})", row)
        file.execute(f"PRAGMA application_id = {module.APPLICATION}")
        file.execute("PRAGMA user_version = 1")


def test_a_store_of_the_version_before_is_made_one_of_this(tmp_path):
    an_old_store(tmp_path / "runs.sqlite")
    with RunStore(tmp_path / "runs.sqlite") as store:
        assert store.runs() == [a_run()]
        store.add(a_run("k2", attempts=2))
    with RunStore(tmp_path / "runs.sqlite") as store:  # and migrated once only
        assert store.table()["attempts"].tolist() == [1, 2]
    assert sqlite3.connect(tmp_path / "runs.sqlite").execute("PRAGMA user_version").fetchone() == (module.SCHEMA,)


def test_a_migration_that_breaks_off_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    an_old_store(tmp_path / "runs.sqlite")
    before = (tmp_path / "runs.sqlite").read_bytes()
    monkeypatch.setattr(module, "_TABLE", "no SQL")  # what comes after the migration, in its transaction
    with pytest.raises(InputError, match="syntax error"):
        RunStore(tmp_path / "runs.sqlite")
    assert (tmp_path / "runs.sqlite").read_bytes() == before


def test_a_copy_holds_all_rows_and_replaces_what_was_there(store):
    store.add(a_run(), a_run("k2", **FAILED))
    target = store.path.with_name("copy.sqlite")
    target.write_text("something else")
    store.copy_to(target)
    with RunStore(target) as copy:
        assert copy.runs() == store.runs()
    assert sorted(path.name for path in store.path.parent.iterdir()) == ["copy.sqlite", "runs.sqlite"]


def test_runs_under_names_of_the_caller(store):
    store.add(a_run(), a_run("k2", responses={"mass": 2.0}))
    table = store.named(["k2", "k1", "k2"], ["heap", "", "drum"])
    assert table["experiment"].tolist() == ["heap", "narrow", "drum"]
    assert table["mass"].tolist()[::2] == [2.0, 2.0]
    assert table["angle"].isna().tolist() == [True, False, True]


def test_no_folder_and_a_folder_in_its_place(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        RunStore(tmp_path / "nowhere" / "runs.sqlite")
    with pytest.raises(InputError, match=r"is a folder; give a file, such as .*runs\.sqlite"):
        RunStore(tmp_path)


WRITER = """
import sys
from tests.study.test_run_store import RunStore, a_run
with RunStore(sys.argv[1]) as store:
    print("open", flush=True)
    sys.stdin.readline()
    for k in range(int(sys.argv[2]), int(sys.argv[3])):
        store.add(a_run(f"k{k}", seed=k, wall_time=float(sys.argv[2])))
"""


def test_two_processes_write_at_once(tmp_path):
    path = tmp_path / "runs.sqlite"
    writers = [
        subprocess.Popen(
            [sys.executable, "-c", WRITER, str(path), str(first), str(first + 100)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=ROOT,
            text=True,
        )
        for first in (0, 50)
    ]
    for writer in writers:
        assert writer.stdout.readline() == "open\n"
    for writer in writers:  # both have the file open before either writes
        writer.stdin.write("go\n")
        writer.stdin.flush()
    assert [writer.wait(timeout=60) for writer in writers] == [0, 0]
    with RunStore(path) as store:
        runs = store.runs()
    assert sorted(run.seed for run in runs) == list(range(150))
    assert {run.wall_time for run in runs} == {0.0, 50.0}
