"""Study folders of filmed drops: they can be read, hold what was filmed, and are as uncertain as dense balls show."""

import numpy as np
import pytest

from benchmarks.ball_drop_studies import (
    HEIGHTS,
    HeightUncertainty,
    autocorrelation,
    height_uncertainty,
    measured,
    speed_at_origin,
    write_studies,
    write_study,
)
from benchmarks.ball_drops import DATA, Ball, Drop
from taichidem.study import read_measurements, read_study

FRAMES = np.arange(0, 2.9, 1 / 15)


def film(scatter=0.0, seed=1):
    """Return a drop from 47 m, let go 0.1 s after the first frame, without any air."""
    noise = scatter * np.random.default_rng(seed).normal(size=len(FRAMES))
    return Drop(FRAMES, 47 - 9.81 / 2 * np.maximum(FRAMES - 0.1, 0.0) ** 2 + noise)


@pytest.fixture
def ball():
    return Ball("made_ball", 0.03, 0.07, (film(), film()))


def test_a_study_holds_what_was_filmed(ball, tmp_path):
    study = read_study(write_study(ball, 0.2, tmp_path / "made"))
    assert study.title == "Made ball, 30 g"
    assert [c.key for c in study.calibrate] == [
        *("drop_1.release_height", "drop_1.release_speed", "drop_2.release_height", "drop_2.release_speed"),
    ]
    assert all(c.is_setting and c.low < study.believed(c.key) < c.high for c in study.calibrate)
    table = read_measurements(study)
    assert len(table) == 2 * HEIGHTS
    assert set(table["u"]) == {0.2}
    assert study.experiment("drop_1").settings.mass == pytest.approx(0.03)
    assert {e.name for e in study.model().effects} == {"normal_hertz", "tangential_mindlin", "body_gravity"}


def test_a_film_without_errors_is_simulated_exactly(ball, tmp_path):
    """The speed at the origin is that of a parabola, whose central slope is exact."""
    study = read_study(write_study(ball, 0.2, tmp_path))
    (outcome,) = study.experiment("drop_1").run(study.model(), [1])
    table = read_measurements(study)
    expected = table[table["experiment"] == "drop_1"]["value"].to_numpy()
    assert list(outcome.observables.values()) == pytest.approx(expected, abs=2e-3)


def test_times_count_from_the_origin_and_go_to_the_end():
    times, heights = measured(film())
    assert (times[0], len(times)) == (0, HEIGHTS)
    assert times[-1] == pytest.approx(FRAMES[-1] - FRAMES[8], abs=1e-5)  # 0.53 s, the first frame after half a second
    assert np.diff(times).min() > 0.15
    assert heights[-1] == film().height[-1]
    assert speed_at_origin(film()) == pytest.approx(9.81 * (FRAMES[8] - 0.1), rel=1e-6)


def test_uncertainty_is_the_scatter_where_errors_are_independent():
    assert HeightUncertainty(0.1, 0.0, 0.0).value == pytest.approx(0.1)
    assert HeightUncertainty(0.1, 0.5, 0.0).value == pytest.approx(0.1 * 3**0.5)
    assert HeightUncertainty(0.3, 0.0, 0.4).value == pytest.approx(0.5)


def test_errors_that_follow_each_other():
    white = np.random.default_rng(1).normal(size=100_000)
    assert autocorrelation(white, 1) == pytest.approx(0, abs=0.01)
    assert autocorrelation(white[1:] + white[:-1], 1) == pytest.approx(0.5, abs=0.01)


def test_dense_balls_tell_the_uncertainty():
    """A scatter of 0.1 m, and a drag that is not there: the film may be wrong by a part of that."""
    dense = Ball("dense", 3.0, 0.2, (film(0.1, 1), film(0.1, 2)))
    u = height_uncertainty([dense])
    assert u.scatter == pytest.approx(0.1, rel=0.2)
    assert u.correlation < 0.3
    assert 0 < u.film < 0.2
    assert u.value > u.scatter


def test_the_filmed_balls(tmp_path):
    if not DATA.is_dir():
        pytest.skip("the ball drops are not at hand (looked in ../shared/lab/ball_drops)")
    folders, u = write_studies(DATA, tmp_path, ["tennis_ball", "bowling_ball"])
    assert 0.15 < u.value < 0.35
    for folder in folders:
        assert len(read_measurements(read_study(folder))) == 2 * HEIGHTS
