"""One screening design over what may be re-calibrated and over the strength of every effect that a model lacks.

It is drawn in blocks: one with no effect in, and one for each effect, in which no other acts, since effects of a family
exclude each other and strong ones act on each other. All blocks vary the calibrated parameters: the first at the ends of their
ranges as well, all of them inside, where a parameter that was measured directly stays near what was measured. So every run tells
of the parameters, and what an effect does is known where re-calibration may go. The design depends on what stands in study.toml
only: another set of measurements on the same bench needs no new run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from designs.space import Factor, FactorSpace
from taichidem import plugins
from taichidem.study.calibrate_section import Calibration
from taichidem.study.hypothesis import Hypothesis

EFFECT, SHARE, SEED, BLOCK = "effect", "share", "seed", "block"
LEAST_SHARE = 0.25  # of the strongest setting, below which an effect of most kinds drowns in the scatter
SEEDS = (1, 2)  # common random numbers: the rows of every block take these in turn
CENTRE_SEEDS = (1, 2, 3, 4)  # repeats at the centre of the ranges, which tell the scatter
NEAR = 3.0  # standard uncertainties about a direct measurement within which a parameter is varied
DESIGN_SEED = 20260  # of the designs themselves


def screening_design(
    calibrate: Sequence[Calibration],
    hypotheses: Sequence[Hypothesis],
    base_rows: int | None = None,
    effect_rows: int = 4,
) -> pd.DataFrame:
    """Return the runs to make: a row each, the value of every calibrated key, effect, share of its strength, seed and block.

    Args:
        calibrate: p parameters with their ranges.
        hypotheses: effects to put in.
        base_rows: space-filling rows without any effect; 3 p by default.
        effect_rows: rows per effect.
    """
    keys = [entry.key for entry in calibrate]
    count = 3 * len(keys) if base_rows is None else base_rows
    blocks = [_base(calibrate, count)]
    blocks += [_block(calibrate, h, effect_rows, number) for number, h in enumerate(hypotheses, 1)]
    table = pd.concat(blocks, ignore_index=True)
    return table[[*keys, EFFECT, SHARE, SEED, BLOCK]]


def _base(calibrate: Sequence[Calibration], count: int) -> pd.DataFrame:
    """Return centre, edges and inside of the ranges, with no effect in."""
    centre = pd.DataFrame([{c.key: (c.low + c.high) / 2 for c in calibrate}] * len(CENTRE_SEEDS))
    if not calibrate:
        centre = pd.DataFrame(index=range(len(CENTRE_SEEDS)))
    rows = pd.concat([_edges(calibrate), _filling(calibrate, count, 0)], ignore_index=True) if calibrate else None
    table = centre if rows is None else pd.concat([centre, rows], ignore_index=True)
    seeds = [*CENTRE_SEEDS, *np.resize(SEEDS, len(table) - len(centre))]
    return table.assign(**{EFFECT: "", SHARE: 0.0, SEED: seeds, BLOCK: 0})


def _edges(calibrate: Sequence[Calibration]) -> pd.DataFrame:
    """Return runs at the ends of the ranges: definitive screening from three parameters on, else all of three levels."""
    name, settings = ("definitive_screening", {}) if len(calibrate) >= 3 else ("full_factorial", {"levels_each": 3})
    design = plugins.get("design", name)(**settings).generate(_space(calibrate), seed=DESIGN_SEED)
    table = design.table[[c.key for c in calibrate]]
    middle = np.all([np.isclose(table[c.key], (c.low + c.high) / 2) for c in calibrate], axis=0)
    return table[~middle]


def _filling(calibrate: Sequence[Calibration], count: int, number: int) -> pd.DataFrame:
    generator = plugins.get("design", "latin_hypercube")(runs=count)
    design = generator.generate(_space(_near(calibrate)), seed=DESIGN_SEED + number)
    return design.table[[c.key for c in calibrate]]


def _block(calibrate: Sequence[Calibration], hypothesis: Hypothesis, count: int, number: int) -> pd.DataFrame:
    """Return the rows of one effect, its shares evenly from a quarter to the whole, on both sides where it has two."""
    share = Factor(SHARE, LEAST_SHARE, 1.0)
    generator = plugins.get("design", "latin_hypercube")(runs=count)
    table = generator.generate(_space(_near(calibrate), share), seed=_own_seed(hypothesis.name)).table
    order = np.argsort(np.argsort(table[SHARE].to_numpy()))
    shares = np.ones(count) if hypothesis.effect.all_or_nothing else np.linspace(LEAST_SHARE, 1.0, count)[order]
    if hypothesis.effect.two_sided:
        shares = np.where(order % 2 == 0, shares, -shares)
    fixed = {EFFECT: hypothesis.name, SHARE: shares, SEED: np.resize(SEEDS, count), BLOCK: number}
    return table[[c.key for c in calibrate]].assign(**fixed)


def _near(calibrate: Sequence[Calibration]) -> list[Calibration]:
    """Return the parameters with the ranges in which they are likely to be."""
    found = []
    for entry in calibrate:
        low, high = entry.low, entry.high
        if entry.value is not None and entry.u is not None:
            low, high = max(low, entry.value - NEAR * entry.u), min(high, entry.value + NEAR * entry.u)
        found.append(replace(entry, low=low, high=high) if low < high else entry)
    return found


def _own_seed(name: str) -> int:
    """Return a seed that belongs to the effect, so that its rows don't change when other effects are registered."""
    return DESIGN_SEED + int.from_bytes(name.encode(), "big") % 1_000_003


def _space(calibrate: Sequence[Calibration], *more: Any) -> FactorSpace:
    return FactorSpace([*(Factor(c.key, c.low, c.high, c.unit) for c in calibrate), *more])
