"""What grains and walls are made of, and which physical effects act."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from taichidem.bodies import Kind
from taichidem.effects.base import ContactEffect, Effect, SetupEffect
from taichidem.effects.body_gravity import BodyGravity
from taichidem.effects.law import check_composition, check_shapes
from taichidem.errors import CompositionError, InputError, unknown_name
from taichidem.materials import Material, MaterialPair
from taichidem.shapes.base import GrainShape


@dataclass(frozen=True)
class Model:
    """What grains and walls are made of, and which physical effects act.

    Args:
        materials: the solids; contacts name them.
        effects: instances, in any order; at most one per family.
        shape: form of the grains, at any size: experiments give them the volume of a sphere of their `diameter`. Spheres
            where left out.

    Raises:
        CompositionError: effects that exclude each other or the shape.
        InputError: two materials of one name, or a parameter given for a pair of materials that do not exist.
    """

    materials: Sequence[Material]
    effects: Sequence[Effect]
    shape: GrainShape | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "materials", tuple(self.materials))
        object.__setattr__(self, "effects", tuple(self.effects))
        names = [m.name for m in self.materials]
        if not names or len(set(names)) != len(names):
            raise InputError(f"Materials are named {names}; give at least one, each with a name of its own.")
        check_composition(tuple(self.effects))
        self._check_shape()
        for effect in self.effects:
            for parameter, value in effect.values.items():
                for pair in value if isinstance(value, dict) else ():
                    self._check_pair(f"{effect.name}.{parameter}", pair)

    def _check_shape(self) -> None:
        if not isinstance(self.shape, GrainShape | None):
            raise InputError(
                f"shape is {self.shape!r}; give a form such as Superquadric.spheroid(1.5), or leave it out for spheres."
            )
        shaping = [e.name for e in self.set_up_effects if type(e).grain_shape is not SetupEffect.grain_shape]
        if len(shaping) + (self.shape is not None) > 1:
            others = f" and the model's shape, {self.shape!r}," if self.shape is not None else ""
            raise CompositionError(
                f"{' and '.join(repr(name) for name in shaping)}{others} both say what form the grains have. Leave one out."
            )
        check_shapes(tuple(self.effects), self.grain_kind)

    def _check_pair(self, where: str, pair: str) -> None:
        parts = pair.split("-")
        if len(parts) != 2:
            raise InputError(f"{where} is given for {pair!r}; a pair is written 'first-second'.")
        for part in parts:
            if part not in [m.name for m in self.materials]:
                raise unknown_name(f"material in {where} of {pair!r}:", part, [m.name for m in self.materials])

    def material_number(self, name: str) -> int:
        """Return the position of a material in the model."""
        names = [m.name for m in self.materials]
        if name not in names:
            raise unknown_name("material", name, names)
        return names.index(name)

    def pairs(self) -> list[MaterialPair]:
        """Return every ordered pair of materials, row by row."""
        return [MaterialPair(a, b) for a in self.materials for b in self.materials]

    def relative_sizes(self) -> tuple[float, ...]:
        """Return the radii of grains over their nominal radius, in equal numbers."""
        sizes = [s for e in self.set_up_effects if (s := e.relative_sizes()) != (1.0,)]
        return sizes[0] if sizes else (1.0,)

    @property
    def grain_shape(self) -> GrainShape | None:
        """The form of the grains, that of a set-up effect or the model's own; None for spheres."""
        given = [shape for e in self.set_up_effects if (shape := e.grain_shape()) is not None]
        return given[0] if given else self.shape

    @property
    def grain_kind(self) -> Kind:
        """What the grains need of an engine; worlds that differ in it can't share one."""
        shape = self.grain_shape
        return "sphere" if shape is None else shape.kind

    @property
    def set_up_effects(self) -> tuple[SetupEffect, ...]:
        """The effects that change grains or apparatus instead of acting in the kernel."""
        return tuple(e for e in self.effects if isinstance(e, SetupEffect))

    def acting(self) -> Model:
        """Return the model as it acts in the apparatus: set-up effects have changed what they change, and are gone."""
        changes = self.set_up_effects
        kept = [e for e in self.effects if not isinstance(e, SetupEffect)]
        for k, effect in enumerate(kept):
            if isinstance(effect, BodyGravity):
                field = np.array([effect.value(axis) for axis in "xyz"])
                for change in changes:
                    field = change.gravity(field)
                kept[k] = BodyGravity(**dict(zip("xyz", field.tolist(), strict=True)))
        return replace(self, effects=kept, shape=self.grain_shape)

    def without_gravity(self) -> Model:
        """Return a copy in which nothing falls; it runs on the same compiled law."""
        none = BodyGravity(x=0.0, y=0.0, z=0.0)
        return replace(self, effects=[none if isinstance(e, BodyGravity) else e for e in self.effects])

    def reach(self, largest_radius: float, grain_names: set[str]) -> float:
        """Return the largest gap [m] at which an effect acts on grains up to a radius [m] of the named materials."""
        pairs = [pair for pair in self.pairs() if pair.first.name in grain_names]
        contact = [e for e in self.effects if isinstance(e, ContactEffect)]
        return max((e.reach(pair, largest_radius) for e in contact for pair in pairs), default=0.0)

    def with_value(self, name: str, value: float, pair: str | None = None) -> Model:
        """Return a copy with the parameter "effect.parameter" changed.

        Args:
            name: effect and parameter, joined by a dot.
            value: the new value, in the parameter's unit.
            pair: the pair of materials "a-b" it holds for; where left out, a parameter that differs between pairs
                changes for the first material with itself, and any other for every pair.

        Raises:
            InputError: an unknown effect, parameter or material, or a value out of bounds.
        """
        effect_name, _, parameter = name.partition(".")
        names = [e.name for e in self.effects]
        if effect_name not in names:
            raise unknown_name("effect", effect_name, names)
        effect = self.effects[names.index(effect_name)]
        held = effect.values.get(parameter)
        new: float | dict[str, float] = value
        if pair is not None or isinstance(held, dict):
            first = self.materials[0].name
            every = held if isinstance(held, dict) else {f"{p.first.name}-{p.second.name}": held for p in self.pairs()}
            changed = pair or f"{first}-{first}"
            reverse = "-".join(reversed(changed.split("-")))
            new = {k: v for k, v in every.items() if k != reverse and v is not None} | {changed: value}
        replaced = effect.with_values(**{parameter: new})
        return replace(self, effects=[replaced if e is effect else e for e in self.effects])
