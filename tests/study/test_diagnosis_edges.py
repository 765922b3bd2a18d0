"""Diagnoses at the edges of what a study may hold: equal tests, no parameters, one test, nothing to put to the test."""

import re

import pandas as pd
import pytest

import taichidem.experiments
from analysis.errors import AnalysisError
from taichidem import plugins
from taichidem.effects import CohesionArea
from taichidem.errors import InputError
from taichidem.study import diagnose, read_study
from taichidem.study.diagnosis_plan import plan
from taichidem.study.diagnosis_run import analyse
from taichidem.study.screening import EFFECT, SEED, SHARE
from tests.study import formula_bench as bench

NULL = bench.changed()
COHESION = bench.changed(CohesionArea(energy_density=4e4))
FRICTION = '"granule-granule.static_friction"'


@pytest.fixture(autouse=True)
def formulas(monkeypatch):
    bench.register(monkeypatch.setitem)
    bench.Formula.simulated.clear()


def edited(folder, change, tests=7):
    """Change a study's text and keep the first tests only."""
    text = change((folder / "study.toml").read_text())
    (folder / "study.toml").write_text(text.partition(f"[experiments.test_{tests}]")[0])
    lines = (folder / "measurements.csv").read_text().splitlines()[: tests + 1]
    (folder / "measurements.csv").write_text("\n".join([*lines, ""]))
    return folder


def simulated_points(folder):
    """Return the points of a plan whose runs all gave the same."""
    planned = plan(read_study(folder), ["cohesion_area"], new_tests=())
    outcomes = pd.DataFrame({"key": [run.key for run in planned.runs], "reading": 1.0})
    return planned.table(outcomes)


def test_equal_tests_under_two_names_are_both_compared(tmp_path):
    folder = edited(bench.write(tmp_path / "s", NULL), lambda t: t.replace("number = 1\n", "number = 0\n"))
    result = diagnose(folder, bench.TESTED)
    errors = [row["believed"] for row in result.standardised_errors]
    assert all(z == z for z in errors)
    assert result.chi2["believed"] > sum(z**2 for z in errors)


def test_a_believed_model_in_the_middle_of_its_ranges_counts_once(tmp_path):
    def change(text):
        text = text.replace("low = 0.2, high = 0.8", "low = 0.2, high = 0.5")
        return text.replace("low = 0.1, high = 0.6", "low = 0.125, high = 0.375")

    points = simulated_points(edited(bench.write(tmp_path / "s", NULL, direct=False), change))
    keys = [key for key in points if "static_friction" in key]
    assert len(keys) == 2
    assert not points.duplicated([*keys, EFFECT, SHARE, SEED]).any()
    assert (points[keys] == [0.35, 0.25]).all(axis=1).sum() >= 4


def test_without_anything_to_calibrate_no_point_counts_twice(tmp_path):
    folder = edited(
        bench.write(tmp_path / "s", COHESION), lambda t: re.sub(r"\[calibrate\]\n.*?\n\n", "", t, flags=re.S)
    )
    points = simulated_points(folder)
    assert not points.duplicated([EFFECT, SHARE, SEED]).any()
    assert diagnose(folder, bench.TESTED).verdict != "nothing_missing"


def test_one_key_for_pairs_that_differ_is_refused_before_anything_runs(tmp_path):
    def change(text):
        return re.sub(
            rf'{FRICTION} = .*\n"granule-wall.*\n',
            '"tangential_mindlin.static_friction" = { low = 0.1, high = 0.8 }\n',
            text,
        )

    folder = edited(bench.write(tmp_path / "s", NULL), change)
    with pytest.raises(InputError, match="its values differ"):
        diagnose(folder, bench.TESTED)
    assert bench.Formula.simulated == []


@pytest.mark.parametrize(("truth", "verdict"), [(NULL, "cannot_tell"), (COHESION, "something_else")])
def test_where_nothing_was_put_to_the_test_it_is_said(tmp_path, truth, verdict):
    result = diagnose(bench.write(tmp_path / "s", truth), ["normal_hertz"])
    assert result.verdict == verdict
    assert "no effect was put to the test" in result.text
    assert result.not_tested == [{"effect": "normal_hertz", "reason": "the model has it already."}]


@pytest.mark.parametrize("tests", [1, 2])
def test_few_tests_give_no_sentence_with_nan(tmp_path, tests):
    result = diagnose(edited(bench.write(tmp_path / "s", COHESION), str, tests), ["cohesion_area"])
    assert "nan" not in result.text


def test_a_test_may_bear_the_name_of_a_type_that_proposes_itself(tmp_path, monkeypatch):
    class Proposed(bench.Formula):
        name = "proposed"

        @classmethod
        def proposed(cls, diameter):
            return {"number": 6}, {"reading": 0.5}

    monkeypatch.setitem(taichidem.experiments.BUILT_IN, "proposed", Proposed)
    plugins.refresh()
    folder = bench.write(tmp_path / "s", NULL)
    for file in ("study.toml", "measurements.csv"):
        (folder / file).write_text((folder / file).read_text().replace("test_3", "proposed"))
    planned = plan(read_study(folder), ["cohesion_area"])
    assert list(planned.proposals) == ["proposed_new"]
    assert {row["proposed"].experiment.settings.number for row in planned.rows} == {3}


@pytest.mark.parametrize(
    ("error", "raised"), [(ValueError("shapes"), ValueError), (AnalysisError("too few"), InputError)]
)
def test_faults_of_the_program_are_not_taken_for_wrong_input(tmp_path, monkeypatch, error, raised):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr(plugins.get("analyser", "missing_effect"), "analyse", fails)
    planned = plan(read_study(bench.write(tmp_path / "s", NULL)), ["cohesion_area"])
    with pytest.raises(raised) as told:
        analyse(planned, pd.DataFrame())
    assert type(told.value) is raised


def test_a_test_that_cannot_be_weighed_is_told(tmp_path):
    with pytest.raises(InputError, match=r"formula does not say .* Those that can: "):
        plan(read_study(bench.write(tmp_path / "s", NULL)), ["cohesion_area"], new_tests=["formula"])
