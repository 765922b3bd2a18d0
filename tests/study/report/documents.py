"""Results as the commands write them, made up: a diagnosis for each of the five verdicts, a comparison, an addition."""

from __future__ import annotations

import copy
import json
from pathlib import Path

from PIL import Image, ImageDraw

VERDICTS = ("nothing_missing", "effect", "one_of", "something_else", "cannot_tell")

TESTS = [  # label, experiment, observable, unit, measured, u, believed, re-calibrated, with effect
    ("ledge", "ledge", "angle_of_repose", "deg", 31.4, 0.6, -9.4, -3.1, -0.4),
    ("heap", "heap", "angle_of_repose", "deg", 28.9, 0.5, -8.2, -2.2, 0.7),
    ("drum_6rpm", "drum_6rpm", "dynamic_angle", "deg", 36.1, 0.4, -11.0, -4.0, 0.9),
    ("drum_20rpm", "drum_20rpm", "dynamic_angle", "deg", 37.4, 0.4, -10.1, -3.3, -1.2),
    ("density", "density", "bulk_density", "kg/m^3", 541.0, 4.0, 3.9, 2.9, 0.3),
    ("hopper_40mm", "hopper_40mm", "discharge_rate", "g/s", 118.0, 1.5, 5.2, 2.0, -0.8),
    ("hopper_55mm", "hopper_55mm", "discharge_rate", "g/s", 262.0, 3.0, 6.0, 2.6, 1.4),
    ("rebound", "rebound", "restitution", "1", 0.61, 0.01, 0.4, 0.2, 0.2),
]

CANDIDATES = [
    ("rolling_constant_torque", "Rolling resistance, constant torque", "rolling_friction", "1", 0.124, 0.013, 48.2),
    ("rolling_spring_dashpot", "Rolling resistance, spring and dashpot", "rolling_friction", "1", 0.131, 0.016, 46.9),
    ("cohesion_area", "Cohesion by contact area", "energy_density", "J/m^3", 21300.0, 4100.0, 21.5),
    ("cohesion_dmt", "Cohesion after Derjaguin, Muller and Toporov", "surface_energy", "J/m^2", 0.0123, 0.003, 20.8),
    ("liquid_bridge", "Liquid bridges", "film_volume", "m^3", 2.1e-12, 9.0e-13, 12.2),
    ("twisting_resistance", "Twisting resistance", "twisting_friction", "1", 0.05, 0.04, 2.1),
    ("air_drag", "Drag and buoyancy of air", "fluid_density", "kg/m^3", 0.0, 0.4, 0.0),
    ("tilted_base", "Base out of level", "tilt", "deg", 0.7, 0.5, 1.9),
]

TEXTS = {
    "nothing_missing": "After re-calibration every test agrees with its measurement within the uncertainties.",
    "effect": "Re-calibration leaves a misfit that rolling resistance explains and nothing else in the library does.",
    "one_of": "Two rolling resistances explain the misfit equally well; these tests can't tell them apart.",
    "something_else": "The best addition improves the fit, yet the tests still fail: what is missing is not in the library.",
    "cannot_tell": "Seven measurements and six parameters leave too little to judge an effect by.",
}


def comparison() -> dict:
    rows = [
        {
            "experiment": experiment,
            "type": experiment.partition("_")[0],
            "observable": observable,
            "condition": "",
            "label": label,
            "unit": unit,
            "measured": measured,
            "u_measured": u,
            "n_measured": 4,
            "simulated": measured + z * u * 1.1,
            "u_simulated": 0.3 * u,
            "n_seeds": 4,
            "error": z * u * 1.1,
            "u_val": 1.1 * u,
            "z": z,
            "ratio": abs(z),
            "p": 0.0001 if abs(z) > 3 else 0.4,
            "fails": abs(z) > 2,
        }
        for label, experiment, observable, unit, measured, u, z, _, _ in TESTS
    ]
    return {
        "schema": 1,
        "study": "Granules 6 mm, batch 12",
        "rows": rows,
        "parameters": [
            {
                "key": "granule-wall.static_friction",
                "unit": "1",
                "believed": 0.3,
                "measured": 0.297,
                "u_measured": 0.02,
                "z": 0.15,
            }
        ],
        "chi2": 462.0,
        "dof": 9,
        "p_value": 0.0,
        "failing": [row["label"] for row in rows if row["fails"]],
        "trends": [
            {
                "observable": "dynamic_angle",
                "condition": "speed",
                "unit": "rpm",
                "experiments": ["drum_6rpm", "drum_20rpm"],
                "conditions": [6, 20],
                "z": [-11.0, -10.1],
                "slope": 0.064,
                "u_slope": 0.1,
                "p": 0.52,
                "text": "The misfit of dynamic_angle does not follow the speed.",
            }
        ],
        "text": "7 of 8 tests fail. The model's heaps are too flat and its hoppers too fast.",
        "advice": ["Diagnose next: the misfit is far beyond what the uncertainties explain."],
        "failures": [{"experiment": "heap", "seed": 3, "reason": "overlap of 31 % of a radius at t = 0.42 s"}],
        "runs": {"stored": 20, "new": 12, "failed": 1},
        "wall_s": 312.4,
        "pictures": {
            "standardised_errors": "standardised_errors.png",
            "series_fall": "series_fall.png",
            "heap_ledge": "heap_ledge.png",
        },
    }


