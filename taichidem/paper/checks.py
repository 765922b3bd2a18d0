"""The paper's numbers beside ours, and whether ours are as near as they should be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from taichidem.heap_comparison import LABORATORY
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.paper.optimum import Optimum
from taichidem.paper.published import CONFIRMED, EFFECTS, OPTIMUM, SURFACE, TIME_SAVED
from taichidem.paper.screening import Screening
from taichidem.paper.surface import Surface

LARGEST_RMS = 2.5  # [deg], of our mean angles at the paper's fifteen points; one heap scatters by 1.3
SMALLEST_RANK_CORRELATION = 0.85
FEWEST = 2  # heaps that tell how far they scatter
ONE = "One heap: how far others scatter around it is not known."
VERDICTS = {
    "within_uncertainty": "agreement within the uncertainty",
    "not_established": "a difference is not established",
    "model_differs": "the model differs",
}


@dataclass(frozen=True)
class Check:
    """A number of the paper beside ours.

    Attributes:
        name: what it is.
        paper: the paper's, as text.
        ours: ours, as text.
        wanted: what would be near enough.
        met: whether it is; None where nothing is wanted.
        note: what keeps it away, or nothing.
    """

    name: str
    paper: str
    ours: str
    wanted: str
    met: bool | None
    note: str = ""


def checks_of(screening: Screening, surface: Surface, rounds: Sequence[Optimum], fine: KeptHeaps) -> Iterator[Check]:
    """Yield every check; the last of the rounds is the confirmation, and those with the designs' fall are the paper's way."""
    yield from _of_screening(screening)
    yield from _of_surface(surface)
    confirmed = rounds[-1]
    yield _of_setting(confirmed)
    (*_, by_surface) = (found for found in rounds if not found.raised)
    if by_surface is not confirmed:
        yield _of_optimum(by_surface)
    yield _of_heaps(confirmed.heaps, confirmed.why_not(), _missed_before(rounds))
    yield _of_heaps(fine, f"{len(fine.angles)} heaps know their mean to {fine.u:.2f}°.")
    yield _of_time(confirmed.heaps, fine)
    yield from _of_failures(screening, surface, [*(found.heaps for found in rounds), fine])


def _of_screening(screening: Screening) -> Iterator[Check]:
    paper = list(EFFECTS)[:2]
    effects = screening.effects.set_index("factor")
    leading = ", ".join(f"{name} {effects.loc[name, 'effect']:+.2f}°" for name in screening.leading[:3])
    third = screening.leading[2]
    note = (
        f"Third is {third} here and {SURFACE[2]} in the paper, whose composite design is run."
        if third != SURFACE[2]
        else ""
    )
    yield Check(
        "leading factors of the screening (Table 7)",
        ", ".join(f"{name} {EFFECTS[name][0]:+.2f}°" for name in list(EFFECTS)[:3]),
        leading,
        "F, then D, with the paper's signs",
        screening.leading[:2] == paper and bool(effects.loc[paper, "same_sign"].all()),
        note,
    )


def _of_surface(surface: Surface) -> Iterator[Check]:
    count = len(surface.points)
    yield Check(
        f"angles at the {count} points of the composite design (Table 5)",
        "EDEM",
        f"RMS difference {surface.rms:.2f}°",
        f"at most {LARGEST_RMS:g}°",
        surface.rms <= LARGEST_RMS,
    )
    yield Check(
        "their order",
        "EDEM",
        f"rank correlation {surface.rank_correlation:.3f}",
        f"at least {SMALLEST_RANK_CORRELATION:g}",
        surface.rank_correlation >= SMALLEST_RANK_CORRELATION,
    )


def _of_setting(optimum: Optimum) -> Check:
    return Check(
        "optimum (setting)",
        ", ".join(f"{name} = {value:g}" for name, value in OPTIMUM.items()),
        ", ".join(f"{name} = {value:.3g}" for name, value in optimum.levels.items()),
        "nothing: many settings give one angle",
        None,
    )


def _of_optimum(optimum: Optimum) -> Check:
    target, u = LABORATORY
    return Check(
        f"heap at the surface's optimum of {', '.join(optimum.levels)}, 6 mm",
        f"{CONFIRMED[6.0][0]:.2f}°",
        _mean_text(optimum.heaps),
        f"{target:g}° ± {u:g}°",
        optimum.settled if _tells_scatter(optimum.heaps) else None,
        optimum.why_not() if _tells_scatter(optimum.heaps) else ONE,
    )


def _missed_before(rounds: Sequence[Optimum]) -> str:
    """Return a sentence on confirmations that missed before the last, which is one chance more; or nothing."""
    missed = [_mean_text(found.heaps) for found in rounds[:-1] if found.confirmation]
    return f"Confirmations before it missed with {', '.join(missed)}." if missed else ""


def _mean_text(heaps: KeptHeaps) -> str:
    """Return the mean, with its uncertainty where there are heaps that tell it."""
    return f"{heaps.mean:.2f}°" + (f" ± {heaps.u:.2f}°" if _tells_scatter(heaps) else "")


def _tells_scatter(heaps: KeptHeaps) -> bool:
    return len(heaps.angles) >= FEWEST


def _of_heaps(heaps: KeptHeaps, why_not: str, before: str = "") -> Check:
    """Return the check of confirmation heaps; their scatter is told as ±, and in the note what the error is worth.

    Args:
        heaps: that confirm, or don't.
        why_not: what keeps them away, told where they are.
        before: what went before, told in any case.
    """
    size = 1000 * heaps.diameter
    angle, allowed = CONFIRMED[round(size, 3)]
    wanted = f"{LABORATORY[0]:g}° within {allowed:g} %, that is {allowed / 100 * LABORATORY[0]:.2f}°"
    name, paper = f"confirmation, {size:g} mm", f"{angle:g}°, {allowed:g} % off"
    ours = f"{_mean_text(heaps)}, {relative_error(heaps):.2f} % off"
    if not _tells_scatter(heaps):
        return Check(name, paper, ours, wanted, None, " ".join(note for note in (ONE, before) if note))
    found = heaps.comparison()
    met = relative_error(heaps) <= allowed
    worth = (
        f"E = {found.error:+.2f}° with u_val = {found.validation_uncertainty:.2f}° ({found.degrees_of_freedom:.0f} degrees of "
        f"freedom; heaps, laboratory, {', '.join(heaps.shared)}): {VERDICTS[found.verdict]}."
    )
    notes = [worth, "" if met else why_not, before]
    return Check(name, paper, ours, wanted, met, " ".join(note for note in notes if note))


def relative_error(heaps: KeptHeaps) -> float:
    """Return the heaps' distance from the laboratory's angle [%]."""
    return 100 * abs(heaps.mean - LABORATORY[0]) / LABORATORY[0]


def time_saved(coarse: KeptHeaps, fine: KeptHeaps) -> float:
    """Return the share of processor time that coarse heaps save [%]."""
    return 100 * (1 - coarse.pouring / fine.pouring)


def _of_time(coarse: KeptHeaps, fine: KeptHeaps) -> Check:
    saved = time_saved(coarse, fine)
    name, wanted = "processor time saved by grains twice as large", f"above {TIME_SAVED:g} %"
    if not np.isfinite(saved):
        why = "Every pour of one size was stopped and taken up again, so that its time is not known."
        return Check(name, f"{TIME_SAVED:g} %", "not known", wanted, None, why)
    ours = f"{saved:.1f} % ({coarse.pouring:.0f} s for {fine.pouring:.0f} s a heap)"
    return Check(name, f"{TIME_SAVED:g} %", ours, wanted, saved > TIME_SAVED)


def _of_failures(screening: Screening, surface: Surface, kept: Sequence[KeptHeaps]) -> Iterator[Check]:
    """Yield a line for heaps that could not be measured, if there are: leaving out the flattest would shift a mean."""
    reasons = [reason for table in (screening.heaps, surface.heaps) for reason in table["reason"] if reason]
    reasons += [reason for heaps in kept for reason in heaps.failures.values()]
    if reasons:
        poured = len(screening.heaps) + len(surface.heaps) + sum(len(h.angles) + len(h.failures) for h in kept)
        yield Check(
            "heaps left out",
            "–",
            f"{len(reasons)} of {poured}",
            "none",
            None,
            f"They could not be measured. The first: {reasons[0]}",
        )
