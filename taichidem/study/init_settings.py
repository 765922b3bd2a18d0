"""Which settings of an experiment a newcomer must decide, and with which numbers they are proposed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from taichidem.experiments.base import Experiment
from taichidem.study.experiment_section import FILLED_IN

#: Exponent of the grain diameter by which a default grows, so that a test with larger grains is the same test under gravity.
SIMILARITY: Mapping[str, float] = {
    "m": 1.0,
    "s": 0.5,
    "m/s": 0.5,
    "1/s": -0.5,
    "rad/s": -0.5,
    "kg": 3.0,
    "Pa": 1.0,
}
DIAMETER = 0.006  # [m] for which the defaults of experiments are meant, unless they state another
WITHOUT_DEFAULT = {"m": 10.0}  # of the grain diameter, for a required length


@dataclass(frozen=True)
class Decision:
    """A setting as it is written out: name, the TOML of its value, and what it means."""

    name: str
    value: str
    meaning: str


def decisions(kind: type[Experiment], diameter: float) -> list[Decision]:
    """Return what a user decides of an experiment: sizes, speeds, times, loads, the number of grains.

    Left out are what follows from the particle, what has a good default for any apparatus (choices, switches, shares), and
    what may be left open.
    """
    fields = kind.settings_type.model_fields
    scale = _scale(kind, diameter)
    found = []
    for name, declared in fields.items():
        extra = declared.json_schema_extra
        unit = str(extra.get("unit", "1")) if isinstance(extra, Mapping) else "1"
        required = declared.is_required()
        if name in FILLED_IN or (not required and not _is_decided(name, unit, declared.default)):
            continue
        value = WITHOUT_DEFAULT.get(unit, 1.0) * (diameter if unit == "m" else 1.0) if required else declared.default
        meaning = declared.description or ""
        if required:
            meaning = f"{meaning} It has no default; this is a guess.".strip()
        found.append(Decision(name, _as_toml(value, unit, 1.0 if required else scale), meaning))
    return found


def _scale(kind: type[Experiment], diameter: float) -> float:
    """Return how much larger the grains are than those of the defaults; 1 for tests of a single grain, which need no likeness."""
    fields = kind.settings_type.model_fields
    if "particles" not in fields:
        return 1.0
    own = fields["diameter"].default if "diameter" in fields else None
    return diameter / (own if isinstance(own, float) and own > 0 else DIAMETER)


def _is_decided(name: str, unit: str, default: Any) -> bool:
    values = default if isinstance(default, tuple) else (default,)
    numbers = values and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
    return bool(numbers) and (unit != "1" or name == "particles")


def _as_toml(value: Any, unit: str, scale: float) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_as_toml(part, unit, scale) for part in value)}]"
    if isinstance(value, int):
        return str(value)
    return quantity_text(value * scale ** SIMILARITY.get(unit, 0.0), unit)


def quantity_text(value: float, unit: str) -> str:
    """Return a quantity as people write it in TOML, with three digits: "36 mm" in quotation marks, 0.3 where it has no unit."""
    if unit == "1":
        return f"{value:.3g}"
    if unit == "kg/m^3":
        return f'"{value:g} {unit}"'
    if unit == "rad/s":
        return f'"{_digits(value * 30 / math.pi)} rpm"'
    if unit == "m" and value < 1:
        return f'"{_digits(1e3 * value)} mm"'
    for factor, text in ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")) if unit == "Pa" else ():
        if value >= factor:
            return f'"{_digits(value / factor)} {text}"'
    return f'"{_digits(value)} {unit}"'


def _digits(value: float) -> str:
    """Return three digits, never as a power of ten below a million."""
    rounded = float(f"{value:.3g}")
    return f"{rounded:.0f}" if abs(rounded) >= 100 and rounded == int(rounded) else f"{rounded:.3g}"
