"""Beyond the paper: do coarse grains do in other tests what real ones do with the same constants?

No hopper, drum or density of these granules was measured. So the real grains of 3 mm, simulated with the same constants, stand
for the measurement, and grains of 6 mm are compared with them as a study is compared with a laboratory. That tests the scale;
whether the constants are right is left open until somebody puts measurements into the study's table.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from taichidem import plugins
from taichidem.errors import SimulationError
from taichidem.experiments.base import Experiment
from taichidem.paper.heaps import SCALE
from taichidem.paper.own_files import changed, write_unless_changed
from taichidem.paper.session import Session
from taichidem.scene import Model
from taichidem.study import Comparison, Run, compare, read_study, run_all
from taichidem.whole_file import write_whole

FIRST_SEED = 5000
STAGE = "held-out tests"
FOLDER, REFERENCE, MEASUREMENTS, STUDY = "held_out", "reference.csv", "measurements.csv", "study.toml"
#: Relative standard uncertainty granted to each reference value besides its scatter, as an instrument would have: the scatter of
#: two seeds may be tiny by chance, and then any difference would look large. The page tells it.
INSTRUMENT = 0.01

#: Type, settings shared by both sizes of grains, number of coarse grains. Heights of the rain are given, so that both fall alike.
TESTS: Mapping[str, tuple[str, dict[str, object], int]] = {
    "hopper": ("hopper_discharge", {"outlet_diameter": "36 mm", "bin_radius": "48 mm", "rain_height": "114 mm"}, 1000),
    "drum": ("rotating_drum", {"radius": "54 mm", "length": "30 mm", "speed": "6 rpm"}, 270),
    "density": ("bulk_density", {"cup_radius": "36 mm", "cup_height": "48 mm", "rain_top": "174 mm"}, 1184),
}


def confirm(session: Session, levels: Mapping[str, float]) -> Comparison:
    """Write the held-out study at a setting of the paper's factors, its reference from fine grains, and compare.

    The fine grains' values are also the study's measurements, until somebody writes her own there.
    """
    folder = session.folder / FOLDER
    folder.mkdir(exist_ok=True)
    model = session.model(levels)
    reference = _reference(session, model).to_csv(index=False)
    write_whole(folder / REFERENCE, reference)
    write_unless_changed(folder, {MEASUREMENTS: reference, STUDY: _study_text(model)})
    seeds = range(FIRST_SEED + 101, FIRST_SEED + 101 + 2 * session.effort.held_out)
    return compare(
        read_study(folder),
        list(seeds),
        session.store,
        folder / "results",
        lambda stage, share: session.tell(STAGE, share),
        executor=session.executor,
    )


def own_files(output: Path) -> tuple[str, ...]:
    """Return which of the study's files in a reproduction's folder a person has written herself."""
    return changed(output / FOLDER, (MEASUREMENTS, STUDY))


def _fine_tests() -> dict[str, Experiment]:
    """Return the tests with grains of 3 mm."""
    return {
        name: plugins.get("experiment", kind)(diameter=0.003, particles=round(count * SCALE**3), **settings)
        for name, (kind, settings, count) in TESTS.items()
    }


def _reference(session: Session, model: Model) -> pd.DataFrame:
    """Return what the fine grains give, as a table of measurements."""
    seeds = range(FIRST_SEED + 1, FIRST_SEED + 1 + session.effort.held_out)
    tests = _fine_tests()
    runs = [Run(test, model, seed, name) for name, test in tests.items() for seed in seeds]
    found = run_all(
        runs, session.store, lambda share: session.tell("held-out reference", share), executor=session.executor
    )
    rows = []
    for name, test in tests.items():
        (observable,) = test.observables
        own = found[found["experiment"] == name]
        if not (own["status"] == "done").all():
            raise SimulationError(f"The held-out test {name} with fine grains failed: {' '.join(own['reason'])}")
        values = own[observable.name].to_numpy(float)
        scatter = np.std(values, ddof=1) / np.sqrt(len(values))
        u = float(np.hypot(scatter, INSTRUMENT * np.mean(values)))
        rows.append((name, observable.name, float(np.mean(values)), u, observable.unit, len(values)))
    return pd.DataFrame(rows, columns=["experiment", "observable", "value", "u", "unit", "n"])


def _study_text(model: Model) -> str:
    """Return the study of the coarse grains: what `taichidem compare` reads."""
    grain, wall = model.materials
    values: dict[str, Any] = {effect.name: effect.values for effect in model.effects}
    same, other = f"{grain.name}-{grain.name}", f"{grain.name}-{wall.name}"
    restitution, friction = values["normal_hertz"]["restitution"], values["tangential_mindlin"]["static_friction"]
    rolling = values["rolling_constant_torque"]["rolling_friction"]
    lines = [
        "# Tests that the model was not fitted to. measurements.csv holds what grains of 3 mm give with the same constants, as",
        "# reference.csv does. Put your own measurements there, and run taichidem compare on this folder; what you change in",
        "# measurements.csv and here is not written over.",
        "schema = 1",
        'title = "Held-out tests of the calibrated polypropylene model"',
        "",
        "[particle]",
        f'diameter = "{3 * SCALE:g} mm"',
        'material = "granule"',
    ]
    for name, material in (("granule", grain), ("wall", wall)):
        lines += ["", f"[materials.{name}]", f"density = {material.density!r}"]
        lines += [f"youngs_modulus = {material.youngs_modulus!r}", f"poissons_ratio = {material.poissons_ratio!r}"]
    for name, pair in (("granule", same), ("wall", other)):
        lines += ["", f"[contacts.granule-{name}]"]
        lines += [f"restitution = {restitution[pair]!r}", f"static_friction = {friction[pair]!r}"]
    lines += ["", "[effects.rolling_constant_torque]"]
    lines += [f'rolling_friction = {{ "granule-granule" = {rolling[same]!r}, "granule-wall" = {rolling[other]!r} }}']
    for name, (kind, settings, count) in TESTS.items():
        lines += ["", f"[experiments.{name}]", f'type = "{kind}"', f"particles = {count}"]
        lines += [f'{key} = "{value}"' for key, value in settings.items()]
    return "\n".join(lines) + "\n"
