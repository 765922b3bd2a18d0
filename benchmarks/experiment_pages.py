"""Write docs/experiments.md and its pictures: `python -m benchmarks.experiment_pages [--pictures [NAME ...]]`.

The page is made from what the experiments declare, and a test holds it to that; the pictures need a run of each.
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

from taichidem.experiments import BUILT_IN, Experiment

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE = DOCS / "experiments.md"
HEAD = """# The experiments

Written by `python -m benchmarks.experiment_pages` from what the experiments declare. Lengths, times and so on may be
given as numbers in the unit of the table or as texts such as `"6 mm"`, `"20 rpm"`, `"1 kPa, 2 kPa"`. Every test with grains
takes part in set-up effects: `size_spread` and `elongation` change its grains, `base_tilt` its gravity. Grains of another
form have the volume of a sphere of `diameter`: [shapes.md](shapes.md).

```
taichidem simulate rotating_drum --set speed='20 rpm' --seeds 1,2 --picture drum.png --movie drum.gif
```

Walls are drawn as glass; colour is speed, or height where the grains rest. `--picture` and `--movie` show a single
experiment, given by its name; a study draws nothing. Each experiment knows a time between frames that suits it;
`--frame-interval '5 ms'` asks for another, `--colour-by spin` for another colour: height, speed, vertical_velocity, spin,
kinetic_energy (½ m v²), force, mass, diameter, tilt (of the grain's third axis), carried (liquid, m³), material or identity.

![Shapes that grains may have](pictures/grain_shapes.png)

Grains are drawn as they are: spheres exactly, clumps as all their spheres, superquadrics by their own surface; so are
the side views in which the angle of repose is measured. Files written with `-o` hold them for ParaView; the settings
stand in `taichidem.output_vtk`, whose `write_grain_surfaces` needs none. In Python, `taichidem.render.heap_picture(snapshot,
colour_by="speed")` draws any snapshot and `shape_surface(shape)` gives a shape as a mesh.
"""
SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}
SPECIAL = {"free_fall": {"release_height": 0.3, "time": 0.6, "floor": True}, "shear_box": {"normal_stresses": 2000.0}}


def page() -> str:
    """Return the page as text."""
    return "\n".join([HEAD, *(section(experiment) for experiment in BUILT_IN.values())])


def section(kind: type[Experiment]) -> str:
    """Return what one experiment declares, as Markdown."""
    experiment = kind()
    settings = [
        f"| `{name}` | {_default(field.default)} | {field.json_schema_extra['unit']} | {_bounds(field)} | "  # type: ignore
        f"{field.description} |"
        for name, field in kind.settings_type.model_fields.items()
    ]
    observed = [f"| `{o.name}` | {o.unit} | {o.meaning} |" for o in experiment.observables]
    grains = experiment.particles_needed()
    return "\n".join(
        [
            f"## {kind.title} (`{kind.name}`)\n",
            f"![{kind.title}](pictures/experiment_{kind.name}.png)\n",
            (inspect.getdoc(kind) or "") + "\n",
            f"Imitates: {kind.imitates}. Costs {grains} grain{'s' if grains > 1 else ''} by default.\n",
            "| measures | unit | |\n|---|---|---|",
            *observed,
            "\n| setting | default | unit | allowed | |\n|---|---|---|---|---|",
            *settings,
            "",
        ]
    )


def _bounds(field: Any) -> str:
    """Return the bounds of a setting, such as "> 0, < 90"."""
    given = {name: getattr(bound, name, None) for name in SIGNS for bound in field.metadata if hasattr(bound, name)}
    return ", ".join(f"{SIGNS[name]} {_default(value)}" for name, value in given.items())


def _default(value: object) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_default, value))
    if isinstance(value, float):
        return f"{value:.6g}"
    return "" if value in (None, "") else str(value)


def pictures() -> None:
    """Run each experiment once and draw it."""
    from PIL import Image

    from taichidem.library import polypropylene
    from taichidem.render_experiment import picture

    model = polypropylene(rolling_friction=0.0)
    wanted = [name for name in sys.argv[1:] if name in BUILT_IN] or list(BUILT_IN)
    for name, kind in ((name, BUILT_IN[name]) for name in wanted):
        experiment = kind(**SPECIAL.get(name, {}))
        outcome = experiment.run(model, [1], frames=kind.frame_interval)[0]
        shot = Image.fromarray(picture(experiment, model, outcome, size=(640, 512)))
        palette = shot.quantize(160, method=Image.Quantize.MAXCOVERAGE)
        small = shot.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
        small.save(DOCS / "pictures" / f"experiment_{name}.png", optimize=True)


if __name__ == "__main__":
    PAGE.write_text(page())
    if "--pictures" in sys.argv:
        pictures()
