"""Frames that are kept on the way, and the pictures and movies made of them."""

import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from taichidem.cli import main
from taichidem.errors import InputError
from taichidem.experiments import BUILT_IN, Outcome
from taichidem.render_experiment import movie, picture
from tests.experiments.planted import SMALL, granules

NAME = "hopper_discharge"


@pytest.fixture(scope="module")
def run():
    experiment = BUILT_IN[NAME](**SMALL[NAME])
    return experiment, experiment.run(granules(), [1, 2], frames=0.033)


def test_looking_changes_no_bit(run):
    experiment, watched = run
    plain = experiment.run(granules(), [1, 2])
    for a, b in zip(watched, plain, strict=True):
        assert a.observables == b.observables
        for name in ("mass_kg", "time_s"):
            assert np.array_equal(a.details[name], b.details[name])
        assert len(b.frames) == 1
    drum = BUILT_IN["rotating_drum"](**SMALL["rotating_drum"])
    looked = drum.run(granules(), [1], frames=0.0123)[0].snapshot
    assert np.array_equal(looked.position, drum.run(granules(), [1])[0].snapshot.position)


def test_frames_come_at_their_times_and_know_which_walls_stand(run):
    for outcome in run[1]:
        times = [f.snapshot.time for f in outcome.frames]
        assert np.allclose(times[:-1], 0.033 * np.arange(len(times) - 1), atol=1e-4)
        assert times[-1] - times[-2] <= 0.034
        standing = [("slide" in f.walls) for f in outcome.frames]
        assert standing == [t <= 0.4 + 1e-4 for t in times]
        assert all({"cone", "bin"} <= set(f.walls) for f in outcome.frames)


def test_a_frame_knows_where_a_moving_wall_is():
    test = BUILT_IN["lifting_cylinder"](**SMALL["lifting_cylinder"])
    frames = test.run(granules(), [1], frames=0.1)[0].frames
    assert frames[0].walls["tube"][2] == 0
    assert frames[-1].walls["tube"][2] > 0.02
    assert np.array_equal(frames[-1].walls["plate"], [0, 0, 0])


def test_picture_and_movie(run, tmp_path):
    experiment, outcomes = run
    image = picture(experiment, granules(), outcomes[0], tmp_path / "still.png", size=(300, 240))
    assert image.shape == (240, 300, 3)
    assert np.asarray(Image.open(tmp_path / "still.png")).shape[:2] == (240, 300)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 200
    other = picture(experiment, granules(), outcomes[0], size=(300, 240), colour_by="identity")
    assert np.abs(other.astype(int) - image).max() > 100
    grains = [frame for frame in outcomes[0].frames if len(frame.snapshot.mass)][::6]
    some = replace(outcomes[0], frames=tuple(grains))
    target = movie(experiment, granules(), some, tmp_path / "run.gif", size=(200, 160))
    played = Image.open(target)
    assert played.size == (200, 160)
    assert played.n_frames == len(grains) >= 3
    shots = []
    for k in (0, played.n_frames - 1):
        played.seek(k)
        shots.append(np.asarray(played.convert("RGB"), float))
    assert np.abs(shots[0] - shots[1]).mean() > 1


def test_what_cannot_be_drawn_is_said(run, tmp_path):
    experiment, outcomes = run
    with pytest.raises(InputError, match=r"ends in \.gif"):
        movie(experiment, granules(), outcomes[0], tmp_path / "run.mp4")
    with pytest.raises(InputError, match="No frame of hopper_discharge with seed 1 holds a grain"):
        picture(experiment, granules(), Outcome({}, 1))
    few = Outcome({}, 1, frames=outcomes[0].frames[:1])
    with pytest.raises(InputError, match="at least two frames"):
        movie(experiment, granules(), few, tmp_path / "run.gif")


def test_the_command_draws(tmp_path):
    shown, played = tmp_path / "fall.png", tmp_path / "fall.gif"
    command = ["simulate", "free_fall", "--set", "time=0.2", "--picture", str(shown), "--movie", str(played), "--json"]
    with pytest.raises(SystemExit, match="0"):
        main(command)
    assert Image.open(shown).size == (900, 720)
    assert Image.open(played).n_frames == 5  # at 0, 0.05, 0.1, 0.15 s and at the end


def test_the_time_between_frames_is_the_experiments_own_or_the_one_asked_for(tmp_path):
    played = tmp_path / "rebound.gif"
    with pytest.raises(SystemExit, match="0"):
        main(["simulate", "rebound", "--movie", str(played), "--json"])
    own = Image.open(played).n_frames
    assert 10 < own < 30
    with pytest.raises(SystemExit, match="0"):
        main(["simulate", "rebound", "--movie", str(played), "--frame-interval", "0.2 ms", "--json"])
    assert 4 <= Image.open(played).n_frames <= own / 3


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--movie", "run.mp4"], r"--movie is '\S*run\.mp4'; it is written as GIF\. Give a name that ends in \.gif\."),
        (
            ["--picture", "run.jpg"],
            r"--picture is '\S*run\.jpg'; it is written as PNG\. Give a name that ends in \.png\.",
        ),
        (["--picture", "nowhere/run.png"], r"--picture nowhere/run\.png: can't be written \(No such file"),
        (["--movie", "nowhere/run.gif"], r"--movie nowhere/run\.gif: can't be written \(No such file"),
        (["--picture", "folder.png"], r"--picture folder\.png: can't be written \(Is a directory\)"),
        (["--frame-interval", "1 ms"], "--frame-interval is of use with --picture or --movie alone"),
        (["--colour-by", "speed"], "--colour-by is of use with --picture or --movie alone"),
        (["--picture", "run.png", "--colour-by", "sped"], "Unknown quantity to colour by 'sped'.*'speed'"),
        (["--movie", "run.gif", "--frame-interval", "0 s"], "--frame-interval is '0 s'; give a time above 0"),
        (["--movie", "run.gif", "--frame-interval", "1 mm"], "--frame-interval is '1 mm'.*converts to s"),
    ],
)
def test_what_cannot_be_written_is_refused_before_anything_runs(options, sentence, tmp_path, monkeypatch, capsys):
    def run(*_, **__):
        raise AssertionError("it ran")

    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.png").mkdir()
    monkeypatch.setattr(BUILT_IN["rebound"], "run", run)
    with pytest.raises(SystemExit, match="2"):
        main(["simulate", "rebound", *options])
    assert re.search(sentence, " ".join(capsys.readouterr().err.split()))
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]
