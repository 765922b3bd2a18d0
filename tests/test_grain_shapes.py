"""The form of the grains, from the model to the bodies that fall in a test."""

from typing import ClassVar

import numpy as np
import pytest

from taichidem.effects import BaseTilt, BodyGravity, ElectrostaticCharge, Elongation, NormalHertz, TangentialMindlin
from taichidem.effects.base import Parameter, SetupEffect
from taichidem.effects.probe import ProbeScale
from taichidem.errors import CompositionError, InputError
from taichidem.experiments import BulkDensity, FixedFunnel, FreeFall, Ledge, LiftingCylinder, Rebound, RollingBall
from taichidem.experiments.together import run_together
from taichidem.grain import random_rotations
from taichidem.materials import Material
from taichidem.scene import Model, Scene
from taichidem.shapes import Superquadric
from taichidem.shapes.outlines import Outlines, highest_point
from taichidem.simulation import Simulation
from taichidem.study import Run, RunStore, run_all, with_values
from taichidem.study.execution import batches
from taichidem.study.hypothesis import Hypothesis
from tests.clump import Row

SOFT = Material("grain", 1000.0, 2e6, 0.3)
PLAIN = [NormalHertz(restitution=0.4), TangentialMindlin(static_friction=0.4), BodyGravity()]
DUMBBELL = Row(2)
CUP = {"diameter": 0.006, "cup_radius": 0.015, "cup_height": 0.006, "particles": 40, "rain_top": 0.1}
CUP |= {"settle_time": 0.2}


class Rows(SetupEffect):
    """Dumbbells in place of spheres, or not."""

    name: ClassVar[str] = "rows"
    title: ClassVar[str] = "Rows"
    parameters: ClassVar = (
        Parameter("strength", "1", 0.0, 1.0, (0.0, 1.0), "Whether.", vanishing=0.0, per_pair=False),
    )

    def grain_shape(self):
        return DUMBBELL if self.value("strength") else None


def model(*more, shape=None):
    return Model([SOFT], [*PLAIN, *more], shape)


def test_every_copy_of_a_model_keeps_its_shape():
    made = model(BaseTilt(angle=2.0), shape=DUMBBELL)
    copies = [
        made.acting(),
        made.without_gravity(),
        made.with_value("tangential_mindlin.static_friction", 0.1),
        with_values(made, {"normal_hertz.restitution": 0.3}),
        Hypothesis(ElectrostaticCharge, ProbeScale(0.003, [SOFT])).joined(model(), 0.5),
        FreeFall(mass=1e-3)._with_density(made),
    ]
    assert [copy.shape for copy in copies] == [DUMBBELL] * 4 + [None, DUMBBELL]
    assert model(Rows(strength=1.0)).acting().grain_shape is DUMBBELL
    assert model(Rows(strength=1.0)).grain_kind == "multisphere"
    assert model(Rows(strength=0.0)).grain_kind == model().grain_kind == "sphere"


def test_two_that_say_what_form_grains_have_are_refused():
    for value in (1.0, 1.5):  # where it vanishes too, so that it can be re-calibrated from there or not at all
        with pytest.raises(CompositionError, match=r"'elongation' and the model's shape, Row.* both say what form"):
            model(Elongation(aspect_ratio=value), shape=DUMBBELL)
    with pytest.raises(CompositionError, match="'rows' and 'elongation' both say"):
        model(Rows(strength=0.0), Elongation(aspect_ratio=1.5))
    with pytest.raises(InputError, match=r"shape is 'long'; give a form such as Superquadric"):
        model(shape="long")


def test_charge_is_refused_on_what_is_no_sphere():
    charge = ElectrostaticCharge(surface_charge_density=1e-6)
    model(charge, Elongation(aspect_ratio=1.0))
    for shape in (DUMBBELL, Superquadric.spheroid(1.5)):
        with pytest.raises(
            CompositionError, match=rf"'electrostatic_charge' can't act on grains of kind '{shape.kind}'"
        ):
            model(charge, shape=shape)
        with pytest.raises(CompositionError, match="can't act"):
            Scene(model=model(charge), bodies=shape.bodies([[0, 0, 0]], 1000.0), domain=((-9,) * 3, (9,) * 3))


