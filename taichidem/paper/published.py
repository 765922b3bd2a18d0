"""What the paper prints: its factors, its tables, its optimum and its errors.

Source: Sudsawat, Chongchitpaisan & Arunyanart, "Calibrating polypropylene particle model parameters with upscaling and repose
surface method", EUREKA: Physics and Engineering 6 (2023) 34–46, doi 10.21303/2461-4262.2023.002968.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from designs.space import Factor, FactorSpace

ANGLE = "aor_deg"
DATA = Path(__file__).parent / "data"


@dataclass(frozen=True)
class PaperFactor:
    """A factor of the paper's screening (Table 2).

    Attributes:
        letter: as the paper calls it.
        meaning: in words.
        unit: of its values.
        low, high: ends of its range.
        fixed: its value where it is not varied.
    """

    letter: str
    meaning: str
    unit: str
    low: float
    high: float
    fixed: float


FACTORS = (
    PaperFactor("A", "Poisson's ratio PP", "1", 0.36, 0.41, 0.36),
    PaperFactor("B", "density PP", "kg/m^3", 889.0, 1107.0, 910.0),
    PaperFactor("C", "Young's modulus PP", "GPa", 1.3, 2.0, 1.3),
    PaperFactor("D", "restitution PP–PP", "1", 0.30, 0.97, 0.55),
    PaperFactor("E", "restitution PP–steel", "1", 0.55, 0.71, 0.55),
    PaperFactor("F", "static friction PP–PP", "1", 0.10, 0.60, 0.52),
    PaperFactor("G", "static friction PP–steel", "1", 0.26, 0.30, 0.26),
    PaperFactor("H", "rolling friction PP–PP", "1", 0.05, 0.44, 0.05),
    PaperFactor("I", "rolling friction PP–steel", "1", 0.246, 0.280, 0.246),
)
SCREENED = tuple(factor.letter for factor in FACTORS)
SURFACE = ("F", "D", "B")  # the three that the paper takes into its composite design

# Table 6, of n = 100: mean, what is printed after ±, and the range where one is printed; single values are not printed.
SAMPLES = 100
PROPERTIES = pd.DataFrame(
    [
        ("length", "mm", 3.00, 0.03, ""),
        ("width", "mm", 3.01, 0.01, ""),
        ("equivalent diameter", "mm", 3.00, 0.011, ""),
        ("density", "kg/m^3", 910.0, 0.889, ""),
        ("angle of repose", "deg", 30.18, 0.51, "29.25–30.86"),
    ],
    columns=["property", "unit", "mean", "plus_minus", "range"],
)

# Table 7: factor → effect [deg] and contribution [%], in the paper's order.
EFFECTS = {
    "F": (11.429, 65.70),
    "D": (-6.589, 21.84),
    "B": (3.197, 5.14),
    "I": (-2.896, 4.22),
    "H": (1.244, 0.78),
    "G": (1.198, 0.72),
    "E": (-1.012, 0.51),
    "C": (0.607, 0.19),
    "A": (-0.354, 0.06),
}

EQUATION_20 = {"Constant": 7.64, "F": 51.3, "D": 33.3, "F*F": -49.3, "D*D": -30.36}
# Table 8: source → degrees of freedom, sum of squares [deg²].
ANOVA = {
    "Model": (4, 376.878),
    "  F": (1, 177.611),
    "  D": (1, 30.902),
    "  F*F": (1, 30.329),
    "  D*D": (1, 37.147),
    "Error": (15, 48.190),
    "  Lack-of-Fit": (10, 41.952),
    "  Pure Error": (5, 6.238),
}
MODEL_SUMMARY = {"S": 1.792, "R2 %": 88.66, "R2 adj %": 85.64}  # the text claims a predicted R² "exceeding 88 %"
REMARKS = (
    "Recomputed from the paper's own Table 5, its Equation 20 and Table 8 come out, with three remarks. Equation 20 is what "
    "backward elimination at α = 0.05 leaves without hierarchy: B*B goes at p = 0.0512; with hierarchy it stays at p = 0.0467 "
    "and keeps density in the model. The predicted R² is 82.2 %; the text's “exceeding 88 %” is R² itself. And five of the six "
    "centre runs gave the same 30.11° and one 27.37°, so the pure error of 6.238 is the square of one outlier."
)
OPTIMUM = {"F": 0.52, "D": 0.55}
CONFIRMED = {6.0: (29.67, 1.69), 3.0: (29.14, 3.45)}  # diameter [mm] → angle [deg], relative error [%]
TIME_SAVED = 71.0  # [%], by grains twice as large


def factor_space(letters: Sequence[str]) -> FactorSpace:
    """Return some of the paper's factors with their ranges."""
    return FactorSpace([Factor(f.letter, f.low, f.high, f.unit) for f in FACTORS if f.letter in letters])


def plackett_burman() -> pd.DataFrame:
    """Return Table 3: run, the nine factors, angle of repose [deg] by EDEM."""
    return _by_letters(pd.read_csv(DATA / "table3_plackett_burman.csv"))


def central_composite() -> pd.DataFrame:
    """Return Table 5: run, static friction F, restitution D, density B, angle of repose [deg] by EDEM."""
    return _by_letters(pd.read_csv(DATA / "table5_central_composite.csv"))


def _by_letters(table: pd.DataFrame) -> pd.DataFrame:
    return table.rename(columns=lambda name: name if name in ("run", ANGLE) else name.split("_")[0])
