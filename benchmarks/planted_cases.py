"""The truths that are planted: nothing missing, each effect weak and strong, two at once, an effect that no library holds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.planted import Truth
from taichidem.study import Study

WEAK, STRONG = 0.35, 0.9  # shares of the strongest setting
NULLS = 40
PER_STRENGTH = 1  # truths of an effect and a strength, each with parameters and seeds of its own
# Two at once that act on different things, so that neither alone can pass for both.
PAIRS = (
    ("rolling_constant_torque", "cohesion_dmt"),
    ("rolling_spring_dashpot", "cohesion_area"),
    ("size_spread", "rolling_constant_torque"),
    ("normal_elastoplastic", "twisting_resistance"),
)
# What is the same physics in another form. An effect is taken from the library together with these.
KIN = (
    ("rolling_constant_torque", "rolling_spring_dashpot"),
    ("cohesion_area", "cohesion_dmt", "cohesion_jkr", "liquid_bridge"),
    ("air_drag", "air_drag_linear"),
    ("normal_viscoelastic", "normal_elastoplastic"),
)
FIRST_SEED, SEEDS_APART = 20_000, 10
INSIDE = 0.15  # of a range, which true parameters keep from its ends


@dataclass(frozen=True)
class Case:
    """A truth, and which effects the diagnosis may name.

    Attributes:
        kind: nothing, weak, strong, pair, removed (its kin stays in the library) or removed_kin.
        truth: what acts.
        effects: hidden; sorted.
        removed: effects that the diagnosis does not know.
    """

    kind: str
    truth: Truth
    effects: tuple[str, ...]
    removed: tuple[str, ...] = ()


def cases(study: Study, names: Sequence[str]) -> list[Case]:
    """Return every case, for the effects that can be put in."""
    return list(_cases(study, names))


def _cases(study: Study, names: Sequence[str]) -> Iterator[Case]:
    plan: list[tuple[str, dict[str, float]]] = [("nothing", {})] * NULLS
    plan += [
        (k, {name: s}) for name in names for k, s in (("weak", WEAK), ("strong", STRONG)) for _ in range(PER_STRENGTH)
    ]
    plan += [
        ("pair", dict.fromkeys(pair, STRONG)) for pair in PAIRS if set(pair) <= set(names) for _ in range(PER_STRENGTH)
    ]
    for number, (kind, shares) in enumerate(plan, 1):
        rng = np.random.default_rng(number)
        truth = Truth(true_values(study, rng), shares, FIRST_SEED + SEEDS_APART * number)
        yield Case(kind, truth, tuple(sorted(shares)))
        if kind == "strong":
            (name,) = shares
            yield Case("removed", truth, (name,), (name,))
            if kin(name) != (name,):
                yield Case("removed_kin", truth, (name,), kin(name))


def kin(name: str) -> tuple[str, ...]:
    """Return an effect and those that are the same physics in another form."""
    return next((family for family in KIN if name in family), (name,))


def true_values(study: Study, rng: np.random.Generator) -> dict[str, float]:
    """Return true parameters: as a direct measurement leaves them open where there is one, else anywhere inside the range."""
    found = {}
    for c in study.calibrate:
        margin = INSIDE * (c.high - c.low)
        inside = rng.uniform(c.low + margin, c.high - margin)
        value = inside if c.value is None or c.u is None else c.value + c.u * rng.standard_normal()
        found[c.key] = float(np.clip(value, c.low + margin / 3, c.high - margin / 3))
    return found
