"""Coarse graining of a model and of an experiment: what grows how, what is kept, what is refused."""

import math
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.coarse_graining import GENERAL, CoarseGraining, rule_text, setting_powers
from taichidem.coarse_graining_page import as_markdown, rewritten
from taichidem.effects import BUILT_IN as EFFECTS
from taichidem.effects import (
    AirDrag,
    AirDragLinear,
    BaseTilt,
    BodyGravity,
    CohesionJkr,
    LiquidBridge,
    NormalHertz,
    TangentialMindlin,
)
from taichidem.effects.base import SetupEffect
from taichidem.errors import InputError
from taichidem.experiments import BUILT_IN, BulkDensity, FixedFunnel, FreeFall, Ledge, RollingBall, ShearBox
from taichidem.experiments.base import Experiment, Settings
from taichidem.library import PAPER_HEAP
from taichidem.materials import Material
from taichidem.model import Model
from taichidem.scene import Scene
from taichidem.shapes import Superquadric
from taichidem.simulation import Simulation
from taichidem.units import Length, quantity

GRAIN, STEEL = Material("grain", 910.0, 5e6, 0.36), Material("steel", 7800.0, 2e11, 0.3)


def model(*effects):
    return Model([GRAIN, STEEL], [NormalHertz(restitution=0.6), *effects, BodyGravity()])


def effect(model, name):
    return next(e for e in model.effects if e.name == name)


@pytest.mark.parametrize("factor", [0.5, 0, -2, math.nan, math.inf, "2", None, True, 0.999999])
def test_a_factor_that_is_no_number_from_1_is_refused(factor):
    with pytest.raises(InputError, match=r"factor of coarse graining is .*; allowed is a finite number from 1.*Give 2"):
        CoarseGraining(factor)


def test_factor_1_changes_nothing():
    fine = model(
        CohesionJkr(work_of_adhesion={"grain-grain": 0.1, "grain-steel": 0.2}), TangentialMindlin(static_friction=0.5)
    )
    same = CoarseGraining(1).model(fine)
    assert [e.values for e in same.effects] == [e.values for e in fine.effects]
    for kind in BUILT_IN.values():
        assert CoarseGraining(1).experiment(kind()).settings == kind().settings
        assert CoarseGraining(1).mass_kept(kind()) == 1


@pytest.mark.parametrize("factor", [1.5, 2, 4])
def test_the_rules_of_every_model(factor):
    """The numbers come from the formulas, the exponents from the declarations."""
    table = CoarseGraining(factor).table(model(), 0.004)
    general = table[table["effect"] == ""]
    assert len(general) == len(GENERAL)
    assert (general["after"] / general["before"]).to_numpy() == pytest.approx(factor ** general["exponent"].to_numpy())
    powers = dict(zip(general["parameter"], general["exponent"], strict=True))
    assert powers["mass m"] == 3
    assert powers["moment of inertia 2/5 m R²"] == 5
    assert powers["Hertz coefficient 4/3 E* √R*"] == 0.5
    assert powers["elastic energy over volume, δ ∝ s"] == 0
    before = dict(zip(general["parameter"], general["before"], strict=True))
    assert before["mass m"] == pytest.approx(910 * math.pi / 6 * 0.004**3)
    given = NormalHertz(restitution=0.6).kernel_coefficients(model().pairs()[0])["stiffness"]
    assert before["Hertz coefficient 4/3 E* √R*"] == pytest.approx(given * math.sqrt(0.001))


def test_the_rows_of_effects_hold_every_pair():
    fine = model(CohesionJkr(work_of_adhesion={"grain-grain": 0.1, "grain-steel": 0.2}))
    table = CoarseGraining(3).table(fine)
    rows = table[table["effect"] == "cohesion_jkr"]
    assert rows["pair"].tolist() == ["grain-grain", "grain-steel"]
    assert rows["after"].tolist() == pytest.approx([0.9, 1.8])
    assert set(rows["rule"]) == {"× s^2"}
    assert set(rows["keeps"]) == {"pull-off force over weight"}
    assert [rule_text(k) for k in (0.0, 1.0, -3.0, 1 / 3)] == ["kept", "× s", "× s^-3", "× s^0.333"]


