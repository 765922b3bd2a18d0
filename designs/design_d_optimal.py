"""D-optimal runs, on their own or added to runs that exist."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from designs.base import DesignGenerator, Points, check_choice, check_whole
from designs.design import check_run_table
from designs.errors import DesignError
from designs.space import Array, FactorSpace
from designs.terms import MODELS, Term, model_matrix, model_terms

_GRID_LIMIT = 1000
_RIDGE = 1e-6


@dataclass(frozen=True, kw_only=True, eq=False)
class DOptimal(DesignGenerator):
    """D-optimal augmentation: the runs that add most information, max |XᵀX|, to the runs that exist (or to none).

    Fedorov exchange: start from the greedy choice, then swap the pair (run, candidate) that raises the determinant
    most, |XᵀX| (1 + Δ), Δ = d(x) − d(r) − d(r) d(x) + d(r, x)², d(a, b) = aᵀ(XᵀX)⁻¹b, until no swap does. The best of
    several random starts is kept. Candidates may be chosen more than once.

    Args:
        existing: run table of the runs done before (columns named as the factors; ``seed`` and ``point_type`` are
            kept); they stay first, in block 1, and the new ones follow in the next block.
        added_runs: number of new runs; default ``runs`` − existing, or what the model still lacks to be estimable.
        fit: the model that the runs shall carry: ``linear``, ``interactions``, ``pure_quadratic``, ``quadratic``.
        candidates: table of candidate runs in natural units; default the three-level grid of the box, or 1,000 Sobol'
            points and the box's centre when the grid is larger.
        starts: number of random starts, ≥ 1.

    Source: Fedorov, "Theory of Optimal Experiments" (1972); Mitchell, Technometrics 16 (1974) 203.
    """

    existing: pd.DataFrame | None = None
    added_runs: int | None = None
    fit: str = "quadratic"
    candidates: pd.DataFrame | None = None
    starts: int = 4

    name: ClassVar[str] = "d_optimal"
    model: ClassVar[str] = "quadratic"
    space_filling: ClassVar[bool] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice(self, "fit", self.fit, MODELS)
        check_whole(self, "starts", self.starts, at_least=1)
        if self.added_runs is not None:
            check_whole(self, "added_runs", self.added_runs, at_least=1)
        object.__setattr__(self, "model", self.fit)

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return the existing runs, then the chosen ones."""
        before = None if self.existing is None else check_run_table(self.existing, space)
        old = np.empty((0, len(space))) if before is None else space.to_coded(before)
        candidates = self._candidates(space, rng)
        terms = model_terms(len(space), self.fit)
        old_rows, rows = model_matrix(old, terms), model_matrix(candidates, terms)
        new = candidates[self._choose(old_rows, rows, self._count(old_rows), rng)]
        coded = np.vstack([old, new])
        self._check_carries(coded, terms)
        kinds = ["existing"] * len(old)
        if before is not None and "point_type" in before.columns:
            kinds = [str(kind) for kind in before["point_type"]]
        block = _blocks(before, len(old), len(new))
        return Points(coded, (*kinds, *["d-optimal"] * len(new)), block=block, run_before=before)

    def _count(self, old_rows: Array) -> int:
        n_old, n_terms = old_rows.shape
        if self.added_runs is not None:
            return self.added_runs
        if self.runs is None:
            missing = n_terms - int(np.linalg.matrix_rank(old_rows)) if n_old else n_terms
            return max(missing, 1)
        if self.runs <= n_old:
            raise DesignError(
                f"d_optimal was asked for {self.runs} runs in all, but {n_old} exist already. Ask for more, or give "
                "added_runs instead."
            )
        return self.runs - n_old

    def _candidates(self, space: FactorSpace, rng: np.random.Generator) -> Array:
        if self.candidates is not None:
            return space.to_coded(check_run_table(self.candidates, space))
        levels = [np.array([-1.0, 0.0, 1.0]) if f.levels is None else f.to_coded(np.asarray(f.levels)) for f in space]
        if np.prod([float(len(values)) for values in levels]) <= _GRID_LIMIT:
            return np.array(list(itertools.product(*levels)))
        from scipy.stats import qmc

        unit = qmc.Sobol(d=len(space), rng=rng).random_base2(10)
        # Extreme levels carry most information, so the points of the sequence are drawn to the levels.
        return np.column_stack([values[(unit[:, i] * len(values)).astype(int)] for i, values in enumerate(levels)])

    def _choose(self, old: Array, rows: Array, count: int, rng: np.random.Generator) -> npt.NDArray[np.int64]:
        """Return the indices of the chosen candidate rows: the best of several exchanges."""
        best, best_value = np.empty(0, dtype=np.int64), -np.inf
        for start in range(self.starts):
            chosen = _greedy(old, rows, count, rng if start else None)
            chosen, value = _exchange(old, rows, chosen)
            if value > best_value + 1e-9:
                best, best_value = chosen, value
        return best

    def _check_carries(self, coded: Array, terms: list[Term]) -> None:
        matrix = model_matrix(coded, terms)
        rank = int(np.linalg.matrix_rank(matrix))
        if rank < matrix.shape[1]:
            raise DesignError(
                f"d_optimal with {len(coded)} runs in all can't carry the {matrix.shape[1]} terms of the {self.fit} "
                f"model (rank {rank}). Add runs, give candidates with more levels, or choose a smaller fit."
            )


def _blocks(before: pd.DataFrame | None, n_old: int, n_new: int) -> npt.NDArray[np.int64]:
    if before is None:
        return np.ones(n_new, dtype=np.int64)
    old = before["block"].to_numpy(dtype=np.int64) if "block" in before.columns else np.ones(n_old, dtype=np.int64)
    return np.concatenate([old, np.full(n_new, old.max(initial=0) + 1)])


def _greedy(old: Array, rows: Array, count: int, rng: np.random.Generator | None) -> npt.NDArray[np.int64]:
    """Add the candidate of largest d(x) again and again; with a generator, half of the runs start at random."""
    inverse = np.linalg.inv(old.T @ old + _RIDGE * np.eye(rows.shape[1]))
    chosen: list[int] = []
    free = 0 if rng is None else count // 2
    for step in range(count):
        projected = rows @ inverse
        variance = np.einsum("ij,ij->i", projected, rows)
        best = int(rng.integers(len(rows))) if rng is not None and step < free else int(np.argmax(variance))
        chosen.append(best)
        inverse -= np.outer(projected[best], projected[best]) / (1.0 + variance[best])
    return np.array(chosen, dtype=np.int64)


def _exchange(old: Array, rows: Array, chosen: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], float]:
    """Swap the best pair until the determinant stops rising; return the indices and ln|XᵀX| (slightly ridged)."""
    chosen = chosen.copy()
    base = old.T @ old + _RIDGE * np.eye(rows.shape[1])
    for _ in range(10 * len(chosen) + 100):
        information = base + rows[chosen].T @ rows[chosen]
        projected = rows @ np.linalg.inv(information)
        variance = np.einsum("ij,ij->i", projected, rows)
        cross = projected[chosen] @ rows.T
        mine = variance[chosen][:, None]
        gain = variance[None, :] - mine - mine * variance[None, :] + cross**2
        run, candidate = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[run, candidate] < 1e-8:
            break
        chosen[run] = candidate
    return chosen, float(np.linalg.slogdet(base + rows[chosen].T @ rows[chosen])[1])
