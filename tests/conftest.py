"""Start the runtime once, and let the many small scenes of the tests share a few compiled engines."""

import pytest

from taichidem import runtime
from taichidem.cli import main
from taichidem.state import Sizes

# Rows that nearly every test scene fits into. An engine is compiled per size; rounding all small scenes up to the same
# size leaves one engine per composition of effects, seconds each instead of minutes in total.
COMMON_SIZES = {
    "worlds": 64,
    "bodies": 1024,
    "elements": 1024,
    "slots": 16384,
    "cells": 65536,
    "meshes": 64,
    "mesh_cells": 65536,
    "mesh_facets": 65536,
    "walls": 128,
    "wall_elements": 2048,
    "planes": 128,
    "revolved": 64,
    "facets": 2048,
    "corner_edges": 32768,
    "pair_rows": 256,
}


@pytest.fixture(scope="session", autouse=True)
def _runtime():
    runtime.start()


def share_engines():
    """Round sizes up from here on; return what rounded them before. Processes that a test starts call it themselves."""
    exact = Sizes.rounded

    def rounded(self: Sizes) -> Sizes:
        own = exact(self)
        return Sizes(**{n: max(getattr(own, n), COMMON_SIZES.get(n, 1)) for n in own.__dataclass_fields__})

    Sizes.rounded = rounded
    return exact


@pytest.fixture(scope="session", autouse=True)
def _few_engines():
    """Round sizes up to the common ones (an engine larger than its scene gives the same bits)."""
    exact = share_engines()
    yield
    Sizes.rounded = exact


@pytest.fixture
def command(capsys, monkeypatch):
    """Run the command line here; return exit code, standard output and standard error."""
    monkeypatch.setenv("COLUMNS", "160")

    def run(*arguments):
        try:
            main([str(a) for a in arguments])
            code = 0
        except SystemExit as end:
            code = end.code or 0
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return run
