"""The interface of a design generator, and what is done once for all of them: order, blocks, seeds, bounds."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from designs.design import Design
from designs.errors import DesignError, nearest_counts, nearest_hint
from designs.space import Array, FactorSpace

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Points:
    """The runs of a design in standard order.

    Args:
        coded: coded values, shape (n, k): low −1, high +1, centre 0.
        point_type: one word per run (``factorial``, ``centre``, ``axial``, …), length n.
        block: block number of each run, from 1, length n; default all 1.
        notes: sentences that the user must read (a saturated design, say).
        run_before: table of the leading rows when these were run before (augmentation); they keep seed and order.
    """

    coded: Array
    point_type: tuple[str, ...]
    block: IntArray | None = None
    notes: tuple[str, ...] = ()
    run_before: pd.DataFrame | None = None


@dataclass(frozen=True, kw_only=True)
class DesignGenerator(abc.ABC):
    """A recipe that turns a factor space into runs.

    Subclasses are frozen, keyword-only dataclasses: their fields are the settings, ``points`` is the recipe, the
    first sentence of their docstring is the summary that lists show. Order, seeds, blocks and bounds come from here.

    Args:
        runs: the number of runs wanted, before replication; a design that can't have it names the nearest it can.
        replicates: how often every run is done; replicates have seeds of their own.
    """

    runs: int | None = None
    replicates: int = 1

    name: ClassVar[str] = ""
    #: The model that the design is meant for; used for D-efficiency and power unless another is asked for.
    model: ClassVar[str] = "linear"
    #: Space-filling designs may put a factor with levels on any level; the others need theirs to be there.
    space_filling: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_whole(self, "replicates", self.replicates, at_least=1)
        if self.runs is not None:
            check_whole(self, "runs", self.runs, at_least=1)

    @abc.abstractmethod
    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the runs in standard order, before replication; ``rng`` is the only source of chance."""

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the run counts the design can have, before replication; empty when only the given one is known."""
        return ()

    def outside_advice(self) -> str:
        """Return what to do when a run lies outside a physical bound of a factor."""
        return "Narrow the range of the factor, or correct its physical bound."

    @classmethod
    def settings(cls) -> dict[str, Any]:
        """Return the settings by name with their defaults."""
        return {f.name: None if f.default is dataclasses.MISSING else f.default for f in dataclasses.fields(cls)}

    @classmethod
    def summary(cls) -> str:
        """Return the first line of the docstring."""
        return next(iter((cls.__doc__ or "").strip().splitlines()), "")

    def generate(self, space: FactorSpace, *, seed: int = 0) -> Design:
        """Return the design: runs in seeded random order within each block, a seed for each run, coded and natural.

        Args:
            space: the factors.
            seed: whole number ≥ 0; the same seed gives the same design, bit for bit.

        Raises:
            DesignError: when the design can't be made for these factors or this number of runs.
        """
        check_whole(self, "seed", seed, at_least=0)
        for_points, for_order, for_seeds = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(3))
        points = _replicated(self._counted(space, self.points(space, for_points)), self.replicates)
        natural = space.to_natural(points.coded)
        self._check_natural(space, natural, points)
        table = _run_table(points, for_order, for_seeds)
        table = pd.concat([table, natural], axis=1)
        order = np.argsort(table["run_order"].to_numpy(), kind="stable")
        return Design(
            name=self.name,
            space=space,
            table=table.iloc[order].reset_index(drop=True),
            coded=pd.DataFrame(points.coded[order] + 0.0, columns=list(space.names)),  # + 0.0: no minus zero
            model=self.model,
            notes=points.notes,
            seed=seed,
        )

    def _counted(self, space: FactorSpace, points: Points) -> Points:
        if self.runs is None or len(points.coded) == self.runs:
            return points
        raise self.wrong_runs(space, [*self.possible_runs(space), len(points.coded)])

    def wrong_runs(self, space: FactorSpace, possible: Iterable[int]) -> DesignError:
        """Return the error for a number of runs that can't be had, with the nearest that can."""
        return DesignError(
            f"{self.name} in {len(space)} factors can't have {self.runs} runs with these settings. "
            f"The nearest it can have: {nearest_counts(self.runs or 0, possible)}."
        )

    def _check_natural(self, space: FactorSpace, natural: pd.DataFrame, points: Points) -> None:
        for factor in space:
            values = natural[factor.name].to_numpy()
            slack = 1e-9 * (factor.high - factor.low)
            low = -np.inf if factor.lowest is None else factor.lowest - slack
            high = np.inf if factor.highest is None else factor.highest + slack
            outside = np.flatnonzero((values < low) | (values > high))
            if outside.size:
                raise DesignError(
                    f"{self.name} puts {factor.name} at {values[outside[0]]:g} {factor.unit}".rstrip()
                    + f" ({points.point_type[outside[0]]} point), outside its physical bounds "
                    f"{_bound(factor.lowest, '−∞')} … {_bound(factor.highest, '∞')}. {self.outside_advice()}"
                )
            if factor.levels is None or self.space_filling:
                continue
            missing = [v for v in values if not np.isclose(v, factor.levels, rtol=0, atol=slack).any()]
            if missing:
                raise DesignError(
                    f"{self.name} needs {factor.name} = {missing[0]:g}, which isn't among its levels {factor.levels}. "
                    "Add the level, or use full_factorial or a space-filling design (latin_hypercube, sobol, halton)."
                )


