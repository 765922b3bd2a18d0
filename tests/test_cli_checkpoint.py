"""`taichidem simulate --checkpoint`, and `--arch`."""

from __future__ import annotations

import json
import os
import signal

import pytest

from taichidem import render_experiment, runtime
from taichidem.checkpoints import keeper
from taichidem.checkpoints.keeper import Keeper
from taichidem.errors import InputError
from taichidem.experiments.rebound import Rebound
from taichidem.stepper import Stepper

DRUM = ["radius=36 mm", "length=24 mm", "particles=75", "settle_time=0.1", "spin_up_time=0.1", "averaging_time=0.1"]
COMMAND = ["simulate", "rotating_drum", *(part for setting in DRUM for part in ("-s", setting)), "--json"]


@pytest.fixture
def stopped(monkeypatch):
    """Let Ctrl-C come at the third look at the clock."""
    between, looks = Keeper._between, []

    def interrupted(self, course):
        looks.append(course.share)
        if len(looks) == 3:
            os.kill(os.getpid(), signal.SIGINT)
        between(self, course)

    monkeypatch.setattr(Keeper, "_between", interrupted)
    return looks


def test_ctrl_c_keeps_the_state_and_the_same_command_goes_on(command, stopped, tmp_path):
    handler = signal.getsignal(signal.SIGINT)
    _, whole, _ = command(*COMMAND)
    file = tmp_path / "state"
    code, out, err = command(*COMMAND, "--checkpoint", file, "--checkpoint-every", "5 min")
    assert (code, out) == (130, "")
    assert f"Stopped. {file} holds how far it came; the same command goes on from there." in err
    assert signal.getsignal(signal.SIGINT) is handler
    before = len(stopped)
    code, out, _ = command(*COMMAND, "--checkpoint", file)
    assert code == 0
    assert json.loads(out) == json.loads(whole)
    assert not file.exists()
    assert stopped[before] > 0  # it began where the other stopped


def test_a_second_ctrl_c_stops_at_once(tmp_path):
    def twice():
        with Keeper(tmp_path / "state", 1.0, {}):
            os.kill(os.getpid(), signal.SIGINT)
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt, match="Stopped at once"):
        twice()


BALL = ["simulate", "rebound", "--json"]


@pytest.mark.parametrize(
    ("stop", "code", "told"),
    [
        (
            KeyboardInterrupt,
            130,
            "Stopped; nothing more was written. {file} is still there; the same command goes on from it.",
        ),
        (InputError("Make room."), 2, "Make room."),
    ],
)
def test_the_state_is_kept_until_all_is_written(command, monkeypatch, tmp_path, stop, code, told):
    def broken(*_, **__):
        raise stop

    file, folder = tmp_path / "state", tmp_path / "results"
    options = ["--output", folder, "--picture", tmp_path / "ball.png", "--checkpoint", file]
    with monkeypatch.context() as patched:
        patched.setattr(render_experiment, "picture", broken)
        before = command(*BALL, *options)
    assert before[0] == code
    assert told.format(file=file) in before[2]
    assert file.exists()
    monkeypatch.setattr(Stepper, "_advance", lambda *_: pytest.fail("it simulated again"))
    monkeypatch.setattr(render_experiment, "picture", lambda *given, **_: given[3].write_text("a ball"))
    code, out, _ = command(*BALL, *options)
    assert (code, out) == (0, before[1])
    assert not file.exists()
    assert json.loads((folder / "result.json").read_text()) == json.loads(out)


def test_the_state_is_kept_where_no_run_went_well(command, monkeypatch, tmp_path):
    monkeypatch.setattr(Rebound, "measure", lambda *_: fail_to_measure())
    assert command(*BALL, "--checkpoint", tmp_path / "state")[0] == 1
    assert (tmp_path / "state").exists()


def fail_to_measure():
    raise InputError("no rebound")


def test_a_checkpoint_that_can_not_be_written_is_told_as_a_note(command, monkeypatch, tmp_path):
    def full(path, *_):
        raise InputError("No space left.")

    monkeypatch.setattr(keeper, "write_checkpoint", full)
    code, out, err = command(*BALL, "--checkpoint", tmp_path / "state")
    assert code == 0
    assert json.loads(out)["runs"][0]["failure"] is None
    assert err.startswith("Note: No space left. The run goes on;")
    assert "keeper.py" not in err


def test_the_interval_reaches_the_run(command, monkeypatch, tmp_path):
    seen = []
    monkeypatch.setattr(keeper.Keeper, "begin", lambda self, course: seen.append(self.every))
    monkeypatch.setattr(keeper.Keeper, "end", lambda *_: None)
    command(*COMMAND, "--checkpoint", tmp_path / "state", "--checkpoint-every", "2 min")
    command(*COMMAND, "--checkpoint", tmp_path / "state")
    assert seen == [120.0, 300.0]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["rebound", "--checkpoint-every", "5 min"], "--checkpoint-every is of use with --checkpoint alone"),
        (["rebound", "--checkpoint", "a", "--checkpoint-every", "5 mm"], "--checkpoint-every is '5 mm'"),
        (["rebound", "--checkpoint", "a", "--checkpoint-every", "-5 s"], "give a time from 0, such as '5 min'"),
        (["rebound", "--checkpoint", "nowhere/a"], "would lie in a folder that doesn't exist"),
        (
            ["examples/bench", "--checkpoint", "a"],
            "--checkpoint can't be used with a study, whose store keeps every run",
        ),
    ],
)
def test_what_cannot_be_done_is_told(command, options, sentence):
    code, out, err = command("simulate", *options)
    assert (code, out) == (2, "")
    assert sentence in " ".join(err.split())


def test_arch_is_checked(command, monkeypatch):
    code, _, err = command("--arch", "gpu", "plugins")
    assert code == 2
    assert "arch is 'gpu'; allowed are 'cpu' and 'cuda'" in err
    other = "cuda" if runtime.start().arch == "cpu" else "cpu"
    code, _, err = command("--arch", other, "plugins")
    assert code == 2
    assert f"arch='{other}' was asked for, but Taichi already runs" in err


def test_arch_is_handed_on(command, monkeypatch):
    monkeypatch.setenv("TAICHIDEM_ARCH", "")
    assert command("--arch", runtime.start().arch, "plugins", "experiment")[0] == 0
    assert os.environ["TAICHIDEM_ARCH"] == runtime.start().arch
