"""Where the surface's three factors don't bring heaps to the laboratory's angle: the screening's next factor is freed as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from taichidem.heap_comparison import LABORATORY
from taichidem.paper.heaps import similar_heap
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.paper.optimum import SEEDS_APART, Optimum, confirm, pour_at
from taichidem.paper.published import FACTORS, SURFACE, PaperFactor
from taichidem.paper.screening import Screening
from taichidem.paper.session import Session

FIRST_SEED = 4000
FIRST_CONFIRMATION = 2  # series of seeds; the first is the surface's own
#: Along the factor, at most: one that misses knows its mean better than any round, so it leads to a last one.
CONFIRMATIONS = 2
TARGET = LABORATORY[0]
PLACES = 2001  # tried along its range
SMALLEST_STEP = 0.2  # of its range: nearer places hardly tell a slope from scatter

Poured = Sequence[tuple[float, KeptHeaps]]  # the factor's value, and heaps there


def search_further(session: Session, screening: Screening, last: Optimum) -> list[Optimum]:
    """Return rounds of pouring along the next factor, a confirmation at the end.

    The setting is meant for the real grains. So the coarse ones fall twice as deep here, which gives them the real ones'
    energy over weight times diameter; the first round shows what that alone does, and where it hits, it is confirmed. Else the
    next goes where the screening's effect would cross the laboratory's angle, and the line through both leads to the
    confirmation. Where that misses, its heaps join the search, and the quadratic through all leads to a last one, which counts
    whatever it gives. Each has seeds of its own.

    Args:
        session: where heaps are poured and kept.
        screening: tells the factor.
        last: the setting to start from, the surface's last round or the confirmation that refuted it.
    """
    how = "The same setting, with grains that fall twice as deep, which gives those of 6 mm the v²/(g d) of the real ones."
    rounds = [_poured(session, dict(last.levels), None, how, 0)]
    number = FIRST_CONFIRMATION
    if rounds[0].hits:
        rounds.append(confirm(session, rounds[0], similar_heap(), number, "The same setting"))
        number += 1
        if rounds[-1].hits:
            return rounds
    effects = dict(zip(screening.effects["factor"], screening.effects["effect"], strict=True))
    freed = next_factor(effects, -rounds[-1].error)
    if freed is not None:
        return [*rounds, *_along(session, freed, effects[freed.letter], rounds, number)]
    if rounds[-1].confirmation is None:
        rounds.append(confirm(session, rounds[0], similar_heap(), number, "The same setting"))
    return rounds


def _along(
    session: Session, freed: PaperFactor, effect: float, before: Sequence[Optimum], first: int
) -> Iterator[Optimum]:
    """Yield the rounds along a factor, from those at its fixed value to the last confirmation.

    Args:
        session: where heaps are poured and kept.
        freed: the factor.
        effect: from its low to its high value, by the screening [deg].
        before: rounds at its fixed value.
        first: series of seeds of the first confirmation.
    """
    letter, levels = freed.letter, before[0].levels
    poured = [(freed.fixed, found.heaps) for found in before]
    value, predicted = where_to_pour(steadier(poured), freed, effect)
    how = (
        f"{letter} ({freed.meaning}), the screening's next factor with {effect:+.2f}°, is freed as well: {predicted:.2f}° "
        f"expected at {letter} = {value:.3g}."
    )
    found = _poured(session, {**levels, letter: value}, predicted, how, 1)
    yield found
    for number in range(first, first + CONFIRMATIONS):
        poured.append((value, found.heaps))
        value, predicted = where_to_pour(steadier(poured), freed, effect)
        known = {place for place, _ in poured}
        found = replace(found, levels={**levels, letter: value}, predicted=predicted)
        origin = f"{letter} = {value:.3g} by the curve through the heaps at {len(known)} values of {letter}"
        found = confirm(session, found, similar_heap(), number, origin)
        yield found
        if found.hits or value in known:  # at the end of the range again, which is as near as it gets
            break


def _poured(session: Session, levels: dict[str, float], predicted: float | None, how: str, step: int) -> Optimum:
    name, first = f"further_heaps_{step + 1}", FIRST_SEED + SEEDS_APART * step
    heaps = pour_at(session, levels, name, first, session.effort.search, similar_heap())
    return Optimum(levels, predicted, how, heaps, raised=True)


def steadier(poured: Poured) -> list[tuple[float, list[float]]]:
    """Return value and angles from positions, shifted by the heaps' mean to what pictures give [deg].

    Positions scatter a fifth less from heap to heap than nine views do, so the search sees further with as many heaps.
    """
    apart = np.concatenate([np.subtract(heaps.profile_angles, heaps.angles) for _, heaps in poured]).mean()
    return [(value, [angle - apart for angle in heaps.profile_angles]) for value, heaps in poured]


def where_to_pour(
    poured: Sequence[tuple[float, Sequence[float]]], factor: PaperFactor, effect: float
) -> tuple[float, float]:
    """Return the factor's value whose expected angle is nearest to the laboratory's, and that angle [deg].

    Args:
        poured: values, and angles of the heaps poured there [deg].
        factor: whose values these are.
        effect: from its low to its high value, by the screening [deg].
    """
    values = np.repeat([value for value, _ in poured], [len(angles) for _, angles in poured])
    angles = np.concatenate([list(given) for _, given in poured])
    places = np.linspace(*_span(values, angles, factor), PLACES)
    if len(np.unique(values)) == 1:
        places = places[np.abs(places - values[0]) >= SMALLEST_STEP * (factor.high - factor.low)]
    expected = _curve(values, angles, effect / (factor.high - factor.low))(places)
    best = int(np.abs(expected - TARGET).argmin())
    return float(places[best]), float(expected[best])


def _curve(values: NDArray[np.float64], angles: NDArray[np.float64], screened: float) -> Polynomial:
    """Return the line through two values or the parabola through more; a line that falls where it should rise is scatter.

    For one value, and for such a line, it is the one with the screening's slope.
    """
    different = len(np.unique(values))
    if different > 1:
        fitted = Polynomial.fit(values, angles, min(different - 1, 2))
        if different > 2 or fitted.deriv()(values[0]) * screened > 0:
            return fitted
    return Polynomial([angles.mean() - screened * values.mean(), screened])


def _span(values: NDArray[np.float64], angles: NDArray[np.float64], factor: PaperFactor) -> tuple[float, float]:
    """Return where to look: between the nearest values on both sides of the target where there are such, else everywhere."""
    means = {float(value): float(angles[values == value].mean()) for value in np.unique(values)}
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
