"""The shipped study with a hidden effect, whole: every effect on trial."""

from __future__ import annotations

import json
import shutil

import pytest

from taichidem.missing_effect_demo import EXAMPLE, go
from taichidem.study import diagnose


@pytest.mark.slow
def test_the_hidden_effect_is_found_added_and_nothing_else_is_missing(tmp_path):
    truth = json.loads((EXAMPLE / "made_with.json").read_text(encoding="utf-8"))
    (hidden,) = truth["hidden_effects"]
    road = go(tmp_path, effects=None)
    assert road.diagnosis.verdict in ("effect", "one_of")
    assert hidden in road.diagnosis.effects
    added = road.additions[0]
    assert added.effect == hidden
    before, after = added.step("recalibrated"), added.step("with_effect")
    assert after["chi2"] < 0.3 * before["chi2"]
    assert after["chi2"] / after["dof"] < 2.5
    assert after["rms_held_out"] < before["rms_held_out"]
    shutil.rmtree(added.new_study / "results")
    assert diagnose(added.new_study).verdict == "nothing_missing"
