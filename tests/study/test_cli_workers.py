"""The options --workers and --cluster of the commands that run campaigns."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

import taichidem.study
from taichidem import runtime
from taichidem.cli import workers
from taichidem.errors import InputError
from taichidem.study import campaign, cluster
from tests.study.fakes import Quick

COMMANDS = {
    "simulate": (),
    "compare": (),
    "diagnose": (),
    "add": ("cohesion_jkr", "-o", "new"),
    "discover": (),
    "coarse-grain": (),
}


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--workers", "0"), "--workers is 0; give a whole number from 1, or leave it out."),
        (("--workers", "2", "--cluster", "local"), "--workers and --cluster were both given; give one of them"),
        (("--cluster", "node1"), "The cluster's address is 'node1'; give that of a Dask scheduler, such as tcp://"),
    ],
)
def test_what_cannot_be_is_said_before_anything_is_run(command, study, name, options, told):
    code, out, err = command(name, study.path, *COMMANDS[name], *options)
    assert (code, out) == (2, "")
    assert told in err
    assert Quick.batches == []
    assert not (study.path / "runs.sqlite").exists()


def test_processes_simulate_a_study(command, study):
    code, out, _ = command("simulate", study.path, "--seeds", "3", "--workers", "2", "--json")
    assert code == 0
    assert Quick.batches == []  # it was done elsewhere
    runs = json.loads(out)["runs"]
    assert [run["attempts"] for run in runs] == [1] * 6
    assert [run["responses"]["angle"] for run in runs] == [30 * 0.4 + seed / 7 for seed in (1, 2, 3)] * 2
    assert "6 runs: 6 were in the store, 0 simulated now" in command("simulate", study.path, "--seeds", "3")[1]


@pytest.mark.parametrize("name", ["simulate", "compare", "diagnose"])
def test_every_command_simulates_on_the_cluster(command, study, elsewhere, name):
    only = ("--new-tests", "none") if name == "diagnose" else ()
    command(name, study.path, "--cluster", "tcp://node1:8786", "--seeds", "2", "--json", *only)
    assert elsewhere == ["tcp://node1:8786"]
    assert Quick.batches


@pytest.mark.parametrize("name", ["add", "discover"])
def test_what_goes_round_after_round_gets_the_executor_too(command, study, elsewhere, monkeypatch, name):
    given = []
    monkeypatch.setattr(taichidem.study, name, lambda *_, executor, **__: given.append(executor) or refuse())
    command(name, study.path, *COMMANDS[name], "--cluster", "tcp://node1:8786")
    assert isinstance(given[0], ThreadPoolExecutor)


def refuse():
    raise InputError("enough")


def test_a_single_experiment_has_no_campaign(command):
    code, _, err = command("simulate", "quick", "--workers", "2", "--cluster", "local")
    assert code == 2
    assert "--workers, --cluster can't be used with a single experiment; they belong to a study" in err


@pytest.mark.parametrize("name", COMMANDS)
def test_arch_can_t_be_told_to_workers_of_others(command, study, elsewhere, monkeypatch, name):
    monkeypatch.setenv("TAICHIDEM_ARCH", "")  # which --arch changes
    here = runtime.start().arch
    code, out, err = command("--arch", here, name, study.path, *COMMANDS[name], "--cluster", "tcp://node1:8786")
    assert (code, out, elsewhere) == (2, "", [])
    assert f"--arch {here} can't be told to the workers of tcp://node1:8786. Leave it out here, and set" in err
    assert f"TAICHIDEM_ARCH={here} where they start" in err


def test_workers_that_are_made_here_get_arch(command, study, elsewhere, monkeypatch):
    monkeypatch.setenv("TAICHIDEM_ARCH", "")
    assert command("--arch", runtime.start().arch, "simulate", study.path, "--cluster", "local")[0] == 0
    assert elsewhere == ["local"]


def test_what_a_cluster_waits_for_is_told_beside_the_result(command, study, monkeypatch):
    @contextmanager
    def waiting(address, tell):
        tell("No worker has come")
        with ThreadPoolExecutor(1) as thread:
            yield thread

    monkeypatch.setattr(cluster, "cluster_executor", waiting)
    monkeypatch.setattr(campaign, "threads_of", lambda executor: 1)
    code, out, err = command("simulate", study.path, "--cluster", "tcp://node1:8786", "--json")
    assert code == 0
    assert json.loads(out)
    assert err.count("No worker has come") == 1


def test_runs_that_were_repeated_are_told(command, write):
    folder = write(("width = 0.05", "width = 0.05\nstopping_seed = 2"), ('"40 mm"', '"40 mm"\nstopping_seed = 3'))
    told = "2 runs were repeated with another random stream after they had diverged, overlapped too far or run out of room."
    for _ in range(2):
        assert told in " ".join(command("simulate", folder, "--seeds", "3")[1].split())
    assert (
        "1 run was repeated with another random stream after it had" in command("simulate", folder, "--seeds", "2")[1]
    )


def test_an_executor_is_given_only_when_asked_for():
    with workers.executor_of(None, None) as executor:
        assert executor is None
