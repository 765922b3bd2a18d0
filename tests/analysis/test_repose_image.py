"""Angle of repose from pictures: drawn heaps of known angle, and pictures with no heap in them."""

from __future__ import annotations

import json

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from analysis.errors import AnalysisError
from analysis.repose_image import measure_repose_image
from analysis.repose_image_settings import ImageSettings

CLEAN = 0.15


@pytest.mark.parametrize("angle", [10, 20, 30, 40, 50])
@pytest.mark.parametrize("dark", [True, False])
def test_a_clean_wedge_gives_its_angle(drawn, angle, dark):
    report = measure_repose_image(drawn(angle, dark=dark))
    assert report.angle_deg == pytest.approx(angle, abs=CLEAN)
    assert report.left_deg == pytest.approx(angle, abs=CLEAN)
    assert report.right_deg == pytest.approx(angle, abs=CLEAN)
    assert report.standard_uncertainty_deg < CLEAN


@pytest.mark.parametrize(
    "fault",
    [
        {"noise": 25.0},
        {"blur": 4.0},
        {"light": 110.0},
        {"light": -110.0, "dark": False},
        {"light": 90.0, "noise": 20.0, "blur": 2.0, "dark": False},
        {"cup": 90.0},
        {"ground": True},
        {"ground": True, "light": 80.0, "noise": 15.0, "dark": False},
    ],
    ids=str,
)
@pytest.mark.parametrize("angle", [16, 30, 44])
def test_faults_of_the_photograph_leave_the_angle(drawn, angle, fault):
    report = measure_repose_image(drawn(angle, **{"half_width": 220.0, **fault}))
    assert report.angle_deg == pytest.approx(angle, abs=0.3)
    assert report.left_deg == pytest.approx(report.right_deg, abs=0.6)


@pytest.mark.parametrize("tilt", [-9.0, -3.0, 3.0, 9.0])
@pytest.mark.parametrize("stand", [{}, {"cup": 70.0}, {"ground": True}], ids=["floor", "cup", "ground"])
def test_a_tilted_camera_is_found_and_undone(drawn, tilt, stand):
    report = measure_repose_image(drawn(28.0, tilt=tilt, noise=8.0, half_width=230.0, **stand))
    (view,) = report.views
    assert view.silhouette.tilt_deg == pytest.approx(tilt, abs=0.25)
    assert report.left_deg == pytest.approx(28.0, abs=0.4)
    assert report.right_deg == pytest.approx(28.0, abs=0.4)


def test_a_given_tilt_is_used_and_parts_the_flanks_where_it_is_wrong(drawn):
    picture = drawn(28.0, tilt=5.0, half_width=230.0)
    right = measure_repose_image(picture, ImageSettings(tilt_deg=5.0))
    assert right.left_deg == pytest.approx(28.0, abs=0.3)
    wrong = measure_repose_image(picture, ImageSettings(tilt_deg=0.0))
    assert wrong.left_deg - wrong.right_deg == pytest.approx(10.0, abs=0.6)
    assert wrong.angle_deg == pytest.approx(28.0, abs=0.4)
    assert wrong.components["flanks"] > 10 * right.components["flanks"]


def test_a_base_below_the_frame_is_taken_as_level(drawn):
    report = measure_repose_image(drawn(30.0, cup=60.0)[:440])
    assert report.views[0].silhouette.tilt_source == "taken as level"
    assert report.angle_deg == pytest.approx(30.0, abs=CLEAN)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(
    angle=some.floats(10.0, 50.0),
    tilt=some.floats(-8.0, 8.0),
    light=some.floats(-80.0, 80.0),
    noise=some.floats(0.0, 18.0),
    dark=some.booleans(),
)
def test_any_angle_from_10_to_50_degrees_is_found(drawn, angle, tilt, light, noise, dark):
    picture = drawn(angle, tilt=tilt, light=light, noise=noise, dark=dark, half_width=200.0)
    assert measure_repose_image(picture).angle_deg == pytest.approx(angle, abs=0.6)


