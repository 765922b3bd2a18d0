"""diagnose, add and discover on a bench of formulas: the planted effect is found, put in, and the error falls."""

import json

import pytest

from taichidem import cli
from taichidem.effects import CohesionArea, RollingConstantTorque, SizeSpread
from taichidem.errors import InputError
from taichidem.study import RunStore, add, cluster, diagnose, discover, read_study
from taichidem.study.diagnosis_plan import plan
from tests.study import formula_bench as bench

NULL = bench.changed()
ROLLING = bench.changed(RollingConstantTorque(rolling_friction=0.15))
COHESION = bench.changed(CohesionArea(energy_density=4e4))
PAIR = bench.changed(CohesionArea(energy_density=5e4), SizeSpread(half_width=0.3))


@pytest.fixture(autouse=True)
def formulas(monkeypatch):
    bench.register(monkeypatch.setitem)
    bench.Formula.simulated.clear()


def found(folder, truth, **options):
    return diagnose(bench.write(folder, truth, **options), bench.TESTED)


def test_nothing_is_missing_where_nothing_is_hidden(tmp_path):
    result = found(tmp_path / "s", NULL)
    assert result.verdict == "nothing_missing"
    assert result.effects == ()
    assert "would have shown" in result.text
    assert all(row["detection_limit"] is not None for row in result.table)
    frictions = {p["key"]: (p["recalibrated"], p["u_recalibrated"]) for p in result.parameters}
    value, u = frictions["granule-granule.static_friction"]
    assert value == pytest.approx(0.42, abs=3 * u)
    assert 0.002 < u < 0.03


def test_a_planted_effect_is_named_with_its_strength(tmp_path):
    result = found(tmp_path / "s", COHESION)
    assert result.verdict == "effect"
    assert result.effects == ("cohesion_area",)
    row = result.table[0]
    assert row["effect"] == "cohesion_area"
    assert row["strength"] == pytest.approx(4e4, abs=3 * row["u_strength"])
    assert row["adjusted_p"] < 0.01
    assert result.chi2["believed"] > result.chi2["recalibrated"] > 4 * result.chi2["with_effect"]
    assert result.held_out_error["after"] < 0.5 * result.held_out_error["before"]


def test_look_alikes_are_named_together(tmp_path):
    result = found(tmp_path / "s", ROLLING)
    assert result.verdict == "one_of"
    assert set(result.effects) == {"rolling_constant_torque", "rolling_spring_dashpot"}
    row = next(r for r in result.table if r["effect"] == "rolling_constant_torque")
    assert row["rho"]["rolling_spring_dashpot"] > 0.98


def test_an_effect_that_is_not_tested_is_not_replaced_by_another(tmp_path):
    folder = bench.write(tmp_path / "s", COHESION)
    result = diagnose(folder, [name for name in bench.TESTED if name != "cohesion_area"])
    assert result.verdict in ("something_else", "cannot_tell")


def test_verdict_json_holds_what_it_must(tmp_path):
    result = found(tmp_path / "s", COHESION)
    kept = json.loads((tmp_path / "s" / "results" / "verdict.json").read_text())
    assert kept == json.loads(result.to_json())
    for name in ("schema", "verdict", "effects", "table", "next_measurement", "runs", "wall_s"):
        assert name in kept
    assert set(kept["chi2"]) >= {"believed", "recalibrated", "with_effect", "dof"}
    assert set(kept["held_out_error"]) == {"before", "after"}
    assert {row["effect"] for row in kept["table"]} == set(bench.TESTED)
    for name in kept["pictures"].values():
        assert (tmp_path / "s" / "results" / name).read_bytes().startswith(b"\x89PNG")


def test_other_measurements_need_no_new_run(tmp_path):
    store = tmp_path / "runs.sqlite"
    diagnose(bench.write(tmp_path / "a", COHESION), bench.TESTED, store=store)
    bench.Formula.simulated.clear()
    again = diagnose(bench.write(tmp_path / "b", NULL, seed=8), bench.TESTED, store=store)
    assert again.runs["new"] == 0
    assert bench.Formula.simulated == []


def test_a_diagnosis_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    folder, batches = bench.write(tmp_path / "s", COHESION), []
    run = bench.Formula.run

    def stops(self, models, seeds, **options):
        batches.append(len(seeds))
        if len(batches) == 20:
            raise KeyboardInterrupt
        return run(self, models, seeds, **options)

    monkeypatch.setattr(bench.Formula, "run", stops)
    with pytest.raises(KeyboardInterrupt):
        diagnose(folder, bench.TESTED)
    done = sum(batches[:-1])
    monkeypatch.setattr(bench.Formula, "run", run)
    result = diagnose(folder, bench.TESTED)
    assert result.runs["stored"] == done
    assert result.verdict == "effect"


def test_failed_runs_are_told_and_do_not_stop_it(tmp_path):
    folder = bench.write(tmp_path / "s", COHESION)
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text.replace("number = 3\n", "number = 3\nfailing_seed = 2\n"))
    result = diagnose(folder, bench.TESTED)
    assert result.effects == ("cohesion_area",)
    assert result.runs["failed"] > 0
    assert all(row["reason"] == "seed 2 diverged" for row in result.failures)


