"""The command line: what it prints, what a program reads from it, and what it says to bad input."""

from __future__ import annotations

import json
import subprocess
import sys

import cv2
import numpy as np
import pytest
import pyvista as pv

from analysis.errors import AnalysisError
from taichidem import __version__, heap_comparison
from tests.small_heap import SMALL, SMALL_TYPED

FILES = ("heap.png", "profile.png", "angle.png", "result.json", "grains_seed_1.vtp", "walls.vtp")


@pytest.fixture
def below_a_file(tmp_path):
    """A folder that nobody can make, whatever her rights: its parent is a file."""
    (tmp_path / "file").write_text("not a folder")
    return tmp_path / "file" / "folder"


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    """A drawn heap with flanks of 30°, 400 pixels wide."""
    image = np.full((300, 600, 3), 255, np.uint8)
    rise = round(200 * np.tan(np.radians(30)))
    cv2.fillPoly(image, [np.array([[100, 250], [500, 250], [300, 250 - rise]], np.int32)], (30, 30, 30))
    path = tmp_path_factory.mktemp("pictures") / "wedge.png"
    cv2.imwrite(str(path), image)
    return path


def settings_of(texts):
    return [part for text in texts for part in ("-s", text)]


def test_version(command):
    assert command("--version") == (0, f"taichidem {__version__}\n", "")


def test_the_command_runs_as_a_program_of_its_own():
    program = [sys.executable, "-c", "from taichidem.cli import main; main()"]
    good = subprocess.run([*program, "--version"], capture_output=True, text=True, check=False)
    assert (good.returncode, good.stdout, good.stderr) == (0, f"taichidem {__version__}\n", "")
    bad = subprocess.run([*program, "plugins", "efect"], capture_output=True, text=True, check=False)
    assert (bad.returncode, bad.stdout) == (2, "")
    assert "Did you mean 'effect'?" in bad.stderr
    assert "Traceback" not in bad.stderr


def test_help_names_the_commands(command):
    code, out, _ = command("--help")
    assert code == 0
    for name in ("demo", "simulate", "repose", "plugins", "design", "analyse"):
        assert name in out


def test_plugins_as_table_and_as_json(command):
    code, out, err = command("plugins", "--json")
    assert (code, err) == (0, "")
    rows = json.loads(out)
    assert {(r["kind"], r["name"]) for r in rows} >= {
        ("effect", "normal_hertz"),
        ("effect", "tangential_mindlin"),
        ("effect", "rolling_constant_torque"),
        ("experiment", "fixed_funnel"),
    }
    assert all(r["status"] == "ok" and r["summary"] for r in rows)
    code, out, _ = command("plugins", "experiment")
    assert code == 0
    assert "fixed_funnel" in out
    assert "normal_hertz" not in out


