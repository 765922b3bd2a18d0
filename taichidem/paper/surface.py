"""Tables 4, 5 and 8 again: the face-centred composite design of the leading three factors, its surface and its variance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from analysis.report import Report
from taichidem import plugins
from taichidem.paper.published import ANGLE, SURFACE, central_composite, factor_space
from taichidem.paper.session import Session

FIRST_SEED = 2000
STAGE = "surface"
#: The paper eliminates terms without asking for hierarchy; with it density stays (p = 0.0467 for B*B against 0.05).
SETTINGS = {"selection": "backward", "hierarchy": "none"}


@dataclass(frozen=True)
class Surface:
    """The response surface beside the paper's.

    Attributes:
        heaps: a row per heap.
        points: a row per distinct point: levels, number of heaps, our mean angle and its standard uncertainty, the paper's mean.
        rms: root mean square of ours minus the paper's over the points [deg].
        rank_correlation: Spearman's, over the points.
        report: of the analyser.
    """

    heaps: pd.DataFrame
    points: pd.DataFrame
    rms: float
    rank_correlation: float
    report: Report


def fit_surface(session: Session) -> Surface:
    """Run the paper's twenty rows and fit the surface."""
    paper = central_composite()
    repeats = paper.groupby(list(SURFACE))["run"].transform("size")  # the centre is run six times as it is
    each = np.ceil(session.effort.surface / repeats).astype(int)
    heaps = session.pour(STAGE, paper, SURFACE, each, FIRST_SEED)
    measured = heaps[heaps[ANGLE].notna()]
    analyser = plugins.get("analyser", "response_surface")(**SETTINGS)
    report = analyser.analyse(measured, responses=[ANGLE], factors=SURFACE, space=factor_space(SURFACE))
    report.save(session.folder / STAGE, analyser.figures(report))
    points = _points(paper, measured)
    apart = (points["ours"] - points["paper"]).dropna()
    rank = float(stats.spearmanr(points["ours"], points["paper"], nan_policy="omit").statistic)
    return Surface(heaps, points, float(np.sqrt(np.mean(apart**2))), rank, report)


def _points(paper: pd.DataFrame, measured: pd.DataFrame) -> pd.DataFrame:
    """Return the distinct points, repeats averaged on both sides."""
    ours = measured.groupby(list(SURFACE))[ANGLE].agg(["count", "mean", "sem"])
    theirs = paper.groupby(list(SURFACE))[ANGLE].mean().rename("paper")
    both = pd.concat([ours.rename(columns={"count": "heaps", "mean": "ours", "sem": "u"}), theirs], axis=1)
    return both.reset_index().sort_values(list(SURFACE), ignore_index=True)
