"""`taichidem simulate --checkpoint`, and `--arch`."""

from __future__ import annotations

import json
import os
import signal

import pytest

from taichidem import runtime
from taichidem.checkpoints import keeper
from taichidem.checkpoints.keeper import Keeper

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
    with Keeper(tmp_path / "state", 1.0, {}):
        os.kill(os.getpid(), signal.SIGINT)
        with pytest.raises(KeyboardInterrupt, match="Stopped at once"):
            os.kill(os.getpid(), signal.SIGINT)


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