def verdict(kind: str = "effect") -> dict:
    added = kind in ("effect", "one_of", "something_else")
    fit = {"nothing_missing": 0.25, "something_else": 2.2}.get(kind, 1.0)
    chi2 = sum((0.25 * row[7] if kind == "nothing_missing" else row[7]) ** 2 for row in TESTS)
    return {
        "schema": 1,
        "study": "Granules 6 mm, batch 12",
        "verdict": kind,
        "text": TEXTS[kind],
        "advice": [
            "Measure the sliding friction of granule on granule: re-calibration drives it to the end of its range."
        ],
        "effects": {
            "effect": ["rolling_constant_torque"],
            "one_of": ["rolling_constant_torque", "rolling_spring_dashpot"],
            "something_else": ["rolling_constant_torque"],
        }.get(kind, []),
        "chi2": {
            "believed": 462.0,
            "recalibrated": chi2,
            "with_effect": (6.3 if kind != "something_else" else 27.5) if added else None,
            "dof": 5,
            "dof_with_effect": 4,
            "p_recalibrated": 0.71 if kind == "nothing_missing" else 2.1e-11,
            "p_with_effect": (0.18 if kind != "something_else" else 1.6e-5) if added else None,
        },
        "held_out_error": {"before": 4.1 if added else 1.2, "after": 1.2 if added else None},
        "table": [_candidate(kind, i, *row) for i, row in enumerate(CANDIDATES)],
        "not_tested": [
            {"effect": "electrostatic_charge", "reason": "no test of this study takes the charge into account"}
        ],
        "parameters": _parameters(added),
        "standardised_errors": [_errors(row, fit, added, kind == "nothing_missing") for row in TESTS],
        "next_measurement": None if kind in ("nothing_missing", "effect") else _next(),
        "threshold": 8.4,
        "bootstrap": 2000,
        "design": {"rows": 96, "seeds": [1, 2, 3, 4], "generator": "definitive_screening", "centre_points": 6},
        "runs": {"stored": 400, "new": 368, "failed": 2},
        "failures": [{"experiment": "hopper_40mm", "seed": 2, "reason": "the hopper arched and did not run empty"}],
        "assumptions": ["The errors of different tests are independent.", "Effects add up at the strengths probed."],
        "wall_s": 2745.0,
    }


def _candidate(kind, i, effect, title, parameter, unit, strength, u, drop) -> dict:
    group = {0: {1: 0.97, 2: 0.55, 3: 0.52}, 1: {2: 0.58, 3: 0.5}, 2: {3: 0.99, 4: 0.88}, 3: {4: 0.86}}
    rho = {row[0]: round(0.31 * (-1) ** (i + j), 2) for j, row in enumerate(CANDIDATES) if j != i}
    for j, value in group.get(i, {}).items():
        rho[CANDIDATES[j][0]] = value
    rho = {name: value for name, value in rho.items() if [r[0] for r in CANDIDATES].index(name) > i}
    flat = kind in ("nothing_missing", "cannot_tell")
    return {
        "effect": effect,
        "title": title,
        "parameter": parameter,
        "unit": unit,
        "strength": 0.1 * strength if flat else strength,
        "u_strength": u,
        "strongest_probed": 3 * (strength or 1.0),
        "chi2_drop": 0.02 * drop if flat else drop,
        "chi2": 54.5 - drop,
        "score": 0.02 * drop if flat else 0.95 * drop,
        "adjusted_p": 0.9 if flat or drop < 10 else 0.0005,
        "eta": round(0.62 / (i + 1), 2),
        "rho": rho,
        "held_out_error": 1.2 + 0.3 * i,
        "aicc": 40.0 + i,
        "detection_limit": 1.8 * u,
        "at_bound": ["granule-granule.static_friction"] if i == 2 else [],
        "beyond_probed": i == 4,
        "in_class": kind == "one_of" and i < 2,
        "visible_as": "steeper heaps and drums",
        "note": "",
    }


def _parameters(added: bool) -> list[dict]:
    keys = [("granule-granule.static_friction", 0.2, 0.7, 0.4), ("granule-granule.restitution", 0.3, 0.9, 0.6)]
    keys += [("granule-wall.static_friction", 0.1, 0.6, 0.3)]
    return [
        {
            "key": key,
            "unit": "1",
            "low": low,
            "high": high,
            "believed": believed,
            "measured": 0.297 if "wall" in key else None,
            "u_measured": 0.02 if "wall" in key else None,
            "recalibrated": high if i == 0 else believed + 0.01,
            "u_recalibrated": 0.021,
            "with_effect": believed + 0.05 if added else None,
            "u_with_effect": 0.024 if added else None,
            "at_bound": "high" if i == 0 else "",
            "at_bound_with_effect": "",
        }
        for i, (key, low, high, believed) in enumerate(keys)
    ]


