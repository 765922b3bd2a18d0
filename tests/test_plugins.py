"""The registries: built-in and outside plugins are equal, broken ones are reported, names are unique."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import subprocess
import sys
import types
import zipfile
from importlib.metadata import EntryPoint
from pathlib import Path

import pandas as pd
import pytest

from designs.space import parse_toml
from taichidem import plugins
from taichidem.errors import InputError

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "add_a_design_or_analyser.md"


def test_built_in_plugins_are_listed_with_all_columns():
    designs = {plugin.name: plugin for plugin in plugins.listing("design")}
    assert {"box_behnken", "plackett_burman", "d_optimal"} <= set(designs)
    found = designs["box_behnken"]
    assert (found.kind, found.source, found.status) == ("design", "taichidem", "ok")
    assert found.summary.startswith("Box–Behnken: three levels")
    assert {"main_effects", "response_surface", "optimise"} <= set(plugins.names("analyser"))


def test_unknown_names_name_the_nearest():
    with pytest.raises(InputError, match="Did you mean 'sobol'"):
        plugins.get("design", "sobel")
    with pytest.raises(InputError, match=r"Unknown kind of plugin 'desing'.*Did you mean 'design'"):
        plugins.listing("desing")


@pytest.fixture
def outside(monkeypatch):
    """Declare entry points of invented distributions: outside((name, value, source), …)."""

    def declare(*points, group="taichidem.designs"):
        made = []
        for name, value, source in points:
            made.append(EntryPoint(name, value, group)._for(types.SimpleNamespace(name=source)))
        monkeypatch.setattr(plugins, "entry_points", lambda group: [p for p in made if p.group == group])
        plugins.refresh()

    yield declare
    monkeypatch.undo()
    plugins.refresh()


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ("no_such_package.module:Design", "ModuleNotFoundError: No module named 'no_such_package'"),
        ("designs:NoSuchDesign", "AttributeError"),
        ("collections:OrderedDict", "no subclass of designs.base.DesignGenerator"),
        ("designs:DesignGenerator", "doesn't define points"),
        ("designs:Sobol", "the class says name = 'sobol'"),
    ],
)
def test_broken_plugins_are_reported_and_skipped(outside, value, reason):
    outside(("strange", value, "strange-package"))
    listed = {plugin.name: plugin for plugin in plugins.listing("design")}
    assert listed["strange"].source == "strange-package"
    assert reason in listed["strange"].status
    assert "strange" not in plugins.names("design")
    assert plugins.get("design", "sobol").name == "sobol"
    assert "strange-package" in plugins.problems("design")[0]
    with pytest.raises(InputError, match="'strange' of strange-package can't be used"):
        plugins.get("design", "strange")


def test_a_plugin_that_exits_at_import_is_skipped(outside, tmp_path, monkeypatch):
    (tmp_path / "exits_at_import.py").write_text("raise SystemExit(3)\n")
    monkeypatch.syspath_prepend(tmp_path)
    outside(("exits", "exits_at_import:Design", "exits"))
    assert "SystemExit: 3" in plugins.problems("design")[0]
    assert "sobol" in plugins.names("design")


def test_a_built_in_name_cannot_be_taken(outside):
    outside(("sobol", "designs:Sobol", "impostor"))
    statuses = {plugin.source: plugin.status for plugin in plugins.listing("design") if plugin.name == "sobol"}
    assert statuses["taichidem"] == "ok"
    assert "impostor and taichidem both declare it" in statuses["impostor"]
    assert plugins.get("design", "sobol").__module__ == "designs.design_sobol"


def test_two_outside_packages_with_one_name_are_both_refused(outside, tmp_path, monkeypatch):
    code = "from designs import Sobol\n\n\nclass Mine(Sobol):\n    'Mine.'\n\n    name = 'mine'\n"
    (tmp_path / "first_mine.py").write_text(code)
    (tmp_path / "second_mine.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    outside(("mine", "first_mine:Mine", "first"), ("mine", "second_mine:Mine", "second"))
    assert [
        p.status.count("first") + p.status.count("second") for p in plugins.listing("design") if p.name == "mine"
    ] == [2, 2]
    assert "mine" not in plugins.names("design")
    with pytest.raises(InputError, match="both declare it"):
        plugins.get("design", "mine")


def test_the_same_distribution_found_twice_is_one_plugin(outside, tmp_path, monkeypatch):
    (tmp_path / "once_mine.py").write_text("from designs import Sobol\n\n\nclass Mine(Sobol):\n    name = 'mine'\n")
    monkeypatch.syspath_prepend(tmp_path)
    outside(("mine", "once_mine:Mine", "once"), ("mine", "once_mine:Mine", "once"))
    assert plugins.names("design").count("mine") == 1


def test_a_folder_that_shadows_ours_is_named(tmp_path):
    (tmp_path / "designs").mkdir()
    (tmp_path / "designs" / "__init__.py").write_text("")
    code = "from taichidem import plugins\nplugins.listing('design')"
    run = python(["-c", code], [tmp_path, ROOT], cwd=tmp_path)
    assert run.returncode != 0
    assert "shadows it" in run.stderr
    assert str(tmp_path / "designs") in run.stderr


def python(arguments, path, **settings):
    """Run Python with the given folders first on the path."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(str(p) for p in path), "PYTHONIOENCODING": "utf-8"}
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, capture_output=True, text=True, encoding="utf-8", env=environment, check=False, **settings
    )