def test_rotations_are_uniform():
    """The axis of a body points as often into each slice of equal height, and the turn about it is as spread."""
    w, x, y, z = random_rotations(np.random.default_rng(1), 20000).T
    height, azimuth = 1 - 2 * (x * x + y * y), np.arctan2(y * z - w * x, x * z + w * y)
    for values, low, high in ((height, -1, 1), (azimuth, -np.pi, np.pi)):
        counts, _ = np.histogram(values, 20, (low, high))
        assert np.abs(counts - 1000).max() < 5 * np.sqrt(1000)


@pytest.mark.parametrize("experiment", [BulkDensity, FixedFunnel, Ledge, LiftingCylinder], ids=lambda e: e.name)
def test_scenes_know_the_grains_that_will_come(experiment):
    test = experiment()
    for shape in (Superquadric.spheroid(2.0), Row(3)):
        scene = test.scene(model(shape=shape))
        largest = shape.bodies([[0, 0, 0]], 1.0, radius=0.003)
        assert scene.kind == shape.kind
        assert scene.elements_per_body == len(shape.elements.radius)
        assert scene.largest_radius == pytest.approx(largest.element_radius.max())
        assert scene.smallest_radius == pytest.approx(largest.smallest_radius)
    plain = test.scene(model())
    assert (plain.kind, plain.largest_radius, plain.smallest_radius) == ("sphere", 0.003, 0.003)


@pytest.mark.parametrize("experiment", [Rebound, RollingBall, FreeFall], ids=lambda e: e.name)
def test_tests_of_one_ball_stay_tests_of_a_ball(experiment):
    test = experiment(**({"mass": 2e-4} if experiment is FreeFall else {}))
    for shaped in (model(shape=DUMBBELL), model(Elongation(aspect_ratio=1.5))):
        scene = test.scene(shaped)
        assert scene.kind == "sphere"
        assert scene.bodies.radius == pytest.approx(0.003)
    alike = [test.run(m, [1])[0].observables for m in (model(), model(shape=DUMBBELL))]
    assert alike[0] == alike[1]


def clumps(snapshot):
    """Return centres (n, 2, 3) and radii of the spheres of dumbbells."""
    w, x, y, z = snapshot.orientation.T
    axis = np.column_stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    radius = snapshot.radius / 2 ** (1 / 3)
    return snapshot.position[:, None] + np.array([-1, 1])[None, :, None] * (radius[:, None] * axis)[:, None], radius


@pytest.fixture(scope="module")
def settled():
    """The same cup with spheres and with dumbbells, by the effect and by the model's shape, in one call."""
    models = [model(Rows(strength=0.0)), model(Rows(strength=1.0)), model(Rows(strength=1.0))]
    test = BulkDensity(**CUP)
    shown: list[float] = []
    together = test.run(models, [1, 1, 2], frames=0.1, report=shown.append)
    alone = [test.run(m, [seed], frames=0.1)[0] for m, seed in zip(models, (1, 1, 2), strict=True)]
    return together, alone, test.run(model(shape=DUMBBELL), [1])[0], shown


def test_spheres_and_others_run_in_one_call_as_they_run_alone(settled):
    together, alone, by_shape, shown = settled
    for one, other in zip(together, alone, strict=True):
        assert one.failure is None
        assert one.observables == other.observables
        assert np.array_equal(one.snapshot.position, other.snapshot.position)
    assert together[1].observables == by_shape.observables
    assert together[0].observables != together[1].observables
    assert shown == sorted(shown)
    assert shown[-1] == pytest.approx(1.0)


