"""What each experiment measures in end states and records of known geometry, and what it says where it can't."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.errors import AnalysisError
from taichidem.errors import InputError
from taichidem.experiments import BulkDensity, HopperDischarge, Ledge, RotatingDrum
from taichidem.experiments.surface_line import surface_line
from tests.experiments.planted import snapshot

# --- the surface line


def test_a_line_goes_through_the_highest_centre_of_each_bin_at_its_middle():
    along = np.array([0.1, 0.9, 1.5, 2.5, 2.6, 3.5, -0.1, 4.0])
    height = np.array([5.0, 3.0, 4.0, 3.0, -9.0, 2.0, 99.0, 99.0])  # the last two lie outside
    line = surface_line(along, height, (0.0, 4.0), 1.0)
    assert line.slope == pytest.approx(-1.0)
    assert line.height(0.5) == pytest.approx(5.0)
    assert line.points == 4


def test_a_bin_without_grain_is_left_out_and_two_are_too_few():
    line = surface_line(np.array([0.5, 2.5, 3.5]), np.array([0.0, 4.0, 6.0]), (0.0, 4.0), 1.0)
    assert (line.slope, line.points) == (pytest.approx(2.0), 3)
    with pytest.raises(InputError, match="Only 2 of 4 bins between 0 and 4 m hold a grain; a slope needs 3"):
        surface_line(np.array([0.5, 2.5]), np.zeros(2), (0.0, 4.0), 1.0)


def test_the_last_bin_is_the_last_with_its_middle_within_the_limits():
    along, height = np.array([0.5, 1.5, 2.5, 3.2, 3.9]), np.array([1.0, 1.0, 1.0, 0.5, 50.0])
    assert surface_line(along, height, (0.0, 3.4), 1.0).slope == pytest.approx(0.0)
    cut = surface_line(along, height, (0.0, 3.6), 1.0)  # the grain at 3.9 lies beyond
    assert (cut.points, cut.slope) == (4, pytest.approx(np.polyfit([0.5, 1.5, 2.5, 3.5], [1, 1, 1, 0.5], 1)[0]))


# --- ledge

D = 0.006


def slope_of_grains(slopes, *, length=0.12, width=0.036):
    """Return a layer of grains on each strip, falling towards the edge with the strip's slope; grains underneath."""
    x = np.arange(D / 2, length, D)
    layers = []
    for k, slope in enumerate(slopes):
        y = (k + 0.5) * 1.5 * D
        top = np.column_stack([x, np.full(len(x), y), 0.01 + slope * (length - x)])
        layers += [top, top - [0, 0, 0.004]]
    return np.concatenate(layers)


def test_the_ledge_takes_the_mean_slope_of_four_strips():
    slopes = [0.2, 0.3, 0.4, 0.7]
    observables, details = Ledge().measure(snapshot(slope_of_grains(slopes)), {})
    assert observables["angle_of_repose"] == pytest.approx(math.degrees(math.atan(0.4)))
    assert details["strip_angles_deg"] == pytest.approx(np.degrees(np.arctan(slopes)))


def test_the_ledge_looks_neither_near_its_ends_nor_below_its_floor():
    grains = slope_of_grains([0.3] * 4)
    odd = [[x, y, 0.3] for x in (0.01, 0.023, 0.1085, 0.119, 0.13) for y in (0.004, 0.013, 0.022, 0.031)]
    fallen = [[0.06, 0.02, -0.01]]
    observables, details = Ledge().measure(snapshot(np.concatenate([grains, odd, fallen])), {})
    assert observables["angle_of_repose"] == pytest.approx(math.degrees(math.atan(0.3)))
    assert details["grains_in_box"] == len(grains) + len(odd)


def test_an_emptied_ledge_is_no_number():
    with pytest.raises(InputError, match="Only 0 of 14 bins"):
        Ledge().measure(snapshot(slope_of_grains([0.3] * 3)), {})


def test_strips_lie_in_the_middle_of_a_box_they_do_not_fill():
    grains = slope_of_grains([0.5, 0.5])
    wide = Ledge(width=2 * 1.5 * D + 0.006)
    shifted = grains + [0, 0.003, 0]
    aside = np.array([[x, y, 0.4 - x] for x in (0.03, 0.05, 0.07) for y in (0.002, 0.0229)])
    observables, details = wide.measure(snapshot(np.concatenate([shifted, aside])), {})
    assert observables["angle_of_repose"] == pytest.approx(math.degrees(math.atan(0.5)))
    assert len(details["strip_angles_deg"]) == 2


# --- bulk density


def test_bulk_density_counts_spheres_that_cross_the_plane_by_their_linear_share():
    radius, top = 0.003, 0.048
    inside = [[0.0, 0.0, z] for z in (0.003, 0.02, 0.045)]
    crossing = [[0.01, 0.0, top], [0.01, 0.01, top + 0.0015], [0.0, 0.01, top - 0.0015]]
    lid = [[x, y, 0.06] for x in np.arange(-0.03, 0.03, 0.006) for y in np.arange(-0.03, 0.03, 0.006)]
    observables, details = BulkDensity().measure(snapshot(inside + crossing + lid, radius, mass=0.2), {})
    mass = 0.2 * (3 + 0.5 + 0.25 + 0.75)
    assert details["mass_kg"] == pytest.approx(mass)
    assert observables["bulk_density"] == pytest.approx(mass / (math.pi * 0.036**2 * 0.048))


def test_a_cup_that_is_not_full_has_no_density():
    grains = [[x, y, 0.03] for x in np.arange(-0.03, 0.03, 0.006) for y in np.arange(-0.03, 0.03, 0.006)]
    with pytest.raises(InputError, match=r"The cup isn't full: .* cover 0 % .* Give more particles"):
        BulkDensity().measure(snapshot(grains), {})