def files_of_the_page(page=PAGE):
    """Return the files that the documentation shows, by path: a heading with the path, then a code block."""
    blocks = re.findall(
        r"^## `([^`]+)`\n.*?^```\w+\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    return dict(blocks)


def wheel(folder, files):
    """Write a wheel by hand, so that the test needs neither network nor build tools; return its path."""
    project = parse_toml(files["pyproject.toml"])["project"]
    stem = f"{project['name'].replace('-', '_')}-{project['version']}"
    points = "".join(
        f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in entries.items())
        for group, entries in project["entry-points"].items()
    )
    content = {name: text for name, text in files.items() if name.endswith(".py")}
    content[f"{stem}.dist-info/METADATA"] = (
        f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    )
    content[f"{stem}.dist-info/WHEEL"] = (
        "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n"
    )
    content[f"{stem}.dist-info/entry_points.txt"] = points
    record = f"{stem}.dist-info/RECORD"
    lines = [f"{name},sha256={_hash(text)},{len(text.encode())}" for name, text in content.items()]
    content[record] = "\n".join([*lines, f"{record},,"]) + "\n"
    path = folder / f"{stem}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in content.items():
            archive.writestr(name, text)
    return path


def _hash(text):
    return base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder with the documentation's package and a broken one, installed by pip."""
    folder = tmp_path_factory.mktemp("outside")
    good = files_of_the_page()
    broken = {
        "pyproject.toml": '[project]\nname = "broken-designs"\nversion = "1"\n'
        '[project.entry-points."taichidem.designs"]\nbroken = "broken_designs:Broken"\n',
        "broken_designs/__init__.py": "import a_library_that_is_not_installed\n",
    }
    good["granule_designs/__init__.py"] = ""
    wheels = [str(wheel(folder, files)) for files in (good, broken)]
    target = folder / "site"
    pip = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--disable-pip-version-check"]
    run = python([*pip, "--target", str(target), *wheels], [])
    assert run.returncode == 0, run.stderr
    return target


COMMAND = "import typer\nfrom taichidem.cli.designs import register\napp = typer.Typer()\nregister(app)\napp()"


def test_outside_package_through_the_api(site):
    code = """
from designs import Factor, FactorSpace
from designs.conformance import check_generator
from taichidem import plugins

design = plugins.get("design", "one_at_a_time")
check_generator(design)
table = design(centre_points=2).generate(FactorSpace([Factor("a", 0, 2), Factor("b", 5, 7)])).table
table["y"] = table["a"] + 0.1 * table["b"]
report = plugins.get("analyser", "rank_correlation")().analyse(table, responses=["y"])
print(len(table), report.tables["rank_correlation"]["Factor"].iloc[0])
for plugin in plugins.listing("design") + plugins.listing("analyser"):
    if plugin.source != "taichidem":
        print(plugin.kind, plugin.name, plugin.source, plugin.summary[:18], plugin.status[:30], sep="|")
"""
    run = python(["-c", code], [ROOT, site])
    assert run.returncode == 0, run.stderr
    lines = run.stdout.splitlines()
    assert lines[0] == "6 a"
    assert "design|one_at_a_time|granule-designs|One factor at a ti|ok" in lines
    assert "analyser|rank_correlation|granule-designs|Spearman's rank co|ok" in lines
    assert any(line.startswith("design|broken|broken-designs||broken_designs:Broken can't be") for line in lines)


def test_outside_package_through_the_command_line(site, tmp_path):
    (tmp_path / "factors.toml").write_text("[factors.a]\nlow = 0\nhigh = 2\n[factors.b]\nlow = 5\nhigh = 7\n")
    arguments = ["design", "one_at_a_time", "--factors", "factors.toml", "--set", "centre_points=2", "-o", "runs.csv"]
    run = python(["-c", COMMAND, *arguments], [ROOT, site], cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert "Note: design 'broken' of broken-designs is not available" in run.stderr
    table = pd.read_csv(tmp_path / "runs.csv")
    assert len(table) == 6
    table.assign(y=table["a"] - 3 * table["b"]).to_csv(tmp_path / "results.csv", index=False)
    run = python(
        ["-c", COMMAND, "analyse", "rank_correlation", "results.csv", "-r", "y", "-o", "out"],
        [ROOT, site],
        cwd=tmp_path,
    )
    assert run.returncode == 0, run.stderr
    assert "y follows b most closely" in run.stdout
    assert (tmp_path / "out" / "rank_correlation.csv").exists()
