"""Experiments that cost nothing, so that tests of studies and campaigns need no engine."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from typing import ClassVar

from pydantic import model_validator

import taichidem.effects
import taichidem.experiments
from taichidem import plugins
from taichidem.effects import NormalHertz, RollingConstantTorque
from taichidem.errors import InputError
from taichidem.experiments.base import Experiment, Observable, Outcome, Settings
from taichidem.scene import Scene
from taichidem.units import Duration, Length, quantity

LOG = "TAICHIDEM_TEST_LOG"  # variable with a file in which every simulated seed leaves a line


class QuickSettings(Settings):
    diameter: Length = quantity("m", "Diameter of the grains.", 0.004, gt=0)
    width: Length = quantity("m", "Width of the box.", gt=0)
    depth: Length = quantity("m", "Depth of the box.", 0.02, gt=0)
    pause: Duration = quantity("s", "Time that a run takes.", 0.0, ge=0)
    failing_seed: int = quantity("1", "Seed that fails.", -1)
    nan_seed: int = quantity("1", "Seed that measures nothing.", -1)
    stopping_seed: int = quantity("1", "Seed whose world stops.", -1)
    stopping_always: bool = quantity("1", "Whether the world of another stream stops too.", False)
    lethal_seed: int = quantity("1", "Seed that ends the process that simulates it.", -1)
    lethal_mark: str = quantity("1", "File that shows it did so already: then it runs as the others.", "")
    dividing_seed: int = quantity("1", "Seed whose measurement divides by zero.", -1)
    broken: str = quantity("1", "An error that breaks every batch.", "")
    grain_material: str = quantity("1", "Material of the grains.", "")
    wall_material: str = quantity("1", "Material of the walls.", "")

    @model_validator(mode="after")
    def _fits(self) -> QuickSettings:
        if self.depth > self.width:
            raise ValueError("depth must not exceed width")
        return self


class Quick(Experiment):
    """A test whose result is a formula of friction, width and seed."""

    name: ClassVar[str] = "quick"
    title: ClassVar[str] = "Quick"
    observables: ClassVar[tuple[Observable, ...]] = (
        Observable("angle", "deg", "An angle."),
        Observable("flow", "g/s", "A flow."),
    )
    settings_type: ClassVar[type[Settings]] = QuickSettings
    errors: ClassVar[dict[str, Exception]] = {
        "error": InputError("the stream is full"),
        "fault": ZeroDivisionError("divided"),
    }
    batches: ClassVar[list[list[int]]] = []

    def scene(self, model):
        if self.settings.width < 3 * self.settings.diameter:
            raise InputError(f"width is {self.settings.width:g} m, less than three grains. Take a wider box.")
        if any(e.values.get("restitution") == 0.001 for e in model.effects):
            raise InputError("this restitution can't be simulated")
        grain = self.settings.grain_material or model.materials[0].name
        return Scene(
            model=model,
            domain=((-1, -1, -1), (1, 1, 1)),
            room=5,
            largest_radius=self.settings.diameter / 2,
            grain_materials=(grain,),
        )

    def run(self, models, seeds, *, schedule="worlds", report=None, frames=None):
        models = [models] * len(seeds) if not isinstance(models, list) else models
        Quick.batches.append(list(seeds))
        if self.settings.broken:
            raise self.errors[self.settings.broken]
        outcomes = []
        for model, seed in zip(models, seeds, strict=True):
            if os.environ.get(LOG):
                with open(os.environ[LOG], "a") as log:
                    log.write(f"{self.settings.width:g} {seed}\n")
            time.sleep(self.settings.pause)
            outcomes.append(self._one(model, seed))
            if report:
                report(len(outcomes) / len(seeds))
        return outcomes

    def _one(self, model, seed):
        if seed == self.settings.dividing_seed:
            raise ZeroDivisionError(f"divided by {seed}")
        if seed == self.settings.lethal_seed and _first(self.settings.lethal_mark):
            os.kill(os.getpid(), signal.SIGKILL)
        if seed == self.settings.stopping_seed or (self.settings.stopping_always and seed > 2**32):
            return Outcome({}, seed, f"It diverged ({seed})", stopped=True)
        if seed == self.settings.failing_seed:
            return Outcome({}, seed, f"seed {seed} diverged")
        friction = next(e for e in model.effects if e.name == "tangential_mindlin").value(
            "static_friction", next(iter(model.pairs()))
        )
        angle = float("nan") if seed == self.settings.nan_seed else 30 * friction + seed / 7
        flow = 1e3 * self.settings.width
        return Outcome({"angle": angle, "flow": flow}, seed, details={"grains": 5, "picture": object()})


def _first(mark):
    """Return whether no process has come here before, as a file tells with the number of the one that has."""
    if not mark:
        return True
    try:
        with open(mark, "x") as file:
            file.write(str(os.getpid()))
    except FileExistsError:
        return False
    return True


class OtherNormal(NormalHertz):
    """Hertz under another name: a second effect of the family "normal"."""

    name: ClassVar[str] = "normal_other"


class RollingWithDefault(RollingConstantTorque):
    """Rolling resistance with a value for pairs that have none."""

    name: ClassVar[str] = "rolling_default"
    parameters: ClassVar = tuple(replace(p, default=0.01) for p in RollingConstantTorque.parameters)


def register(setitem) -> None:
    """Make the fakes known; `setitem` is that of pytest's monkeypatch, or operator.setitem."""
    setitem(taichidem.experiments.BUILT_IN, "quick", Quick)
    setitem(taichidem.effects.BUILT_IN, "normal_other", OtherNormal)
    setitem(taichidem.effects.BUILT_IN, "rolling_default", RollingWithDefault)
    plugins.refresh()


STUDY = """\
schema = 1
title = "A study"

[particle]
shape = "sphere"
diameter = "6 mm"
material = "granule"

[materials.granule]
density = "910 kg/m^3"
youngs_modulus = "5 MPa"
poissons_ratio = 0.36

[materials.wall]
density = "7.8 g/cm^3"
youngs_modulus = "50 MPa"
poissons_ratio = 0.3

[contacts.granule-granule]
restitution = 0.6
static_friction = 0.4

[contacts.granule-wall]
restitution = 0.7
static_friction = 0.3

[effects.rolling_constant_torque]
rolling_friction = { "granule-granule" = 0.12, "wall-granule" = 0.11 }

[calibrate]
"granule-granule.restitution" = { low = 0.3, high = 0.9 }
"granule-wall.static_friction" = { low = 0.1, high = 0.6, value = 0.3, u = 0.02 }

[experiments.narrow]
type = "quick"
width = "40 mm"

[experiments.wide]
type = "quick"
width = 0.05
diameter = "5 mm"
"""

MEASUREMENTS = """\
experiment,observable,value,u,unit,n,remark
narrow,angle,12.5,0.5,deg,4,by hand
narrow,flow,0.04,0.002,kg/s,3,
wide,angle,0.2,0.01,rad,1,
"""