@pytest.mark.parametrize("angle", [15.0, 30.0])
def test_the_uncertainty_covers_the_roughness_of_grains(drawn, angle):
    misses = []
    for seed in range(8):
        views = [drawn(angle, grains=14.0, cup=40.0, noise=6.0, seed=10 * seed + view) for view in range(2)]
        report = measure_repose_image(views, ImageSettings(base_width_px=560.0))
        misses.append((report.angle_deg - angle) / report.standard_uncertainty_deg)
    assert 0.3 < np.sqrt(np.mean(np.square(misses))) < 2.0
    assert np.abs(misses).max() < 4.0


def test_more_views_lower_the_flank_uncertainty(drawn):
    views = [drawn(30.0, grains=14.0, cup=40.0, seed=seed) for seed in range(8)]
    one = np.mean([measure_repose_image(view).components["flanks"] for view in views])
    report = measure_repose_image(views)
    assert len(report.views) == 8
    assert report.components["flanks"] < 0.6 * one
    assert report.angle_deg == pytest.approx(np.mean([view.angle_deg for view in report.views]))


def test_views_of_different_angles_raise_the_views_component(drawn):
    report = measure_repose_image([drawn(26.0), drawn(34.0)])
    assert report.angle_deg == pytest.approx(30.0, abs=CLEAN)
    assert report.components["views"] == pytest.approx(4.0, abs=0.2)
    assert report.components["flanks"] < 0.1


def curved(rounding: float = 120.0) -> np.ndarray:
    """Draw a heap whose top is rounded off, y = H − s·√(x² + c²)."""
    x = np.arange(800) - 400.0
    height = 0.6 * (np.hypot(290.0, rounding) - np.hypot(x, rounding))
    down = np.arange(560)[:, None]
    return np.where((down > 450 - height) & (down <= 450), 60, 210).astype(np.uint8)


def test_the_window_decides_on_a_rounded_heap_and_is_in_the_report():
    picture = curved()
    outer = measure_repose_image(picture, ImageSettings(fit_from=0.5, fit_to=0.95))
    inner = measure_repose_image(picture, ImageSettings(fit_from=0.1, fit_to=0.6))
    assert outer.angle_deg - inner.angle_deg > 4.0
    assert (outer.window.fit_from, outer.window.fit_to) == (0.5, 0.95)
    assert outer.as_dict()["fit_to"] == 0.95
    assert "0.50 to 0.95" in outer.text
    others = [
        measure_repose_image(picture, ImageSettings(fit_from=low, fit_to=high)).angle_deg
        for low, high in ((0.4, 0.95), (0.6, 0.95), (0.5, 0.87), (0.6, 0.87))
    ]
    half_range = np.ptp([outer.angle_deg, *others]) / 2.0
    assert outer.components["window"] == pytest.approx(half_range / np.sqrt(3.0), abs=1e-6)
    assert measure_repose_image(curved(1.0)).components["window"] < 0.1 < outer.components["window"]


def test_the_window_is_measured_on_the_known_cup_width():
    picture = curved()
    seen = measure_repose_image(picture, ImageSettings(fit_from=0.4, fit_to=0.8))
    narrower = measure_repose_image(
        picture, ImageSettings(fit_from=0.5, fit_to=1.0, base_width_m=0.1, pixels_per_metre=8 * seen.half_width_px * 2)
    )
    assert narrower.half_width_px == pytest.approx(0.8 * seen.half_width_px)
    assert narrower.angle_deg == pytest.approx(seen.angle_deg, abs=0.05)
    assert narrower.pixels_per_metre == pytest.approx(16 * seen.half_width_px)


def test_the_scale_follows_from_the_known_width_of_the_base(drawn):
    report = measure_repose_image(drawn(30.0, cup=80.0), ImageSettings(base_width_m=0.1))
    assert report.pixels_per_metre == pytest.approx(5600.0, rel=0.01)


def test_a_region_of_interest_leaves_out_what_stands_beside_the_heap(drawn):
    picture = drawn(30.0, half_width=180.0)
    picture[100:460, 20:90] = 70
    with pytest.raises(AnalysisError):
        measure_repose_image(picture[:, :600])
    report = measure_repose_image(picture, ImageSettings(region=(130, 60, 700, 540)))
    assert report.angle_deg == pytest.approx(30.0, abs=CLEAN)
    assert report.views[0].corner == (130, 60)


