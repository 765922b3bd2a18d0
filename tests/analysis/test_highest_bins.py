"""The rule by which bins lie in a window, and which point each takes."""

import numpy as np
import pytest

from analysis.highest_bins import highest_in_bins


def test_each_bin_of_each_part_takes_its_highest_point():
    along = np.array([1.0, 1.9, 2.5, 1.5, 2.9, 0.9, 3.0])
    height = np.array([5.0, 7.0, 4.0, -3.0, 2.0, 99.0, 99.0])  # the last two lie outside
    part = np.array([0, 0, 0, 1, 1, 1, 1])
    middles, highest = highest_in_bins(along, height, (1.0, 3.0), 1.0, part, 3)
    assert middles.tolist() == [1.5, 2.5]
    assert np.array_equal(highest, [[7.0, -3.0, np.nan], [4.0, 2.0, np.nan]], equal_nan=True)
    assert highest_in_bins(along, height, (1.0, 3.0), 1.0)[1].tolist() == [[7.0], [4.0]]


@pytest.mark.parametrize(("high", "bins"), [(3.4, 3), (3.5, 4), (3.6, 4), (0.4, 0), (-2.0, 0), (0.1 * 3 * 10, 3)])
def test_bins_are_as_many_as_have_their_middle_in_the_window(high, bins):
    assert len(highest_in_bins(np.array([0.5]), np.array([1.0]), (0.0, high), 1.0)[0]) == bins


def test_the_upper_limit_cuts_the_last_bin_short():
    _, highest = highest_in_bins(np.array([0.5, 1.55, 1.65]), np.array([1.0, 2.0, 3.0]), (0.0, 1.6), 1.0)
    assert highest.ravel().tolist() == [1.0, 2.0]
