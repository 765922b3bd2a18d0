"""What docs/campaigns.md shows works."""

from __future__ import annotations

import re
import sys
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType, SimpleNamespace

import typer

from taichidem.cli import application
from taichidem.study import SpawnedProcesses, campaign, cluster, diagnosis_run
from taichidem.study.executors import IN_FLIGHT
from tests.study.fakes import Quick

PAGE = (Path(__file__).parents[2] / "docs" / "campaigns.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)


def test_the_example_of_processes_runs(write, tmp_path, monkeypatch, capsys):
    write()
    monkeypatch.chdir(tmp_path.parent)
    source = PYTHON[0].replace("my_study", tmp_path.name)
    exec(compile(source, "campaigns.md", "exec"), {"__name__": "__main__"})
    assert "[6 rows x" in capsys.readouterr().out
    assert Quick.batches == []  # nothing was simulated here


def test_the_script_for_slurm_runs(monkeypatch, capsys, elsewhere):
    """With stand-ins for the queue, the client and the diagnosis, which have tests of their own."""
    asked: dict = {}

    class Queue:
        def __init__(self, **options):
            asked.update(options)

        def __enter__(self):
            return self

        def __exit__(self, *_):
            asked["ended"] = True

        def scale(self, jobs):
            asked["jobs"] = jobs

    def client(there):
        assert isinstance(there, Queue)
        return nullcontext(SimpleNamespace(get_executor=lambda: "workers"))

    for name, held in (("dask_jobqueue", {"SLURMCluster": Queue}), ("distributed", {"Client": client})):
        module = ModuleType(name)
        vars(module).update(held)
        monkeypatch.setitem(sys.modules, name, module)
    told = lambda study, executor: SimpleNamespace(text=f"{study} on {executor}")  # noqa: E731
    monkeypatch.setattr("taichidem.study.diagnose", told)
    exec(compile(PYTHON[1], "campaigns.md", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out == "my_study on workers\n"
    assert (asked["jobs"], asked["cores"], asked["processes"], asked["ended"]) == (8, 16, 16, True)
    assert "executor" in diagnosis_run.diagnose.__annotations__


def test_every_command_that_takes_workers_is_named():
    commands = typer.main.get_command(application.app).commands
    taking = {name for name, command in commands.items() if any(p.name == "cluster" for p in command.params)}
    assert set(re.findall(r"`([a-z-]+)`", PAGE.split("\n\n")[1])) == taking


def test_numbers_and_names_are_those_of_the_code():
    assert f"({IN_FLIGHT} on a cluster)" in PAGE
    assert f"more than {IN_FLIGHT} batches" in PAGE
    studies = " ".join((Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8").split())
    assert f"`--workers` up to two batches per process, with `--cluster` up to {IN_FLIGHT} batches" in studies
    assert campaign.WORLDS_PER_THREAD == 2  # "two runs per processor"
    assert SpawnedProcesses(3).in_flight == 2 * 3
    assert f"--cluster {cluster.LOCAL}" in PAGE