def test_pull_off_liquid_and_drag_scale_with_the_weight():
    fine = model(CohesionJkr(work_of_adhesion=0.1), AirDragLinear(coefficient=1e-4))
    wet = model(LiquidBridge(surface_tension=0.072, liquid_fraction=0.01, viscosity=1e-3))
    air = model(AirDrag())
    for s in (2.0, 4.0):
        coarse = CoarseGraining(s)
        work = effect(coarse.model(fine), "cohesion_jkr").value("work_of_adhesion")
        assert 1.5 * math.pi * work * s * 0.001 == pytest.approx(s**3 * 1.5 * math.pi * 0.1 * 0.001)
        assert effect(coarse.model(fine), "air_drag_linear").value("coefficient") == pytest.approx(1e-4 * s**3)
        assert effect(coarse.model(air), "air_drag").value("represented_scale") == s
        bridge, large = effect(wet, "liquid_bridge"), effect(coarse.model(wet), "liquid_bridge")
        assert large.value("surface_tension") == pytest.approx(0.072 * s**2)
        small = bridge.initial_amounts(np.array([1.0]), np.array([0.002]))
        assert large.initial_amounts(np.array([s**3]), np.array([s * 0.002])) == pytest.approx(small * s**3)


def test_what_a_model_holds_beside_effects_is_kept():
    form = Superquadric.spheroid(1.5)
    fine = Model([GRAIN], [NormalHertz(restitution=0.6), BaseTilt(angle=2.0)], shape=form)
    coarse = CoarseGraining(2).model(fine)
    assert coarse.shape == form
    assert coarse.materials == fine.materials
    assert effect(coarse, "base_tilt").values == effect(fine, "base_tilt").values


class Silent(AirDragLinear):
    name: ClassVar[str] = "silent_drag"
    similarity: ClassVar = None


def test_effects_without_a_rule_are_refused_by_name():
    with pytest.raises(InputError, match="no rule for silent_drag: it declares no `similarity`"):
        CoarseGraining(2).model(model(Silent(coefficient=1e-4)))


def test_a_parameter_that_would_leave_its_bounds_is_told_with_the_factor():
    with pytest.raises(
        InputError, match=r"cohesion_jkr can't be coarse-grained by a factor of 4: .*work_of_adhesion is 1600"
    ):
        CoarseGraining(4).model(model(CohesionJkr(work_of_adhesion=100.0)))


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_apparatus_stays_and_grains_grow(name):
    test = BUILT_IN[name]()
    s, powers = 1.5, setting_powers(BUILT_IN[name]())
    coarse = CoarseGraining(s).experiment(test)
    for setting in type(test.settings).model_fields:
        before, after = getattr(test.settings, setting), getattr(coarse.settings, setting)
        if setting not in powers or before is None:
            assert after == before
        elif isinstance(before, int):
            assert powers[setting] == -3
            assert abs(after - before / s**3) <= 0.5
        else:
            assert after == pytest.approx(before * s ** powers[setting], rel=1e-12)
    assert coarse.settings.diameter == pytest.approx(0.009, rel=1e-15)
    assert coarse.particles_needed() == 1 or coarse.particles_needed() < test.particles_needed() / 3


def test_heap_of_the_paper_at_its_factor():
    """3 mm grains at s = 2 are the paper's 6 mm grains: 8 times fewer, 8 times fewer per second."""
    fine = FixedFunnel(**PAPER_HEAP | {"diameter": "3 mm", "particles": 20000, "stream_rate": 4800.0})
    assert CoarseGraining(2).experiment(fine).settings == FixedFunnel(**PAPER_HEAP).settings


def test_rounding_to_whole_grains_is_reported():
    assert CoarseGraining(2).mass_kept(BulkDensity(particles=100)) == pytest.approx(13 * 8 / 100)
    assert CoarseGraining(2).experiment(BulkDensity(particles=2)).settings.particles == 1
    assert CoarseGraining(2).mass_kept(ShearBox(normal_stresses=(1e3, 2e3))) == pytest.approx(113 * 8 / 900)
    assert CoarseGraining(2).mass_kept(RollingBall()) == 1


def test_optional_settings_scale_where_they_are_given():
    assert CoarseGraining(2).experiment(Ledge(rain_top=0.3)).settings.rain_top == 0.6
    assert CoarseGraining(2).experiment(Ledge()).settings.rain_top is None
    assert CoarseGraining(2).experiment(FreeFall(mass=0.001)).settings.mass == 0.008


def test_an_apparatus_too_small_tells_the_factor():
    with pytest.raises(InputError, match=r"ledge can't be coarse-grained by a factor of 3: .*width must be at least 3"):
        CoarseGraining(3).experiment(Ledge())
    with pytest.raises(InputError, match=r"factor of 4: .*greater than or equal to 50.*smaller factor"):
        CoarseGraining(4).experiment(BUILT_IN["lifting_cylinder"]())


