"""A heap of spheroids has the same slope whether they are made of spheres or are superquadrics."""

from __future__ import annotations

import pytest

from benchmarks import spheroid_heap


@pytest.mark.slow
def test_clumps_and_superquadrics_of_one_form_make_the_same_heap():
    heaps = spheroid_heap.pour_both()
    poured = spheroid_heap.SETTINGS["particles"]
    for kind in (heaps.clumps, heaps.superquadrics):
        assert len(kind.angles) == len(spheroid_heap.SEEDS)
        assert all(200 < stayed < 0.95 * poured for stayed in kind.in_cup), "the cup must overflow"
    assert abs(heaps.shape_error.volume) < 0.02
    assert heaps.agrees, spheroid_heap.as_text(heaps)
