"""Experiments that were stopped and taken up again measure the same, to the last bit."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from taichidem import stepper
from taichidem.checkpoints import keeper
from taichidem.checkpoints.course import Course
from taichidem.errors import InputError
from taichidem.experiments import BUILT_IN
from taichidem.experiments.base import Experiment
from taichidem.experiments.together import run_together
from taichidem.grain import Grain
from tests.clump import Row
from tests.experiments.planted import SMALL, granules
from tests.small_heap import SMALL as HEAP

ROOT = Path(__file__).parents[2]
FUNNEL = HEAP | {"particles": 400, "cup_radius": 0.012, "stream_radius": 0.006, "settle_time": 0.1}
FUNNEL |= {"longest_settle_time": 0.2}
SHORT_SHEAR = {"particles": 110, "shear_displacement": "2 mm", "settle_time": 0.15}
SETTINGS = {**SMALL, "fixed_funnel": FUNNEL, "shear_box": SMALL["shear_box"] | SHORT_SHEAR}


class Killed(Exception):  # noqa: N818 - it is no error
    """Stands for the end of a process."""


def plain(outcome):
    """Return what an outcome holds, without reports."""
    details = {k: np.asarray(v) for k, v in outcome.details.items() if isinstance(v, (list, float, int, np.ndarray))}
    return dict(outcome.observables), details, outcome.failure, outcome.seed


def assert_same(found, expected):
    for one, two in zip(found, expected, strict=True):
        (values, details, *rest), (wanted, others, *more) = plain(one), plain(two)
        assert (values, rest) == (wanted, more)
        assert details.keys() == others.keys()
        for name, held in details.items():
            assert np.array_equal(held, others[name]), name
        assert np.array_equal(one.snapshot.position, two.snapshot.position)
        assert len(one.frames) == len(two.frames)
        for a, b in zip(one.frames, two.frames, strict=True):
            assert a.walls.keys() == b.walls.keys()
            assert np.array_equal(a.snapshot.velocity, b.snapshot.velocity)


@pytest.fixture
def killed_at(monkeypatch):
    """Return a function that lets a run seem to die by its first checkpoint after a share of it is done, or never."""

    def go(run, share):
        def between(self, course):
            if course.share >= share:
                self._write(course)
                raise Killed

        with monkeypatch.context() as patched:
            patched.setattr(keeper.Keeper, "_between", between)
            if share > 1:
                return run()
            with pytest.raises(Killed):
                run()
        return None

    return go


@pytest.mark.parametrize(
    ("name", "shares", "steps"),
    [
        ("fixed_funnel", (0.05, 0.3, 0.66), 4_000_000),  # twice in the stream, and while it settles
        ("hopper_discharge", (0.25, 0.7), 20_000),  # launches of some hundred steps: the checkpoint falls into a wait
        ("rotating_drum", (0.2, 0.9), 4_000),
        ("shear_box", (0.3, 0.9), 4_000_000),
        ("lifting_cylinder", (0.5, 0.8), 4_000_000),
        ("rebound", (0.005,), 4_000_000),
        ("ledge", (0.3, 0.7), 20_000),
    ],
)
def test_taken_up_is_never_stopped(name, shares, steps, killed_at, monkeypatch, tmp_path):
    monkeypatch.setattr(stepper, "PARTICLE_STEPS", steps)
    test, file = BUILT_IN[name](**SETTINGS[name]), tmp_path / "state"
    frames = 0.11 if name == "hopper_discharge" else None  # longer than a wait
    expected = test.run(granules(), [1, 2], frames=frames)
    assert not any(outcome.failure for outcome in expected)
    for share in shares:
        killed_at(lambda: test.run(granules(), [1, 2], frames=frames, checkpoint=file), share)
        assert file.exists()
    assert_same(killed_at(lambda: test.run(granules(), [1, 2], frames=frames, checkpoint=file), 2), expected)
    monkeypatch.setattr(stepper.Stepper, "_advance", lambda *_: pytest.fail("it simulated again"))
    assert_same(test.run(granules(), [1, 2], frames=frames, checkpoint=file), expected)


def two_kinds(file=None):
    """Run spheres and clumps, which no engine holds together."""
    test = BUILT_IN["rotating_drum"](**SETTINGS["rotating_drum"] | {"particles": 50})
    models = [granules(), replace(granules(), shape=Row(2))]
    return run_together([test] * 2, models, [1, 2], checkpoint=file)


def test_a_run_of_two_kinds_of_grains_is_taken_up_in_the_second(killed_at, tmp_path):
    expected = two_kinds()
    write = keeper.Keeper._write

    def between(self, course):
        if self.ended and course.share > 0.5:
            write(self, course)
            raise Killed

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(keeper.Keeper, "_between", between)
        with pytest.raises(Killed):
            two_kinds(tmp_path / "state")
    before = (tmp_path / "state").read_bytes()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Course, "take_up", dies_in_the_second)
        with pytest.raises(Killed):
            two_kinds(tmp_path / "state")
    assert (tmp_path / "state").read_bytes() == before
    assert_same(killed_at(lambda: two_kinds(tmp_path / "state"), 2), expected)


def dies_in_the_second(course, state, take_up=Course.take_up):
    """Take a course up, unless it is the one that had not ended."""
    if state["waiting"]:
        raise Killed
    take_up(course, state)


class Forgetful(BUILT_IN["rebound"]):
    """A test that depends on what is not its world's."""

    name = "rebound"
    again = False

    def procedure(self, world, model):
        if self.again:
            world.wall("wall")
        yield 1e-4
        yield 1e-4