def test_simulate_gives_json_and_nothing_else_and_leaves_its_files(command, tmp_path):
    arguments = [*settings_of(SMALL_TYPED), "--seeds", "1,2", "-p", "tangential_mindlin.static_friction=0.3"]
    code, out, err = command("simulate", "fixed_funnel", *arguments, "-o", tmp_path / "run", "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["experiment"] == "fixed_funnel"
    assert result["units"] == {"angle_of_repose": "deg"}
    assert [run["seed"] for run in result["runs"]] == [1, 2]
    assert all(0 < run["observables"]["angle_of_repose"] < 60 and run["failure"] is None for run in result["runs"])
    assert json.loads((tmp_path / "run" / "result.json").read_text()) == result
    for seed in (1, 2):
        grains = pv.read(tmp_path / "run" / f"grains_seed_{seed}.vtp")
        assert grains.n_points > 400
        assert {"radius", "velocity", "angular_velocity", "id", "mass"} <= set(grains.array_names)


def test_simulate_prints_a_table(command):
    code, out, err = command("simulate", "fixed_funnel", *settings_of(SMALL_TYPED), "--seeds", "1,2")
    assert code == 0
    assert "angle_of_repose" in out
    assert "seed 2" in out
    assert "deg" in out
    assert "simulating" in err  # the progress bar keeps out of the result


def test_repose_measures_a_picture(command, picture, tmp_path):
    code, out, err = command("repose", picture, "--json", "-o", tmp_path / "measured.png")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert result["angle_deg"] == pytest.approx(30, abs=0.5)
    assert result["standard_uncertainty_deg"] > 0
    assert cv2.imread(str(tmp_path / "measured.png")) is not None
    code, out, _ = command("repose", picture, "--base-width", "100 mm")
    assert code == 0
    assert "30." in out or "29." in out


@pytest.fixture
def small_by_default(monkeypatch):
    """The demo with a small heap in place of the paper's."""
    monkeypatch.setattr(heap_comparison, "PAPER_HEAP", SMALL)


@pytest.mark.usefixtures("small_by_default")
def test_demo_compares_and_leaves_every_file(command, tmp_path):
    folder = tmp_path / "demo"
    code, out, err = command("demo", "--heap-only", "--seeds", "2", "-o", folder, "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert json.loads((folder / "result.json").read_text()) == result
    check_comparison(result)
    assert sorted(path.name for path in folder.iterdir()) == sorted([*FILES, "grains_seed_2.vtp"])
    check_pictures(folder)
    check_vtk(folder)


@pytest.mark.usefixtures("small_by_default")
def test_a_heap_that_cant_be_measured_costs_only_itself(command, tmp_path, monkeypatch):
    measure = heap_comparison.picture_angle

    def fails_once(experiment, outcome):
        if outcome.seed == 1:
            raise AnalysisError("no heap in it")
        return measure(experiment, outcome)

    monkeypatch.setattr(heap_comparison, "picture_angle", fails_once)
    code, out, _ = command("demo", "--heap-only", "--seeds", "2", "-o", tmp_path, "--json")
    result = json.loads(out)
    assert code == 0
    assert "no heap in it" in result["failures"]["1"]
    assert list(result["from_pictures_deg"]) == ["2"]
    assert (tmp_path / "grains_seed_1.vtp").is_file()


def check_comparison(result):
    c = result["comparison"]
    assert (c["measured"], c["measured_uncertainty"]) == heap_comparison.LABORATORY
    angles = result["from_pictures_deg"]
    assert list(angles) == ["1", "2"]
    assert c["simulated"] == pytest.approx(np.mean(list(angles.values())))
    assert c["error"] == pytest.approx(c["simulated"] - c["measured"])
    assert c["validation_uncertainty"] >= c["measured_uncertainty"]
    assert result["failures"] == {}
    assert result["settings"]["cup_radius"] == SMALL["cup_radius"]
    # Two ways of measuring one heap; a heap of some hundred grains is coarse.
    for seed, angle in result["from_positions_deg"].items():
        assert angle == pytest.approx(angles[seed], abs=10)


def check_pictures(folder):
    for name in ("heap.png", "profile.png", "angle.png"):
        image = cv2.imread(str(folder / name))
        assert image is not None, name
        assert min(image.shape[:2]) > 200, name
        assert image.std() > 5, f"{name} is blank"


def check_vtk(folder):
    grains = pv.read(folder / "grains_seed_1.vtp")
    assert 400 < grains.n_points < SMALL["particles"]
    assert grains.n_verts == grains.n_points
    assert np.all(grains["radius"] == 0.0015)
    assert len(np.unique(grains["id"])) == grains.n_points
    assert grains["mass"] == pytest.approx(910 * 4 / 3 * np.pi * 0.0015**3)
    assert grains.field_data["TimeValue"][0] > SMALL["particles"] / SMALL["stream_rate"]
    walls = pv.read(folder / "walls.vtp")
    reach = SMALL["cup_radius"]
    assert walls.bounds == pytest.approx((-reach, reach, -reach, reach, 0.0, SMALL["rim_height"]), abs=1e-4)


@pytest.mark.usefixtures("small_by_default")
def test_demo_says_what_it_found(command, tmp_path):
    code, out, err = command("demo", "--heap-only", "--seeds", "1", "-o", tmp_path / "demo")
    assert code == 0
    for word in ("simulated S", "measured D", "error E = S − D", "u_val", "30.18", "0.51"):
        assert word in out
    for name in FILES:
        assert name in out.replace("\n", "")
    assert "pouring" in err


SIMULATE = ("simulate", "fixed_funnel")
PARAMETER = (*SIMULATE, "-p")
SETTING = (*SIMULATE, "-s")
BAD_INPUT = {
    "experiment": (
        ("simulate", "fixed_funel"),
        ["Unknown experiment 'fixed_funel'", "Allowed: ", "Did you mean 'fixed_funnel'?"],
    ),
    "setting": (
        (*SETTING, "cup_radus=50 mm"),
        ["Unknown setting of fixed_funnel 'cup_radus'", "Allowed: ", "Did you mean 'cup_radius'?"],
    ),
    "effect": (
        (*PARAMETER, "normal_herz.restitution=0.5"),
        ["Unknown effect 'normal_herz'", "Allowed: ", "Did you mean 'normal_hertz'?"],
    ),
    "parameter": (
        (*PARAMETER, "normal_hertz.restituton=0.5"),
        ["Unknown parameter 'restituton'", "Allowed: restitution", "Did you mean 'restitution'?"],
    ),
    "material": (
        (*PARAMETER, "normal_hertz.restitution:polypropylene-steal=0.5"),
        ["'steal'", "Allowed: polypropylene, steel", "Did you mean 'steel'?"],
    ),
    "restitution above 1": (
        (*PARAMETER, "normal_hertz.restitution=1.4"),
        ["normal_hertz.restitution", "1.4", "to 1", "Plausible"],
    ),
    "negative friction": (
        (*PARAMETER, "tangential_mindlin.static_friction=-0.2"),
        ["tangential_mindlin.static_friction", "-0.2", "from 0", "Plausible"],
    ),
    "a parameter that is no number": (
        (*PARAMETER, "normal_hertz.restitution=high"),
        ["'high' is no number", "write effect.parameter=value"],
    ),
    "unit of another dimension": (
        (*SETTING, "cup_radius=50 kg"),
        ["cup_radius", "'50 kg'", "kilogram", "converts to m"],
    ),
    "a setting out of bounds": (
        (*SETTING, "particles=0"),
        ["fixed_funnel.particles is '0' [1]", "greater than or equal to 1"],
    ),
    "a setting without value": (
        (*SETTING, "cup_radius"),
        ["'cup_radius' can't be read", "write name=value"],
    ),
    "seeds": ((*SIMULATE, "--seeds", "a"), ["seeds is 'a'", "whole numbers from 0", "such as 1,2,3"]),
    "seeds twice": ((*SIMULATE, "--seeds", "1,1"), ["seeds is '1,1'", "different whole numbers"]),
    "kind of plugin": (("plugins", "efect"), ["Unknown kind of plugin 'efect'", "Allowed: ", "'effect'?"]),
    "no picture": (
        ("repose", "nowhere.png"),
        ["nowhere.png", "Allowed", "Check the path"],
    ),
    "region": (
        ("repose", "nowhere.png", "--region", "1,2,3"),
        ["region is '1,2,3'", "left,top,right,bottom"],
    ),
    "base width": (
        ("repose", "nowhere.png", "--base-width", "3 kg"),
        ["base_width is '3 kg'", "converts to m"],
    ),
}


def check_refusal(answer, parts):
    """Check the exit code, that nothing was printed as a result, and that one readable sentence says what is wrong."""
    code, out, err = answer
    assert (code, out) == (2, "")
    assert "Traceback" not in err
    sentence = err.strip().splitlines()[-1]  # a progress bar may have begun above it
    assert sentence.startswith("Error: ")
    assert err.count("Error: ") == 1
    for part in parts:
        assert part in sentence, err


@pytest.mark.parametrize("case", BAD_INPUT)
def test_bad_input_is_refused_in_one_sentence(command, case):
    arguments, parts = BAD_INPUT[case]
    check_refusal(command(*arguments), parts)


@pytest.mark.parametrize("arguments", [("demo",), SIMULATE])
def test_a_folder_that_cannot_be_written_is_refused_before_anything_is_poured(command, below_a_file, arguments):
    answer = command(*arguments, "-o", below_a_file)
    check_refusal(answer, [f"Output folder {below_a_file}", "can't be written", "Give another with -o"])


def test_an_annotated_picture_that_cannot_be_written_is_refused(command, picture, below_a_file):
    check_refusal(command("repose", picture, "-o", below_a_file / "measured.png"), [str(below_a_file)])


def test_a_file_that_is_no_picture_is_refused(command, tmp_path):
    text = tmp_path / "notes.png"
    text.write_text("not a picture")
    check_refusal(command("repose", text), [str(text), "Allowed"])


def test_a_picture_without_a_heap_is_refused(command, tmp_path):
    blank = tmp_path / "blank.png"
    cv2.imwrite(str(blank), np.full((300, 400, 3), 200, np.uint8))
    check_refusal(
        command("repose", blank),
        ["No heap found in", "blank.png", "Allowed: a contrast of at least", "Photograph the heap before"],
    )


def test_a_pour_that_cannot_keep_its_rate_is_refused(command):
    texts = [
        *SMALL_TYPED,
        "particles=1000",
        "stream_rate=20000",
        "batch_interval=1 ms",
        "stream_top=30 mm",
        "drop_velocity=0",
    ]
    check_refusal(command(*SIMULATE, *settings_of(texts)), ["can't keep 20000 grains per second", "lower the rate"])


def test_options_of_the_command_itself_are_checked(command):
    code, out, err = command("demo", "--seeds", "0")
    assert (code, out) == (2, "")
    assert "--seeds" in err
