"""Runs whose checkpoints can't be written, are stopped at the end, or meet another run under the same name."""

from __future__ import annotations

import os
import signal
import warnings

import pytest

from taichidem.checkpoints import keeper
from taichidem.checkpoints.keeper import Keeper
from taichidem.errors import CheckpointWarning, InputError
from taichidem.experiments.rebound import Rebound
from taichidem.experiments.together import discard_checkpoint
from tests.experiments.planted import granules


class Long(Rebound):
    """A rebound with several looks at the clock."""

    name = "rebound"

    def procedure(self, world, model):
        yield from super().procedure(world, model)
        for _ in range(6):
            yield 1e-5


def run(file, seed=1):
    (outcome,) = Long().run(granules(), [seed], checkpoint=file, checkpoint_every=0)
    return outcome


@pytest.fixture
def full_disk(monkeypatch):
    """Let the writes of some numbers fail, and return the numbers of all writes."""
    write, numbers, failing = keeper.write_checkpoint, [], set()

    def written(path, *rest):
        numbers.append(len(numbers))
        if numbers[-1] in failing:
            raise InputError(f"The checkpoint {path} can't be written (No space left on device). Make room.")
        write(path, *rest)

    monkeypatch.setattr(keeper, "write_checkpoint", written)

    def fail(*which):
        failing.update(which)
        return numbers

    return fail


def test_a_full_disk_is_told_once_and_tried_again(full_disk, tmp_path):
    numbers = full_disk(1, 2, 4)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = run(tmp_path / "state")
    assert len(numbers) > 6
    notes = [str(one.message) for one in told if one.category is CheckpointWarning]
    assert len(notes) == 2  # 1 and 2 are one outage
    assert all(
        "(No space left on device). Make room. The run goes on; until a checkpoint can" in note for note in notes
    )
    assert run(None).observables == found.observables


def test_a_full_disk_at_the_end_costs_no_outcome(full_disk, tmp_path):
    full_disk(*range(2, 99))
    with pytest.warns(CheckpointWarning, match="No space left"):
        found = run(tmp_path / "state")
    assert found.failure is None
    assert (tmp_path / "state").exists()  # the one before


def test_a_full_disk_is_an_error_where_a_stop_was_asked_for(full_disk, monkeypatch, tmp_path):
    full_disk(1)
    keep = Keeper._keep

    def stopped(self, course):
        if self.path.exists():
            os.kill(os.getpid(), signal.SIGINT)
        keep(self, course)

    monkeypatch.setattr(Keeper, "_keep", stopped)
    with pytest.raises(InputError, match="No space left"):
        run(tmp_path / "state")


@pytest.mark.parametrize("notes", [None, b"my notes"])
def test_a_name_that_another_has_taken_is_left_to_it(notes, monkeypatch, tmp_path):
    file, keep, looks = tmp_path / "state", Keeper._keep, []
    run(tmp_path / "other", seed=2)
    others = notes or (tmp_path / "other").read_bytes()

    def meets(self, course):
        looks.append(course.share)
        if len(looks) == 2:
            file.write_bytes(others)
        keep(self, course)

    monkeypatch.setattr(Keeper, "_keep", meets)
    with pytest.warns(
        CheckpointWarning, match=r"is by now that of another run, or damaged\. Move it away, and give each"
    ):
        assert run(file).failure is None
    discard_checkpoint(file, [Long()], [granules()], [1])
    assert file.read_bytes() == others


def test_a_run_discards_its_own_file_alone(tmp_path):
    run(tmp_path / "state")
    discard_checkpoint(tmp_path / "state", [Long()], [granules()], [2])
    assert (tmp_path / "state").exists()
    for _ in range(2):  # also one that is not there
        discard_checkpoint(tmp_path / "state", [Long()], [granules()], [1])
        assert not (tmp_path / "state").exists()


@pytest.mark.parametrize("when", ["end", "measure"])
def test_ctrl_c_after_the_last_step_stops_and_nothing_is_lost(when, monkeypatch, tmp_path):
    owner = {"end": Keeper, "measure": Long}[when]
    usual = getattr(owner, when)

    def pressed(self, *given):
        os.kill(os.getpid(), signal.SIGINT)
        return usual(self, *given)

    with monkeypatch.context() as patched:
        patched.setattr(owner, when, pressed)
        with pytest.raises(KeyboardInterrupt, match="state holds how far it came; the same command goes on from there"):
            run(tmp_path / "state")
    monkeypatch.setattr("taichidem.stepper.Stepper._advance", lambda *_: pytest.fail("it simulated again"))
    assert run(tmp_path / "state").failure is None


class Refusing(Long):
    """A test that gives up after some checkpoints."""

    def procedure(self, world, model):
        yield from super().procedure(world, model)
        raise InputError("no place")


def test_the_checkpoint_before_a_failure_stays(monkeypatch, tmp_path):
    file, written = tmp_path / "state", []
    write = Keeper._write
    monkeypatch.setattr(Keeper, "_write", lambda self, course: (write(self, course), written.append(file.read_bytes())))
    with pytest.raises(InputError, match="no place"):
        Refusing().run(granules(), [1], checkpoint=file, checkpoint_every=0)
    assert file.read_bytes() == written[-1]
    assert run(file).failure is None  # mended: it goes on from there