def test_a_procedure_that_asks_otherwise_is_told(killed_at, tmp_path):
    test = Forgetful()
    killed_at(lambda: test.run(granules(), [1], checkpoint=tmp_path / "state"), 0)
    test.again = True
    with pytest.raises(InputError, match="it came to 'wait' then, and comes to 'wall wall' now"):
        test.run(granules(), [1], checkpoint=tmp_path / "state")


def shifted(self, drawn, centres=None, velocity=(0.0, 0.0, 0.0), bodies=Grain.bodies):
    """Return the grains elsewhere."""
    return bodies(self, drawn, None if centres is None else centres + 1e-4, velocity)


def test_grains_that_are_put_elsewhere_are_told(killed_at, tmp_path, monkeypatch):
    test = BUILT_IN["ledge"](**SETTINGS["ledge"])
    killed_at(lambda: test.run(granules(), [1], checkpoint=tmp_path / "state"), 0.1)
    monkeypatch.setattr(Grain, "bodies", shifted)
    with pytest.raises(InputError, match="comes to 'insert with other values' now"):
        test.run(granules(), [1], checkpoint=tmp_path / "state")


class HalfFailing(BUILT_IN["rebound"]):
    """A test whose first world gives up early, after it asked something more, and whose second one is stopped by the engine."""

    name = "rebound"

    def scene(self, model):
        return replace(super().scene(model), room=4)

    def procedure(self, world, model):
        yield 1e-4
        if world.number == 0 and world.time > 0:
            raise InputError("no place")
        if world.number == 1:
            ball = world.simulation.scenes[1].bodies
            world.insert(replace(ball, position=ball.position + [[0.004, 0.0, 0.0]]))
        yield from [1e-4] * 6


def test_worlds_that_failed_stay_failed(killed_at, tmp_path):
    expected = HalfFailing().run(granules(), [1, 2, 3], frames=1e-4)
    assert expected[0].failure == "no place"
    assert "overlaps too far" in expected[1].failure
    assert expected[2].failure is None

    def go():
        return HalfFailing().run(granules(), [1, 2, 3], frames=1e-4, checkpoint=tmp_path / "state")

    with pytest.MonkeyPatch.context() as patched:
        looks = []

        def between(self, course):
            looks.append(course.share)
            if len(looks) == 5:
                self._write(course)
                raise Killed

        patched.setattr(keeper.Keeper, "_between", between)
        with pytest.raises(Killed):
            go()
    found = killed_at(go, 2)
    assert [o.failure for o in found] == [o.failure for o in expected]
    assert [len(o.frames) for o in found] == [len(o.frames) for o in expected]