def test_an_axis_beside_the_middle_shifts_the_windows():
    picture = curved()
    moved = measure_repose_image(picture, ImageSettings(axis_px=400.0 + 40.0))
    level = measure_repose_image(picture)
    assert moved.right_deg > level.right_deg + 0.5
    assert moved.left_deg < level.left_deg - 0.5


@pytest.mark.parametrize("kind", ["uint16", "float", "colour", "alpha", "one channel"])
def test_pictures_of_every_usual_kind_are_read(drawn, kind):
    grey = drawn(30.0)
    picture = {
        "uint16": grey.astype(np.uint16) * 257,
        "float": grey / 255.0,
        "colour": np.dstack([grey] * 3),
        "alpha": np.dstack([grey] * 3 + [np.full_like(grey, 255)]),
        "one channel": grey[:, :, None],
    }[kind]
    assert measure_repose_image(picture).angle_deg == pytest.approx(30.0, abs=CLEAN)


def test_a_heap_of_another_colour_but_the_same_brightness_is_found(drawn):
    share = drawn(30.0)[:, :, None] < 140
    picture = np.where(share, np.array([40, 90, 200]), np.array([140, 100, 129])).astype(np.uint8)
    assert (
        abs(int(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).max()) - cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).min()) < 12
    )
    for order in ("BGR", "RGB"):
        report = measure_repose_image(picture, ImageSettings(channel_order=order))
        assert report.angle_deg == pytest.approx(30.0, abs=CLEAN)


def no_heaps() -> dict[str, np.ndarray]:
    """Return pictures with no heap in them."""
    rng = np.random.default_rng(1)
    rows, columns = 400, 640
    across, down = np.meshgrid(np.arange(columns), np.arange(rows))

    def shape(*corners: tuple[int, int]) -> np.ndarray:
        return cv2.fillPoly(np.full((rows, columns), 215, np.uint8), [np.array(corners)], 40)

    noise = rng.integers(0, 256, (rows, columns)).astype(np.uint8)
    specks = np.full((rows, columns), 215, np.uint8)
    for x, y in rng.uniform([20, 20], [620, 380], (60, 2)):
        cv2.circle(specks, (int(x), int(y)), 10, 40, -1)
    return {
        "blank": np.full((rows, columns), 215, np.uint8),
        "black": np.zeros((rows, columns), np.uint8),
        "gradient": (40 + 170 * across / columns).astype(np.uint8),
        "noise": noise,
        "faint noise": np.clip(rng.normal(128, 12, (rows, columns)), 0, 255).astype(np.uint8),
        "clouds": cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 12), None, 0, 255, cv2.NORM_MINMAX),
        "specks": specks,
        "full frame": shape((2, 2), (637, 2), (637, 399), (2, 399)),
        "box": shape((150, 150), (490, 150), (490, 320), (150, 320)),
        "flat layer": shape((80, 320), (90, 312), (320, 310), (550, 312), (560, 320)),
        "ramp": shape((120, 320), (520, 320), (520, 160)),
        "upside down": shape((120, 160), (520, 160), (320, 320)),
        "disc": cv2.circle(np.full((rows, columns), 215, np.uint8), (320, 200), 120, 40, -1),
        "bare table": np.where(down > 250, 40, 215).astype(np.uint8),
        "checks": np.where((across // 40 + down // 40) % 2, 40, 215).astype(np.uint8),
        "two heaps": shape((80, 320), (200, 160), (320, 312), (440, 160), (560, 320)),
        "cut at the left": shape((0, 320), (400, 320), (160, 120), (0, 256)),
        "cut at both sides": shape((0, 399), (639, 399), (639, 280), (320, 80), (0, 280)),
        "cut at the top": shape((60, 360), (580, 360), (320, -140)),
        "tower": shape((250, 350), (390, 350), (330, 60), (310, 60)),
    }


@pytest.mark.parametrize("name", sorted(no_heaps()))
def test_a_picture_with_no_heap_is_refused(name):
    with pytest.raises(AnalysisError, match="No heap found in picture 1") as caught:
        measure_repose_image(no_heaps()[name])
    message = str(caught.value)
    assert "Show one whole heap" in message or "Photograph the heap" in message


def test_unreadable_files_are_refused_by_name(tmp_path):
    missing = tmp_path / "heap.png"
    with pytest.raises(AnalysisError, match=r"heap\.png.*can't be read"):
        measure_repose_image(missing)
    broken = tmp_path / "broken.png"
    broken.write_bytes(b"\x89PNG\r\n\x1a\nnothing more")
    empty = tmp_path / "empty.jpg"
    empty.write_bytes(b"")
    text = tmp_path / "notes.txt"
    text.write_text("no picture")
    for path in (broken, empty, text):
        with pytest.raises(AnalysisError, match=f"{path.name}.*no picture OpenCV can decode"):
            measure_repose_image(path)
    with pytest.raises(AnalysisError, match="can't be read"):
        measure_repose_image(tmp_path)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"fit_from": 0.8, "fit_to": 0.5}, "Fit window"),
        ({"fit_from": float("nan")}, "Fit window"),
        ({"base_width_m": -1.0}, "base_width_m"),
        ({"pixels_per_metre": float("nan")}, "pixels_per_metre"),
        ({"tilt_deg": 40.0}, "tilt_deg"),
        ({"noise_filter_px": 4}, "noise_filter_px"),
    ],
)
def test_settings_outside_their_bounds_are_refused(given, said):
    with pytest.raises(AnalysisError, match=said):
        ImageSettings(**given)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"region": (0, 0, 10, 10)}, "Region given"),
        ({"region": (0, 0, 5000, 300)}, "Region given"),
        ({"base_width_px": 3000.0}, "3000 pixels wide"),
        ({"channel_order": "HSV"}, "Channel order"),
    ],
)
def test_settings_that_dont_fit_the_picture_are_refused(drawn, given, said):
    with pytest.raises(AnalysisError, match=said):
        measure_repose_image(drawn(30.0), ImageSettings(**given))


