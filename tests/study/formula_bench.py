"""A bench whose tests are formulas of the model, so that a diagnosis from plan to page takes seconds and its truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

import numpy as np

import taichidem.experiments
from taichidem import plugins
from taichidem.effects import BUILT_IN
from taichidem.experiments.base import Experiment, Observable, Outcome, Settings
from taichidem.scene import Scene
from taichidem.study import read_study
from taichidem.units import Length, quantity

#: What every quantity does to each of the seven tests: friction of grains and walls (over its middle), then effects (over a
#: strong value). The two rolling laws look alike.
BENDS = {
    "static_friction granule-granule": (0.4, (6.0, -4.0, 3.0, 1.0, 2.0, -3.0, 0.0)),
    "static_friction granule-wall": (0.3, (2.0, -1.0, 6.0, 4.0, -2.0, 0.0, 1.0)),
    "rolling_constant_torque.rolling_friction": (0.2, (7.0, -3.0, 1.0, 6.0, -4.0, 0.0, 8.0)),
    "rolling_spring_dashpot.rolling_friction": (0.2, (7.0, -3.1, 1.2, 6.0, -4.2, 0.0, 7.9)),
    "cohesion_area.energy_density": (5e4, (3.0, 6.0, -2.0, 1.0, 9.0, -6.0, 0.0)),
    "size_spread.half_width": (0.35, (0.0, 8.0, 1.0, 0.0, 1.0, 6.0, 0.0)),
    "base_tilt.angle": (3.0, (-9.0, 0.0, 0.0, 7.0, 0.0, 0.0, 0.0)),
    "elongation.aspect_ratio": (0.5, (4.0, 4.0, 5.0, -5.0, 0.0, 3.0, 4.0)),
}
SCATTER = 0.3
TESTS = tuple(f"test_{k}" for k in range(7))
PROPOSED = ("rolling_ball", "lifting_cylinder")
TESTED = ("rolling_constant_torque", "rolling_spring_dashpot", "cohesion_area", "size_spread", "base_tilt")


class FormulaSettings(Settings):
    diameter: Length = quantity("m", "Diameter of the grains.", 0.006, gt=0)
    number: int = quantity("1", "Which of the seven formulas.", 0, ge=0, le=6)
    failing_seed: int = quantity("1", "Seed that fails.", -1)


class Formula(Experiment):
    """A test whose result is a formula of friction, effects and seed."""

    name: ClassVar[str] = "formula"
    title: ClassVar[str] = "Formula"
    observables: tuple[Observable, ...] = (Observable("reading", "deg", "A reading."),)
    settings_type: ClassVar[type[Settings]] = FormulaSettings
    simulated: ClassVar[list[int]] = []

    def scene(self, model):
        grain = model.materials[0].name
        return Scene(model=model, domain=((-1,) * 3, (1,) * 3), room=5, largest_radius=0.003, grain_materials=(grain,))

    def run(self, models, seeds, *, schedule="worlds", report=None, frames=None):
        models = models if isinstance(models, list) else [models] * len(seeds)
        Formula.simulated.extend(seeds)
        return [self._one(model, seed) for model, seed in zip(models, seeds, strict=True)]

    def _one(self, model, seed):
        s = self.settings
        if seed == s.failing_seed:
            return Outcome({}, seed, f"seed {seed} diverged")
        noise = np.random.default_rng([seed, s.number]).normal(0, SCATTER)
        return Outcome({"reading": 20 + expected(model)[s.number] + noise}, seed)


def expected(model) -> np.ndarray:
    """Return the seven readings without scatter, less their offset."""
    total = np.zeros(7)
    grain = model.materials[0]
    for name, (unit, bends) in BENDS.items():
        parameter, _, pair = name.partition(" ")
        x = _value(model, parameter, pair, grain.name) / unit
        total += np.array(bends) * (np.log(x) if pair else x / (0.7 + 0.3 * abs(x)))
    return total


def _value(model, parameter, pair, grain):
    effect_name, _, name = ("tangential_mindlin." + parameter if pair else parameter).partition(".")
    effect = next((e for e in model.effects if e.name == effect_name), None)
    if effect is None:
        return 0.0
    held = effect.values[name]
    if isinstance(held, dict):
        return held[pair or f"{grain}-{grain}"]
    if not pair:
        held -= next(p.vanishing for p in effect.parameters if p.name == name)
    lean = effect.values.get("azimuth", 0.0)
    return -held if lean == 180.0 else held


def register(setitem) -> None:
    """Make the bench known; `setitem` is that of pytest's monkeypatch."""
    kept = {name: kind for name, kind in taichidem.experiments.BUILT_IN.items() if name not in PROPOSED}
    for name in PROPOSED:  # tests that propose themselves would be simulated by the engine
        setitem(taichidem.experiments.BUILT_IN, name, kept["rebound"])
    setitem(taichidem.experiments.BUILT_IN, "formula", Formula)
    plugins.refresh()


def write(folder: Path, truth, *, seed: int = 5, u: float = 0.4, direct: bool = True) -> Path:
    """Write a study whose measurements come from the model `truth(model)`, and return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(study_text(direct))
    (folder / "measurements.csv").write_text("experiment,observable,value,u,unit,n\ntest_0,reading,1,1,deg,1\n")
    readings = 20 + expected(truth(read_study(folder).model())) + np.random.default_rng(seed).normal(0, u, 7)
    lines = [f"{name},reading,{value:.4f},{u},deg,4" for name, value in zip(TESTS, readings, strict=True)]
    (folder / "measurements.csv").write_text("\n".join(["experiment,observable,value,u,unit,n", *lines, ""]))
    return folder


def study_text(direct: bool) -> str:
    """Return a study file with the seven tests."""
    measured = (", value = 0.42, u = 0.02", ", value = 0.29, u = 0.02") if direct else ("", "")
    tests = "".join(f'\n[experiments.{name}]\ntype = "formula"\nnumber = {k}\n' for k, name in enumerate(TESTS))
    return f"""\
schema = 1
title = "Formulas"                      # a comment that stays

[particle]
diameter = "6 mm"
material = "granule"

[materials.granule]
density = "910 kg/m^3"
youngs_modulus = "5 MPa"
poissons_ratio = 0.36

[materials.wall]
density = "7800 kg/m^3"
youngs_modulus = "50 MPa"
poissons_ratio = 0.3

[contacts.granule-granule]
restitution = 0.6
static_friction = 0.35

[contacts.granule-wall]
restitution = 0.6
static_friction = 0.25

[calibrate]
"granule-granule.static_friction" = {{ low = 0.2, high = 0.8{measured[0]} }}
"granule-wall.static_friction" = {{ low = 0.1, high = 0.6{measured[1]} }}
{tests}"""


def changed(*effects, friction=(0.42, 0.29)):
    """Return the change of a model to other frictions with effects added."""
    from taichidem.scene import Model
    from taichidem.study import with_values

    def apply(model):
        values = dict(zip(("granule-granule.static_friction", "granule-wall.static_friction"), friction, strict=True))
        moved = with_values(model, values)
        return Model(moved.materials, [*moved.effects, *effects])

    return apply


__all__ = ["BUILT_IN", "TESTED", "Formula", "changed", "register", "write"]
