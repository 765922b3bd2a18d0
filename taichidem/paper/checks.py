"""The paper's numbers beside ours, and whether ours are as near as they should be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from taichidem.heap_comparison import LABORATORY
from taichidem.paper.kept_heaps import KeptHeaps
from taichidem.paper.optimum import Optimum
from taichidem.paper.published import CONFIRMED, EFFECTS, OPTIMUM, SURFACE, TIME_SAVED
from taichidem.paper.screening import Screening
from taichidem.paper.surface import Surface

LARGEST_RMS = 2.5  # [deg], of our mean angles at the paper's fifteen points; one heap scatters by 1.3
SMALLEST_RANK_CORRELATION = 0.85


@dataclass(frozen=True)
class Check:
    """A number of the paper beside ours.

    Attributes:
        name: what it is.
        paper: the paper's, as text.
        ours: ours, as text.
        wanted: what would be near enough.
        met: whether it is.
        note: what keeps it away, or nothing.
    """

    name: str
    paper: str
    ours: str
    wanted: str
    met: bool
    note: str = ""


def checks_of(screening: Screening, surface: Surface, rounds: Sequence[Optimum], fine: KeptHeaps) -> Iterator[Check]:
    """Yield every check; the last of the rounds is the result, those without a further factor are the paper's way."""
    yield from _of_screening(screening)
    yield from _of_surface(surface)
    optimum = rounds[-1]
    yield _of_setting(optimum)
    (*_, by_surface) = (found for found in rounds if set(found.levels) == set(SURFACE))
    yield _of_optimum(by_surface)
    if optimum is not by_surface:
        yield _of_optimum(optimum)
    yield from (_of_heaps(heaps) for heaps in (optimum.heaps, fine))
    yield _of_time(optimum.heaps, fine)


def _of_screening(screening: Screening) -> Iterator[Check]:
    ours, paper = screening.leading[:2], list(EFFECTS)[:2]
    signs = screening.effects.set_index("factor").loc[paper, ["effect", "same_sign"]]
    sizes = ", ".join(f"{name} {signs.loc[name, 'effect']:+.2f}°" for name in paper)
    yield Check(
        "leading factors of the screening (Table 7)",
        ", ".join(f"{name} {EFFECTS[name][0]:+.2f}°" for name in paper),
        f"{', '.join(ours)} ({sizes})",
        "F, then D, with the paper's signs",
        ours == paper and bool(signs["same_sign"].all()),
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
    ours = ", ".join(f"{name} = {optimum.levels[name]:.3g}" for name in optimum.levels)
    return Check(
        "optimum (setting)",
        ", ".join(f"{name} = {value:g}" for name, value in OPTIMUM.items()),
        ours,
        "many settings give one angle: for information",
        True,
    )


def _of_optimum(optimum: Optimum) -> Check:
    target, u = LABORATORY
    return Check(
        f"heap at the optimum of {', '.join(optimum.levels)}, 6 mm",
        f"{CONFIRMED[6.0][0]:.2f}°",
        f"{optimum.heaps.mean:.2f}° ± {optimum.heaps.u:.2f}°",
        f"{target:g}° ± {u:g}°",
        optimum.hits,
        optimum.why_not(),
    )


def _of_heaps(heaps: KeptHeaps) -> Check:
    size = 1000 * heaps.diameter
    angle, allowed = CONFIRMED[round(size, 3)]
    error, u = relative_error(heaps), 100 * heaps.u / LABORATORY[0]
    return Check(
        f"error at {size:g} mm",
        f"{allowed:g} % ({angle:g}°)",
        f"{error:.2f} % ± {u:.2f} % ({heaps.mean:.2f}°)",
        f"at most {allowed:g} %",
        error <= allowed,
        "" if error <= allowed else f"{len(heaps.angles)} heaps know their mean to {heaps.u:.2f}°, which is {u:.1f} %.",
    )


def relative_error(heaps: KeptHeaps) -> float:
    """Return the heaps' distance from the laboratory's angle [%]."""
    return 100 * abs(heaps.mean - LABORATORY[0]) / LABORATORY[0]


def time_saved(coarse: KeptHeaps, fine: KeptHeaps) -> float:
    """Return the share of the wall time that coarse heaps save [%]."""
    return 100 * (1 - coarse.wall_time / fine.wall_time)


def _of_time(coarse: KeptHeaps, fine: KeptHeaps) -> Check:
    saved = time_saved(coarse, fine)
    return Check(
        "time saved by grains twice as large",
        f"{TIME_SAVED:g} %",
        f"{saved:.1f} % ({coarse.wall_time:.0f} s for {fine.wall_time:.0f} s a heap)",
        f"above {TIME_SAVED:g} %",
        saved > TIME_SAVED,
    )