def check_whole(owner: DesignGenerator, setting: str, value: Any, *, at_least: int) -> None:
    """Raise a ``DesignError`` unless the value is a whole number of at least ``at_least`` (NumPy integers count)."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < at_least:
        raise DesignError(f"{owner.name} has {setting} = {value!r}; a whole number ≥ {at_least} is needed.")


def check_choice(owner: DesignGenerator, setting: str, value: Any, allowed: Iterable[str]) -> None:
    """Raise a ``DesignError`` unless the value is one of the allowed words, naming the nearest."""
    names = list(allowed)
    if value not in names:
        raise DesignError(f"{owner.name} has {setting} = {value!r}. {nearest_hint(str(value), names)}")


def _bound(value: float | None, otherwise: str) -> str:
    return otherwise if value is None else f"{value:g}"


def _replicated(points: Points, replicates: int) -> Points:
    """Repeat the new rows; rows that were run before are not repeated."""
    if replicates == 1:
        return points
    before = 0 if points.run_before is None else len(points.run_before)
    n = len(points.coded)
    rows = np.concatenate([np.arange(before)] + [np.arange(before, n)] * replicates)
    block = None if points.block is None else points.block[rows]
    kinds = tuple(points.point_type[row] for row in rows)
    return dataclasses.replace(points, coded=points.coded[rows], point_type=kinds, block=block)


def _run_table(points: Points, for_order: np.random.Generator, for_seeds: np.random.Generator) -> pd.DataFrame:
    n = len(points.coded)
    block = np.ones(n, dtype=np.int64) if points.block is None else points.block
    before = 0 if points.run_before is None else len(points.run_before)
    order = np.concatenate([np.arange(before), before + _shuffled_in_blocks(block[before:], for_order)])
    run_order = np.empty(n, dtype=np.int64)
    run_order[order] = np.arange(1, n + 1)
    return pd.DataFrame(
        {
            "run": run_order,
            "std_order": np.arange(1, n + 1),
            "run_order": run_order,
            "block": block,
            "point_type": list(points.point_type),
            "seed": _seeds(n, points.run_before, for_seeds),
        }
    )


def _shuffled_in_blocks(block: IntArray, rng: np.random.Generator) -> IntArray:
    parts = [rng.permutation(np.flatnonzero(block == number)) for number in np.unique(block)]
    return np.concatenate(parts) if parts else np.empty(0, dtype=np.int64)


def _seeds(n: int, run_before: pd.DataFrame | None, rng: np.random.Generator) -> IntArray:
    """Return n different seeds below 2³¹, beginning with those of the runs done before."""
    kept = np.empty(0, dtype=np.int64)
    if run_before is not None and "seed" in run_before.columns:
        kept = run_before["seed"].to_numpy(dtype=np.int64)
    drawn = rng.choice(2**31 - 1, size=n + kept.size, replace=False, shuffle=True) + 1
    fresh = drawn[~np.isin(drawn, kept)]
    return np.concatenate([kept, fresh])[:n]
