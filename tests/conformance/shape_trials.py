"""Every registered effect on grains that are no single spheres, with as few compiled laws as the registry allows."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichidem.bodies import Bodies, Kind
from taichidem.effects.base import BodyEffect, ContactEffect, Effect, Stage
from taichidem.effects.law import check_composition
from taichidem.errors import CompositionError
from taichidem.shapes import Multisphere, Superquadric
from taichidem.simulation import Simulation, Snapshot
from tests.apparatus import FLOOR, SOFT, ball, scene
from tests.conformance.registered import BODY, CONTACT
from tests.effect_bench import RADIUS, middle
from tests.shapes.pair_search import random_quaternions

EffectKind = type[Effect]

SHAPES: tuple[Kind, ...] = ("multisphere", "superquadric")
ACTING: list[EffectKind] = [*CONTACT, *BODY]
CLUMP = Multisphere.spheroid(1.5, 3, RADIUS)
ELLIPSOID = Superquadric(0.008, 0.01, 0.014)
ROUNDED_BOX = Superquadric(0.009, 0.009, 0.009, 4.0, 4.0)
# No ellipsoid to the engine, which has a search of their own for them.
ALMOST_SPHERE = Superquadric(RADIUS, RADIUS, RADIUS, float(np.nextafter(2, 3)), float(np.nextafter(2, 3)))

STEP = 2e-5  # [s], an impact here takes about a hundred
DURATION = {"round": 0.04, "free": 0.1, "floor": 0.06, "together": 0.02}  # [s]; where the grains are, and what they are


def fits(chosen: Iterable[EffectKind]) -> bool:
    """Return True if effects can act in one model."""
    try:
        check_composition(tuple(middle(kind) for kind in chosen))
    except CompositionError:
        return False
    return True


def needed(kind: EffectKind, chosen: Iterable[EffectKind]) -> list[EffectKind]:
    """Return the effects among the chosen ones on which an effect builds, but the normal one, which always acts."""
    return [other for other in chosen if other is not kind and other.family in kind.needs and other.family != "normal"]


def _grounded(kind: EffectKind, candidates: list[EffectKind]) -> list[EffectKind]:
    """Return an effect with what it needs from among the candidates, the first ones that will do."""
    wanted = dict(kind.needs)
    if issubclass(kind, ContactEffect) and kind.family != "normal":
        wanted.setdefault("normal", ())
    chosen = [kind]
    for family, names in wanted.items():
        chosen.append(next(k for k in candidates if k.family == family and (not names or k.name in names)))
    return chosen


def packed(kinds: Iterable[EffectKind]) -> list[tuple[EffectKind, ...]]:
    """Return few compositions in which every effect stands: greedily, those with the most particular needs first."""
    left = sorted(kinds, key=lambda kind: -len(kind.needs.get("normal", ())))
    every, made = list(left), []
    while left:
        chosen = _grounded(left[0], left + every)
        for kind in sorted(left, key=lambda kind: len(kind.needs)):
            if kind not in chosen and fits([*chosen, kind]):
                chosen.append(kind)
        made.append(tuple(sorted(chosen, key=lambda kind: kind.name)))
        left = [kind for kind in left if kind not in chosen]
    return made


PACKED = {shape: packed([kind for kind in ACTING if shape in kind.shapes]) for shape in SHAPES}


def composition_of(kind: EffectKind, shape: Kind) -> tuple[EffectKind, ...]:
    """Return the composition in which an effect is tried on a shape."""
    return next(chosen for chosen in PACKED[shape] if kind in chosen)


def law(chosen: Iterable[EffectKind], active: Iterable[EffectKind]) -> list[Effect]:
    """Return the effects of a composition, those that aren't active without what they do, or lose, a normal one."""
    return [middle(kind) if kind in active else _idle(middle(kind)) for kind in chosen]


def _idle(effect: Effect) -> Effect:
    lossless = {"restitution": 1.0} if "restitution" in effect.values else {}
    return effect.vanished().with_values(**lossless)


def _heap(seed: int, spacing: float) -> dict[str, Any]:
    """Return six grains on their way to the floor and to each other."""
    rng = np.random.default_rng(seed)
    place = [[a, 0.0, 0.75 + c] for a in range(2) for c in range(3)] + rng.uniform(-0.03, 0.03, (6, 3))
    velocity = rng.normal(0, 0.15, (6, 3)) + np.array([[0.2 - 0.4 * a, 0, -0.5] for a in range(2) for _ in range(3)])
    radius = RADIUS * np.linspace(0.8, 1.0, 6)
    return {"position": spacing * place, "velocity": velocity, "spin": rng.normal(0, 20, (6, 3)), "radius": radius}


def _meeting(seed: int) -> dict[str, Any]:
    """Return grains that meet in the middle of an empty space."""
    rng = np.random.default_rng(seed)
    place = np.array([[0.03, 0, 0], [-0.03, 0.01, 0], [0, 0.045, 0.005], [0, -0.04, 0], [0, 0, 0.06]])
    radius = RADIUS * np.linspace(0.8, 1.1, 5)
    return {"position": place, "velocity": -20 * place, "spin": rng.normal(0, 20, (5, 3)), "radius": radius}


