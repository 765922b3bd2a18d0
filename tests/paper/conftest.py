"""The paper's flow with planted heaps, and a session of it that draws nothing."""

from __future__ import annotations

import pytest

from analysis.report import Report
from taichidem import plugins
from taichidem.paper import kept_heaps
from taichidem.paper.effort import EFFORTS
from taichidem.paper.session import Session
from taichidem.study import RunStore
from tests.paper import planted_heap
from tests.paper.planted_heap import SMALL


@pytest.fixture(scope="module")
def planted():
    """The flow with planted heaps, a small cup as the only held-out test, and few heaps."""
    with pytest.MonkeyPatch.context() as patch:
        planted_heap.plant(patch)
        patch.setitem(EFFORTS, "quick", SMALL)
        yield
    plugins.refresh()


@pytest.fixture
def bench(planted, tmp_path, monkeypatch):
    """A session in a folder of its own, in which nothing is drawn."""
    monkeypatch.setattr(kept_heaps, "_draw", lambda *_: {})
    monkeypatch.setattr(Report, "save", lambda *_: [])
    with RunStore(tmp_path / "runs.sqlite") as store:
        yield Session(tmp_path, store, SMALL, lambda stage, share: None)
