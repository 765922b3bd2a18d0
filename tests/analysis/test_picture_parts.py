"""The single steps from a picture to a silhouette, each on what only it can get right."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.heap_silhouette import trace_silhouette
from analysis.picture_binary import binarise
from analysis.repose_image import measure_repose_image

SIZE = (400, 640)


def filled(*corners: tuple[int, int]) -> np.ndarray:
    """Return a mask with one polygon in it."""
    return cv2.fillPoly(np.zeros(SIZE, np.uint8), [np.array(corners)], 1)


def as_picture(mask: np.ndarray) -> np.ndarray:
    return np.where(mask > 0, 60, 210).astype(np.uint8)


def in_colour(grey: np.ndarray) -> np.ndarray:
    return np.dstack([grey] * 3)


def test_a_dark_rim_as_of_an_old_lens_is_background(drawn):
    grey = drawn(30.0, half_width=200.0).astype(float)
    down, across = np.mgrid[-1 : 1 : grey.shape[0] * 1j, -1 : 1 : grey.shape[1] * 1j]
    picture = (grey * (1.0 - 0.32 * (across**2 + down**2))).astype(np.uint8)
    # The corners are darker than the heap is in the middle: no single threshold parts them.
    assert picture[5, 5] < picture[330, 400] + 25
    assert measure_repose_image(picture).angle_deg == pytest.approx(30.0, abs=0.3)


def test_pepper_and_salt_leave_no_specks():
    heap = filled((120, 320), (320, 180), (520, 320))
    rng = np.random.default_rng(0)
    grey = as_picture(heap)
    struck = rng.random(SIZE)
    grey[struck < 0.12] = 0
    grey[struck > 0.88] = 255
    mask = binarise(in_colour(grey), 5, "peppered").mask()
    wrong = mask != heap
    edge = cv2.dilate(heap, np.ones((9, 9), np.uint8)) != cv2.erode(heap, np.ones((9, 9), np.uint8))
    assert not np.any(wrong & ~edge)


def test_a_hair_on_the_flank_is_taken_off():
    heap = filled((120, 320), (320, 180), (520, 320))
    grey = as_picture(heap)
    clean = measure_repose_image(grey).angle_deg
    cv2.line(grey, (420, 260), (470, 150), 60, 4)
    mask = binarise(in_colour(grey), 7, "hairy").mask()
    assert mask[:200, 440:].sum() == 0
    assert clean == pytest.approx(np.degrees(np.arctan(0.7)), abs=0.15)


def test_a_dark_gap_between_grains_doesnt_split_the_heap():
    grey = as_picture(filled((120, 320), (320, 180), (520, 320)))
    grey[:, 318:322] = 210
    assert measure_repose_image(grey).angle_deg == pytest.approx(np.degrees(np.arctan(0.7)), abs=0.3)


def test_a_faint_soft_edge_raises_the_threshold_component(drawn):
    sharp = measure_repose_image(drawn(30.0))
    down, across = np.mgrid[0:560, 0:800]
    height = 0.58 * (280.0 - np.abs(across - 400.0))
    # A haze over the flanks, thicker outwards: where the edge lies depends on the threshold.
    softness = 2.0 + 0.12 * np.abs(across - 400.0)
    share = 1.0 / (1.0 + np.exp((448.0 - height - down) / softness * 1.0)) * (down < 448)
    hazy = measure_repose_image((210.0 - 150.0 * share).astype(np.uint8))
    assert hazy.components["threshold"] > 0.2 > 10 * sharp.components["threshold"]


def test_a_full_mask_is_no_heap():
    with pytest.raises(AnalysisError, match="fills the whole frame"):
        trace_silhouette(np.ones(SIZE, np.uint8), None, "full")


def test_an_empty_mask_is_no_heap():
    with pytest.raises(AnalysisError, match="larger than specks"):
        trace_silhouette(np.zeros(SIZE, np.uint8), None, "empty")


def test_a_comb_is_ragged():
    mask = filled((100, 330), (540, 330), (540, 322), (100, 322))
    for column in range(100, 540, 44):
        mask[330 - 12 - int(0.5 * (220 - abs(column + 9 - 320))) : 330, column : column + 18] = 1
    with pytest.raises(AnalysisError, match="ragged"):
        trace_silhouette(mask, None, "comb")


def test_a_skyline_has_no_straight_flanks():
    mask = np.zeros(SIZE, np.uint8)
    for number, column in enumerate(range(80, 560, 40)):
        tall = 190 - 0.4 * abs(column + 20 - 320) + (50 if min(number, 11 - number) % 2 == 0 else -50)
        mask[340 - int(tall) : 340, column : column + 40] = 1
    with pytest.raises(AnalysisError, match="no straight lines"):
        measure_repose_image(as_picture(mask))


def test_flanks_that_differ_much_are_refused():
    with pytest.raises(AnalysisError, match=r"differ by more than 20"):
        measure_repose_image(as_picture(filled((120, 330), (220, 160), (520, 330))))


def test_a_flat_heap_cut_by_the_side_is_refused():
    mask = filled((0, 399), (639, 399), (639, 318), (470, 298), (120, 340), (0, 340))
    with pytest.raises(AnalysisError, match="cut by the sides"):
        measure_repose_image(as_picture(mask))


def test_the_silhouette_is_given_in_pixels_of_the_picture():
    silhouette = trace_silhouette(filled((120, 320), (320, 180), (520, 320)), None, "wedge")
    assert silhouette.left == pytest.approx(120, abs=4)
    assert silhouette.right == pytest.approx(520, abs=4)
    assert silhouette.middle == pytest.approx(320, abs=1)
    summit = int(np.argmax(silhouette.height))
    assert silhouette.pixel(silhouette.across[summit], silhouette.height[summit]) == pytest.approx((320, 180), abs=1.5)
