"""Comparing a study with its measurements, on experiments that cost nothing."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import FrozenInstanceError
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest
from scipy import stats

from taichidem import heap_views
from taichidem.errors import InputError
from taichidem.experiments import FixedFunnel
from taichidem.experiments.base import Outcome
from taichidem.study import (
    FileError,
    compare,
    comparison_rows,
    measured_parameters,
    read_measurements,
    read_study,
    simulate,
)
from taichidem.study.comparison_rows import ROW
from tests.analysis.conftest import draw_heap
from tests.experiments.planted import snapshot
from tests.study.fakes import MEASUREMENTS, Quick

HEADER = "experiment,observable,value,u,unit,n\n"
FALL = '[experiments.fall]\ntype = "free_fall"\nrelease_height = 10\ntime = [0.25, 0.5, 1]\n'
# The fakes measure angle = 30 · friction + seed/7 and flow = 1000 · width: 12 + 0.357 deg and 40, 50 g/s.


def series(*errors):
    """Return [experiments] and measurements of boxes of five widths whose measured flow is off by these errors."""
    widths = [20 * (k + 2) for k in range(len(errors))]
    tests = "".join(f'[experiments.box_{w}]\ntype = "quick"\nwidth = "{w} mm"\n' for w in widths)
    rows = "".join(f"box_{w},flow,{w - e},1,g/s,4\n" for w, e in zip(widths, errors, strict=True))
    return tests, rows


def test_rows_by_hand(study):
    table = simulate(study, seeds=[1, 2, 3, 4])
    rows = comparison_rows(study, read_measurements(study), table)
    assert list(rows.columns) == list(ROW)
    row = rows.iloc[0]
    u_seeds = math.sqrt(5 / 3) / 7 / 2  # seeds 1 … 4 have the standard deviation √(5/3)
    assert (row["label"], row["type"], row["observable"], row["condition"]) == ("narrow angle", "quick", "angle", "")
    assert (row["simulated"], row["u_simulated"], row["n_seeds"]) == pytest.approx((12 + 2.5 / 7, u_seeds, 4))
    assert row["error"] == pytest.approx(12 + 2.5 / 7 - 12.5)
    assert row["u_val"] == pytest.approx(math.hypot(0.5, u_seeds))
    assert row["z"] == pytest.approx(row["error"] / row["u_val"])
    assert row["ratio"] == abs(row["z"])
    flow = rows.iloc[1]
    assert (flow["u_simulated"], flow["error"], flow["p"]) == (0.0, 0.0, 1.0)
    assert Quick.batches == [[1, 2, 3, 4], [1, 2, 3, 4]]  # asking for rows runs nothing


def test_the_whole_comparison(study):
    shares = []
    result = compare(study, report=lambda stage, share: shares.append((stage, share)))
    z = [*result.table["z"], 0.0]
    assert (result.chi2, result.dof) == (pytest.approx(sum(v * v for v in z)), 4)
    normal = [stats.norm.isf(p / 2) ** 2 for p in result.table["p"]]
    assert result.p_value == pytest.approx(stats.chi2.sf(sum(normal), 4))
    assert result.failing == ()
    assert result.runs == {"stored": 0, "new": 8, "failed": 0, "repeated": 0}
    assert {stage for stage, _ in shares} == {"simulating", "drawing"}
    assert shares[-1] == ("drawing", 1.0)
    folder = study.path / "results"
    written = json.loads((folder / "comparison.json").read_text(encoding="utf-8"))
    assert written == result.as_dict()
    assert written["schema"] == 1
    assert written["parameters"] == [
        {
            "key": "granule-wall.static_friction",
            "unit": "1",
            "believed": 0.3,
            "measured": 0.3,
            "u_measured": 0.02,
            "z": 0.0,
        }
    ]
    with (folder / "comparison.csv").open(encoding="utf-8") as file:
        assert [row["label"] for row in csv.DictReader(file)] == ["narrow angle", "narrow flow", "wide"]
    assert written["pictures"] == {"standardised_errors": "standardised_errors.png"}
    assert cv2.imread(str(folder / "standardised_errors.png")).std() > 10
    with pytest.raises(FrozenInstanceError):
        result.chi2 = 0.0
    assert compare(study.path).runs["stored"] == 8


def test_planted_errors_and_a_planted_trend(write):
    tests, rows = series(0.0, -2.0, -4.5, -6.0, -8.5)
    study = read_study(write(end=tests, measurements=MEASUREMENTS + "\n".join(f"{r}," for r in rows.splitlines())))
    result = compare(study, seeds=[1, 2])
    assert result.failing == ("box_80", "box_100", "box_120")
    (trend,) = [t for t in result.trends if t["observable"] == "flow"]
    assert (trend["condition"], trend["unit"], trend["claimed"]) == ("width", "m", True)
    assert trend["conditions"] == pytest.approx([0.04, 0.04, 0.06, 0.08, 0.10, 0.12])
    assert trend["experiments"] == ["narrow", "box_40", "box_60", "box_80", "box_100", "box_120"]
    by_hand = np.polyfit(trend["conditions"], [0.0, 0.0, -2.0, -4.5, -6.0, -8.5], 1, w=[0.5, 1, 1, 1, 1, 1])
    assert trend["slope"] == pytest.approx(by_hand[0])
    assert "The error of flow grows with width: from 0 g/s at 0.04 m to −8.5 g/s at 0.12 m" in result.text
    assert "box_120 is simulated 8.5 g/s too low" in result.text
    assert set(result.pictures) == {"standardised_errors", "series_quick_width"}


def test_heights_over_time_are_a_series_and_need_no_seeds(write):
    rows = HEADER.strip() + ",time\n" + MEASUREMENTS.partition("\n")[2].replace(",by hand", ",")
    rows += "fall,height,9.69,0.1,m,1,0.25\nfall,height,8.0,0.1,m,1,0.5\nfall,height,2.0,0.1,m,1,1.0\n"
    study = read_study(write(end=FALL, measurements=rows))
    runs = pd.DataFrame(
        {
            "experiment": ["fall"],
            "seed": 1,
            "status": "done",
            "height_at_0.25_s": 9.69,
            "height_at_0.5_s": 8.8,
            "height_at_1_s": 5.1,
        }
    )
    found = comparison_rows(study, read_measurements(study), runs)
    fall = found[found["experiment"] == "fall"]
    assert list(fall["label"]) == ["fall at 0.25 s", "fall at 0.5 s", "fall at 1 s"]
    assert list(fall["condition"]) == ["time = 0.25 s", "time = 0.5 s", "time = 1 s"]
    assert list(fall["observable"]) == ["height_at_0.25_s", "height_at_0.5_s", "height_at_1_s"]
    assert list(fall["u_simulated"]) == [0.0] * 3
    assert list(fall["fails"]) == [False, True, True]
    assert found[found["experiment"] != "fall"]["z"].isna().all()
    assert list(found[found["experiment"] != "fall"]["n_seeds"]) == [0, 0, 0]


def test_rows_told_apart_by_a_further_column(write):
    text = (
        HEADER.strip() + ",day\nnarrow,flow,40,1,g/s,1,Monday\nnarrow,flow,41,1,g/s,1,Friday\nwide,flow,50,1,g/s,1,\n"
    )
    study = read_study(write(measurements=text))
    rows = compare(study, seeds=[1, 2]).table
    assert list(rows["label"]) == ["narrow (day Monday)", "narrow (day Friday)", "wide"]
    assert list(rows["condition"]) == ["day = Monday", "day = Friday", ""]


def test_parameters_measured_directly(write):
    rolling = '"rolling_constant_torque.rolling_friction" = { low = 0, high = 0.3, value = 0.12, u = 0.01 }\n\n'
    changes = (
        ("value = 0.3, u = 0.02", "value = 0.4, u = 0.02"),
        ("[experiments.narrow]", f"{rolling}[experiments.narrow]"),
    )
    study = read_study(write(*changes, measurements=MEASUREMENTS))
    found = measured_parameters(study).set_index("key")
    assert found.loc["granule-wall.static_friction", "z"] == pytest.approx(-5.0)
    farthest = found.loc["rolling_constant_torque.rolling_friction"]
    assert farthest["believed"] in (0.0, 0.11)  # of 0.12 between grains, 0.11 at walls
    result = compare(study)
    assert result.chi2 == pytest.approx((result.table["z"] ** 2).sum() + (found["z"] ** 2).sum())
    assert "The model holds granule-wall.static_friction = 0.3, but it was measured as 0.4 ± 0.02." in result.text


def test_failed_runs_are_told_and_the_others_count(write):
    broken = ("width = 0.05", "width = 0.05\nfailing_seed = 2")
    result = compare(write(broken, measurements=MEASUREMENTS))
    assert list(result.failures) == [{"experiment": "wide", "seed": 2, "reason": "seed 2 diverged", "stored": False}]
    assert result.runs == {"stored": 0, "new": 8, "failed": 1, "repeated": 0}
    assert list(result.table["n_seeds"]) == [4, 4, 3]


def test_a_test_whose_runs_all_fail_is_left_out_in_words(write):
    result = compare(write(("width = 0.05", "width = 0.05\nfailing_seed = 1"), measurements=MEASUREMENTS), seeds=[1])
    assert math.isnan(result.table["z"][2])
    assert result.as_dict()["rows"][2]["z"] is None
    assert result.dof == 3
    assert "Not compared, as no run gave a value: wide." in result.text


def test_one_seed_is_not_judged(study):
    result = compare(study, seeds=[1])
    assert math.isnan(result.p_value)
    assert result.as_dict()["p_value"] is None
    assert not result.table["fails"].any()
    assert "at least three seeds" in result.advice[0]


BAD = {
    "an experiment without measurements": (
        MEASUREMENTS.replace("wide,angle,0.2,0.01,rad,1,\n", ""),
        "experiments.wide has no measurement. Add a row for it, or take [experiments.wide] out of study.toml",
    ),
    "u = 0": (MEASUREMENTS.replace("0.5,deg", "0,deg"), "line 2: u is 0"),
    "u < 0": (MEASUREMENTS.replace("0.5,deg", "-1,deg"), "line 2: u is -1"),
    "no unit": (MEASUREMENTS.replace("0.5,deg", "0.5,"), "line 2: unit is empty"),
    "an observable that isn't made": (
        MEASUREMENTS.replace("narrow,angle", "narrow,density"),
        "Unknown observable of narrow",
    ),
    "an unknown experiment": (MEASUREMENTS.replace("wide", "wyde"), "Did you mean 'wide'?"),
    "a photograph of no heap": (
        MEASUREMENTS.replace("remark", "photograph"),
        "narrow angle: a photograph is given for angle of quick; photographs are compared for angle_of_repose of fixed_funnel",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_before_anything_runs(write, command, case):
    text, part = BAD[case]
    folder = write(measurements=text)
    with pytest.raises(FileError) as error:
        compare(folder)
    assert part in str(error.value)
    code, out, err = command("compare", folder)
    assert (code, out) == (2, "")
    assert part in err
    assert "Traceback" not in err
    assert Quick.batches == []
    assert sorted(path.name for path in folder.iterdir()) == ["measurements.csv", "study.toml"]


def test_no_measurements_and_a_folder_that_cannot_be_written(write, command):
    folder = write()
    assert "There is no" in command("compare", folder)[2]
    write(measurements=MEASUREMENTS)
    with pytest.raises(InputError, match="Give another with -o"):
        compare(folder, output=folder / "study.toml")
    with pytest.raises(InputError, match="No seed"):
        compare(folder, seeds=[])


HEAP = '[experiments.heap]\ntype = "fixed_funnel"\n'
SHOWN = HEADER.strip() + ",photograph\nnarrow,flow,40,1,g/s,4,\nwide,flow,50,1,g/s,4,\n"


def test_a_photograph_that_cannot_be_read(write, command):
    folder = write(end=HEAP, measurements=f"{SHOWN}heap,angle_of_repose,20,1,deg,4,heap.png; notes.txt\n")
    (folder / "notes.txt").write_text("no picture")
    code, _, err = command("compare", folder)
    assert code == 2
    assert f"heap: Picture given: {folder / 'heap.png'}, which can't be read" in err
    assert "notes.txt" in err
    assert Quick.batches == []


def test_a_photograph_is_no_condition(write):
    rows = "heap,angle_of_repose,20,1,deg,4,a.png\nheap,angle_of_repose,21,1,deg,4,b.png\n"
    with pytest.raises(FileError, match="line 5: heap, angle_of_repose stands in line 4 already"):
        read_measurements(read_study(write(end=HEAP, measurements=SHOWN + rows)))


def test_a_heap_beside_a_photograph(write, monkeypatch):
    """Grains of an independent code stand for the simulated heap; a drawn one of known angle is the photograph."""
    table = np.loadtxt(Path(__file__).parents[1] / "analysis" / "heap_poured.csv", delimiter=",", skiprows=3) * 1e-6
    end, runs = snapshot(table), []

    def quickly(self, models, seeds, **_):
        runs.append(list(seeds))
        return [Outcome({"angle_of_repose": 20.0 + seed}, seed, None, end) for seed in seeds]

    monkeypatch.setattr(FixedFunnel, "run", quickly)
    monkeypatch.setattr(heap_views, "AZIMUTHS", (0, 45, 90, 135))
    settings = 'cup_radius = "50 mm"\nfit_from = 0.4\nfit_to = 0.92\n'
    folder = write(end=HEAP + settings, measurements=f"{SHOWN}heap,angle_of_repose,20,1,deg,4,heap.png\n")
    cv2.imwrite(str(folder / "heap.png"), draw_heap(17.0, grains=12))
    result = compare(folder, seeds=[1, 2, 6])
    assert result.pictures["heap_heap"] == "heap_heap.png"
    (numbers,) = result.photographs
    assert numbers["photograph_deg"] == pytest.approx(17.0, abs=1.5)
    assert numbers["simulated_deg"] == pytest.approx(29.9, abs=1.5)  # docs/angle_of_repose.md
    assert (numbers["seed"], runs) == (
        2,
        [[1, 2, 6], [2]],
    )  # nearest to the mean of 21, 22 and 26; its grains weren't kept
    picture = cv2.imread(str(result.folder / "heap_heap.png"))
    halves = (picture[:, : picture.shape[1] // 2], picture[:, picture.shape[1] // 2 :])
    assert all(half.std() > 20 for half in halves)
    assert "in the photograph and " in result.text
    cv2.imwrite(str(folder / "heap.png"), 200 + 0 * draw_heap(17.0))
    assert "can't be shown side by side: No heap found in heap.png" in compare(folder, seeds=[1, 2, 6]).text
    assert len(runs) == 2  # the grains were kept this time


def line_of(out, *parts):
    (line,) = [line for line in out.splitlines() if all(part in line for part in parts)]
    return line.split()


def test_the_command_prints_a_table_and_where_things_are(command, write):
    folder = write(measurements=MEASUREMENTS.replace("0.04,0.002", "0.03,0.002"))
    code, out, err = command("compare", folder, "--seeds", "3")
    assert code == 0
    numbers = ["30", "±", "2", "40", "10", "2", "5", "5.7e−07", "fails"]
    assert line_of(out, "narrow flow [g/s]") == ["narrow", "flow", "[g/s]", "flow", *numbers]
    assert "narrow flow is simulated 10 g/s too high (|E|/u_val = 5.0)" in out
    assert "Next: Find out whether re-calibration" in out
    assert f"6 runs: 0 were in the store, 6 simulated now; 0 failed. Store: {folder / 'runs.sqlite'}" in out
    assert f"wrote {folder / 'results' / 'standardised_errors.png'}" in out
    assert "simulating" in err


def test_a_narrow_terminal_keeps_the_numbers(command, write, monkeypatch):
    folder = write(measurements=MEASUREMENTS)
    monkeypatch.setenv("COLUMNS", "80")
    out = command("compare", folder)[1]
    assert "…" not in out
    assert all(len(line) <= 80 for line in out.splitlines()[:8])
    assert line_of(out, "wide [deg]")[2:8] == ["11.46", "±", "0.57", "12.36", "±", "0.092"]


def test_json_and_nothing_else(command, write, tmp_path):
    folder = write(measurements=MEASUREMENTS)
    code, out, err = command("compare", folder, "--json", "-o", tmp_path / "out", "--store", tmp_path / "other.sqlite")
    assert (code, err) == (0, "")
    assert out == (tmp_path / "out" / "comparison.json").read_text(encoding="utf-8")
    assert [row["label"] for row in json.loads(out)["rows"]] == ["narrow angle", "narrow flow", "wide"]
    assert not (folder / "results").exists()
    assert not (folder / "runs.sqlite").exists()


def test_ctrl_c_says_how_far_it_came_and_the_same_command_goes_on(command, write, monkeypatch):
    folder, whole = write(measurements=MEASUREMENTS), Quick.run

    def stop_at_wide(self, *arguments, **options):
        if self.settings.width > 0.045:
            raise KeyboardInterrupt
        return whole(self, *arguments, **options)

    monkeypatch.setattr(Quick, "run", stop_at_wide)
    code, out, err = command("compare", folder, "--seeds", "3")
    assert (code, out) == (130, "")
    assert f"Stopped. 3 of 6 runs are in {folder / 'runs.sqlite'}; the same command goes on." in err
    monkeypatch.setattr(Quick, "run", whole)
    assert "6 runs: 3 were in the store, 3 simulated now" in command("compare", folder, "--seeds", "3")[1]


def test_failures_are_printed_and_nothing_but_failures_is_no_success(command, write):
    folder = write(("width = 0.05", "width = 0.05\nfailing_seed = 2"), measurements=MEASUREMENTS)
    code, out, _ = command("compare", folder)
    assert code == 0
    assert "wide, seed 2 failed: seed 2 diverged" in out
    assert "wide, seed 2 failed (before; --retry-failed runs it again)" in command("compare", folder)[1]
    Quick.batches.clear()
    command("compare", folder, "--retry-failed")
    assert Quick.batches == [[2]]
    change = (
        ("width = 0.05", "width = 0.05\nfailing_seed = 7"),
        ('width = "40 mm"', 'width = "40 mm"\nfailing_seed = 7'),
    )
    code, out, _ = command("compare", write(*change, measurements=MEASUREMENTS), "--seeds", "7,")
    assert code == 1
    assert "Nothing can be compared" in out or "no run gave a value" in out


def test_the_usual_numbers_of_the_shared_bench_make_series():
    """Hoppers that differ in outlet and time of flow, drums in speed, rebounds in speed: three series."""
    from taichidem.study.comparison_conditions import condition_columns

    folder = Path(__file__).parents[2] / "examples" / "bench"
    study = read_study(folder)
    measured = pd.DataFrame(
        [{"experiment": n, "observable": study.experiment(n).observables[0].name} for n in study.experiments]
    )
    names = set(condition_columns(study, measured))
    assert {"outlet_diameter [m]", "speed [rad/s]", "speed [m/s]"} <= names
    assert "flow_time [s]" not in names