def _errors(row, fit: float, added: bool, fits: bool) -> dict:
    label, experiment, observable, unit, measured, u, believed, recalibrated, with_effect = row
    return {
        "experiment": experiment,
        "observable": observable,
        "condition": "",
        "label": label,
        "unit": unit,
        "measured": measured,
        "u_measured": u,
        "believed": believed,
        "recalibrated": 0.25 * recalibrated if fits else recalibrated,
        "with_effect": fit * with_effect if added else None,
        "held_out_before": 1.3 * recalibrated,
        "held_out_after": 1.3 * with_effect if added else None,
    }


def _next() -> dict:
    return {
        "text": "Measure the angle of a drum at 2 rpm to ± 0.4°: the two candidates differ there by 4.1 standard uncertainties.",
        "what": "new_test",
        "experiment": "rotating_drum",
        "settings": {"speed": "2 rpm", "fill": 0.35},
        "observable": "dynamic_angle",
        "unit": "deg",
        "u_assumed": 0.4,
        "separates": ["rolling_constant_torque", "rolling_spring_dashpot"],
        "separation": 4.1,
        "predictions": {"rolling_constant_torque": 34.8, "rolling_spring_dashpot": 36.6},
    }


def addition() -> dict:
    tests = [
        {
            "experiment": experiment,
            "observable": observable,
            "condition": "",
            "label": label,
            "unit": unit,
            "measured": measured,
            "u_measured": u,
            "believed": measured + believed * u,
            "recalibrated": measured + recalibrated * u,
            "with_effect": measured + with_effect * u,
            "u_with_effect": 0.3 * u,
            "z_believed": believed,
            "z_recalibrated": recalibrated,
            "z_with_effect": with_effect,
            "z_held_out_before": 1.3 * recalibrated,
            "z_held_out_after": 1.3 * with_effect,
        }
        for label, experiment, observable, unit, measured, u, believed, recalibrated, with_effect in TESTS
    ]
    steps = [
        ("believed", "As believed", 462.0, 9, 7.6, None),
        ("recalibrated", "Re-calibrated", 57.7, 5, 2.8, 4.1),
        ("with_effect", "+ Rolling resistance, constant torque", 6.3, 4, 0.8, 1.2),
    ]
    keys = ("step", "label", "chi2", "dof", "rms_fitted", "rms_held_out")
    return {
        "schema": 1,
        "study": "Granules 6 mm, batch 12",
        "effect": "rolling_constant_torque",
        "title": "Rolling resistance, constant torque",
        "parameter": "rolling_friction",
        "unit": "1",
        "strength": 0.124,
        "u_strength": 0.013,
        "waterfall": [dict(zip(keys, step, strict=True)) for step in steps],
        "tests": tests,
        "parameters": _parameters(added=True),
        "fresh_seeds": [101, 102, 103, 104],
        "text": "With rolling resistance the tests agree with their measurements on seeds that the fit has not seen.",
        "pictures": {"waterfall": "waterfall.png", "heap_after": "heap_after.png"},
        "runs": {"stored": 0, "new": 96, "failed": 0},
        "wall_s": 512.0,
    }


def discovery() -> dict:
    steps = [
        ("effect", ["rolling_constant_torque"], "rolling_constant_torque", 57.7, 5, "step_1"),
        ("nothing_missing", [], None, 6.3, 4, "step_2"),
    ]
    keys = ("verdict", "effects", "added", "chi2", "dof", "folder")
    return {
        "schema": 1,
        "steps": [dict(zip(keys, step, strict=True)) for step in steps],
        "removed": [],
        "stopped_because": "nothing is missing",
        "text": "One effect was added in one step; then nothing was missing.",
    }


def hostile(document, text: str = "<script>alert(1)</script> & \"quotes\" 'single' $x_1$ {{ 7 * 7 }}"):
    """Return a copy whose texts of people (titles, labels, names, reasons) all hold a hostile one."""
    fixed = {"verdict", "step", "at_bound", "at_bound_with_effect", "effects", "effect"}

    def changed(value, key=""):
        if key in fixed or key == "pictures":
            return value
        if isinstance(value, str):
            return f"{value} {text}"
        if isinstance(value, list):
            return [changed(v) for v in value]
        if isinstance(value, dict):
            return {k: changed(v, k) for k, v in value.items()}
        return value

    return changed(copy.deepcopy(document))


def lay_out(
    folder: Path, documents: dict[str, dict], pictures=("series_fall.png", "heap_ledge.png", "heap_after.png")
) -> Path:
    """Write a study folder with results and pictures, and return it."""
    results = folder / "results"
    results.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text("schema = 1\n")
    for kind, document in documents.items():
        (results / f"{kind}.json").write_text(json.dumps(document, indent=2), encoding="utf-8")
    for name in pictures:
        _drawn(results / name)
    return folder


def _drawn(path: Path) -> None:
    image = Image.new("RGB", (900, 420), "white")
    draw = ImageDraw.Draw(image)
    draw.polygon([(60, 360), (430, 360), (245, 200)], fill="#46525d")
    draw.polygon([(470, 360), (840, 360), (655, 150)], fill="#1f5f8b")
    image.save(path)
