"""Tables 2, 3 and 7 again: twelve Plackett–Burman runs of nine factors, and which of them matter."""

from __future__ import annotations

from dataclasses import dataclass

import pandas as pd

from analysis.report import Report
from taichidem import plugins
from taichidem.paper.published import ANGLE, EFFECTS, FACTORS, SCREENED, factor_space, plackett_burman
from taichidem.paper.session import Session, means

FIRST_SEED = 1000
STAGE = "screening"


@dataclass(frozen=True)
class Screening:
    """The screening beside the paper's.

    Attributes:
        heaps: a row per heap.
        runs: a row per run: levels, our mean angle, the paper's.
        effects: a row per factor: our effect [deg] with its standard error u and p, contribution [%] and rank, the paper's,
            whether the signs agree.
        report: of the analyser.
    """

    heaps: pd.DataFrame
    runs: pd.DataFrame
    effects: pd.DataFrame
    report: Report

    @property
    def leading(self) -> list[str]:
        """The factors by size of their effects."""
        return self.effects.sort_values("rank")["factor"].tolist()


def screen(session: Session) -> Screening:
    """Run the paper's twelve rows and return the effects."""
    paper = plackett_burman()
    heaps = session.pour(STAGE, paper, SCREENED, session.effort.screening, FIRST_SEED)
    measured = heaps[heaps[ANGLE].notna()]
    analyser = plugins.get("analyser", "main_effects")()
    space = factor_space(SCREENED)
    report = analyser.analyse(measured, responses=[ANGLE], factors=SCREENED, space=space)
    report.save(session.folder / STAGE, analyser.figures(report))
    runs = paper.rename(columns={ANGLE: "paper"})
    runs["ours"] = runs["run"].map(means(measured))
    return Screening(heaps, runs, _beside(report), report)


def _beside(report: Report) -> pd.DataFrame:
    """Return our effects beside the paper's, in the paper's order."""
    ours = report.tables["effects"].set_index("Term")
    errors = report.details["fit"].coefficient_table().set_index("Term")["SE Coef"]
    meaning = {factor.letter: factor.meaning for factor in FACTORS}
    rows = [
        {
            "factor": letter,
            "meaning": meaning[letter],
            "effect": float(ours.loc[letter, "Effect"]),
            "u": 2 * float(errors[letter]),  # from low to high are two steps of the coded factor
            "p": float(ours.loc[letter, "p"]),
            "contribution": float(ours.loc[letter, "Contribution %"]),
            "rank": int(ours.loc[letter, "Order"]),
            "paper_effect": effect,
            "paper_contribution": share,
            "paper_rank": rank,
            "same_sign": bool(ours.loc[letter, "Effect"] * effect > 0),
        }
        for rank, (letter, (effect, share)) in enumerate(EFFECTS.items(), 1)
    ]
    return pd.DataFrame(rows)