class NoRules(Experiment):
    name: ClassVar[str] = "no_rules"

    class settings_type(Settings):  # noqa: N801
        size: Length = quantity("m", "Size.", 0.1)


class NoCount(Experiment):
    name: ClassVar[str] = "no_count"

    class settings_type(Settings):  # noqa: N801
        diameter: Length = quantity("m", "Size.", 0.1, coarse_graining=1)
        particles: int = quantity("1", "Grains.", 100)


def test_experiments_without_rules_are_refused_by_name():
    with pytest.raises(InputError, match=r"no_rules can't be coarse-grained: it doesn't state the rule of any of its"):
        CoarseGraining(2).experiment(NoRules())
    with pytest.raises(InputError, match=r"no_count can't be coarse-grained: .* how many grains there are"):
        CoarseGraining(2).experiment(NoCount())


def test_scenes_follow_by_themselves():
    """Radius s, mass s³, moment of inertia s⁵, time step s, and the reach of a bridge s."""
    wet = Model([GRAIN, STEEL], [*polypropylene_like(), LiquidBridge(surface_tension=0.072, liquid_fraction=0.01)])
    small = RollingBall().scene(wet)
    for s in (2.0, 4.0):
        graining = CoarseGraining(s)
        coarse = graining.model(wet)
        large = graining.experiment(RollingBall()).scene(coarse)
        assert large.bodies.radius == pytest.approx(s * small.bodies.radius)
        assert large.bodies.mass == pytest.approx(s**3 * small.bodies.mass)
        assert large.bodies.inertia == pytest.approx(s**5 * small.bodies.inertia)
        assert large.dt == pytest.approx(s * small.dt)
        assert coarse.reach(s * 0.003, {"grain"}) == pytest.approx(s * wet.reach(0.003, {"grain"}))


def polypropylene_like():
    return [NormalHertz(restitution=0.6), TangentialMindlin(static_friction=0.5), BodyGravity()]


def test_collisions_are_alike_in_the_kernel():
    """Two grains head-on at 0.5 m/s: restitution and largest overlap over radius don't know s; the duration is s times."""
    fine = Model([GRAIN], [NormalHertz(restitution=0.6)])
    scenes = []
    for s in (1.0, 2.0, 4.0):
        radius, coarse = 0.003 * s, CoarseGraining(s).model(fine)
        places = np.array([[0, 0, -radius], [0, 0, radius]])
        pair = Bodies.spheres(places, radius, GRAIN.density, velocity=np.array([[0, 0, 0.25], [0, 0, -0.25]]))
        scenes.append(Scene(model=coarse, bodies=pair, domain=((-1, -1, -1), (1, 1, 1))))
    simulation = Simulation(scenes)
    assert [scene.dt for scene in scenes] == pytest.approx([scenes[0].dt * s for s in (1, 2, 4)])
    overlap, steps = np.zeros(3), np.array([scene.dt for scene in scenes])
    for _ in range(600):
        simulation.run(steps)
        for k in range(3):
            z = simulation.snapshot(k).position[:, 2]
            overlap[k] = max(overlap[k], 2 * scenes[k].largest_radius - (z[1] - z[0]))
    speeds = [np.diff(simulation.snapshot(k).velocity[:, 2])[0] / 0.5 for k in range(3)]
    assert speeds[0] == pytest.approx(0.6, rel=5e-3)
    assert speeds == pytest.approx([speeds[0]] * 3, rel=1e-9)
    assert overlap[0] > 0.01 * 0.003
    assert overlap / (0.003 * np.array([1, 2, 4])) == pytest.approx([overlap[0] / 0.003] * 3, rel=1e-9)


def test_every_registered_effect_has_a_rule():
    for kind in EFFECTS.values():
        if kind.similarity is None:
            assert issubclass(kind, SetupEffect)
            assert all(p.coarse_graining == 0 for p in kind.parameters)


def test_the_page_holds_the_rules_as_declared():
    page = (Path(__file__).parents[1] / "docs" / "coarse_graining.md").read_text(encoding="utf-8")
    assert as_markdown() in page, "run: python -m taichidem.coarse_graining_page docs/coarse_graining.md"
    assert rewritten(page) == page
    assert all(f"| `{name}` |" in page for name in (*EFFECTS, *BUILT_IN))
