"""Where the surface's three factors can't reach the laboratory's angle: the screening's next factor is freed as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from taichidem.heap_comparison import LABORATORY
from taichidem.paper.heaps import similar_heap
from taichidem.paper.optimum import Optimum, pour_at
from taichidem.paper.published import FACTORS, SURFACE, PaperFactor
from taichidem.paper.screening import Screening
from taichidem.paper.session import Session

ROUNDS = 5
FIRST_POUR = 10  # their seeds come after those of the surface's rounds
TARGET = LABORATORY[0]


def search_further(session: Session, screening: Screening, last: Optimum) -> Iterator[Optimum]:
    """Yield rounds of pouring along the next factor, from the surface's best setting until the heaps hit.

    The coarse grains fall from twice as high here, so that they strike the heap as the real ones do, which the setting is
    meant for. A step follows the screening's effect until heaps lie on both sides of the laboratory's angle, and then the
    straight line between the nearest on either side. Each round pours with seeds of its own. Nothing is poured where the
    heaps hit already, or where no factor can move the angle the right way.

    Args:
        session: where heaps are poured and kept.
        screening: tells the factor.
        last: the surface's last round.
    """
    effects = dict(zip(screening.effects["factor"], screening.effects["effect"], strict=True))
    freed = next_factor(effects, -last.error)
    if last.hits or freed is None:
        return
    letter, effect = freed.letter, effects[freed.letter]
    poured = {freed.fixed: last.heaps.mean}
    for number in range(ROUNDS):
        value, predicted = _step(poured, freed, effect)
        if value in poured:  # the end of its range
            return
        how = (
            f"{letter} ({freed.meaning}), the screening's next factor with {effect:+.2f}°, is freed as well: "
            f"{predicted:.2f}° expected at {letter} = {value:.3g}. The grains fall twice as deep now, which gives grains of 6 mm "
            "the v²/(g d) of the real ones."
        )
        levels = {**last.levels, letter: value}
        heaps = pour_at(session, levels, f"further_heaps_{number + 1}", FIRST_POUR + number, similar_heap())
        found = Optimum(levels, predicted, how, heaps)
        yield found
        if found.hits:
            return
        poured[value] = found.heaps.mean


def _step(poured: Mapping[float, float], factor: PaperFactor, effect: float) -> tuple[float, float]:
    """Return the value to pour at next, and the angle expected there [deg].

    Args:
        poured: value → mean angle [deg].
        factor: whose values these are.
        effect: from its low to its high value, by the screening [deg].
    """
    below = [value for value, angle in poured.items() if angle < TARGET]
    above = [value for value, angle in poured.items() if angle > TARGET]
    near = min(poured, key=lambda value: abs(poured[value] - TARGET))
    slope = effect / (factor.high - factor.low)
    if below and above:
        one, other = max(below, key=poured.__getitem__), min(above, key=poured.__getitem__)
        slope = (poured[one] - poured[other]) / (one - other)
    value = min(max(near + (TARGET - poured[near]) / slope, factor.low), factor.high)
    return value, poured[near] + slope * (value - near)


def next_factor(effects: Mapping[str, float], wanted: float) -> PaperFactor | None:
    """Return the factor outside the surface that can move the angle furthest the wanted way, or none.

    Args:
        effects: letter → effect from low to high [deg].
        wanted: change of the angle; its sign counts.
    """
    free = [factor for factor in FACTORS if factor.letter not in SURFACE]
    reach = {factor.letter: _reach(factor, effects[factor.letter], wanted) for factor in free}
    best = max(free, key=lambda factor: reach[factor.letter])
    return best if reach[best.letter] > 0.0 else None


def _reach(factor: PaperFactor, effect: float, wanted: float) -> float:
    """Return how far a factor moves the angle the wanted way from its fixed value to the end of its range [deg]."""
    slope = effect / (factor.high - factor.low)
    return max((slope if wanted > 0 else -slope) * (end - factor.fixed) for end in (factor.low, factor.high))
