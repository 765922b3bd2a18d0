"""What a physical effect declares: its parameters, its memory, its needs and one pure function.

An effect is at once a force in the kernel, a factor in a design (`effect.parameter`) and a hypothesis about what a model
lacks. The engine knows only this declaration; no name of an effect stands in it.
"""

# No `from __future__ import annotations` here: effects hold Taichi functions, whose annotations must be types.

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar

import numpy as np

from taichidem.errors import InputError
from taichidem.materials import MaterialPair

PairValues = Mapping[str, float]


class Stage(IntEnum):
    """When a contact effect acts; later stages may read what earlier ones wrote into the contact."""

    NORMAL = 0
    ADHESION = 1
    TANGENTIAL = 2
    ROLLING = 3
    TWISTING = 4


@dataclass(frozen=True)
class Parameter:
    """A named number of an effect.

    Args:
        name: whole words, unique within the effect.
        unit: SI unit as text, "1" for a pure number.
        low, high: physical bounds, inclusive unless `open_low`.
        plausible: range in which real materials lie; a design takes it where the user gives none.
        vanishing: value at which the effect does nothing, or None where there is none.
        default: value used when none is given; None makes the parameter required.
        per_pair: True if each pair of materials may have its own value.
        meaning: one sentence.
    """

    name: str
    unit: str
    low: float
    high: float
    plausible: tuple[float, float]
    meaning: str
    vanishing: float | None = None
    default: float | None = None
    per_pair: bool = True
    open_low: bool = False

    def check(self, effect: str, where: str, value: float) -> float:
        """Return the value as a float; raise InputError when it is no number or out of bounds."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        below = number <= self.low if self.open_low else number < self.low
        if not math.isfinite(number) or below or number > self.high:
            low = "above" if self.open_low else "from"
            raise InputError(
                f"{effect}.{self.name}{where} is {value!r}; allowed is {low} {self.low:g} to {self.high:g} [{self.unit}]. "
                f"{self.meaning} Plausible: {self.plausible[0]:g} to {self.plausible[1]:g}."
            )
        return number


@dataclass(frozen=True)
class Memory:
    """A quantity that a contact remembers while it lives.

    Args:
        name: whole words.
        size: 1 for a number, 3 for a vector.
        odd: True if it changes sign when the two sides are swapped (any quantity of i relative to j).
    """

    name: str
    size: int = 3
    odd: bool = True


class Effect:
    """Base of all effects; holds the values a user gave and checks them.

    Values are one number for every pair of materials, or a mapping "a-b" → number. The pair's order does not matter.

    Raises:
        InputError: an unknown parameter, a missing one, or a value outside its physical bounds.
    """

    name: ClassVar[str] = ""
    title: ClassVar[str] = ""
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    family: ClassVar[str] = ""  # at most one effect of a family in a model, "" where any number may act together
    visible_as: ClassVar[str] = ""  # what a person sees when it is strong
    source: ClassVar[str] = ""

    def __init__(self, **values: "float | PairValues") -> None:
        known = {p.name: p for p in self.parameters}
        for given in values:
            if given not in known:
                near = difflib.get_close_matches(given, known, n=1, cutoff=0.4)
                hint = f" Did you mean {near[0]!r}?" if near else ""
                raise InputError(
                    f"Unknown parameter {given!r} of effect {self.name!r}. Allowed: {', '.join(known) or 'none'}.{hint}"
                )
        self.values: dict[str, float | dict[str, float]] = {
            p.name: self._checked(p, values.get(p.name, p.default)) for p in self.parameters
        }

    def _checked(self, parameter: Parameter, value: "float | PairValues | None") -> "float | dict[str, float]":
        if value is None:
            raise InputError(f"{self.name}.{parameter.name} [{parameter.unit}] is missing. {parameter.meaning}")
        if not isinstance(value, Mapping):
            return parameter.check(self.name, "", value)
        if not parameter.per_pair:
            raise InputError(f"{self.name}.{parameter.name} is one number for the whole model; {value!r} was given.")
        for pair in value:
            reverse = "-".join(reversed(pair.split("-")))
            if reverse != pair and reverse in value:
                raise InputError(
                    f"{self.name}.{parameter.name} is given for {pair!r} and for {reverse!r}, which are one pair. Leave one out."
                )
        return {pair: parameter.check(self.name, f" of {pair}", number) for pair, number in value.items()}

    def value(self, parameter: str, pair: MaterialPair | None = None) -> float:
        """Return a parameter's value, for a pair of materials where it has one per pair.

        Raises:
            InputError: no value was given for this pair.
        """
        held = self.values[parameter]
        if not isinstance(held, dict):
            return held
        assert pair is not None
        first, second = pair.first.name, pair.second.name
        for key in (f"{first}-{second}", f"{second}-{first}"):
            if key in held:
                return held[key]
        raise InputError(
            f"{self.name}.{parameter} has no value for the pair '{first}-{second}'. "
            f"Given: {', '.join(held) or 'none'}. Add '{first}-{second}', or give one number for every pair."
        )

    @property
    def composition(self) -> tuple:
        """What the compiled kernel depends on: the class and its options (every attribute but the values)."""
        options = sorted((name, held) for name, held in vars(self).items() if name != "values")
        return (type(self), *options)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.values.items())})"


class ContactEffect(Effect):
    """A force or couple between two touching elements.

    A subclass declares `stage`, `memory`, `coefficients` (names of the numbers its kernel needs) and writes
    `kernel_coefficients` (Python: parameters and materials → those numbers) and `wrench` (a `ti.func`).
    """

    stage: ClassVar[Stage]
    memory: ClassVar[tuple[Memory, ...]] = ()
    coefficients: ClassVar[tuple[str, ...]] = ()
    conservative: ClassVar[bool] = False

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return the numbers named in `coefficients` for a pair of materials."""
        return {name: self.value(name, pair) for name in self.coefficients}

    def reach(self) -> float:
        """Return the surface gap [m] up to which the effect acts; 0 for effects of touching grains only."""
        return 0.0

    def wrench(self, p, c, m):  # type: ignore[no-untyped-def]
        """Return the Wrench on side i; `p` coefficients, `c` Contact, `m` this effect's memory."""
        raise NotImplementedError(f"{type(self).__name__} must define wrench(self, p, c, m) as a ti.func")


class SetupEffect(Effect):
    """A hypothesis about the set-up: what the grains are or how the apparatus stands, not a force in the kernel.

    A subclass overrides what it changes. It is a factor and a hypothesis like any other effect, and at its vanishing value
    it changes nothing.
    """

    def gravity(self, gravity: np.ndarray) -> np.ndarray:
        """Return the acceleration of free fall in the frame of the apparatus, (3,) [m/s²]."""
        return gravity

    def relative_sizes(self) -> tuple[float, ...]:
        """Return the radii of the grains over the nominal one, in equal numbers."""
        return (1.0,)


class BodyEffect(Effect):
    """A force or couple on a single body; `wrench(p, b)` is a `ti.func`, its parameters are one number per world."""

    @property
    def coefficients(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def kernel_coefficients(self) -> dict[str, float]:
        """Return the numbers named in `coefficients`."""
        return {name: self.value(name) for name in self.coefficients}

    def wrench(self, p, b):  # type: ignore[no-untyped-def]
        """Return the Wrench on the body; `p` coefficients, `b` Body."""
        raise NotImplementedError(f"{type(self).__name__} must define wrench(self, p, b) as a ti.func")
