"""The walls of the house that no linter knows."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import analysis
import designs
import taichidem

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("taichidem", "designs", "analysis")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
MOST_LINES = 300
LONGER: dict[str, int] = {}  # file → lines allowed, with the reason beside it
ALLOCATORS = {"FieldsBuilder", "field", "ndarray", "dense", "pointer", "bitmasked"}


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imports_taichi(tree: ast.Module) -> bool:
    return any(
        (isinstance(node, ast.Import) and any(alias.name.split(".")[0] == "taichi" for alias in node.names))
        or (isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "taichi")
        for node in ast.walk(tree)
    )


def calls(tree: ast.Module) -> list[str]:
    """Return the dotted names that are called, as written."""
    return [ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)]


def test_the_search_finds_our_files():
    names = [name_of(path) for path in FILES]
    assert {"taichidem/runtime.py", "taichidem/arena.py", "designs/base.py", "analysis/base.py"} <= set(names)


def test_only_the_engine_imports_taichi():
    assert {name_of(p).split("/")[0] for p in FILES if imports_taichi(tree_of(p))} == {"taichidem"}


def test_only_runtime_starts_taichi():
    assert [name_of(p) for p in FILES if "ti.init" in calls(tree_of(p))] == ["taichidem/runtime.py"]
    started = [name_of(p) for p in FILES if re.search(r"from taichi import|taichi\.init|ti\.reset\(", p.read_text())]
    assert started == ["taichidem/runtime.py"]  # which gives a runtime back that fell short of what was asked for


def test_only_the_arena_allocates_taichi_memory():
    def allocates(tree: ast.Module) -> bool:
        # What is called last counts: in `ti.types.struct(...).field()` the name before it holds a call of its own.
        named = [call for call in calls(tree) if "." in call and not call.startswith(("np.", "ti.types.ndarray"))]
        return imports_taichi(tree) and any(call.rpartition(".")[2] in ALLOCATORS for call in named)

    assert [name_of(p) for p in FILES if allocates(tree_of(p))] == ["taichidem/arena.py"]


def test_kernel_files_do_not_postpone_annotations():
    """Taichi reads the annotations of kernels as types; postponed ones are texts."""

    def defines_kernels(tree: ast.Module) -> bool:
        functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        return any(ast.unparse(d) in ("ti.func", "ti.kernel") for f in functions for d in f.decorator_list)

    def postpones(tree: ast.Module) -> bool:
        return any(isinstance(node, ast.ImportFrom) and node.module == "__future__" for node in tree.body)

    kernels = [path for path in FILES if defines_kernels(tree_of(path))]
    assert len(kernels) > 10
    assert [name_of(path) for path in kernels if postpones(tree_of(path))] == []


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_files_stay_short(path):
    lines = len(path.read_text(encoding="utf-8").splitlines())
    assert lines <= LONGER.get(name_of(path), MOST_LINES), f"{name_of(path)} has {lines} lines; split it"


def test_the_table_of_long_files_is_up_to_date():
    for name in LONGER:
        assert len((ROOT / name).read_text(encoding="utf-8").splitlines()) > MOST_LINES, f"take {name} off the table"


def test_the_packages_are_ours():
    """`designs` and `analysis` are common names; another folder of that name must not be tested in their place."""
    for package in (taichidem, designs, analysis):
        assert Path(package.__file__).resolve() == ROOT / package.__name__ / "__init__.py"