def _others(shape: Kind, moving: dict[str, Any]) -> Bodies:
    """Return grains of a shape that are no spheres."""
    moving["orientation"] = random_quaternions(np.random.default_rng(9), len(moving["position"]))
    return _dealt([CLUMP] if shape == "multisphere" else [ELLIPSOID, ROUNDED_BOX], moving)


def _dealt(forms: list[Any], moving: dict[str, Any]) -> Bodies:
    """Return grains that take their forms in turn."""
    turns = len(forms)
    parts = [
        form.bodies(density=SOFT.density, **{name: column[k::turns] for name, column in moving.items()})
        for k, form in enumerate(forms)
    ]
    return Bodies.joined(parts)


def grains(shape: Kind, place: str) -> Bodies:
    """Return the grains of a world."""
    if place != "round":
        return _others(shape, _meeting(4) if place == "free" else _heap(5, 0.029))
    moving = _heap(2, 0.0215)  # in the order in which forms are dealt, which numbers the grains
    if shape != "superquadric":
        return Bodies.joined([ball(**{name: column[k::2] for name, column in moving.items()}) for k in range(2)])
    moving["orientation"] = random_quaternions(np.random.default_rng(7), 6)
    return _dealt([Superquadric.sphere(RADIUS), ALMOST_SPHERE], moving)


@dataclass(frozen=True)
class World:
    """A world of a trial: which effects act, and where."""

    active: frozenset[EffectKind]
    place: str


@dataclass(frozen=True)
class Outcome:
    """How a world began and ended."""

    bodies: Bodies
    start: Snapshot
    end: Snapshot

    def differs(self, other: Outcome) -> bool:
        """Return True if the motion is plainly another one."""
        pairs = [(getattr(self.end, name), getattr(other.end, name)) for name in ("velocity", "spin")]
        return any(np.abs(one - two).max() > 1e-6 * np.abs(two).max() for one, two in pairs)


def worlds_of(chosen: tuple[EffectKind, ...], shape: Kind) -> list[World]:
    """Return for each effect of a composition the worlds with it and without it, beside what it needs."""
    made: dict[World, None] = {}
    for kind in chosen:
        ground = frozenset(needed(kind, chosen))
        made[World(ground | {kind}, "round")] = None
        for place in ("free", "floor") if shape != "sphere" else ():
            made |= {World(ground | {kind}, place): None, World(ground, place): None}
    if shape != "sphere":
        made[World(frozenset(chosen), "together")] = None
    return list(made)


def simulated(chosen: tuple[EffectKind, ...], shape: Kind, worlds: list[World], schedule: str) -> dict[World, Outcome]:
    """Return what became of worlds of a composition, run side by side in the engine of a shape."""
    bodies = [grains(shape, world.place) for world in worlds]
    scenes = [
        scene(
            own,
            walls=() if world.place == "free" else (FLOOR,),
            law=law(chosen, world.active),
            domain=((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)),
            time_step=STEP,
            grains_like=CLUMP.bodies(np.zeros((1, 3)), SOFT.density) if shape == "multisphere" else None,
        )
        for own, world in zip(bodies, worlds, strict=True)
    ]
    simulation = Simulation(scenes, schedule)
    starts = [simulation.snapshot(k) for k in range(len(worlds))]
    simulation.run([DURATION[world.place] for world in worlds])
    simulation.check()
    return {world: Outcome(bodies[k], starts[k], simulation.snapshot(k)) for k, world in enumerate(worlds)}


@functools.cache
def outcomes(chosen: tuple[EffectKind, ...], shape: Kind) -> dict[World, Outcome]:
    """Return what became of all worlds of a composition; it is run once."""
    return simulated(chosen, shape, worlds_of(chosen, shape), "worlds")


@dataclass(frozen=True)
class Trial:
    """An effect on a shape."""

    kind: EffectKind
    shape: Kind

    @property
    def chosen(self) -> tuple[EffectKind, ...]:
        return composition_of(self.kind, self.shape)

    @property
    def is_body_effect(self) -> bool:
        return issubclass(self.kind, BodyEffect)

    @property
    def attracts(self) -> bool:
        """True if the effect may draw grains together, so that they gain energy of motion."""
        return issubclass(self.kind, ContactEffect) and self.kind.stage == Stage.ADHESION

    @property
    def carries(self) -> bool:
        """True if grains carry an amount that the effect exchanges."""
        return issubclass(self.kind, ContactEffect) and bool(self.kind.carries)

    def outcome(self, place: str, *, shape: Kind | None = None, acting: bool = True) -> Outcome:
        """Return what became of a world with the effect or without it, on its shape or on another."""
        active = frozenset(needed(self.kind, self.chosen)) | ({self.kind} if acting else frozenset())
        return outcomes(self.chosen, shape or self.shape)[World(active, place)]


TRIALS = [Trial(kind, shape) for shape in SHAPES for kind in ACTING if shape in kind.shapes]
REFUSED = [Trial(kind, shape) for shape in SHAPES for kind in ACTING if shape not in kind.shapes]
