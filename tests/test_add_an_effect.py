"""The package of docs/add_an_effect.md is built, installed, run, and put on trial like a built-in effect."""

from __future__ import annotations

import re

import pytest

from tests.test_plugins import ROOT, files_of_the_page, python, wheel

PAGE = ROOT / "docs" / "add_an_effect.md"


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return the folder into which pip installed the package, and the file with its tests."""
    folder = tmp_path_factory.mktemp("effect")
    files = files_of_the_page(PAGE)
    own_test = folder / "test_adhesion_constant.py"
    own_test.write_text(files.pop("tests/test_adhesion_constant.py"), encoding="utf-8")
    files["granule_effects/__init__.py"] = ""
    pip = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--disable-pip-version-check"]
    run = python([*pip, "--target", str(folder / "site"), str(wheel(folder, files))], [])
    assert run.returncode == 0, run.stderr
    return folder / "site", own_test


def passed(run):
    """Return how many tests a run of pytest passed; none may have failed or been skipped."""
    assert run.returncode == 0, run.stdout + run.stderr
    assert not re.search(r"failed|error|skipped", run.stdout.splitlines()[-1])
    return int(re.search(r"(\d+) passed", run.stdout)[1])


def test_its_own_closed_forms_hold(package):
    site, own_test = package
    run = python(["-m", "pytest", "-q", "-p", "no:cacheprovider", str(own_test)], [ROOT, site], cwd=own_test.parent)
    assert passed(run) == 2


def test_it_stands_trial_with_the_built_in_effects(package):
    site, _ = package
    suite = [
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "tests/conformance",
        "-k",
        "adhesion_constant",
    ]
    run = python(suite, [ROOT, site], cwd=ROOT)
    assert passed(run) >= 20


def test_it_is_a_factor_and_a_force_like_any_other(package):
    """By its name alone, as a study file would ask for it."""
    site, _ = package
    code = """
from taichidem import plugins
from taichidem.effects import BodyGravity, NormalHertz
from taichidem.experiments import Rebound
from taichidem.materials import Material
from taichidem.scene import Model

kind = plugins.get("effect", "adhesion_constant")
(found,) = [p for p in plugins.listing("effect") if p.name == kind.name]
print(found.source, found.status)
grain = Material("grain", 2500.0, 1e7, 0.3)
models = [Model([grain], [NormalHertz(restitution=0.5), kind(pull=pull), BodyGravity()]) for pull in (0.0, 0.01)]
for outcome in Rebound(speed=0.1).run(models, [1, 1]):
    print(outcome.observables["coefficient_of_restitution"])
"""
    run = python(["-c", code], [ROOT, site])
    assert run.returncode == 0, run.stderr
    first, free, held = run.stdout.splitlines()[-3:]
    assert first == "granule-effects ok"
    assert float(free) == pytest.approx(0.5, abs=0.02)  # at the usual step
    assert 0 < float(held) < 0.9 * float(free)
