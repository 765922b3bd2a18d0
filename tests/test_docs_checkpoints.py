"""What docs/checkpoints.md shows works."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from taichidem.experiments import BUILT_IN
from tests.experiments.planted import SMALL, granules

PAGE = (Path(__file__).parents[1] / "docs" / "checkpoints.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", PAGE, flags=re.S)


@pytest.mark.parametrize("block", PYTHON, ids=range(len(PYTHON)))
def test_python_blocks_run(block, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "checkpoints.md", "exec"), {})
    assert capsys.readouterr().out.strip()


def test_the_file_of_a_test_stays_until_it_is_deleted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before, deleted, after = PYTHON[0].partition("file.unlink()")
    names = {}
    exec(compile(before, "checkpoints.md", "exec"), names)
    assert names["file"].exists()
    exec(compile(deleted + after, "checkpoints.md", "exec"), names)
    assert not names["file"].exists()


def test_the_size_it_names(tmp_path, monkeypatch):
    from taichidem.checkpoints.keeper import Keeper

    sizes = []
    write = Keeper._write
    monkeypatch.setattr(
        Keeper, "_write", lambda self, course: (write(self, course), sizes.append(self.path.stat().st_size))
    )
    settings = SMALL["lifting_cylinder"] | {"rest_time": 0.05}
    BUILT_IN["lifting_cylinder"](**settings).run(granules(), [1], checkpoint=tmp_path / "state", checkpoint_every=0)
    told = float(re.search(r"some ([\d.]+) kB a grain", PAGE).group(1))
    assert max(sizes) / settings["particles"] / 1000 == pytest.approx(told, rel=0.6)
