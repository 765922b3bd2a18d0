"""How kernels are compiled."""

from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from taichidem import runtime
from taichidem.runtime import compiling_by_llvm_alone
from taichidem.stepper import Stepper


def own_optimisation() -> bool:
    return ti.lang.impl.current_cfg().advanced_optimization


def test_taichi_optimises_again_after_what_was_left_to_llvm():
    assert own_optimisation()
    with pytest.raises(KeyError):
        fail_while_compiling_by_llvm_alone()
    assert own_optimisation()


def fail_while_compiling_by_llvm_alone():
    with compiling_by_llvm_alone():
        assert not own_optimisation()
        raise KeyError


@pytest.mark.parametrize(("kind", "own"), [("sphere", True), ("multisphere", True), ("superquadric", False)])
def test_only_the_search_between_superquadrics_is_left_to_llvm(kind, own):
    rows = {"status": np.zeros(1), "target": np.array([5]), "step": np.zeros(1), "bodies": np.ones(1)}
    seen = []

    def advance(worlds, limit):
        seen.append(own_optimisation())
        rows["step"] = rows["target"]

    table = SimpleNamespace(read_all=lambda worlds: dict(rows))
    engine = SimpleNamespace(kind=kind, particles=None, access={"worlds": table}, advance_worlds=advance)
    Stepper(engine).run(1)
    assert seen == [own]


def test_an_empty_variable_counts_as_unset(monkeypatch):
    monkeypatch.setattr(runtime, "_running", None)  # as in a process that has not started Taichi
    monkeypatch.setattr(runtime, "_thread", None)
    monkeypatch.setattr(runtime, "_init", lambda wanted: None)
    for name in ("ARCH", "THREADS", "DEBUG"):
        monkeypatch.setenv(f"TAICHIDEM_{name}", "")
    assert runtime.start() == runtime.Runtime("cpu", runtime.cores(), False)
