"""Angle of repose from positions: heaps of spheres under a cone of known angle, and bad input."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.height_map import upper_surface
from analysis.plots_repose import plot_profile
from analysis.repose_profile import ProfileSettings, measure_repose_profile

CUP = 0.05


def ideal(angle: float, spacing: float = 0.001, radius: float = 0.003):
    """Return a dense sheet of spheres whose centres lie exactly on a cone."""
    x, y = np.meshgrid(np.arange(-CUP, CUP, spacing), np.arange(-CUP, CUP, spacing))
    distance = np.hypot(x, y)
    z = 0.03 + (CUP - distance) * np.tan(np.radians(angle))
    inside = distance < CUP
    return np.stack([x, y, z], axis=-1)[inside], np.full(np.count_nonzero(inside), radius)


@pytest.mark.parametrize("angle", [10.0, 30.0, 50.0])
@pytest.mark.parametrize("method", ["rings", "sectors"])
def test_a_smooth_cone_gives_its_angle(angle, method):
    report = measure_repose_profile(*ideal(angle), CUP, ProfileSettings(method=method))
    assert report.angle_deg == pytest.approx(angle, abs=0.4)
    assert report.part_scatter_deg < 0.5


@pytest.mark.parametrize("angle", [20.0, 30.0, 38.0])
def test_rings_find_the_angle_of_a_heap_of_grains(heap, angle):
    angles = [measure_repose_profile(*heap(angle, seed), CUP).angle_deg for seed in range(3)]
    assert np.mean(angles) == pytest.approx(angle, abs=1.0)


def test_the_upper_surface_of_one_sphere_is_its_cap():
    surface = upper_surface(np.array([[0.0101, -0.0203, 0.02]]), np.array([0.003]), 0.0005)
    rho = np.hypot(surface.x - 0.0101, surface.y + 0.0203)
    assert rho.max() < 0.003
    assert surface.height == pytest.approx(0.02 + np.sqrt(0.003**2 - rho**2))
    assert surface.x.size == pytest.approx(np.pi * 36, rel=0.1)


def test_the_upper_surface_takes_the_higher_of_two_spheres():
    centres = np.array([[0.0, 0.0, 0.01], [0.001, 0.0, 0.02]])
    both = upper_surface(centres, np.array([0.003, 0.002]), 0.0005)
    at_axis = (both.x == 0.0) & (both.y == 0.0)
    assert both.height[at_axis] == pytest.approx(0.02 + np.sqrt(0.002**2 - 0.001**2))
    far = (both.x == pytest.approx(-0.002)) & (both.y == 0.0)
    assert both.height[far] == pytest.approx(0.01 + np.sqrt(0.003**2 - 0.002**2))


def test_rings_average_the_surface_over_azimuth_by_hand():
    centres, radii = ideal(30.0)
    report = measure_repose_profile(centres, radii, CUP)
    surface = upper_surface(centres, radii, 0.0005)
    ring = (surface.distance >= 0.02) & (surface.distance < 0.022)
    row = report.profile[np.isclose(report.profile["radius_m"], 0.021)]
    assert float(row["height_m"].iloc[0]) == pytest.approx(surface.height[ring].mean())
    window = report.profile[report.profile["radius_m"].between(0.02, 0.046)]
    slope = np.polyfit(window["radius_m"], window["height_m"], 1)[0]
    assert report.angle_deg == pytest.approx(np.degrees(np.arctan(-slope)))
    assert len(window) == 13


def test_sectors_take_the_highest_centre_of_each_bin_by_hand(heap):
    centres, radii = heap(30.0)
    report = measure_repose_profile(centres, radii, CUP, ProfileSettings(method="sectors"))
    distance = np.hypot(centres[:, 0], centres[:, 1])
    azimuth = np.mod(np.arctan2(centres[:, 1], centres[:, 0]), 2 * np.pi)
    slopes = []
    for sector in range(8):
        mine = (azimuth >= sector * np.pi / 4) & (azimuth < (sector + 1) * np.pi / 4)
        points = []
        for low in 0.0075 + 0.006 * np.arange(7):
            here = mine & (distance >= low) & (distance < min(low + 0.006, 0.0475))
            if here.any():
                points.append((low + 0.003, centres[here, 2].max()))
        slopes.append(np.polyfit(*np.array(points).T, 1)[0])
    assert report.angle_deg == pytest.approx(np.degrees(np.arctan(-np.mean(slopes))))
    assert report.part_angles_deg == pytest.approx(np.degrees(np.arctan(-np.array(slopes))))
    assert report.window.fit_from == 0.15
    beyond = np.array([[0.0478, 0.005, 0.2]])  # the seventh bin would hold it, the window doesn't
    more = (np.concatenate([centres, beyond]), np.append(radii, radii[0]))
    assert measure_repose_profile(*more, CUP, ProfileSettings(method="sectors")).angle_deg == report.angle_deg
    assert len(report.profile) == 7  # the seventh has its middle in the window, which ends at 47.5 mm


def test_a_heap_that_leans_shows_in_the_scatter_and_not_in_the_angle():
    centres, radii = ideal(30.0)
    leaning = centres + np.outer(centres[:, 0], [0.0, 0.0, 0.12])
    level, leant = (measure_repose_profile(places, radii, CUP) for places in (centres, leaning))
    assert leant.angle_deg == pytest.approx(level.angle_deg, abs=0.5)
    assert leant.part_scatter_deg > 3.0
    assert leant.components["azimuth"] == pytest.approx(leant.part_scatter_deg / 2.0)


def test_the_window_changes_the_angle_of_a_heap_with_a_flat_top():
    centres, radii = ideal(30.0)
    distance = np.hypot(centres[:, 0], centres[:, 1])
    centres[:, 2] = np.minimum(centres[:, 2], 0.03 + (CUP - 0.02) * np.tan(np.radians(30.0)))
    assert distance.min() < 0.01
    outer = measure_repose_profile(centres, radii, CUP, ProfileSettings(fit_from=0.44, fit_to=0.92))
    whole = measure_repose_profile(centres, radii, CUP, ProfileSettings(fit_from=0.2, fit_to=0.84))
    assert outer.angle_deg == pytest.approx(30.0, abs=0.4)
    assert outer.angle_deg - whole.angle_deg > 3.0
    assert whole.components["window"] > 0.8
    assert "10 to 42 mm" in whole.text


def test_the_order_and_the_azimuth_of_the_grains_dont_matter(heap):
    centres, radii = heap(30.0)
    order = np.random.default_rng(2).permutation(len(radii))
    mirrored = centres[order] * [-1.0, -1.0, 1.0]
    first = measure_repose_profile(centres, radii, CUP)
    second = measure_repose_profile(mirrored, radii[order], CUP)
    assert second.angle_deg == pytest.approx(first.angle_deg, abs=1e-9)
    assert second.part_scatter_deg == pytest.approx(first.part_scatter_deg, abs=1e-6)


def test_grains_that_fell_off_dont_count(heap):
    centres, radii = heap(30.0)
    fallen = np.array([[0.07, 0.0, 0.01], [0.0, 0.02, -0.01], [0.03, 0.03, -0.2]])
    more = measure_repose_profile(np.vstack([centres, fallen]), np.append(radii, [0.003] * 3), CUP)
    assert more.angle_deg == measure_repose_profile(centres, radii, CUP).angle_deg
    assert more.grains == len(radii)


def test_lengths_scale_with_the_grains(heap):
    centres, radii = heap(30.0)
    small = measure_repose_profile(centres / 10, radii / 10, CUP / 10)
    assert small.angle_deg == pytest.approx(measure_repose_profile(centres, radii, CUP).angle_deg, abs=0.2)


def test_2500_grains_take_less_than_a_fifth_of_a_second(heap):
    centres, radii = heap(30.0, rim=0.05)
    centres, radii = np.vstack([centres] * 2)[:2500], np.append(radii, radii)[:2500]
    assert len(radii) == 2500
    best = min(timed(centres, radii) for _ in range(3))
    assert best < 0.2


def timed(centres: np.ndarray, radii: np.ndarray) -> float:
    start = time.perf_counter()
    measure_repose_profile(centres, radii, CUP)
    return time.perf_counter() - start


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda c, r: (c[:, :2], r, CUP), "shape"),
        (lambda c, r: (c, r[:-1], CUP), "radii given"),
        (lambda c, r: (np.where(c > 0.04, np.nan, c), r, CUP), "NaN"),
        (lambda c, r: (c, -r, CUP), "positive"),
        (lambda c, r: (c, r, -CUP), "cup_radius"),
        (lambda c, r: (c * 1000, r, CUP), "grains lie above"),
        (lambda c, r: (c[:20], r[:20], CUP), "Allowed: 50 or more"),
        (lambda c, r: (c, r, CUP / 10), "grains lie above|points of the flank"),
    ],
)
def test_positions_that_cant_be_measured_are_refused(heap, change, said):
    with pytest.raises(AnalysisError, match=said):
        measure_repose_profile(*change(*heap(30.0)))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"method": "ring"}, "Method given"),
        ({"fit_from": 0.9}, "Fit window"),
        ({"sectors": 1}, "sectors"),
        ({"bin_width_m": 0.0}, "bin_width_m"),
        ({"grid_spacing_m": float("nan")}, "grid_spacing_m"),
    ],
)
def test_settings_outside_their_bounds_are_refused(given, said):
    with pytest.raises(AnalysisError, match=said):
        ProfileSettings(**given)


def test_too_few_bins_are_refused(heap):
    with pytest.raises(AnalysisError, match="holds 3 bins"):
        measure_repose_profile(*heap(30.0), CUP, ProfileSettings(method="sectors", bin_width_m=0.015))
    with pytest.raises(AnalysisError, match="points of the flank"):
        measure_repose_profile(*heap(30.0), CUP, ProfileSettings(ring_width_m=0.02))


@pytest.mark.parametrize("method", ["rings", "sectors"])
def test_the_profile_is_plotted(heap, tmp_path, method):
    report = measure_repose_profile(*heap(30.0), CUP, ProfileSettings(method=method))
    path = plot_profile(report, tmp_path / "profile.png", laboratory=(30.18, 0.51))
    assert path.read_bytes().startswith(b"\x89PNG")
    assert path.stat().st_size > 20_000
    with pytest.raises(AnalysisError, match="can't be written"):
        plot_profile(report, tmp_path / "no" / "profile.png")
    json.dumps(report.as_dict())
