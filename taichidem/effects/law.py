"""Compose effects into one contact law: order them, refuse conflicts, lay out their memory, unroll them in the kernel."""

from dataclasses import dataclass

import taichi as ti

from taichidem.arena import Arena
from taichidem.bodies import Kind
from taichidem.contact import Wrench, vec3
from taichidem.effects.base import BodyEffect, ContactEffect, Effect, SetupEffect
from taichidem.errors import CompositionError


def check_composition(effects: tuple[Effect, ...]) -> None:
    """Raise CompositionError when two effects exclude each other or one stands twice."""
    for effect in effects:
        if not isinstance(effect, (ContactEffect, BodyEffect, SetupEffect)):
            raise CompositionError(
                f"{effect!r} is not an effect. Give instances such as NormalHertz(restitution=0.5), not classes."
            )
    seen: dict[str, Effect] = {}
    for effect in effects:
        key = effect.family or effect.name
        if key in seen:
            raise CompositionError(
                f"{effect.name!r} and {seen[key].name!r} are both of family {key!r}, of which a model holds one. Leave one out."
            )
        seen[key] = effect
    contact = [e for e in effects if isinstance(e, ContactEffect)]
    carriers = [e.name for e in contact if e.carries]
    if len(carriers) > 1:
        raise CompositionError(
            f"{' and '.join(carriers)} both let grains carry an amount; a model holds one such effect."
        )
    if contact and not any(e.family == "normal" for e in contact):
        raise CompositionError(
            f"{', '.join(e.name for e in contact)} act on a contact force that no effect makes. Add one of family 'normal'."
        )
    for effect in effects:
        _check_needs(effect, seen)


def _check_needs(effect: Effect, present: dict[str, Effect]) -> None:
    """Raise CompositionError when an effect builds on one that is not there."""
    for family, names in effect.needs.items():
        found = present.get(family)
        if found is None or (names and found.name not in names):
            wanted = " or ".join(names) or f"one of family {family!r}"
            held = f"holds {found.name}" if found else "holds none"
            raise CompositionError(
                f"{effect.name!r} needs {wanted}; the model {held}. Add it, or leave {effect.name!r} out."
            )


def check_shapes(effects: tuple[Effect, ...], kind: Kind) -> None:
    """Raise CompositionError when an effect can't act on grains of a kind."""
    for effect in effects:
        if kind not in effect.shapes:
            raise CompositionError(
                f"{effect.name!r} can't act on grains of kind {kind!r}, since {effect.shapes_reason}. It acts on "
                f"{' and '.join(effect.shapes)}: take such grains, or leave {effect.name!r} out."
            )


def contact_effects(effects: tuple[Effect, ...]) -> tuple[ContactEffect, ...]:
    """Return the contact effects in the order in which they act."""
    return tuple(sorted((e for e in effects if isinstance(e, ContactEffect)), key=lambda e: (e.stage, e.name)))


def body_effects(effects: tuple[Effect, ...]) -> tuple[BodyEffect, ...]:
    """Return the body effects in a fixed order, gravity first."""
    return tuple(
        sorted((e for e in effects if isinstance(e, BodyEffect)), key=lambda e: (e.family != "gravity", e.name))
    )


@dataclass
class _Kept:
    """One remembered quantity: its column in the slot table, and whether it turns round when the sides swap."""

    column: ti.Field
    vector: bool
    odd: bool


@dataclass
class _Bound:
    """An effect with its tables: `given` (coefficients per row) and `past` (memory per slot, or None)."""

    effect: ContactEffect | BodyEffect
    given: ti.StructField
    past: ti.StructField | None

    @property
    def remembers(self) -> bool:
        return self.past is not None


@ti.data_oriented
class Law:
    """The effects of one engine with their tables; physics enters the kernels only through it."""

    def __init__(self, effects: tuple[Effect, ...]) -> None:
        check_composition(effects)
        self.contact = contact_effects(effects)
        self.body = body_effects(effects)
        self.contact_bound: list[_Bound] = []
        self.body_bound: list[_Bound] = []
        self.kept: list[_Kept] = []
        self.carries = any(e.carries for e in self.contact)  # bodies carry an amount that contacts exchange

    @property
    def memories(self) -> list[dict]:
        """Return, for each contact effect that remembers, the members of its memory struct."""
        return [_memory_members(e) for e in self.contact if e.memory]

    def allocate(self, arena: Arena, pair_rows: int, worlds: int, past: list[ti.StructField]) -> None:
        """Make the coefficient tables and take over the memory tables, one per member of `memories`."""
        remembered = iter(past)
        for effect in self.contact:
            given = arena.table(pair_rows, dict.fromkeys(effect.coefficients, ti.f64))
            table = next(remembered) if effect.memory else None
            self.contact_bound.append(_Bound(effect, given, table))
            if table is not None:
                self.kept += [_Kept(table.get_member_field(m.name), m.size > 1, m.odd) for m in effect.memory]
        for body_effect in self.body:
            given = arena.table(worlds, dict.fromkeys(body_effect.coefficients, ti.f64))
            self.body_bound.append(_Bound(body_effect, given, None))

    @ti.func
    def contact_wrench(self, row, slot, c: ti.template(), h: ti.template()):
        """Return the wrench on side i of a touching pair; `row` of the coefficients, `slot` of the memory."""
        total = Wrench(force=vec3(0.0), torque=vec3(0.0))
        for bound in ti.static(self.contact_bound):
            if ti.static(bound.effect.carries != ""):
                part = bound.effect.wrench(bound.given[row], c, bound.past[slot], h)
                total.force += part.force
                total.torque += part.torque
            elif ti.static(not bound.remembers):
                part = bound.effect.wrench(bound.given[row], c, 0)
                total.force += part.force
                total.torque += part.torque
            else:
                part = bound.effect.wrench(bound.given[row], c, bound.past[slot])
                total.force += part.force
                total.torque += part.torque
        return total

    @ti.func
    def release(self, slot, h: ti.template(), at_wall):
        """Let the effect whose amount bodies carry give back what a contact that is gone held."""
        for bound in ti.static(self.contact_bound):
            if ti.static(bound.effect.carries != ""):
                bound.effect.release(bound.past[slot], h, at_wall)

    @ti.func
    def body_wrench(self, world, b: ti.template()):
        """Return the wrench of all body effects."""
        total = Wrench(force=vec3(0.0), torque=vec3(0.0))
        for bound in ti.static(self.body_bound):
            part = bound.effect.wrench(bound.given[world], b)
            total.force += part.force
            total.torque += part.torque
        return total

    @ti.func
    def forget(self, slot):
        """Empty the memory of a slot, when its contact begins."""
        for kept in ti.static(self.kept):
            if ti.static(kept.vector):
                kept.column[slot] = vec3(0.0)
            else:
                kept.column[slot] = 0.0

    @ti.func
    def carry(self, old, new, swapped):
        """Copy the memory of one slot into another; odd quantities turn round when the sides were swapped."""
        for kept in ti.static(self.kept):
            value = kept.column[old]
            if ti.static(kept.odd):
                value = (1.0 - 2.0 * swapped) * value
            kept.column[new] = value


def _memory_members(effect: ContactEffect) -> dict:
    return {m.name: ti.f64 if m.size == 1 else ti.types.vector(m.size, ti.f64) for m in effect.memory}