def test_spheroids_and_spheres_of_one_effect_run_in_one_call():
    """As a screening asks for them: at a share of its strength, and at none."""
    models = [model(Elongation(aspect_ratio=ratio)) for ratio in (1.0, 1.5, 0.6)]
    test = BulkDensity(**CUP)
    together = test.run(models, [1, 1, 1])
    assert [outcome.failure for outcome in together] == [None] * 3
    assert together[0].observables == test.run(model(), [1])[0].observables
    assert together[1].observables == test.run(models[1], [1])[0].observables
    assert len({outcome.observables["bulk_density"] for outcome in together}) == 3
    shown = together[1].snapshot
    assert not shown.forms.round
    assert shown.mass == pytest.approx(together[0].snapshot.mass)
    below, _ = Outlines.of(shown).both_ways(2)
    assert (shown.position[:, 2] - below).min() > -2e-4


def test_grains_come_turned_and_touch_nothing(settled):
    for outcome in settled[0][1:]:
        first = outcome.frames[0].snapshot
        assert first.time == 0.0
        centres, radius = clumps(first)
        assert len(np.unique(first.orientation.round(6), axis=0)) == len(first.mass) == 40
        flat = centres.reshape(-1, 3)
        apart = np.linalg.norm(flat[:, None] - flat[None], axis=2)
        own = np.kron(np.eye(40), np.ones((2, 2))).astype(bool)
        assert apart[~own].min() >= 2 * radius[0]
        side = np.hypot(0.009 - radius[0], radius[0]) + radius[0]  # of one that lies along it, from which it bends away
        assert (np.hypot(*flat[:, :2].T) + radius[0]).max() <= side
        assert (flat[:, 2] - radius[0]).min() >= 0.006


def test_dumbbells_lie_in_the_cup_and_keep_their_mass(settled):
    sphere, dumbbell = (outcome.snapshot for outcome in settled[0][:2])
    assert dumbbell.mass == pytest.approx(sphere.mass)
    assert dumbbell.radius == pytest.approx(0.003)
    centres, radius = clumps(dumbbell)
    assert (centres[:, :, 2] - radius[:, None]).min() > -2e-4
    assert Outlines.of(dumbbell).radius == pytest.approx(2 * radius)


def test_a_stream_pours_them():
    funnel = FixedFunnel(
        cup_radius="20 mm", rim_height="4 mm", stream_bottom="20 mm", stream_top="60 mm", particles=60, settle_time=0.05
    )
    outcome = funnel.run(model(shape=DUMBBELL), [1])[0]
    assert outcome.snapshot is not None
    assert outcome.snapshot.left + len(outcome.snapshot.mass) == 60
    assert outcome.snapshot.forms.offset.any()


def test_the_tube_is_lifted_clear_of_what_stands_upright():
    """Its way follows from the highest point of any grain, not from the radius of the sphere of equal volume."""
    bodies = Row(3).bodies([[0, 0, 0.5]], SOFT.density, radius=0.1)
    scene = Scene(model=model(), bodies=bodies, domain=((-1,) * 3, (1,) * 3))
    assert highest_point(Simulation(scene).snapshot()) == pytest.approx(0.5 + 3 * 0.1 / 3 ** (1 / 3))


def test_runs_of_different_kinds_are_batched_apart(tmp_path):
    test = BulkDensity(**CUP)
    runs = [Run(test, model(Rows(strength=s)), seed) for seed in (1, 2) for s in (0.0, 1.0)]
    assert [[runs.index(run) for run in batch] for batch in batches(runs, 8)] == [[0, 2], [1, 3]]
    keys = {run.key for run in runs} | {Run(test, model(shape=DUMBBELL), 1).key, Run(test, model(), 1).key}
    assert len(keys) == 6
    with RunStore(tmp_path / "runs.sqlite") as store:
        table = run_all(runs, store)
    assert table["status"].tolist() == ["done"] * 4


def test_different_tests_of_different_kinds_run_together():
    tests = [BulkDensity(**CUP), BulkDensity(**{**CUP, "settle_time": 0.1})]
    found = run_together(tests, [model(shape=DUMBBELL), model()], [1, 1])
    assert [o.failure for o in found] == [None, None]
    assert found[1].observables == tests[1].run(model(), [1])[0].observables
    assert found[0].observables == tests[0].run(model(shape=DUMBBELL), [1])[0].observables
