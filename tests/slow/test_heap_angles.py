"""Heaps at the paper's design points have the slopes that an independent code gives."""

from __future__ import annotations

import pytest

from benchmarks import heap_table


@pytest.mark.slow
def test_heap_angles_agree_with_the_reference():
    if not heap_table.REFERENCE.is_file():
        pytest.skip(f"the reference angles are not here: {heap_table.REFERENCE}")
    points = heap_table.read_points()
    assert len(points) == 6  # five of the design and the optimum
    rows = heap_table.pour_points(points)
    assert heap_table.agrees(rows), heap_table.as_text(rows)
