"""Stand s times as large grains in for many small ones: one declared operation on a model and on an experiment.

Source of the idea: Sudsawat, Chongchitpaisan & Arunyanart (2023), doi 10.21303/2461-4262.2023.002968, Eqs. 2–16.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

from taichidem.effects.base import Effect, SetupEffect
from taichidem.errors import InputError
from taichidem.experiments.base import Experiment
from taichidem.materials import Material, MaterialPair, rayleigh_time_step
from taichidem.model import Model
from taichidem.scene import SAFE_STEP

DIGITS = 15  # a text and a float have as many in common, so that 6 mm times 1.5 is 9 mm to the last bit
OVERLAP = 0.01  # of the radius, in the examples of the table


@dataclass(frozen=True)
class GeneralRule:
    """What holds for grains s times as large whatever the effects are.

    Args:
        quantity: in words.
        unit: SI.
        exponent: k of q′ = s^k q.
        keeps: why, in words.
        value: (material, radius [m], overlap [m], overlap before coarse graining [m]) → the quantity, for two equal grains.
    """

    quantity: str
    unit: str
    exponent: float
    keeps: str
    value: Callable[[Material, float, float, float], float]


def _mass(material: Material, radius: float) -> float:
    return 4 / 3 * math.pi * material.density * radius**3


def _modulus(material: Material) -> float:
    return MaterialPair(material, material).youngs_modulus


def _dashpot(material: Material, radius: float, overlap: float) -> float:
    """Return 2 √(5/6) √(S_n m*) [kg/s] with S_n = 2 E* √(R* δ), of equal grains: R* = R/2, m* = m/2."""
    stiffness = 2 * _modulus(material) * math.sqrt(radius / 2 * overlap)
    return 2 * math.sqrt(5 / 6) * math.sqrt(stiffness * _mass(material, radius) / 2)


def _energy_density(material: Material, radius: float, overlap: float) -> float:
    """Return the elastic energy 8/15 E* √R* δ^2.5 of a contact over the volume of a grain [J/m³]."""
    return 8 / 15 * _modulus(material) * math.sqrt(radius / 2) * overlap**2.5 / (4 / 3 * math.pi * radius**3)


GENERAL = (
    GeneralRule("radius R", "m", 1, "by definition", lambda m, r, o, o1: r),
    GeneralRule(
        "grains per solid volume", "1/m^3", -3, "mass of the bulk", lambda m, r, o, o1: 3 / (4 * math.pi * r**3)
    ),
    GeneralRule("density", "kg/m^3", 0, "density", lambda m, r, o, o1: m.density),
    GeneralRule("mass m", "kg", 3, "density", lambda m, r, o, o1: _mass(m, r)),
    GeneralRule("moment of inertia 2/5 m R²", "kg m^2", 5, "density", lambda m, r, o, o1: 0.4 * _mass(m, r) * r**2),
    GeneralRule("Young's modulus", "Pa", 0, "modulus", lambda m, r, o, o1: m.youngs_modulus),
    GeneralRule(
        "Hertz coefficient 4/3 E* √R*",
        "N/m^1.5",
        0.5,
        "modulus",
        lambda m, r, o, o1: 4 / 3 * _modulus(m) * math.sqrt(r / 2),
    ),
    GeneralRule(
        "stiffness 2 E* √(R* δ), δ ∝ s",
        "N/m",
        1,
        "overlap over radius in a collision",
        lambda m, r, o, o1: 2 * _modulus(m) * math.sqrt(r / 2 * o),
    ),
    GeneralRule(
        "elastic energy over volume, δ ∝ s",
        "J/m^3",
        0,
        "energy density",
        lambda m, r, o, o1: _energy_density(m, r, o),
    ),
    GeneralRule("dashpot 2 √(5/6) √(S_n m*), δ ∝ s", "kg/s", 2, "restitution", lambda m, r, o, o1: _dashpot(m, r, o)),
    GeneralRule("the same at equal overlap", "kg/s", 1.75, "restitution", lambda m, r, o, o1: _dashpot(m, r, o1)),
    GeneralRule(
        "time step", "s", 1, "share of the Rayleigh time", lambda m, r, o, o1: SAFE_STEP * rayleigh_time_step(r, m)
    ),
)


@dataclass(frozen=True)
class CoarseGraining:
    """Grains `factor` times as large that stand in for factor³ grains each, in the apparatus as it is.

    Density, moduli and coefficients of restitution and friction are kept, so that mass ∝ s³, moment of inertia ∝ s⁵, the
    coefficient of Hertz's law ∝ √s and the energy density of a collision is kept. The dashpot follows by itself:
    2 √(5/6) β √(S_n m*) at kept restitution is ∝ s^1.75 at equal overlap and ∝ s² in similar collisions, where the overlap
    grows as s; s^1.5, the paper's rule, is the part √m* of it, at equal stiffness S_n. Every effect changes its
    parameters by p′ = s^k p and states what that keeps (`Effect.similarity`); contacts, walls and time step follow.

    Args:
        factor: s, 1 or more.

    Raises:
        InputError: a factor that is no finite number from 1.
    """

    factor: float

    def __post_init__(self) -> None:
        factor = self.factor
        number = isinstance(factor, (int, float, np.number)) and not isinstance(factor, bool)
        if not number or not math.isfinite(factor) or factor < 1:
            raise InputError(
                f"The factor of coarse graining is {factor!r}; allowed is a finite number from 1, where grains stay as they "
                "are. Give 2, say, for grains of twice the diameter."
            )

    def model(self, model: Model) -> Model:
        """Return the model with every effect's parameters under its rule.

        Raises:
            InputError: an effect that states no rule, or whose parameter would leave its bounds.
        """
        check_rules(model)
        return replace(model, effects=tuple(self._effect(effect) for effect in model.effects))

    def _effect(self, effect: Effect) -> Effect:
        try:
            return effect.coarse_grained(self.factor)
        except InputError as error:
            raise InputError(
                f"{effect.name} can't be coarse-grained by a factor of {self.factor:g}: {error} Take a smaller factor."
            ) from error

    def experiment(self, experiment: Experiment) -> Experiment:
        """Return the experiment with grains s times as large and s³ times fewer; the apparatus stays.

        Each setting states its own exponent. Numbers of grains are rounded to the nearest whole one, at least 1. A test of
        a single grain has no packing: it is the same test of a grain s times as large.

        Raises:
            InputError: an experiment that states no exponents, or an apparatus too small for the grains.
        """
        powers = setting_powers(experiment)
        held = {name: getattr(experiment.settings, name) for name in experiment.settings_type.model_fields}
        changed = {name: self._scaled(held[name], power) for name, power in powers.items() if held[name] is not None}
        try:
            return type(experiment)(**held | changed)
        except InputError as error:
            raise self.refusal(experiment, error) from error

    def refusal(self, experiment: Experiment, error: Exception) -> InputError:
        """Return the error for an experiment that can't be had at this factor."""
        return InputError(
            f"{experiment.name} can't be coarse-grained by a factor of {self.factor:g}: {error} Take a smaller factor, or "
            "start from a larger apparatus with more grains."
        )

    def _scaled(self, value: Any, power: float) -> Any:
        if isinstance(value, (tuple, list)):
            return tuple(self._scaled(part, power) for part in value)
        scaled = float(f"{value * self.factor**power:.{DIGITS}g}")
        return max(1, math.floor(scaled + 0.5)) if isinstance(value, int) else scaled

    def mass_kept(self, experiment: Experiment) -> float:
        """Return the mass of the coarse grains over that of the fine ones [1]; off 1 by the rounding to whole grains.

        1 for a test of a single grain, which stands for itself.
        """
        fine, coarse = experiment.particles_needed(), self.experiment(experiment).particles_needed()
        return 1.0 if fine == 1 else coarse * self.factor**3 / fine

    def table(self, model: Model, diameter: float = 0.006) -> pd.DataFrame:
        """Return every rule with the numbers before and after.

        Args:
            model: first the rules that hold for every model, of its first material, then those of its effects.
            diameter: of the grains before [m].

        Returns:
            Columns effect ("" for a general rule), parameter, pair ("" for all), unit, rule, exponent, before, after,
            keeps.
        """
        return pd.DataFrame([*self._general_rows(model.materials[0], diameter / 2), *self._effect_rows(model)])

    def _general_rows(self, material: Material, radius: float) -> Iterator[dict[str, Any]]:
        small, large = OVERLAP * radius, OVERLAP * radius * self.factor
        for rule in GENERAL:
            before = rule.value(material, radius, small, small)
            after = rule.value(material, self.factor * radius, large, small)
            yield _row("", rule.quantity, "", rule.unit, rule.exponent, before, after, rule.keeps)

    def _effect_rows(self, model: Model) -> Iterator[dict[str, Any]]:
        for effect, coarse in zip(model.effects, self.model(model).effects, strict=True):
            keeps = effect.similarity.kept if effect.similarity else "what is a share or an angle"
            for p in effect.parameters:
                before, after = _by_pair(effect.values[p.name]), _by_pair(coarse.values[p.name])
                for pair, value in before.items():
                    yield _row(effect.name, p.name, pair, p.unit, p.coarse_graining, value, after[pair], keeps)