# --- hopper


def emptying(rate, *, mass=0.1, until=2.0, stops_at=0.0):
    """Return a record of a hopper that empties evenly [kg/s] down to a mass [kg], sampled every 0.01 s."""
    time = 0.9 + 0.01 * np.arange(round(until / 0.01) + 1)
    left = np.maximum(mass - rate * (time - 0.9), stops_at)
    return {"time": time.tolist(), "mass": left.tolist(), "count": np.round(left / 1e-4).astype(int).tolist()}


def test_the_hopper_rate_is_the_slope_between_85_and_25_percent():
    record = emptying(0.150)
    # Outside the window the mass does as it likes.
    record["mass"] = [m if 0.025 <= m <= 0.085 else (0.086 if m > 0.05 else 0.024) for m in record["mass"]]
    record["mass"][0] = 0.1
    observables, details = HopperDischarge().measure(None, record)
    assert observables["mass_flow_rate"] == pytest.approx(150.0)
    assert "note" not in details
    assert details["time_s"][0] == 0


def test_a_hopper_that_stops_half_way_gives_the_mean_up_to_the_end_and_says_so():
    observables, details = HopperDischarge().measure(None, emptying(0.150, stops_at=0.05))
    assert 0 < observables["mass_flow_rate"] < 75
    assert details["note"].startswith("50 % of the mass is still in the hopper after 2 s")


def test_a_blocked_hopper_has_no_flow():
    observables, details = HopperDischarge().measure(None, emptying(0.150, stops_at=0.09))
    assert observables["mass_flow_rate"] == 0.0
    assert "90 % of the mass" in details["note"]


def test_a_hopper_too_slow_or_too_quick_to_be_sampled_is_no_number():
    with pytest.raises(InputError, match=r"Only 0 samples, 0\.01 s apart.* 86 % remained.*longer flow_time"):
        HopperDischarge().measure(None, emptying(0.007))
    with pytest.raises(InputError, match=r"Only 3 samples.* 0 % remained.*more particles to a quick one"):
        HopperDischarge().measure(None, emptying(2.0))


# --- drum


def drum_frame(angle_deg, *, bed=0.05):
    """Return x and z of a bed of grains whose surface slopes by an angle, in a drum of radius 72 mm."""
    along, depth = np.meshgrid(np.arange(-0.06, 0.0601, 0.003), np.arange(0, bed, 0.004))
    turn = math.radians(angle_deg)
    u, v = along.ravel(), -0.01 - depth.ravel()
    return np.column_stack([u * math.cos(turn) - v * math.sin(turn), u * math.sin(turn) + v * math.cos(turn)])


@pytest.mark.parametrize("angle", [-35.0, -10.0, 0.0, 22.0, 45.0])
def test_the_drum_finds_the_angle_of_a_flat_surface(angle):
    observables, details = RotatingDrum().measure(None, {"frame": [drum_frame(angle)]})
    assert observables["dynamic_angle_of_repose"] == pytest.approx(abs(angle), abs=0.05)
    assert details["frame_angles_deg"] == pytest.approx([angle], abs=0.05)


def test_the_drum_averages_the_size_of_the_angle_over_its_frames():
    frames = [drum_frame(angle) for angle in (20.0, -30.0, 34.0)]
    observables, _ = RotatingDrum().measure(None, {"frame": frames})
    assert observables["dynamic_angle_of_repose"] == pytest.approx(28.0, abs=0.05)


def curved_frame(bend):
    """Return x and z of a bed in S shape, whose surface falls short of 35° by more the farther from the middle."""
    along, depth = np.meshgrid(np.arange(-0.066, 0.0661, 0.002), np.arange(0, 0.04, 0.004))
    turn = math.radians(35)
    u, v = along.ravel(), (-0.01 - bend * along * abs(along) - depth).ravel()
    return np.column_stack([u * math.cos(turn) - v * math.sin(turn), u * math.sin(turn) + v * math.cos(turn)])


def angle_by_the_protocol(frame, passes):
    """Return the angle [deg] after so many passes, step by step as the protocol words it, for a drum of 72 mm."""
    angle = 0.0
    for _ in range(passes):
        x = [a * math.cos(angle) + b * math.sin(angle) for a, b in frame]
        z = [b * math.cos(angle) - a * math.sin(angle) for a, b in frame]
        tops = {}
        for along, height in zip(x, z, strict=True):
            if -0.036 <= along < 0.036:
                k = math.floor((along + 0.036) / D)
                tops[k] = max(tops.get(k, height), height)
        middles = [-0.036 + (k + 0.5) * D for k in tops]
        angle += math.atan(np.polyfit(middles, list(tops.values()), 1)[0])
    return math.degrees(angle)


def test_the_drum_takes_three_passes():
    frame = curved_frame(6.0)
    two, three, four = (angle_by_the_protocol(frame, passes) for passes in (2, 3, 4))
    assert abs(two - three) > 0.1
    assert abs(four - three) > 0.1
    observables, _ = RotatingDrum().measure(None, {"frame": [frame]})
    assert observables["dynamic_angle_of_repose"] == pytest.approx(three, abs=1e-6)


def test_grains_far_from_the_middle_of_the_drum_do_not_count():
    frame = np.concatenate([drum_frame(0.0), [[0.037, 0.06], [-0.0365, 0.06]]])
    observables, _ = RotatingDrum().measure(None, {"frame": [frame]})
    assert observables["dynamic_angle_of_repose"] == pytest.approx(0.0, abs=0.05)


def test_a_nearly_empty_drum_is_no_number():
    with pytest.raises((InputError, AnalysisError), match="bins"):
        RotatingDrum().measure(None, {"frame": [np.array([[0.0, -0.07], [0.01, -0.069]])]})
