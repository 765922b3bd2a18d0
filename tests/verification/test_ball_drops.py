"""Real balls in still air: the fit on a fall made independently, and the smallest part of the benchmark on the data."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.ball_drops import DATA, Ball, Drop, Row, as_text, fallen, lay, measure, picture, read_balls
from taichidem.errors import InputError


def independent_fall(ball, times, density=1.204, viscosity=1.825e-5):
    """Return the distance fallen from rest [m], by Brown & Lawler's drag and with buoyancy."""
    radius = ball.diameter / 2
    weight = (ball.mass - density * math.pi / 6 * ball.diameter**3) * 9.81

    def motion(_, state):
        speed = max(state[1], 1e-9)
        reynolds = density * speed * ball.diameter / viscosity
        coefficient = 24 / reynolds * (1 + 0.15 * reynolds**0.681) + 0.407 / (1 + 8710 / reynolds)
        return [state[1], (weight - 0.5 * density * coefficient * math.pi * radius**2 * speed**2) / ball.mass]

    run = solve_ivp(motion, (0, 5.0), [0, 0], dense_output=True, rtol=1e-10, atol=1e-10)
    return run.sol(times)[0]


@pytest.fixture(scope="module")
def filmed():
    """A light ball whose two falls are made independently, one let go before and one after the first frame."""
    ball = Ball("made", 0.03, 0.07, ())
    frames = np.arange(0, 3.5, 1 / 15)
    drops = []
    for release, height in ((-0.123, 46.0), (0.234, 47.5)):
        drops.append(Drop(frames, height - independent_fall(ball, np.maximum(frames - release, 0.0))))
    return Ball("made", 0.03, 0.07, tuple(drops))


@pytest.fixture(scope="module")
def falls(filmed):
    return fallen(filmed, [0.0, 1.0])


def test_simulated_fall_against_an_independent_integration(filmed, falls):
    times = np.linspace(0, 4, 81)
    plain, dragged = falls
    assert plain(times) == pytest.approx(9.81 * times**2 / 2, abs=1e-6)
    # First order in the step: the drag sees half-step velocities.
    assert dragged(times) == pytest.approx(independent_fall(filmed, times), abs=2e-3)
    assert plain(4.0) - dragged(4.0) > 20


def test_a_factor_scales_the_whole_drag():
    """Also where viscosity counts: a grain of 0.1 mm in a fluid twice as dense and as viscous as air."""
    fine, times = Ball("fine", 1e-9, 1e-4, ()), np.linspace(0, 4, 41)
    expected = independent_fall(fine, times, 2 * 1.204, 2 * 1.825e-5)
    assert fallen(fine, [2.0])[0](times) == pytest.approx(expected, abs=1e-3)


def test_release_is_found(filmed, falls):
    """Both models are laid in the same way; the right one finds the release and leaves nothing."""
    plain, dragged = (lay(filmed, distance) for distance in falls)
    assert np.array(dragged.releases) == pytest.approx(np.array([[-0.123, 46.0], [0.234, 47.5]]), abs=2e-3)
    assert dragged.misfit < 1e-3
    assert plain.misfit > 1.0
    mean = [float(np.mean(error)) for error in plain.errors]
    assert mean == pytest.approx([0, 0], abs=1e-9)  # height is fitted on this side as well


def test_table_and_picture(filmed, falls, tmp_path):
    plain, dragged = (lay(filmed, distance) for distance in falls)
    row = Row(filmed, plain, dragged, 6e4, 1.0)
    assert f"{row.ratio:.2f}" in as_text([row])
    picture([row], tmp_path / "errors.png")
    assert (tmp_path / "errors.png").stat().st_size > 2000


def test_missing_data_is_said(tmp_path):
    with pytest.raises(InputError, match="--data"):
        read_balls(tmp_path)


def test_drag_is_what_light_balls_lack():
    """Tennis ball and bowling ball, the least clear of the light ones and the negative control."""
    if not DATA.is_dir():
        pytest.skip("the ball drops are not at hand (looked in ../shared/lab/ball_drops)")
    light, heavy = (measure(ball, (0.7, 1.0, 1.3)) for ball in read_balls(names=["tennis_ball", "bowling_ball"]))
    assert light.without.misfit > 0.8
    assert light.ratio > 3
    assert light.best_factor == 1.0
    assert heavy.best_factor == 0.0
    assert heavy.ratio < 1
