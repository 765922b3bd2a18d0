"""Where the surface's three factors can't reach the laboratory's angle: the screening's next factor is freed as well."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.polynomial import Polynomial

from taichidem.heap_comparison import LABORATORY
from taichidem.paper.heaps import similar_heap
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.paper.optimum import SEEDS_APART, Optimum, confirm, pour_at
from taichidem.paper.published import FACTORS, SURFACE, PaperFactor
from taichidem.paper.screening import Screening
from taichidem.paper.session import Session

FIRST_SEED = 4000
FIRST_CONFIRMATION = 2  # the first of all is the surface's own
CONFIRMATIONS = 2  # at most: one that misses knows its mean better than any round, so it leads to a last one
TARGET = LABORATORY[0]
PLACES = 2001  # tried along its range


def search_further(session: Session, screening: Screening, last: Optimum) -> list[Optimum]:
    """Return rounds of pouring along the next factor, the confirmation at its end.

    The setting is meant for the real grains. So the coarse ones fall twice as deep here, which gives them the real ones'
    energy over weight times diameter; the first round shows what that alone does. The second goes where the screening's effect
    would cross the laboratory's angle, and the line through both leads to the confirmation. Where that misses, its heaps join
    the search, and the quadratic through all leads to a last one, which counts whatever it gives. Each has seeds of its own.

    Args:
        session: where heaps are poured and kept.
        screening: tells the factor.
        last: the surface's last round.
    """
    how = "The same setting, with grains that fall twice as deep, which gives those of 6 mm the v²/(g d) of the real ones."
    alone = _poured(session, dict(last.levels), None, how, 0)
    effects = dict(zip(screening.effects["factor"], screening.effects["effect"], strict=True))
    freed = next_factor(effects, -alone.error)
    if freed is None:
        return [alone, confirm(session, alone, similar_heap(), FIRST_CONFIRMATION, "The same setting")]
    return [alone, *_along(session, freed, effects[freed.letter], alone)]


def _along(session: Session, freed: PaperFactor, effect: float, alone: Optimum) -> list[Optimum]:
    """Return the rounds along a factor, from heaps at its fixed value to the last confirmation."""
    letter, poured = freed.letter, {freed.fixed: alone.heaps}
    value, predicted = where_to_pour(steadier(poured), freed, effect)
    how = (
        f"{letter} ({freed.meaning}), the screening's next factor with {effect:+.2f}°, is freed as well: {predicted:.2f}° "
        f"expected at {letter} = {value:.3g}."
    )
    rounds = [_poured(session, {**alone.levels, letter: value}, predicted, how, 1)]
    poured[value] = rounds[0].heaps
    for number in range(FIRST_CONFIRMATION, FIRST_CONFIRMATION + CONFIRMATIONS):
        value, predicted = where_to_pour(steadier(poured), freed, effect)
        found = replace(rounds[0], levels={**alone.levels, letter: value}, predicted=predicted)
        origin = f"{letter} = {value:.3g} by the curve through the heaps at {len(poured)} values of {letter}"
        rounds.append(confirm(session, found, similar_heap(), number, origin))
        if rounds[-1].hits or value in poured:  # or at the end of the range again
            break
        poured[value] = rounds[-1].heaps
    return rounds


def _poured(session: Session, levels: dict[str, float], predicted: float | None, how: str, step: int) -> Optimum:
    name, first = f"further_heaps_{step + 1}", FIRST_SEED + SEEDS_APART * step
    heaps = pour_at(session, levels, name, first, session.effort.search, similar_heap())
    return Optimum(levels, predicted, how, heaps, raised=True)


def steadier(poured: Mapping[float, KeptHeaps]) -> dict[float, list[float]]:
    """Return value → angles from positions, shifted by the heaps' mean to what pictures give [deg].

    Positions scatter a fifth less from heap to heap than nine views do, so the search sees further with as many heaps.
    """
    every = list(poured.values())
    apart = np.concatenate([np.subtract(heaps.profile_angles, heaps.angles) for heaps in every]).mean()
    return {value: [angle - apart for angle in heaps.profile_angles] for value, heaps in poured.items()}


def where_to_pour(poured: Mapping[float, Sequence[float]], factor: PaperFactor, effect: float) -> tuple[float, float]:
    """Return the factor's value whose expected angle is nearest to the laboratory's, and that angle [deg].

    Args:
        poured: value → angles of the heaps poured there [deg].
        factor: whose values these are.
        effect: from its low to its high value, by the screening [deg]; used while heaps were poured at one value only.
    """
    values = np.repeat(list(poured), [len(angles) for angles in poured.values()])
    angles = np.concatenate([list(given) for given in poured.values()])
    if len(poured) == 1:
        slope = effect / (factor.high - factor.low)
        curve = Polynomial([angles.mean() - slope * values[0], slope])
    else:
        curve = Polynomial.fit(values, angles, min(len(poured) - 1, 2))
    places = np.linspace(*_span(poured, factor), PLACES)
    expected = curve(places)
    best = int(np.abs(expected - TARGET).argmin())
    return float(places[best]), float(expected[best])


def _span(poured: Mapping[float, Sequence[float]], factor: PaperFactor) -> tuple[float, float]:
    """Return where to look: between the nearest values on both sides of the target where there are such, else everywhere."""
    means = {value: float(np.mean(angles)) for value, angles in poured.items()}
    below = [value for value, mean in means.items() if mean < TARGET]
    above = [value for value, mean in means.items() if mean >= TARGET]
    if below and above:
        return max(below, key=means.__getitem__), min(above, key=means.__getitem__)
    return factor.low, factor.high


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
