"""Runs of one type that differ in a setting share a call of the engine, and each gives what it gives alone."""

from __future__ import annotations

import numpy as np

from taichidem.effects import AirDrag, AirDragLinear, BodyGravity, NormalHertz
from taichidem.experiments import BulkDensity, FreeFall, ShearBox
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.study import Run, RunStore, run_all
from taichidem.study.execution import batches, execute
from tests.study.fakes import Quick

BALL = Material("ball", 500.0, 1e7, 0.3)


def model(*more):
    return Model([BALL], [NormalHertz(restitution=0.5), BodyGravity(), *more])


def fall(height=10.0, speed=0.0, time=(0.5, 1.0)):
    return FreeFall(diameter=0.07, release_height=height, release_speed=speed, time=time)


def test_what_differs_in_a_number_runs_together():
    drag = model(AirDrag())
    runs = [
        Run(fall(10.0), drag, 1),
        Run(fall(11.0, 2.0), drag, 1),
        Run(fall(10.0), model(AirDragLinear(coefficient=0.01)), 1),
        Run(fall(10.0, time=(0.5,)), drag, 1),
        Run(BulkDensity(settle_time=1.0), drag, 1),
        Run(BulkDensity(settle_time=1.1), drag, 1),
        Run(BulkDensity(particles=500), drag, 1),
        Run(ShearBox(), drag, 1),
    ]
    assert [[runs.index(run) for run in batch] for batch in batches(runs, 8)] == [[0, 1], [2], [3], [4, 5], [6], [7]]


def test_a_type_that_runs_in_a_way_of_its_own_is_left_alone():
    runs = [Run(Quick(width=width), model(), 1) for width in (0.03, 0.04, 0.03)]
    assert [[runs.index(run) for run in batch] for batch in batches(runs, 8)] == [[0, 2], [1]]


def test_each_gives_what_it_gives_alone():
    models = [model(AirDrag(fluid_density=density)) for density in (1.0, 2.0, 1.0)]
    tests = [fall(10.0), fall(12.0, 3.0), fall(10.0, -1.0)]
    runs = [Run(test, m, seed) for seed, (test, m) in enumerate(zip(tests, models, strict=True), 1)]
    assert len(list(batches(runs, 8))) == 1
    for row, run in zip(execute(runs), runs, strict=True):
        (alone,) = run.experiment.run(run.model, [run.seed])
        assert row.key == run.key
        assert row.responses == dict(alone.observables)


def test_parts_go_to_the_experiment_they_belong_to(tmp_path):
    """A shear box is several worlds; two of different speed in one batch each get their own back."""
    small = {"particles": 60, "length": 0.03, "width": 0.03, "lower_height": 0.012, "settle_time": 0.02}
    small |= {"consolidation_time": 0.02, "shear_displacement": 0.0004, "normal_stresses": (500.0, 2000.0)}
    tests = [ShearBox(shear_speed=speed, **small) for speed in (0.02, 0.04)]
    soft = Model([Material("ball", 910.0, 5e6, 0.3)], model().effects)
    with RunStore(tmp_path / "runs.sqlite") as store:
        table = run_all([Run(test, soft, 1) for test in tests], store, worlds=8)
    for row, test in zip(table.to_dict("records"), tests, strict=True):
        (alone,) = test.run(soft, [1])
        assert (row["status"] == "failed") == (alone.failure is not None)
        for name, value in alone.observables.items():
            assert np.float64(row[name]) == value
