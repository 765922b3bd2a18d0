"""Adding and discovering where something stands in the way: told before anything runs, gone on with after a stop."""

import json
from types import SimpleNamespace
from typing import ClassVar

import pytest

import taichidem.effects
from taichidem import cli, plugins
from taichidem.effects import CohesionArea, SizeSpread
from taichidem.effects.base import Parameter, SetupEffect
from taichidem.errors import InputError
from taichidem.experiments.base import Outcome
from taichidem.study import RunStore, add, discover, discovery, read_study
from taichidem.study.addition_run import FRESH_SEEDS
from taichidem.study.hypothesis import hypotheses
from tests.study import formula_bench as bench

COHESION = bench.changed(CohesionArea(energy_density=4e4))
PAIR = bench.changed(CohesionArea(energy_density=5e4), SizeSpread(half_width=0.3))


class Offset(SetupEffect):
    """An effect of an outside package: both signs, and as strong as it may be at the end of what is plausible."""

    name: ClassVar[str] = "cohesion_offset"
    title: ClassVar[str] = "Offset"
    two_sided: ClassVar[bool] = True
    parameters: ClassVar = (
        Parameter("offset", "1", -1.0, 1.0, (-0.5, 1.0), "An offset.", vanishing=0.0, per_pair=False),
    )


@pytest.fixture(autouse=True)
def formulas(monkeypatch):
    bench.register(monkeypatch.setitem)
    bench.Formula.simulated.clear()


@pytest.fixture
def folder(tmp_path):
    return bench.write(tmp_path / "s", COHESION)


def fails_where(monkeypatch, wanted):
    """Let a formula fail where wanted(settings, model, seed) says so."""
    one = bench.Formula._one

    def run(self, model, seed):
        return Outcome({}, seed, "stuck") if wanted(self.settings, model, seed) else one(self, model, seed)

    monkeypatch.setattr(bench.Formula, "_one", run)


