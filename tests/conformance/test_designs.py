"""Every registered design passes the one conformance suite."""

from __future__ import annotations

import pytest

from designs import BUILT_IN
from designs.conformance import check_generator


@pytest.mark.parametrize("name", sorted(BUILT_IN))
def test_built_in_design_conforms(name):
    assert BUILT_IN[name].name == name
    check_generator(BUILT_IN[name])
