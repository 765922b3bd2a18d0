"""A study written with an effect more reads back as the model that was meant, comments and order kept."""

import shutil

import pytest

from taichidem import plugins
from taichidem.errors import InputError
from taichidem.study import read_study
from taichidem.study.addition_study import free_parameters
from taichidem.study.diagnosis_plan import plan
from taichidem.study.hypothesis import hypotheses
from taichidem.study.study_writer import write_study
from tests.study import formula_bench as bench

VALUES = {"granule-granule.static_friction": 0.47, "granule-wall.static_friction": 0.23}


@pytest.fixture
def study(tmp_path, monkeypatch):
    bench.register(monkeypatch.setitem)
    return read_study(bench.write(tmp_path / "s", bench.changed()))


def edited(study, change):
    """Return the study with its file changed by a function of its text."""
    study.file.write_text(change(study.file.read_text()))
    return read_study(study.path)


def numbers(values):
    """Return values with pairs named in one way and rounded as they are written."""
    if isinstance(values, dict):
        return {"-".join(sorted(k.split("-"))) if "-" in k else k: numbers(v) for k, v in values.items()}
    return pytest.approx(values, rel=1e-5)


@pytest.mark.parametrize("name", [n for n in plugins.names("effect")])
def test_every_effect_can_be_written(study, tmp_path, name):
    found = hypotheses(study, [name])
    if not found.tested:
        assert name in ("normal_hertz", "tangential_mindlin", "body_gravity")
        return
    (hypothesis,) = found.tested
    planned = plan(study, [name], new_tests=())
    share = 1.0 if hypothesis.effect.all_or_nothing else 0.6
    model = study.at(VALUES).model
    meant = hypothesis.joined(model, share)
    free = free_parameters(hypothesis, share, planned)
    new = write_study(study, tmp_path / "new", VALUES, hypothesis.at(share, model), free, "new")
    read = {e.name: e for e in new.model().effects}
    assert set(read) == {e.name for e in meant.effects}
    for effect in meant.effects:
        held = numbers(effect.values)
        assert {k: held[k] for k in held} == read[effect.name].values or numbers(
            read[effect.name].values
        ) == effect.values
    assert "# a comment that stays" in new.file.read_text()
    ours = [c for c in new.calibrate if getattr(c.names, "effect", "") == name]
    assert ours
    for entry in ours:
        assert entry.low <= new.believed(entry.key) <= entry.high


def test_a_measured_range_is_kept(study, tmp_path):
    (hypothesis,) = hypotheses(study, ["rolling_constant_torque"]).tested
    new = write_study(study, tmp_path / "new", VALUES, hypothesis.at(0.5, study.model()), [], "new")
    entry = next(c for c in new.calibrate if c.key == "granule-wall.static_friction")
    assert (entry.low, entry.high, entry.value, entry.u) == (0.1, 0.6, 0.29, 0.02)
    assert new.believed("granule-wall.static_friction") == 0.23


def test_a_number_for_all_pairs_gives_way_to_one(study, tmp_path):
    key = "tangential_mindlin.static_friction"
    study = edited(
        study,
        lambda t: (
            t.replace('"granule-granule.static_friction"', f'"{key}"')
            .replace('"granule-wall.static_friction" = { low = 0.1, high = 0.6, value = 0.29, u = 0.02 }', "")
            .replace("static_friction = 0.25", "static_friction = 0.35")
        ),
    )
    (hypothesis,) = hypotheses(study, ["rolling_constant_torque"]).tested
    new = write_study(study, tmp_path / "new", {key: 0.5}, hypothesis.at(0.5, study.model()), [], "new")
    assert new.believed(key) == 0.5


def test_numbers_under_effects_are_changed_there_too(study, tmp_path):
    study = edited(
        study,
        lambda t: (
            t.replace("static_friction = 0.35\n", "").replace("static_friction = 0.25\n", "")
            + '\n[effects.tangential_mindlin]\nstatic_friction = { "granule-granule" = 0.35, "wall-granule" = 0.25 }\n'
        ),
    )
    (hypothesis,) = hypotheses(study, ["cohesion_jkr"]).tested
    new = write_study(study, tmp_path / "new", VALUES, hypothesis.at(0.5, study.model()), [], "new")
    assert {key: new.believed(key) for key in VALUES} == VALUES


def test_nothing_is_overwritten(study):
    (hypothesis,) = hypotheses(study, ["cohesion_jkr"]).tested
    with pytest.raises(InputError, match="nothing is overwritten"):
        write_study(study, study.path, VALUES, hypothesis.at(0.5, study.model()), [], "new")


def test_what_was_killed_on_the_way_is_given_again(study, tmp_path, monkeypatch):
    class Killed(BaseException):
        pass

    def killed(source, target):
        target.write_text("half of it")
        raise Killed

    (hypothesis,) = hypotheses(study, ["cohesion_jkr"]).tested
    given = (study, tmp_path / "new", VALUES, hypothesis.at(0.5, study.model()), [], "new")
    with monkeypatch.context() as patched:
        patched.setattr(shutil, "copyfile", killed)
        with pytest.raises(Killed):
            write_study(*given)
    assert write_study(*given).title == "new"
    assert (tmp_path / "new" / "measurements.csv").read_bytes() == (study.path / "measurements.csv").read_bytes()