def test_a_test_that_fails_with_the_effect_is_no_error_that_fell(folder, tmp_path, monkeypatch):
    def stuck(settings, model, seed):
        return settings.number == 3 and seed in FRESH_SEEDS and "cohesion_area" in {e.name for e in model.effects}

    fails_where(monkeypatch, stuck)
    with pytest.raises(InputError, match=r"test_3 gave no result.*stuck"):
        add(folder, "cohesion_area", tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_test_that_fails_as_believed_leaves_its_chi2_unknown(folder, tmp_path, monkeypatch):
    def stuck(settings, model, seed):
        return settings.number == 3 and seed in FRESH_SEEDS and "cohesion_area" not in {e.name for e in model.effects}

    fails_where(monkeypatch, stuck)
    kept = json.loads(add(folder, "cohesion_area", tmp_path / "new").to_json())
    assert [step["chi2"] is None for step in kept["waterfall"]] == [True, True, False]


@pytest.mark.parametrize("seeds", [(1, 101), (11,), ()])
def test_seeds_that_are_fitted_to_are_not_fresh(folder, tmp_path, seeds):
    with pytest.raises(InputError, match="fresh_seeds"):
        add(folder, "cohesion_area", tmp_path / "new", fresh_seeds=seeds)
    assert bench.Formula.simulated == []


def test_a_folder_that_cannot_be_written_is_told_before_anything_runs(folder, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="can't be written"):
        add(folder, "cohesion_area", tmp_path / "file" / "new")
    assert bench.Formula.simulated == []


def test_a_number_for_all_pairs_becomes_one_per_pair(folder, tmp_path):
    text = (folder / "study.toml").read_text()
    text = text.replace("static_friction = 0.35\n", "").replace("static_friction = 0.25\n", "")
    (folder / "study.toml").write_text(text + "\n[effects.tangential_mindlin]\nstatic_friction = 0.3\n")
    result = add(folder, "cohesion_area", tmp_path / "new")
    new, keys = read_study(tmp_path / "new"), [p["key"] for p in result.parameters]
    assert [new.believed(key) for key in keys] == pytest.approx([p["with_effect"] for p in result.parameters], rel=1e-5)


def test_an_effect_of_both_signs_at_its_bounds_can_be_added(folder, tmp_path, monkeypatch):
    expected = bench.expected

    def with_offset(model):
        offset = next((e.values["offset"] for e in model.effects if e.name == Offset.name), 0.0)
        return expected(model) + offset * bench.np.array([0.0, 9.0, 1.0, -8.0, 1.0, 6.0, 0.0])

    monkeypatch.setitem(taichidem.effects.BUILT_IN, Offset.name, Offset)
    plugins.refresh()
    monkeypatch.setattr(bench, "expected", with_offset)
    written = bench.write(tmp_path / "offset", bench.changed(Offset(offset=-0.99)))
    result = add(written, Offset.name, tmp_path / "new")
    new = read_study(tmp_path / "new")
    assert result.strength == pytest.approx(-0.97, abs=0.1)
    assert new.believed("cohesion_offset.offset") == pytest.approx(result.strength, rel=1e-5)
    (hypothesis,) = hypotheses(new, ["base_tilt"]).tested
    assert hypothesis.strength(-1.0, new.model()) == -hypothesis.strength(1.0, new.model())


def test_the_command_gives_the_new_study_a_copy_of_the_runs(folder, tmp_path, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["add", str(folder), "cohesion_area", "-o", str(tmp_path / "new"), "--json"])
    assert end.value.code == 0
    assert json.loads(capsys.readouterr().out)["effect"] == "cohesion_area"
    with RunStore(tmp_path / "new" / "runs.sqlite") as copy, RunStore(folder / "runs.sqlite") as own:
        assert copy.runs() == own.runs() != []


def test_a_stopped_command_counts_no_runs_that_it_does_not_know(folder, tmp_path, monkeypatch, capsys):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("taichidem.study.addition_run.write_addition", stopped)
    monkeypatch.setattr("taichidem.study.addition_run.rehearse", lambda *_: None)
    with pytest.raises(SystemExit) as end:
        cli.main(["add", str(folder), "cohesion_area", "-o", str(tmp_path / "new")])
    assert end.value.code == 130
    told = capsys.readouterr().err
    assert "the same command goes on" in told
    assert " of " not in told.splitlines()[-1]


def test_a_search_can_be_made_again_after_a_stop(folder, monkeypatch):
    step = discovery._Trail.step

    def stopped(self, may_add):
        if self.added:
            raise KeyboardInterrupt
        return step(self, may_add)

    monkeypatch.setattr(discovery._Trail, "step", stopped)
    with pytest.raises(KeyboardInterrupt):
        discover(folder, bench.TESTED)
    kept = json.loads((folder / "results" / "discovery.json").read_text())
    assert [s["added"] for s in kept["steps"]] == ["cohesion_area"]
    assert "interrupted" in kept["stopped_because"]
    monkeypatch.setattr(discovery._Trail, "step", step)
    bench.Formula.simulated.clear()
    result = discover(folder, bench.TESTED)
    assert [s["verdict"] for s in result.steps] == ["effect", "nothing_missing"]
    assert set(bench.Formula.simulated) <= {1, 2, 3, 4}  # nothing of the first step is run again


def test_a_search_overwrites_no_study_of_someone_else(folder, tmp_path):
    bench.write(tmp_path / "mine" / "step_1", COHESION)
    with pytest.raises(InputError, match="holds step_1 already"):
        discover(folder, bench.TESTED, output=tmp_path / "mine")
    assert bench.Formula.simulated == []


def test_a_search_writes_where_it_is_told_only(folder, tmp_path):
    discover(folder, ["cohesion_area"], output=tmp_path / "out")
    assert not (folder / "results").exists()
    assert (tmp_path / "out" / "verdict.json").exists()
    assert (tmp_path / "out" / "step_1_cohesion_area" / "results" / "addition.json").exists()


def test_more_knobs_than_measurements_after_an_addition_end_a_search(tmp_path):
    folder = bench.write(tmp_path / "s", COHESION, direct=False)
    text = (folder / "study.toml").read_text()
    (folder / "study.toml").write_text(text.partition("[experiments.test_4]")[0])
    lines = (folder / "measurements.csv").read_text().splitlines()[:5]
    (folder / "measurements.csv").write_text("\n".join(lines))
    result = discover(folder, bench.TESTED)
    assert [s["added"] for s in result.steps] == ["cohesion_area"]
    assert "as many knobs" in result.stopped_because
    assert result.final == folder / "results" / "discovery" / "step_1_cohesion_area"


def trail_of(folder, monkeypatch, chi2, unneeded):
    """Return a search that has added three effects, and the names of what it builds anew: with less, χ² is chi2(effects)."""
    built = []

    def addition(effect, effects):
        steps = {"with_effect": {"chi2": chi2(effects)}, "recalibrated": {"chi2": 500.0}}
        return SimpleNamespace(effect=effect, step=steps.get, new_study=folder)

    def joined(self, study, effect, name, stage):
        built.append(effect)
        return addition(effect, built)

    monkeypatch.setattr(discovery._Trail, "_joined", joined)
    monkeypatch.setattr(discovery._Trail, "_vanished", lambda self, earlier: earlier.effect in unneeded)
    trail = discovery._Trail(read_study(folder), folder, folder, "", None, discovery._Options(None, None, None), print)
    names = ["rolling_constant_torque", "base_tilt", "cohesion_area"]
    trail.added = [addition(name, names) for name in names]
    trail.steps, trail.last = [{}] * 4, SimpleNamespace(parameters=[])
    return trail, built


def test_effects_that_came_to_nothing_are_all_taken_out_together(folder, monkeypatch):
    unneeded = ["rolling_constant_torque", "base_tilt"]
    trail, built = trail_of(folder, monkeypatch, lambda effects: 5.0 + (3 - len(effects)), unneeded)
    trail.look_back()
    assert built == ["cohesion_area"]
    assert trail.removed == unneeded
    assert "Added: cohesion_area;" in trail.text()
    assert "rolling_constant_torque, base_tilt" in trail.text()


def test_an_effect_without_which_the_error_rises_stays(folder, monkeypatch):
    trail, _ = trail_of(folder, monkeypatch, lambda effects: 5.0 + 90 * (3 - len(effects)), ["base_tilt"])
    trail.look_back()
    assert trail.removed == []
    assert len(trail.added) == 3


@pytest.mark.parametrize(
    ("effect", "parameter", "value", "vanished"),
    [
        ("kinetic_friction", "kinetic_ratio", 0.98, True),
        ("kinetic_friction", "kinetic_ratio", 0.3, False),
        ("cohesion_offset", "offset", -0.01, True),
        ("cohesion_offset", "offset", -0.9, False),
    ],
)
def test_near_vanishing_is_measured_from_where_the_effect_vanishes(
    folder, monkeypatch, effect, parameter, value, vanished
):
    monkeypatch.setitem(taichidem.effects.BUILT_IN, Offset.name, Offset)
    plugins.refresh()
    trail = discovery._Trail(read_study(folder), folder, folder, "", None, discovery._Options(None, None, None), print)
    row = {"key": f"{effect}.{parameter}", "low": -1.0 if value < 0 else 0.2, "high": 0.0 if value < 0 else 1.0}
    trail.last = SimpleNamespace(parameters=[row | {"recalibrated": value, "u_recalibrated": 0.05}])
    assert trail._vanished(SimpleNamespace(effect=effect, parameter=parameter)) is vanished
