"""Published data with printed answers, used by several tests; those of the paper are in taichidem.paper.published.

Sources:
    Odour: John, "Statistical Design and Analysis of Experiments" (1971), as in the SAS/STAT User's Guide, PROC RSREG,
        "A Response Surface with a Simple Optimum".
    Mercaptobenzothiazole: Myers (1976), as in the SAS/STAT User's Guide, PROC RSREG, "A Saddle Surface Response".
    Chemical reaction: Myers, Montgomery & Anderson-Cook, "Response Surface Methodology", 3rd ed. (2009), Table 7.6, as
        in Lenth, J. Stat. Software 32(7) (2009), doi 10.18637/jss.v032.i07.
    Filtration rate: Montgomery, "Design and Analysis of Experiments", Example 6.2 (an unreplicated 2⁴ factorial).
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd


def odour() -> pd.DataFrame:
    """A Box–Behnken design: Odor against T, R, H."""
    text = """66 40 .3 4  39 120 .3 4  43 40 .7 4  49 120 .7 4  58 40 .5 2  17 120 .5 2  -5 40 .5 6  -40 120 .5 6
              65 80 .3 2   7 80 .7 2   43 80 .3 6  -22 80 .7 6  -31 80 .5 4  -35 80 .5 4  -26 80 .5 4"""
    return pd.DataFrame(np.array(text.split(), dtype=float).reshape(-1, 4), columns=["Odor", "T", "R", "H"])


def mercaptobenzothiazole() -> pd.DataFrame:
    """Yield MBT against Time and Temp, 12 runs."""
    text = """4 250 83.8  20 250 81.7  12 250 82.4  12 250 82.9  12 220 84.7  12 280 57.9  12 250 81.2  6.3 229 81.3
              6.3 271 83.1  17.7 229 85.3  17.7 271 72.7  4 250 82.0"""
    return pd.DataFrame(np.array(text.split(), dtype=float).reshape(-1, 3), columns=["Time", "Temp", "MBT"])


def chemical_reaction() -> pd.DataFrame:
    """A central composite design in two blocks: Yield against Time and Temp."""
    text = """80 170 80.5 80 180 81.5 90 170 82.0 90 180 83.5 85 175 83.9 85 175 84.3 85 175 84.0
              85 175 79.7 85 175 79.8 85 175 79.5 92.07 175 78.4 77.93 175 75.6 85 182.07 78.5 85 167.93 77.0"""
    table = pd.DataFrame(np.array(text.split(), dtype=float).reshape(-1, 3), columns=["Time", "Temp", "Yield"])
    table.insert(0, "block", [1] * 7 + [2] * 7)
    return table


def filtration_rate() -> pd.DataFrame:
    """A 2⁴ factorial in Yates order: rate against A, B, C, D (coded)."""
    rows = [(a, b, c, d) for d, c, b, a in itertools.product((-1, 1), repeat=4)]
    table = pd.DataFrame(rows, columns=["A", "B", "C", "D"])
    table["rate"] = [45, 71, 48, 65, 68, 60, 80, 65, 43, 100, 45, 104, 75, 86, 70, 96]
    return table
