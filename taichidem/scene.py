"""What to simulate, said with plain values: a model (materials and effects) in an apparatus (walls, grains, domain)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from taichidem.bodies import Bodies, Kind
from taichidem.effects.base import ContactEffect
from taichidem.effects.law import check_shapes
from taichidem.errors import CompositionError, InputError
from taichidem.materials import MaterialPair, rayleigh_time_step
from taichidem.model import Model
from taichidem.walls import Motion, Wall

__all__ = ["Model", "Scene"]

SAFE_STEP = 0.2  # of the Rayleigh time
LARGEST_STEP = 0.3  # of the Rayleigh time, beyond which contacts are not resolved


@dataclass(frozen=True, kw_only=True)
class Scene:
    """One world: a model, walls, the grains it starts with and room for those that come.

    Args:
        model: materials and effects.
        walls: rigid walls.
        bodies: grains present at time 0.
        grains_like: a grain of each kind that will come later, where they are no single spheres or none is there yet; from it
            the scene learns their radii and what engine they need.
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
    grains_like: Bodies | None = None
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
        for known in filter(None, (self.bodies, self.grains_like)):
            largest, smallest = float(known.element_radius.max()), known.smallest_radius
            object.__setattr__(self, "largest_radius", max(self.largest_radius, largest))
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
        check_shapes(tuple(self.model.effects), self.kind)
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
        least = 4 / 3 * math.pi * density * self.smallest_size**3
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
        smallest, largest = bodies.smallest_radius, float(bodies.element_radius.max())
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

    @property
    def kind(self) -> Kind:
        """The kind of bodies that the scene's engine must know."""
        kinds = {known.kind for known in (self.bodies, self.grains_like) if known is not None}
        if kinds >= {"multisphere", "superquadric"}:
            raise CompositionError(
                "The scene holds bodies composed of spheres and superquadrics; one engine knows one of the two. Describe all "
                "of them by spheres, or all by superquadrics."
            )
        return next((kind for kind in ("superquadric", "multisphere") if kind in kinds), "sphere")  # type: ignore[return-value]

    @property
    def smallest_size(self) -> float:
        """Radius of the sphere of the smallest known grain's volume [m]."""
        if self.kind == "sphere":
            return self.smallest_radius
        return min(float(known.radius.min()) for known in (self.bodies, self.grains_like) if known is not None)

    @property
    def elements_per_body(self) -> float:
        """The most contact elements that a body of a kind known to the scene has on average."""
        known = [bodies for bodies in (self.bodies, self.grains_like) if bodies is not None]
        return max((len(b.element_body) / len(b) for b in known), default=1.0)

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