@pytest.mark.parametrize(
    ("changes", "difference"),
    [
        ({"seeds": [1, 3]}, r"list of seeds \(\[1, 2\] there, \[1, 3\] here\)"),
        ({"settings": {"speed": "2 m/s"}}, "settings"),
        ({"frames": 0.1}, r"interval between frames \(None there, 0\.1 here\)"),
        ({"schedule": "particles"}, "schedule"),
        ({"model": granules(restitution=0.5)}, "model"),
    ],
)
def test_a_checkpoint_of_another_run_is_refused_and_left_alone(changes, difference, killed_at, tmp_path):
    file = tmp_path / "state"
    killed_at(lambda: BUILT_IN["rebound"]().run(granules(), [1, 2], checkpoint=file), 0)
    before = file.read_bytes()
    given = {"seeds": [1, 2], "model": granules(), "settings": {}} | changes
    test = BUILT_IN["rebound"](**given.pop("settings"))
    with pytest.raises(InputError, match=f"differs in its {difference}"):
        test.run(given.pop("model"), checkpoint=file, **given)
    assert file.read_bytes() == before


def test_wrong_places_and_intervals_are_told_before_anything_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(Experiment, "outcome", lambda *_: pytest.fail("it ran"))
    test = BUILT_IN["rebound"]()
    with pytest.raises(InputError, match="folder that doesn't exist"):
        test.run(granules(), [1], checkpoint=tmp_path / "nowhere" / "state")
    for seconds in (-1.0, float("nan")):
        with pytest.raises(InputError, match="checkpoint_every is"):
            test.run(granules(), [1], checkpoint=tmp_path / "state", checkpoint_every=seconds)


def test_the_schedule_is_time_on_the_clock(monkeypatch, tmp_path):
    now, written = [0.0], []

    def clock():
        now[0] += 10.0
        return now[0]

    monkeypatch.setattr(keeper, "monotonic", clock)
    monkeypatch.setattr(keeper, "write_checkpoint", lambda *_: written.append(now[0]))
    test = BUILT_IN["rotating_drum"](**SETTINGS["rotating_drum"])
    test.run(granules(), [1], checkpoint=tmp_path / "state", checkpoint_every=45.0)
    gaps = np.diff(written[:-1])  # the last is written at the end, whenever that is
    assert len(gaps) > 2
    assert np.all(gaps == 60.0)  # the first look at or after 45 s, a look every 10 s, and one to write the time down


SCRIPT = """
import json, sys
from taichidem.experiments import BUILT_IN
from tests.conftest import share_engines
from tests.experiments.planted import granules
from tests.experiments.test_checkpoints import FUNNEL
share_engines()
(outcome,) = BUILT_IN["fixed_funnel"](**FUNNEL).run(granules(), [2], checkpoint=sys.argv[1], checkpoint_every=0)
print(json.dumps([outcome.observables["angle_of_repose"], outcome.snapshot.position.tolist()]))
"""


def process(file):
    return subprocess.Popen([sys.executable, "-c", SCRIPT, str(file)], stdout=subprocess.PIPE, cwd=ROOT, text=True)


def test_a_killed_process_is_taken_up_by_another(tmp_path):
    (expected,) = BUILT_IN["fixed_funnel"](**FUNNEL).run(granules(), [2])
    file = tmp_path / "state"
    first = process(file)
    while not file.exists() and first.poll() is None:
        time.sleep(0.02)
    time.sleep(0.3)
    first.send_signal(signal.SIGKILL)
    first.communicate()
    assert first.returncode == -signal.SIGKILL  # it had not ended by itself
    assert {name for name in os.listdir(tmp_path) if not name.endswith(".part")} == {"state"}
    second = process(file)
    out, _ = second.communicate(timeout=120)
    angle, position = json.loads(out.splitlines()[-1])
    assert angle == expected.observables["angle_of_repose"]
    assert np.array_equal(position, expected.snapshot.position)
