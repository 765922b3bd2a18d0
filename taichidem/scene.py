"""What to simulate, said with plain values: a model (materials and effects) in an apparatus (walls, grains, domain)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taichidem.bodies import Bodies
from taichidem.effects.base import ContactEffect, Effect, SetupEffect
from taichidem.effects.body_gravity import BodyGravity
from taichidem.effects.law import check_composition
from taichidem.errors import InputError, unknown_name
from taichidem.materials import Material, MaterialPair, rayleigh_time_step
from taichidem.walls import Motion, Wall

SAFE_STEP = 0.2  # of the Rayleigh time
LARGEST_STEP = 0.3  # of the Rayleigh time, beyond which contacts are not resolved


@dataclass(frozen=True)
class Model:
    """What grains and walls are made of, and which physical effects act.

    Args:
        materials: the solids; contacts name them.
        effects: instances, in any order; at most one per family.

    Raises:
        CompositionError: effects that exclude each other.
        InputError: two materials of one name, or a parameter given for a pair of materials that do not exist.
    """

    materials: Sequence[Material]
    effects: Sequence[Effect]

    def __post_init__(self) -> None:
        object.__setattr__(self, "materials", tuple(self.materials))
        object.__setattr__(self, "effects", tuple(self.effects))
        names = [m.name for m in self.materials]
        if not names or len(set(names)) != len(names):
            raise InputError(f"Materials are named {names}; give at least one, each with a name of its own.")
        check_composition(tuple(self.effects))
        for effect in self.effects:
            for parameter, value in effect.values.items():
                for pair in value if isinstance(value, dict) else ():
                    self._check_pair(f"{effect.name}.{parameter}", pair)

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
        return Model(self.materials, kept)

    def without_gravity(self) -> Model:
        """Return a copy in which nothing falls; it runs on the same compiled law."""
        none = BodyGravity(x=0.0, y=0.0, z=0.0)
        return Model(self.materials, [none if isinstance(e, BodyGravity) else e for e in self.effects])

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
        return Model(self.materials, [replaced if e is effect else e for e in self.effects])


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One world: a model, walls, the grains it starts with and room for those that come.

    Args:
        model: materials and effects.
        walls: rigid walls.
        bodies: grains present at time 0.
        room: largest number of bodies at any time; by default those present at the start.
        domain: lower and upper corner [m]; what leaves it is removed.
        largest_radius, smallest_radius: of any grain that will ever be there [m]; by default those of `bodies`.
        time_step: [s]; by default 0.2 of the Rayleigh time of the smallest grain.
        force_time_step: allow a step above 0.3 of the Rayleigh time.
        skin: margin of the neighbour lists [m]; by default a share of the largest radius that suits a pour.
        partners: listed partners per element to make room for.

    Raises:
        InputError: a time step too large for the contacts, a domain without volume, too little room.
    """

    model: Model
    walls: Sequence[Wall] = ()
    bodies: Bodies | None = None
    room: int = 0
    domain: tuple[Sequence[float], Sequence[float]]
    largest_radius: float = 0.0
    smallest_radius: float = 0.0
    time_step: float | None = None
    force_time_step: bool = False
    skin: float | None = None
    partners: float = 12.0
    grain_materials: Sequence[str] = field(default=())

    def __post_init__(self) -> None:
        lower, upper = (np.asarray(corner, float) for corner in self.domain)
        if (
            lower.shape != (3,)
            or upper.shape != (3,)
            or not np.all(np.isfinite([lower, upper]))
            or np.any(upper <= lower)
        ):
            raise InputError(
                f"domain is {self.domain!r}; give a lower and a higher corner of three finite numbers [m]."
            )
        present = 0 if self.bodies is None else len(self.bodies)
        room = max(self.room, present)
        if room < 1:
            raise InputError(
                "The scene has no grains and no room for any; give bodies, or room for those that will come."
            )
        object.__setattr__(self, "room", room)
        if self.bodies is not None:
            radii = self.bodies.element_radius
            object.__setattr__(self, "largest_radius", max(self.largest_radius, float(radii.max())))
            smallest = float(radii.min())
            object.__setattr__(self, "smallest_radius", min(self.smallest_radius or smallest, smallest))
        object.__setattr__(self, "smallest_radius", self.smallest_radius or self.largest_radius)
        if not 0 < self.smallest_radius <= self.largest_radius:
            raise InputError("The scene needs the radius of its grains: give bodies, or largest_radius above 0 [m].")
        self._check_lists()
        for wall in self.walls:
            self.model.material_number(wall.material)
            self.check_load(wall.name, wall.motion)
            if math.isnan(wall.removed_at):
                raise InputError(f"Wall {wall.name!r}: removed_at is nan; give a time [s], or leave it out.")
        for name in self.grain_materials:
            self.model.material_number(name)
        if self.bodies is None:
            self._check_time_step()
        else:
            self.check_bodies(self.bodies)
        for pair in self.model.pairs():
            for effect in self.model.effects:
                if isinstance(effect, ContactEffect) and self.can_touch(pair):
                    effect.kernel_coefficients(pair)

    def _check_lists(self) -> None:
        if self.skin is not None and not (math.isfinite(self.skin) and self.skin >= 0):
            raise InputError(f"skin is {self.skin!r}; it must be a finite number from 0 [m], or left out.")
        if not (math.isfinite(self.partners) and self.partners > 0):
            raise InputError(
                f"partners is {self.partners!r}; it must be a finite number above 0 (12 suits most scenes)."
            )

    def check_load(self, name: str, motion: Motion) -> None:
        """Raise InputError for a loaded wall so light that the time step, chosen for the grains, can't follow it."""
        density = min(m.density for m in self.model.materials if m.name in self.grain_names)
        least = 4 / 3 * math.pi * density * self.smallest_radius**3
        if any(motion.load) and motion.mass < least:
            raise InputError(
                f"Wall {name!r} is loaded and has a mass of {motion.mass:.3g} kg, less than the lightest grain ({least:.3g} kg); "
                "the time step doesn't resolve how it would bounce. Give it the mass of the grains below it, or more."
            )

    def check_bodies(self, bodies: Bodies) -> None:
        """Raise InputError for grains that the scene's lists, step or materials do not fit."""
        numbers = np.unique(bodies.element_material)
        grains = [k for k, m in enumerate(self.model.materials) if m.name in self.grain_names]
        if not np.all(np.isin(numbers, grains)):
            raise InputError(
                f"Grains have material numbers {numbers.tolist()}; this scene's grains may have "
                f"{', '.join(f'{k} ({self.model.materials[k].name!r})' for k in grains)}. Correct the number, or add the "
                "material to grain_materials."
            )
        smallest, largest = float(bodies.element_radius.min()), float(bodies.element_radius.max())
        if largest > self.largest_radius * (1 + 1e-9) or smallest < self.smallest_radius * (1 - 1e-9):
            raise InputError(
                f"Grains have radii from {smallest:g} to {largest:g} m; the scene was laid out for {self.smallest_radius:g} "
                f"to {self.largest_radius:g} m. Give it smallest_radius and largest_radius of all that will come."
            )
        self._check_time_step()
        self._check_density(bodies)
        lower, upper = (np.asarray(corner, float) for corner in self.domain)
        outside = np.any((bodies.position < lower) | (bodies.position > upper), axis=1)
        if np.any(outside):
            first = int(np.flatnonzero(outside)[0])
            raise InputError(
                f"{int(outside.sum())} of {len(bodies)} grains lie outside the domain {self.domain!r}, the first at "
                f"{bodies.position[first].tolist()}. Move them, or enlarge the domain."
            )

    def _check_density(self, bodies: Bodies) -> None:
        """Refuse bodies so light that the time step no longer resolves their contacts."""
        lightest = float((bodies.mass / (4 / 3 * np.pi * bodies.radius**3)).min())
        declared = min(m.density for m in self.model.materials if m.name in self.grain_names)
        allowed = LARGEST_STEP * self.rayleigh_time() * math.sqrt(min(1.0, lightest / declared))
        if self.dt > allowed and not self.force_time_step:
            raise InputError(
                f"Bodies as light as {lightest:.4g} kg/m^3 were given; their materials have {declared:.4g}, and the time step "
                f"{self.dt:.3g} s is above {LARGEST_STEP} of the bodies' own Rayleigh time. Give them the material's density, "
                f"take a step of at most {allowed:.3g} s, or set force_time_step=True."
            )

    def can_touch(self, pair: MaterialPair) -> bool:
        """Return True if a grain may be of the pair's first material (walls don't touch walls)."""
        return pair.first.name in self.grain_names

    @property
    def grain_names(self) -> set[str]:
        """Materials that grains may have: those announced, else those present at the start, else all."""
        if self.grain_materials:
            return set(self.grain_materials)
        if self.bodies is not None:
            known = range(len(self.model.materials))
            return {self.model.materials[k].name for k in np.unique(self.bodies.element_material) if k in known}
        return {m.name for m in self.model.materials}

    def reach(self) -> float:
        """Return the largest gap [m] at which an effect acts in this scene."""
        return self.model.reach(self.largest_radius, self.grain_names)

    def rayleigh_time(self) -> float:
        """Return the shortest Rayleigh time of the scene's grains [s]."""
        return min(
            rayleigh_time_step(self.smallest_radius, m) for m in self.model.materials if m.name in self.grain_names
        )

    @property
    def dt(self) -> float:
        """The time step used [s]."""
        return self.time_step if self.time_step is not None else SAFE_STEP * self.rayleigh_time()

    def _check_time_step(self) -> None:
        rayleigh = self.rayleigh_time()
        if not (math.isfinite(self.dt) and self.dt > 0):
            raise InputError(f"time_step is {self.time_step!r} s; it must be a finite number above 0.")
        if self.dt > LARGEST_STEP * rayleigh and not self.force_time_step:
            raise InputError(
                f"time_step is {self.dt:.3g} s, {self.dt / rayleigh:.2f} of the Rayleigh time {rayleigh:.3g} s; allowed is "
                f"up to {LARGEST_STEP}. Take {SAFE_STEP * rayleigh:.3g} s or less, soften the material, or set "
                "force_time_step=True if you know that contacts stay resolved."
            )
