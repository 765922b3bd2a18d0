"""The study of held-out tests: what is written, and what a person has written there herself stays."""

from __future__ import annotations

from dataclasses import replace

import pandas as pd
import pytest

from taichidem import plugins
from taichidem.paper import held_out, own_files
from taichidem.paper.effort import QUICK
from taichidem.paper.session import Session
from taichidem.study import RunStore
from tests.paper import planted_heap

LEVELS = {"F": 0.5, "B": 910.0}
MINE = "experiment,observable,value,u,unit,n\ndensity,bulk_density,600,6,kg/m^3,5\n"


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A session with the planted cup as the only test."""
    with monkeypatch.context() as patch:
        planted_heap.plant(patch)
        with RunStore(tmp_path / "runs.sqlite") as store:
            yield Session(tmp_path, store, QUICK, lambda stage, share: None)
    plugins.refresh()


def test_the_fine_grains_are_reference_and_measurement_until_somebody_writes_hers(bench):
    folder = bench.folder / "held_out"
    held_out.confirm(bench, LEVELS)
    reference = (folder / "reference.csv").read_text()
    assert (folder / "measurements.csv").read_text() == reference
    assert held_out.own_files(bench.folder) == ()

    held_out.confirm(bench, LEVELS | {"B": 1000.0})  # another optimum: both follow
    assert (folder / "reference.csv").read_text() != reference
    assert (folder / "measurements.csv").read_text() == (folder / "reference.csv").read_text()
    assert "density = 1000.0" in (folder / "study.toml").read_text()


def test_own_measurements_are_kept_and_compared_with(bench):
    folder = bench.folder / "held_out"
    held_out.confirm(bench, LEVELS)
    (folder / "measurements.csv").write_text(MINE)
    found = held_out.confirm(bench, LEVELS | {"B": 1000.0})
    assert (folder / "measurements.csv").read_text() == MINE
    assert held_out.own_files(bench.folder) == ("measurements.csv",)
    assert found.table["measured"].item() == 600
    assert pd.read_csv(folder / "reference.csv")["value"].item() == pytest.approx(0.55 * 1000, rel=0.01)
    assert "density = 1000.0" in (folder / "study.toml").read_text()  # that one she left as it was

    (folder / "measurements.csv").unlink()
    held_out.confirm(bench, LEVELS)
    assert held_out.own_files(bench.folder) == ()


def test_an_own_study_is_kept(bench):
    held_out.confirm(bench, LEVELS)
    file = bench.folder / "held_out" / "study.toml"
    mine = file.read_text().replace('cup_radius = "36 mm"', 'cup_radius = "40 mm"')
    file.write_text(mine)
    held_out.confirm(bench, LEVELS | {"B": 1000.0})
    assert file.read_text() == mine
    assert held_out.own_files(bench.folder) == ("study.toml",)


def test_the_reference_is_uncertain_by_its_scatter_and_by_one_per_cent(bench):
    held_out.confirm(bench, LEVELS)
    row = pd.read_csv(bench.folder / "held_out" / "reference.csv").iloc[0]
    values = 0.55 * 910 * pd.Series([1 + 0.002 * (seed % 3 - 1) for seed in (5001, 5002)])
    assert row["n"] == 2
    assert row["value"] == pytest.approx(values.mean())
    assert row["u"] == pytest.approx(((0.01 * values.mean()) ** 2 + values.sem() ** 2) ** 0.5)


def test_more_seeds_are_more_of_the_reference(bench):
    held_out.confirm(replace(bench, effort=replace(QUICK, held_out=3)), LEVELS)
    assert pd.read_csv(bench.folder / "held_out" / "reference.csv")["n"].item() == 3


@pytest.mark.parametrize("record", [None, "{ damaged", '["not", "a", "table"]'])
def test_without_a_good_record_of_what_was_written_nothing_is_written_over(tmp_path, record):
    (tmp_path / "a.csv").write_text("hers")
    if record is not None:
        (tmp_path / own_files.RECORD).write_text(record)
    own_files.write_unless_changed(tmp_path, {"a.csv": "ours", "b.csv": "ours"})
    assert (tmp_path / "a.csv").read_text() == "hers"
    assert (tmp_path / "b.csv").read_text() == "ours"
    assert own_files.changed(tmp_path, ["a.csv", "b.csv", "c.csv"]) == ("a.csv",)


def test_what_was_written_counts_as_ours_though_a_kill_came_before_the_file(tmp_path, monkeypatch):
    def written(text):
        own_files.write_unless_changed(tmp_path, {"a.csv": text})

    written("first")
    with monkeypatch.context() as patch:
        whole = own_files.write_whole
        patch.setattr(own_files, "write_whole", lambda path, text: path.name == own_files.RECORD and whole(path, text))
        written("second")  # the record is there, the file is not
    assert (tmp_path / "a.csv").read_text() == "first"
    written("third")
    assert (tmp_path / "a.csv").read_text() == "third"
