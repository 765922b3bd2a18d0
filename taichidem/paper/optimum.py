"""The optimum of the surface, and heaps poured there until they hit the laboratory's angle or the box is at its end."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis.report import Report
from taichidem import plugins
from taichidem.heap_comparison import LABORATORY
from taichidem.paper.heaps import coarse_heap
from taichidem.paper.kept_heaps import KeptHeaps, pour_and_keep
from taichidem.paper.published import ANGLE, FACTORS, SURFACE, factor_space
from taichidem.paper.session import Session
from taichidem.paper.surface import SETTINGS, Surface

FIRST_SEED, SEEDS_APART = 3000, 100
ROUNDS = 3  # of searching and pouring; each pours with seeds of its own
SAME = 0.02  # in coded units: a setting that moves less than this is the old one
STAGE = "optimum"


@dataclass(frozen=True)
class Optimum:
    """The setting of one round of the search, and what was poured there.

    Attributes:
        levels: letter → value in the paper's units.
        predicted: by the surface [deg].
        report: of the optimiser.
        heaps: of 6 mm at this setting.
    """

    levels: Mapping[str, float]
    predicted: float
    report: Report
    heaps: KeptHeaps

    @property
    def error(self) -> float:
        """Angle minus the laboratory's [deg]."""
        return self.heaps.mean - LABORATORY[0]

    @property
    def hits(self) -> bool:
        """Whether the heaps lie within the laboratory's uncertainty."""
        return abs(self.error) <= LABORATORY[1]

    def why_not(self) -> str:
        """Return what keeps the heap from the laboratory's angle, or nothing where it hits."""
        if self.hits:
            return ""
        target, u = LABORATORY[0], self.heaps.u
        if self.predicted < target - 0.01:
            return (
                f"The surface reaches {self.predicted:.2f}° inside the ranges of {', '.join(SURFACE)} and not {target:g}°: with "
                f"the other factors at their fixed values these three can't lift the heap to the laboratory's angle."
            )
        return (
            f"The surface promises {self.predicted:.2f}° at this setting and the heaps give {self.heaps.mean:.2f}° ± {u:.2f}°: "
            f"what is left is the scatter from heap to heap and what a quadratic surface misses."
        )


def search(session: Session, surface: Surface) -> list[Optimum]:
    """Return the rounds of the search, the last one being the result.

    A round fits the surface to all heaps poured so far, takes the setting that it sends to the laboratory's angle, and pours
    there with seeds of its own. The search ends when these heaps hit, or when the setting stays where it was.
    """
    table = surface.heaps[surface.heaps[ANGLE].notna()]
    rounds: list[Optimum] = []
    for number in range(ROUNDS):
        report, levels, predicted = _setting(table)
        if rounds and _distance(levels, rounds[-1].levels) < SAME:
            break
        heaps = _pour(session, levels, number)
        rounds.append(Optimum(levels, predicted, report, heaps))
        if rounds[-1].hits:
            break
        table = pd.concat(
            [table, pd.DataFrame([{**levels, ANGLE: angle} for angle in heaps.angles])], ignore_index=True
        )
    report = rounds[-1].report
    report.save(session.folder / STAGE, plugins.get("analyser", "optimise")().figures(report))
    return rounds


def _setting(table: pd.DataFrame) -> tuple[Report, dict[str, float], float]:
    """Return the optimiser's report, the levels and the angle that the surface predicts there."""
    analyser = plugins.get("analyser", "optimise")(goals=f"{ANGLE}:target={LABORATORY[0]}", **SETTINGS)
    report = analyser.analyse(table, responses=[ANGLE], factors=SURFACE, space=factor_space(SURFACE))
    setting = report.tables["setting"].set_index("Factor")
    levels = {letter: float(setting.loc[letter, "Natural"]) for letter in SURFACE}
    for factor in FACTORS:  # what no model holds is left at what was measured
        if factor.letter in levels and setting.loc[factor.letter, "Note"].startswith("in no model"):
            levels[factor.letter] = factor.fixed
    return report, levels, float(report.numbers[ANGLE])


def _pour(session: Session, levels: Mapping[str, float], number: int) -> KeptHeaps:
    first = FIRST_SEED + SEEDS_APART * number
    seeds = range(first + 1, first + 1 + session.effort.coarse)
    name = f"{STAGE}_heaps" + (f"_{number + 1}" if number else "")
    return pour_and_keep(session, name, coarse_heap(), session.model(levels), seeds)


def _distance(levels: Mapping[str, float], others: Mapping[str, float]) -> float:
    """Return how far two settings are apart in the factor that differs most, in coded units."""
    space = factor_space(SURFACE)
    coded = [space.to_coded(pd.DataFrame([{name: held[name] for name in space.names}]))[0] for held in (levels, others)]
    return float(np.abs(coded[0] - coded[1]).max())
