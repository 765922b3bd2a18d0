"""The optimum of the surface: heaps poured where it sends them to the laboratory's angle, and a confirmation with other seeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from analysis.report import Report
from taichidem import plugins
from taichidem.experiments import FixedFunnel
from taichidem.heap_comparison import LABORATORY
from taichidem.paper.heaps import coarse_heap
from taichidem.paper.kept_heaps import KeptHeaps, pour_and_keep
from taichidem.paper.published import ANGLE, FACTORS, SURFACE, factor_space
from taichidem.paper.session import Session
from taichidem.paper.surface import SETTINGS, Surface

FIRST_SEED, SEEDS_APART = 3000, 100
CONFIRMATION_SEED = 7000
ROUNDS = 3  # of searching and pouring; each pours with seeds of its own
SAME = 0.02  # in coded units: a setting that moves less than this is the old one
STAGE = "optimum"
MEASURED = ("B",)  # of the surface's factors: known of the grains themselves, so that no search may move it


@dataclass(frozen=True)
class Optimum:
    """A setting, and what was poured there.

    Attributes:
        levels: letter → value in the paper's units.
        predicted: the angle expected there [deg]; None where nothing tells it.
        how: sentences that say how the setting was found.
        heaps: of 6 mm at this setting.
        raised: whether the grains fell twice as deep as in the designs, so that they strike as the real ones do.
        confirmation: number of its series of seeds, from 1; None for a round of the search.
    """

    levels: Mapping[str, float]
    predicted: float | None
    how: str
    heaps: KeptHeaps
    raised: bool = False
    confirmation: int | None = None

    @property
    def error(self) -> float:
        """Angle minus the laboratory's [deg]."""
        return self.heaps.mean - LABORATORY[0]

    @property
    def hits(self) -> bool:
        """Whether the heaps' mean lies within the laboratory's uncertainty."""
        return abs(self.error) <= LABORATORY[1]

    @property
    def out_of_reach(self) -> bool:
        """Whether even the expected angle lies beyond the laboratory's uncertainty."""
        return self.predicted is not None and abs(self.predicted - LABORATORY[0]) > LABORATORY[1]

    @property
    def settled(self) -> bool:
        """Whether the heaps hit where they were expected to; heaps that hit by chance settle nothing."""
        return self.hits and not self.out_of_reach

    def why_not(self) -> str:
        """Return what keeps the setting from the laboratory's angle, or nothing where it is settled."""
        if self.settled:
            return ""
        if self.hits:
            return f"These heaps hit by chance: {self.predicted:.2f}° is what is expected there."
        if self.out_of_reach:
            return (
                f"{self.predicted:.2f}° is the nearest to {LABORATORY[0]:g}° that is expected in the ranges searched: with the "
                "other factors at their fixed values the heap can't be brought to the laboratory's angle."
            )
        return (
            f"{self.heaps.mean:.2f}° ± {self.heaps.u:.2f}° from {len(self.heaps.angles)} heaps: what is left is the scatter "
            "from heap to heap and what a smooth curve misses."
        )


def search(session: Session, surface: Surface) -> list[Optimum]:
    """Return the rounds of the search.

    A round fits the surface to all heaps poured so far, takes the setting that it sends to the laboratory's angle, and pours
    there with seeds of its own. The search ends when these heaps hit, when the setting stays where it was, or when the
    surface doesn't reach the angle inside its ranges.
    """
    table = surface.heaps[surface.heaps[ANGLE].notna()]
    rounds: list[Optimum] = []
    for number in range(ROUNDS):
        report, levels, predicted = _setting(table)
        if rounds and _distance(levels, rounds[-1].levels) < SAME:
            break
        report.save(session.folder / STAGE, plugins.get("analyser", "optimise")().figures(report))
        name, first = f"{STAGE}_heaps_{number + 1}", FIRST_SEED + SEEDS_APART * number
        heaps = pour_at(session, levels, name, first, session.effort.search, coarse_heap())
        rounds.append(Optimum(levels, predicted, " ".join(report.sentences), heaps))
        if rounds[-1].hits or rounds[-1].out_of_reach:
            break
        table = pd.concat(
            [table, pd.DataFrame([{**levels, ANGLE: angle} for angle in heaps.angles])], ignore_index=True
        )
    return rounds


def confirm(session: Session, found: Optimum, heap: FixedFunnel, number: int, origin: str) -> Optimum:
    """Return a setting with heaps that no search has seen: those that ended it were chosen because they hit.

    Args:
        session: where they are poured and kept.
        found: the setting.
        heap: how they are poured.
        number: of its series of seeds, from 1; each confirmation has seeds of its own.
        origin: where the setting comes from, in words that go on with "poured with seeds that no search has seen".
    """
    name, first = f"confirmation_heaps_{number}", CONFIRMATION_SEED + SEEDS_APART * (number - 1)
    heaps = pour_at(session, found.levels, name, first, session.effort.confirmation, heap)
    how = f"{origin}, poured with seeds that no search has seen."
    return replace(found, how=how, heaps=heaps, confirmation=number)


def pour_at(
    session: Session, levels: Mapping[str, float], name: str, first_seed: int, count: int, heap: FixedFunnel
) -> KeptHeaps:
    """Return heaps at a setting.

    Args:
        session: where they are poured and kept.
        levels: letter → value in the paper's units.
        name: of their folder.
        first_seed: the seeds are those that follow.
        count: how many heaps.
        heap: how they are poured.
    """
    seeds = range(first_seed + 1, first_seed + 1 + count)
    return pour_and_keep(session, name, heap, session.model(levels), seeds)


def _setting(table: pd.DataFrame) -> tuple[Report, dict[str, float], float]:
    """Return the optimiser's report, the levels and the angle that the surface predicts there; density is as measured."""
    hold = {factor.letter: factor.fixed for factor in FACTORS if factor.letter in MEASURED}
    analyser = plugins.get("analyser", "optimise")(goals=f"{ANGLE}:target={LABORATORY[0]}", hold=hold, **SETTINGS)
    report = analyser.analyse(table, responses=[ANGLE], factors=SURFACE, space=factor_space(SURFACE))
    setting = report.tables["setting"].set_index("Factor")
    return report, {letter: float(setting.loc[letter, "Natural"]) for letter in SURFACE}, float(report.numbers[ANGLE])


def _distance(levels: Mapping[str, float], others: Mapping[str, float]) -> float:
    """Return how far two settings are apart in the factor that differs most, in coded units."""
    space = factor_space(SURFACE)
    coded = [space.to_coded(pd.DataFrame([{name: held[name] for name in space.names}]))[0] for held in (levels, others)]
    return float(np.abs(coded[0] - coded[1]).max())
