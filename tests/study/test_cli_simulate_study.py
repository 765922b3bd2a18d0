"""taichidem simulate STUDY."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from taichidem.cli.simulate import LARGEST_SEED, parse_seeds
from taichidem.errors import InputError
from taichidem.study import run_store
from tests.study.fakes import MEASUREMENTS, Quick

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "study"


def line_of(out, *parts):
    """Return the cells of the one line that holds all parts."""
    (line,) = [line for line in out.splitlines() if all(part in line for part in parts)]
    return [cell.strip() for cell in line.strip("│").split("│")]


def test_a_study_is_run_and_printed_beside_its_measurements(command, write):
    folder = write(measurements=MEASUREMENTS)
    code, out, err = command("simulate", folder, "--seeds", "3")
    assert code == 0
    assert line_of(out, "narrow", "angle") == ["narrow", "angle", "12.29", "0.082", "3", "12.5 ± 0.5", "deg"]
    assert line_of(out, "wide", "flow") == ["wide", "flow", "50", "0", "3", "–", "g/s"]
    assert "A study" in out
    assert f"6 runs: 0 were in the store, 6 simulated now; 0 failed. Store: {folder / 'runs.sqlite'}" in out
    assert "simulating" in err
    code, out, _ = command("simulate", folder / "study.toml", "--seeds", "1,2,7")
    assert "6 runs: 4 were in the store, 2 simulated now; 0 failed." in out


def test_four_seeds_unless_told_otherwise(command, write):
    code, out, err = command("simulate", write(), "--json")
    assert (code, err) == (0, "")
    assert [run["seed"] for run in json.loads(out)["runs"]] == [1, 2, 3, 4] * 2


def test_json_and_nothing_else(command, write, tmp_path):
    folder = write(measurements=MEASUREMENTS)
    store = tmp_path / "other.sqlite"
    arguments = ("simulate", folder, "--experiments", "wide", "--seeds", "5,", "--store", store, "--json")
    code, out, err = command(*arguments)
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert (result["study"], result["store"], result["already_there"]) == ("A study", str(store), 0)
    (run,) = result["runs"]
    assert (run["experiment"], run["type"], run["seed"], run["status"]) == ("wide", "quick", 5, "done")
    assert run["responses"] == {"angle": 12 + 5 / 7, "flow": 50.0}
    assert (run["stored"], run["reason"], len(run["key"])) == (False, None, 64)
    angle, flow = result["observables"]
    assert angle == {
        "experiment": "wide",
        "observable": "angle",
        "unit": "deg",
        "mean": 12 + 5 / 7,
        "u": None,
        "n": 1,
        "measured": pytest.approx(11.459, abs=1e-3),
        "measured_u": pytest.approx(0.573, abs=1e-3),
    }
    assert flow["measured"] is None
    assert not (folder / "runs.sqlite").exists()
    assert json.loads(command(*arguments)[1])["already_there"] == 1


def test_failures_are_told_with_their_reason_and_run_again_when_asked(command, write):
    folder = write(("width = 0.05", "width = 0.05\nfailing_seed = 2"))
    code, out, _ = command("simulate", folder, "--seeds", "3")
    assert code == 0
    assert line_of(out, "wide", "angle")[4] == "2"
    assert "1 failed" in out
    assert "wide, seed 2 failed: seed 2 diverged" in out
    code, out, _ = command("simulate", folder, "--seeds", "3")
    assert "wide, seed 2 failed (before; --retry-failed runs it again): seed 2 diverged" in out
    Quick.batches.clear()
    code, out, _ = command("simulate", folder, "--seeds", "3", "--retry-failed")
    assert Quick.batches == [[2]]
    assert "5 were in the store, 1 simulated now; 1 failed" in out
    assert json.loads(command("simulate", folder, "--json")[1])["runs"][5]["reason"] == "seed 2 diverged"


def test_nothing_but_failures_is_no_success(command, write):
    folder = write(("width = 0.05", "width = 0.05\nfailing_seed = 1"))
    code, out, _ = command("simulate", folder, "--seeds", "1", "--experiments", "wide")
    assert code == 1
    assert line_of(out, "wide", "angle")[2:5] == ["failed", "–", "0"]


def test_every_problem_is_printed(command, write):
    code, out, err = command("simulate", write(("schema = 1", "schema = 3"), ("u = 0.02", "u = 0")))
    assert (code, out) == (2, "")
    assert "has 2 problems:" in err
    assert "calibrate.granule-wall.static_friction.u is 0" in err
    assert "Traceback" not in err


def test_bad_measurements_are_refused_before_anything_is_run(command, write):
    code, _, err = command("simulate", write(measurements=MEASUREMENTS.replace("0.5", "0")))
    assert code == 2
    assert "line 2: u is 0" in err
    assert Quick.batches == []


CASES = {
    "neither": (
        ("nowhere",),
        ["Unknown experiment 'nowhere'", "Allowed: ", "fixed_funnel", "There is no study nowhere"],
    ),
    "nearest experiment": (("fixed_funel",), ["Did you mean 'fixed_funnel'?", "There is no study fixed_funel"]),
    "a missing file": (("nowhere/study.toml",), ["There is no study nowhere/study.toml"]),
    "a folder without study": (("empty",), ["The folder empty holds no study.toml"]),
    "another file": (("notes.txt",), ["notes.txt is no study", ".toml"]),
    "experiment's option with a study": (
        (".", "-s", "width=3", "-o", "out", "-p", "a=3"),
        ["--set, --parameter, --output can't be used with a study"],
    ),
    "a picture of a study": (
        (".", "--picture", "a.png", "--movie", "b.gif", "--frame-interval", "1 ms"),
        ["--picture, --movie, --frame-interval can't be used with a study; they show a single experiment"],
    ),
    "study's option with an experiment": (
        ("quick", "--retry-failed", "--store", "a", "--experiments", "b"),
        ["--experiments, --store, --retry-failed can't be used with a single experiment"],
    ),
    "unknown experiment of the study": ((".", "--experiments", "wide,narow"), ["'narow'", "Did you mean 'narrow'?"]),
    "seeds": ((".", "--seeds", "many"), ["seeds is 'many'", "how many", "such as 1,2,3"]),
    "store in a folder's place": (
        (".", "--store", "empty"),
        ["Run store empty is a folder; give a file, such as empty/runs.sqlite."],
    ),
    "store": ((".", "--store", "nowhere/runs.sqlite"), ["there is no folder nowhere"]),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_refused(command, write, monkeypatch, case):
    monkeypatch.chdir(write())
    Path("empty").mkdir()
    Path("notes.txt").write_text("no study")
    arguments, parts = CASES[case]
    code, out, err = command("simulate", *arguments)
    assert (code, out) == (2, "")
    for part in parts:
        assert part in err
    assert "Traceback" not in err
    assert not Path("runs.sqlite").exists()


def test_a_campaign_that_is_stopped_says_how_far_it_came(command, write, monkeypatch):
    folder, whole = write(), Quick.run

    def stop_at_wide(self, *arguments, **options):
        if self.settings.width > 0.045:
            raise KeyboardInterrupt
        return whole(self, *arguments, **options)

    monkeypatch.setattr(Quick, "run", stop_at_wide)
    for options in ((), ("--json",)):
        code, out, err = command("simulate", folder, "--seeds", "3", *options)
        assert (code, out) == (130, "")
        assert f"Stopped. 3 of 6 runs are in {folder / 'runs.sqlite'}; the same command goes on." in err
    monkeypatch.setattr(Quick, "run", whole)
    assert "6 runs: 3 were in the store, 3 simulated now" in command("simulate", folder, "--seeds", "3")[1]


def test_a_study_in_a_folder_named_like_an_experiment_wins(command, write, monkeypatch):
    folder = write()
    monkeypatch.chdir(folder)
    (folder / "quick").mkdir()
    (folder / "quick" / "study.toml").write_text((folder / "study.toml").read_text())
    assert json.loads(command("simulate", "quick", "--json")[1])["study"] == "A study"


def test_a_folder_without_a_study_does_not_hide_an_experiment(command, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "quick").mkdir()
    result = json.loads(command("simulate", "quick", "-s", "width=0.04", "--json")[1])
    assert (result["experiment"], [run["seed"] for run in result["runs"]]) == ("quick", [1])


@pytest.mark.parametrize(
    ("text", "seeds"),
    [("4", [1, 2, 3, 4]), ("1", [1]), ("1,2,7", [1, 2, 7]), ("7,", [7]), (" 0 , 5 ", [0, 5])],
)
def test_seeds(text, seeds):
    assert parse_seeds(text) == seeds


@pytest.mark.parametrize("text", ["", ",", "0", "-1", "1,1", "a", "1,,2", "2.5", "1000000", f"1,{2**63}"])
def test_bad_seeds(text):
    with pytest.raises(InputError, match="give how many"):
        parse_seeds(text)


def test_the_largest_seed_is_that_of_the_store():
    assert parse_seeds(f"1,{LARGEST_SEED}") == [1, run_store.LARGEST_SEED]


def test_the_example_runs(command, tmp_path):
    arguments = (
        "simulate",
        EXAMPLE,
        "--seeds",
        "2",
        "--store",
        tmp_path / "runs.sqlite",
        "--experiments",
        "narrow_heap",
    )
    code, out, _ = command(*arguments)
    assert code == 0
    name, observable, mean, _, n, measured, unit = line_of(out, "narrow_heap")
    assert (name, observable, n, measured, unit) == ("narrow_heap", "angle_of_repose", "2", "20.1 ± 0.8", "deg")
    assert 8 < float(mean) < 30
    assert "2 were in the store, 0 simulated now" in command(*arguments)[1]