def test_adding_writes_a_study_in_which_the_error_fell(tmp_path):
    folder = bench.write(tmp_path / "s", COHESION)
    result = add(folder, "cohesion_area", tmp_path / "new")
    believed, recalibrated, after = result.waterfall
    assert believed["chi2"] > recalibrated["chi2"] > 4 * after["chi2"]
    assert after["chi2"] < 3 * after["dof"]
    assert after["rms_held_out"] < 0.5 * recalibrated["rms_held_out"]
    new = read_study(tmp_path / "new")
    held = next(e for e in new.model().effects if e.name == "cohesion_area").values["energy_density"]
    assert held["granule-granule"] == pytest.approx(result.strength, rel=1e-4)
    assert new.believed("granule-granule.static_friction") == pytest.approx(0.42, abs=0.05)
    assert "granule-granule.cohesion_area.energy_density" in [c.key for c in new.calibrate]
    assert "# a comment that stays" in (tmp_path / "new" / "study.toml").read_text()
    kept = json.loads((tmp_path / "new" / "results" / "addition.json").read_text())
    assert kept["effect"] == "cohesion_area"
    again = diagnose(new, ["size_spread", "base_tilt"])
    assert again.verdict == "nothing_missing"


def test_nothing_fitted_is_judged_on_the_seeds_it_was_fitted_to(tmp_path, elsewhere):
    folder = bench.write(tmp_path / "s", COHESION)
    with cluster.cluster_executor("here") as executor:  # every round is simulated there
        result = add(folder, "cohesion_area", tmp_path / "new", fresh_seeds=(901, 902), executor=executor)
    with RunStore(folder / "runs.sqlite") as store:
        seeds = [run.seed for run in store.runs()]
    assert result.fresh_seeds == (901, 902)
    assert seeds.count(901) == 3 * 7
    assert max(seed for seed in seeds if seed < 900) < 100


def test_adding_what_nobody_asks_for_is_refused(tmp_path):
    folder = bench.write(tmp_path / "s", NULL, u=0.05)
    with pytest.raises(InputError, match="gets no strength"):
        add(folder, "cohesion_area", tmp_path / "new", effect_rows=6)
    assert not (tmp_path / "new" / "study.toml").exists()


def test_adding_does_not_overwrite(tmp_path):
    folder = bench.write(tmp_path / "s", COHESION)
    with pytest.raises(InputError, match="nothing is overwritten"):
        add(folder, "cohesion_area", folder)


def test_discovering_finds_two_effects_one_after_the_other(tmp_path):
    folder = bench.write(tmp_path / "s", PAIR, u=0.25)
    result = discover(folder, bench.TESTED)
    assert {step["added"] for step in result.steps} - {None} == {"cohesion_area", "size_spread"}
    assert result.steps[-1]["verdict"] in ("nothing_missing", "cannot_tell")
    assert result.removed == []
    assert result.steps[-1]["chi2"] < 0.2 * result.steps[0]["chi2"]
    assert {e.name for e in read_study(result.final).model().effects} >= {"cohesion_area", "size_spread"}


def test_discovering_tries_look_alikes_and_keeps_what_fresh_seeds_prefer(tmp_path):
    result = discover(bench.write(tmp_path / "s", ROLLING), bench.TESTED, most=1)
    steps = tmp_path / "s" / "results" / "discovery"
    tried = {}
    for effect in result.steps[0]["effects"]:
        kept = json.loads((steps / f"step_1_{effect}" / "results" / "addition.json").read_text())
        tried[effect] = kept["waterfall"][-1]["chi2"]
    assert len(tried) == 2
    assert result.steps[0]["added"] == min(tried, key=tried.get)


def test_discovering_nothing_adds_nothing(tmp_path, elsewhere):
    with cluster.cluster_executor("here") as executor:
        result = discover(bench.write(tmp_path / "s", NULL), bench.TESTED, executor=executor)
    assert len(result.steps) == 1
    assert result.final == tmp_path / "s"
    assert result.text.startswith("No effect was added.")


def test_as_many_knobs_as_measurements_are_refused_before_anything_runs(tmp_path):
    folder = bench.write(tmp_path / "s", NULL, direct=False)
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text[: text.index("[experiments.test_2]")])
    lines = (folder / "measurements.csv").read_text().splitlines()[:3]
    (folder / "measurements.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="as many knobs"):
        diagnose(folder, bench.TESTED)
    assert bench.Formula.simulated == []
    assert not (folder / "runs.sqlite").exists()


def test_an_experiment_without_measurements_is_refused(tmp_path):
    folder = bench.write(tmp_path / "s", NULL)
    lines = (folder / "measurements.csv").read_text().splitlines()[:-1]
    (folder / "measurements.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match="test_6 has no measurement"):
        diagnose(folder, bench.TESTED)


@pytest.mark.parametrize("name", ["cohesion", "nothing"])
def test_unknown_effects_are_refused_with_the_nearest(tmp_path, name):
    with pytest.raises(InputError, match="Unknown effect"):
        plan(read_study(bench.write(tmp_path / "s", NULL)), [name])


def test_the_command_line_says_the_verdict(tmp_path, capsys):
    folder = bench.write(tmp_path / "s", COHESION)
    with pytest.raises(SystemExit) as end:
        cli.main(["diagnose", str(folder), "--effects", ",".join(bench.TESTED)])
    assert end.value.code == 0
    printed = capsys.readouterr().out
    assert "Verdict: effect: cohesion_area" in printed
    assert "error of predicting tests that were left out" in printed
    with pytest.raises(SystemExit) as end:
        cli.main(["add", str(folder), "cohesion_area", "-o", str(tmp_path / "new")])
    assert end.value.code == 0
    printed = capsys.readouterr().out
    assert "cohesion_area was added with" in printed
    assert "re-calibrated" in printed
    with pytest.raises(SystemExit) as end:
        cli.main(["diagnose", str(folder), "--effects", "cohesion_area,size_spread", "--json"])
    assert json.loads(capsys.readouterr().out)["verdict"] == "effect"