@pytest.mark.parametrize(
    "array", [np.zeros((5, 5, 7)), np.zeros((0, 9)), np.full((90, 90), np.nan), np.full((90, 90), -3.0)], ids=str
)
def test_arrays_that_are_no_pictures_are_refused(array):
    with pytest.raises(AnalysisError, match="Picture array given"):
        measure_repose_image(array)


def test_no_picture_or_a_wrong_number_of_names_is_refused(drawn):
    with pytest.raises(AnalysisError, match="none"):
        measure_repose_image([])
    with pytest.raises(AnalysisError, match="2 names given for 1"):
        measure_repose_image(drawn(30.0), names=["a", "b"])


def test_the_report_is_written_and_drawn(drawn, tmp_path):
    path = tmp_path / "heap.png"
    cv2.imwrite(str(path), drawn(30.0, cup=60.0))
    report = measure_repose_image([path, path], names=["front", "side"])
    numbers = json.loads(json.dumps(report.as_dict()))
    assert numbers["angle_deg"] == pytest.approx(30.0, abs=CLEAN)
    assert [view["name"] for view in numbers["views"]] == ["front", "side"]
    saved = report.save_annotated(tmp_path / "annotated.png")
    again = cv2.imread(str(saved))
    assert np.array_equal(again, report.annotated)
    # The flank lines are there, in their colours, where the flanks are.
    blue, green, red = (again[:, :, band].astype(int) for band in range(3))
    assert np.count_nonzero((red > 180) & (green < 110) & (blue < 90)) > 500
    assert np.count_nonzero((blue > 180) & (red < 90)) > 500
    with pytest.raises(AnalysisError, match="can't be written"):
        report.save_annotated(tmp_path / "no" / "folder.png")
    with pytest.raises(AnalysisError, match="can't be written"):
        report.save_annotated(tmp_path / "name.without_format")
