"""The bench's own study folders are read as they stand."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, ClassVar

import pytest
from pydantic import create_model

import taichidem.experiments
from taichidem import plugins
from taichidem.experiments.base import Experiment, Observable, Settings
from taichidem.scene import Scene
from taichidem.study import read_measurements, read_study

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

STUDIES = Path(__file__).resolve().parents[3] / "shared" / "lab" / "studies"
NAMES = ("pub-a", "pub-b", "pub-c", "pub-c-bulk-only")
OBSERVABLES = {
    "ledge": ("angle_of_repose", "deg"),
    "bulk_density": ("bulk_density", "kg/m^3"),
    "hopper_discharge": ("mass_flow_rate", "g/s"),
    "rotating_drum": ("dynamic_angle_of_repose", "deg"),
    "rebound": ("coefficient_of_restitution", "1"),
}

pytestmark = pytest.mark.skipif(not STUDIES.is_dir(), reason=f"the shared studies are not at {STUDIES}")


def stand_in(kind, observable, unit):
    """Return an experiment that takes the settings of the shared studies, for a type that is not registered here."""
    tests = tomllib.loads((STUDIES / NAMES[0] / "study.toml").read_text())["experiments"].values()
    settings = {name: (Any, None) for test in tests if test["type"] == kind for name in test if name != "type"}

    class StandIn(Experiment):
        name: ClassVar[str] = kind
        observables: ClassVar = (Observable(observable, unit, "A stand-in's."),)
        settings_type: ClassVar[type[Settings]] = create_model("StandInSettings", __base__=Settings, **settings)

        def scene(self, model):
            grain = model.materials[0].name
            domain = ((0, 0, 0), (1, 1, 1))
            return Scene(model=model, domain=domain, room=1, largest_radius=0.003, grain_materials=[grain])

    return StandIn


@pytest.fixture(autouse=True)
def _every_type(monkeypatch):
    for kind, made in OBSERVABLES.items():
        if kind not in plugins.names("experiment"):
            monkeypatch.setitem(taichidem.experiments.BUILT_IN, kind, stand_in(kind, *made))
    plugins.refresh()
    yield
    monkeypatch.undo()
    plugins.refresh()


@pytest.mark.parametrize("name", NAMES)
def test_a_shared_study_is_read(name):
    study = read_study(STUDIES / name)
    assert len(study.experiments) == 11
    assert next(iter(study.experiments)) == "ledge"
    assert len(study.calibrate) == 4
    measured = [c.key for c in study.calibrate if c.value is not None]
    both = ["granule-granule.static_friction", "granule-wall.static_friction"]
    assert measured == ([] if name == "pub-c-bulk-only" else both)
    assert {e.name for e in study.model().effects} == {"normal_hertz", "tangential_mindlin", "body_gravity"}
    assert study.experiment("heap").settings.cup_radius == 0.042
    assert study.experiment("heap").settings.diameter == 0.006
    assert study.experiment("heap").settings.wall_material == "wall"
    measurements = read_measurements(study)
    assert list(measurements["experiment"]) == list(study.experiments)
    assert (measurements["u"] > 0).all()