def _by_pair(value: float | dict[str, float]) -> dict[str, float]:
    return value if isinstance(value, dict) else {"": value}


def _row(*cells: Any) -> dict[str, Any]:
    effect, parameter, pair, unit, exponent, before, after, keeps = cells
    return {
        "effect": effect,
        "parameter": parameter,
        "pair": pair,
        "unit": unit,
        "rule": rule_text(exponent),
        "exponent": float(exponent),
        "before": before,
        "after": after,
        "keeps": keeps,
    }


def rule_text(exponent: float) -> str:
    """Return the rule of an exponent k in words, "kept" or "× s^k"."""
    return "kept" if exponent == 0 else f"× s^{exponent:.3g}".removesuffix("^1")


def check_rules(model: Model) -> None:
    """Raise InputError for effects that don't say what coarse graining keeps; set-up effects are shares and angles."""
    silent = [e.name for e in model.effects if e.similarity is None and not isinstance(e, SetupEffect)]
    if silent:
        raise InputError(
            f"Coarse graining knows no rule for {', '.join(silent)}: {'it declares' if len(silent) == 1 else 'they declare'} "
            "no `similarity`. State in the effect what it keeps and the exponent of each parameter, or take it out of the "
            "model."
        )


def setting_powers(experiment: Experiment) -> dict[str, float]:
    """Return the exponents of the settings that coarse graining changes, those that are not 0.

    Raises:
        InputError: an experiment that states none, or that has many grains and doesn't say which setting counts them.
    """
    powers = {}
    for name, declared in experiment.settings_type.model_fields.items():
        extra = declared.json_schema_extra
        power = extra.get("coarse_graining", 0.0) if isinstance(extra, dict) else 0.0
        if power:
            powers[name] = float(power)  # type: ignore[arg-type]
    if not powers or (experiment.particles_needed() > 1 and -3.0 not in powers.values()):
        lacking = "how many grains there are" if powers else "any of its settings"
        raise InputError(
            f"{experiment.name} can't be coarse-grained: it doesn't state the rule of {lacking}. Declare them in its settings, "
            "quantity(..., coarse_graining=1) for the diameter and −3 for numbers of grains."
        )
    return powers
