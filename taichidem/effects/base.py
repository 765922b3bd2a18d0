"""What a physical effect declares: its parameters, its memory, its needs and one pure function.

An effect is at once a force in the kernel, a factor in a design (`effect.parameter`) and a hypothesis about what a model
lacks. The engine knows only this declaration; no name of an effect stands in it.
"""

# No `from __future__ import annotations` here: effects hold Taichi functions, whose annotations must be types.

import difflib
from collections.abc import Mapping, Sequence
from enum import IntEnum
from typing import Any, ClassVar

import numpy as np

from taichidem.bodies import Bodies, Kind
from taichidem.effects.declarations import IN_COLLISION, UNDER_WEIGHT, Memory, Parameter, Similarity
from taichidem.effects.probe import ProbeScale, between
from taichidem.errors import InputError
from taichidem.materials import MaterialPair
from taichidem.shapes.base import GrainShape

PairValues = Mapping[str, float]

__all__ = [
    "IN_COLLISION",
    "UNDER_WEIGHT",
    "BodyEffect",
    "ContactEffect",
    "Effect",
    "Memory",
    "Parameter",
    "SetupEffect",
    "Similarity",
    "Stage",
]


class Stage(IntEnum):
    """When a contact effect acts; later stages may read what earlier ones wrote into the contact."""

    NORMAL = 0
    ADHESION = 1
    SLIDING = 2  # changes how the tangential effect slides
    TANGENTIAL = 3
    ROLLING = 4
    TWISTING = 5


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
    needs: ClassVar[Mapping[str, tuple[str, ...]]] = {}  # family → names of which one must be there, () for any
    similarity: ClassVar[Similarity | None] = None  # what coarse graining keeps
    visible_as: ClassVar[str] = ""  # what a person sees when it is strong
    # Kinds of bodies that it can act on, and why on no other, as what follows "since".
    shapes: ClassVar[tuple[Kind, ...]] = ("sphere", "multisphere", "superquadric")
    shapes_reason: ClassVar[str] = ""
    source: ClassVar[str] = ""
    # As a hypothesis: what grows with its strength, the first of which measures it (by default all that `strongest` gives
    # and that has a vanishing value); whether a negative strength has a meaning; whether it acts wholly or not at all.
    grows: ClassVar[tuple[str, ...]] = ()
    two_sided: ClassVar[bool] = False
    all_or_nothing: ClassVar[bool] = False

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
    def options(self) -> dict[str, object]:
        """What was chosen at construction besides the values; another option is another kernel."""
        return {name: held for name, held in vars(self).items() if name != "values"}

    def with_values(self, **changes: "float | PairValues") -> "Effect":
        """Return a copy with some values changed."""
        given: dict[str, Any] = {**self.options, **self.values, **changes}
        return type(self)(**given)

    def coarse_grained(self, factor: float) -> "Effect":
        """Return the effect for grains `factor` times as large, p′ = s^k p for every parameter."""
        changes: dict[str, float | PairValues] = {}
        for p in self.parameters:
            held, scale = self.values[p.name], factor**p.coarse_graining
            changes[p.name] = {k: v * scale for k, v in held.items()} if isinstance(held, dict) else held * scale
        return self.with_values(**changes)

    def vanished(self) -> "Effect":
        """Return a copy that does nothing: every parameter with a vanishing value at it, the others as they are."""
        return self.with_values(**{p.name: p.vanishing for p in self.parameters if p.vanishing is not None})

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return values with which nobody would overlook the effect; by default the far ends of the plausible ranges.

        Args:
            scale: the grain and the tests; what competes with weight or stiffness is measured against theirs.
        """
        return {
            p.name: max(p.plausible, key=lambda value, p=p: abs(value - p.vanishing))  # type: ignore[misc]
            for p in cls.parameters
            if p.vanishing is not None and p.default != p.vanishing
        }

    @classmethod
    def growing(cls, scale: ProbeScale) -> tuple[str, ...]:
        """Return the parameters that grow with the strength; the first one measures it."""
        vanishing = {p.name for p in cls.parameters if p.vanishing is not None}
        return cls.grows or tuple(name for name in cls.strongest(scale) if name in vanishing)

    @classmethod
    def at_strength(cls, share: float, scale: ProbeScale, present: "Sequence[Effect]") -> "Effect":
        """Return the effect at a share of its strongest setting, p = p₀ + share (p₁ − p₀), p₀ where it vanishes.

        Args:
            share: 0 where it does nothing, 1 at the strongest; negative only for a `two_sided` effect.
            scale: the grain and the tests.
            present: effects of the model that it joins, some of which may lend it values.
        """
        start = {p.name: p.vanishing for p in cls.parameters}
        values = cls.strongest(scale)
        for name in cls.growing(scale):
            values[name] = between(start[name], values[name], share)  # type: ignore[arg-type]
        return cls(**values)

    @property
    def composition(self) -> tuple:
        """What the compiled kernel depends on: the class and its options (every attribute but the values)."""
        return (type(self), *sorted(self.options.items()))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.values.items())})"


class ContactEffect(Effect):
    """A force or couple between two touching elements.

    A subclass declares `stage`, `memory`, `coefficients` (names of the numbers its kernel needs) and writes
    `kernel_coefficients` (Python: parameters and materials → those numbers) and `wrench` (a `ti.func`).

    An effect that acts before touch returns a `reach`. One whose bodies carry an amount that contacts exchange (liquid, say)
    names it in `carries`, returns `initial_amounts`, and its `wrench` takes a Holding as last argument. Its `release` gives
    back what a contact holds that ended out of its sight: beyond the reach, at the edge of a mesh, at a wall taken away.
    """

    stage: ClassVar[Stage]
    memory: ClassVar[tuple[Memory, ...]] = ()
    coefficients: ClassVar[tuple[str, ...]] = ()
    carries: ClassVar[str] = ""  # name and unit of the amount that bodies carry, such as "liquid [m^3]"
    conservative: ClassVar[bool] = False  # True: has a ti.func `energy(p, c)` whose slope is the force

    def kernel_coefficients(self, pair: MaterialPair) -> dict[str, float]:
        """Return the numbers named in `coefficients` for a pair of materials."""
        return {name: self.value(name, pair) for name in self.coefficients}

    def reach(self, pair: MaterialPair, largest_radius: float) -> float:
        """Return the surface gap [m] up to which the effect acts on a pair; 0 for effects of touching grains only.

        Args:
            pair: materials of the contact.
            largest_radius: of any grain that will ever be there [m].
        """
        return 0.0

    def initial_amounts(self, mass: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Return what new bodies of mass [kg] and radius [m], (n,), carry of the amount named in `carries`."""
        return np.zeros(len(mass))

    def wrench(self, p, c, m):  # type: ignore[no-untyped-def]
        """Return the Wrench on side i; `p` coefficients, `c` Contact, `m` this effect's memory."""
        raise NotImplementedError(f"{type(self).__name__} must define wrench(self, p, c, m) as a ti.func")

    def release(self, m, h, at_wall):  # type: ignore[no-untyped-def]
        """Put into the Holding `h` what the memory `m` holds of the carried amount, and empty the memory."""
        raise NotImplementedError(f"{type(self).__name__} must define release(self, m, h, at_wall) as a ti.func")


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

    def grain_shape(self) -> GrainShape | None:
        """Return the form of the grains in place of spheres, at any size, or None where they stay what they are.

        A model holds one thing that says so: an effect that overrides this, or its own `shape`.
        """
        return None

    def grains(self, bodies: Bodies) -> Bodies:
        """Return what is put into the apparatus in place of these bodies: of the same form, such as of another mass."""
        return bodies


class BodyEffect(Effect):
    """A force or couple on a single body; `wrench(p, b)` is a `ti.func`, its parameters are one number per world.

    Gravity acts first and leaves its field in `b.gravity`.
    """

    @property
    def coefficients(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def kernel_coefficients(self) -> dict[str, float]:
        """Return the numbers named in `coefficients`."""
        return {name: self.value(name) for name in self.coefficients}

    def wrench(self, p, b):  # type: ignore[no-untyped-def]
        """Return the Wrench on the body; `p` coefficients, `b` Body."""
        raise NotImplementedError(f"{type(self).__name__} must define wrench(self, p, b) as a ti.func")
