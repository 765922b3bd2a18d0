"""Studies of experiments that cost nothing."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest

from taichidem import plugins
from taichidem.study import RunStore, campaign, cluster, read_study
from tests.study import fakes


@pytest.fixture(autouse=True)
def _fakes(monkeypatch):
    fakes.register(monkeypatch.setitem)
    fakes.Quick.batches.clear()
    yield
    monkeypatch.undo()
    plugins.refresh()


@pytest.fixture
def store(tmp_path):
    """An empty run store, open for the test."""
    with RunStore(tmp_path / "runs.sqlite") as opened:
        yield opened


@pytest.fixture
def elsewhere(monkeypatch):
    """Put a thread in the place of a cluster, and let nothing be simulated but there; return the addresses asked for."""
    asked = []

    @contextmanager
    def instead(address, tell=None):
        asked.append(address)
        with ThreadPoolExecutor(1) as thread:
            yield thread

    monkeypatch.setattr(cluster, "cluster_executor", instead)
    monkeypatch.setattr(campaign, "execute", None)
    monkeypatch.setattr(campaign, "threads_of", lambda executor: 1)  # Taichi itself can't be used by that thread
    return asked


@pytest.fixture
def write(tmp_path):
    """Write a study folder from the usual text with replacements; return the folder."""

    def make(*changes, measurements=None, end=""):
        text = fakes.STUDY
        for old, new in changes:
            assert old in text, old
            text = text.replace(old, new)
        (tmp_path / "study.toml").write_text(text + end, encoding="utf-8")
        if measurements is not None:
            (tmp_path / "measurements.csv").write_text(measurements, encoding="utf-8")
        return tmp_path

    return make


@pytest.fixture
def study(write):
    """The usual study, read."""
    return read_study(write(measurements=fakes.MEASUREMENTS))
