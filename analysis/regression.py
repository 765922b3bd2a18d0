"""Least squares in coded units by statsmodels, with what it lacks: PRESS, lack of fit, adequate precision."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats
from statsmodels.regression.linear_model import OLS

from analysis.errors import AnalysisError
from analysis.run_table import RunTable
from designs.space import Array
from designs.terms import Term, model_matrix


@dataclass(frozen=True)
class FittedModel:
    """A polynomial fitted to one response, y = X b + e, in coded units.

    Columns of X: constant, blocks (contrasts that add up to zero, so that the constant is the mean over blocks),
    terms.

    Args:
        runs: the runs.
        response: name of the response.
        terms: the terms besides the constant.

    Raises:
        AnalysisError: for fewer runs than coefficients, or terms that the runs can't tell apart.
    """

    runs: RunTable
    response: str
    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        n, p = self.matrix.shape
        if n < p:
            raise AnalysisError(
                f"The model has {p} coefficients and the table {n} runs; at least as many runs are needed. Choose a "
                "smaller model (linear, interactions, pure_quadratic) or fewer factors."
            )
        if np.linalg.matrix_rank(self.matrix) < p:
            names = ", ".join(self.aliased_labels())
            raise AnalysisError(
                f"The runs can't tell these terms from the others: {names}. They are aliased; leave them out or add "
                "runs (design d_optimal with existing runs)."
            )

    def aliased_labels(self) -> list[str]:
        """Return the labels of terms that depend on those before them."""
        kept, labels = self.matrix[:, : self.n_blocks], []
        for term, column in zip(self.terms, self.matrix[:, self.n_blocks :].T, strict=True):
            wider = np.column_stack([kept, column])
            if np.linalg.matrix_rank(wider) == wider.shape[1]:
                kept = wider
            else:
                labels.append(term.label(self.runs.names))
        return labels

    @property
    def n_blocks(self) -> int:
        """Number of columns before the first term: the constant and the block contrasts."""
        return self.runs.n_blocks

    @cached_property
    def matrix(self) -> Array:
        """X, shape (n, p)."""
        return np.column_stack([block_matrix(self.runs), model_matrix(self.runs.coded, self.terms, constant=False)])

    @cached_property
    def y(self) -> Array:
        """The response, shape (n,)."""
        return self.runs.responses[self.response]

    @cached_property
    def results(self) -> Any:
        """The statsmodels results object."""
        return OLS(self.y, self.matrix).fit()

    @cached_property
    def coefficients(self) -> Array:
        """b, shape (p,): constant, blocks, terms."""
        return np.asarray(self.results.params)

    @cached_property
    def term_coefficients(self) -> dict[Term, float]:
        """Coded coefficient of each term."""
        return dict(zip(self.terms, self.coefficients[self.n_blocks :].tolist(), strict=True))

    @property
    def constant(self) -> float:
        """Coded constant: the prediction at the centre, averaged over blocks."""
        return float(self.coefficients[0])

    @cached_property
    def fitted(self) -> Array:
        """Fitted values, shape (n,)."""
        return np.asarray(self.results.fittedvalues)

    @cached_property
    def residuals(self) -> Array:
        """y − fitted, shape (n,)."""
        return self.y - self.fitted

    @cached_property
    def leverage(self) -> Array:
        """Diagonal of X (XᵀX)⁻¹ Xᵀ, shape (n,)."""
        q, _ = np.linalg.qr(self.matrix)
        return np.einsum("ij,ij->i", q, q)

    @property
    def error_df(self) -> int:
        """n − p."""
        return self.matrix.shape[0] - self.matrix.shape[1]

    @property
    def error_ss(self) -> float:
        """Sum of squared residuals (0 for a saturated model, whatever the rounding left)."""
        return float(self.residuals @ self.residuals) if self.error_df else 0.0

    @property
    def total_ss(self) -> float:
        """Sum of squares about the mean."""
        deviation = self.y - self.y.mean()
        return float(deviation @ deviation)

    @property
    def s(self) -> float:
        """Residual standard deviation √(SSE / (n − p)), NaN for a saturated model."""
        return math.sqrt(self.error_ss / self.error_df) if self.error_df else math.nan

    @property
    def r_squared(self) -> float:
        """R² in per cent."""
        return 100.0 * (1.0 - self.error_ss / self.total_ss) if self.total_ss else math.nan

    @property
    def r_squared_adjusted(self) -> float:
        """Adjusted R² in per cent, 1 − (SSE/(n − p)) / (SST/(n − 1))."""
        if not self.error_df or not self.total_ss:
            return math.nan
        return 100.0 * (1.0 - (self.error_ss / self.error_df) / (self.total_ss / (len(self.y) - 1)))

    @property
    def press(self) -> float:
        """Σ (eᵢ / (1 − hᵢ))², NaN where a run determines a coefficient alone (hᵢ = 1)."""
        spare = 1.0 - self.leverage
        if not self.error_df or (spare < 1e-9).any():
            return math.nan
        return float(np.sum((self.residuals / spare) ** 2))

    @property
    def r_squared_predicted(self) -> float:
        """Predicted R² in per cent, 1 − PRESS / SST."""
        return 100.0 * (1.0 - self.press / self.total_ss) if self.total_ss else math.nan

    @property
    def adequate_precision(self) -> float:
        """(max ŷ − min ŷ) / √(p s² / n): signal to noise, above 4 wanted."""
        n, p = self.matrix.shape
        if not self.error_df or self.error_ss <= 0:
            return math.nan
        return float(np.ptp(self.fitted)) / math.sqrt(p * self.s**2 / n)

    @property
    def cv_percent(self) -> float:
        """100 s / |mean|."""
        mean = float(self.y.mean())
        return 100.0 * self.s / abs(mean) if mean else math.nan

    def information(self, criterion: str) -> float:
        """Return AICc or BIC, n ln(SSE/n) plus its penalty; the variance counts as a parameter.

        AICc: 2m + 2m(m + 1)/(n − m − 1), BIC: m ln n, with m = p + 1. Infinite where AICc isn't defined.
        """
        n, p = self.matrix.shape
        m = p + 1
        if self.error_ss <= 0:
            return math.nan
        deviance = n * math.log(self.error_ss / n)
        if criterion.lower() == "bic":
            return deviance + m * math.log(n)
        return deviance + 2 * m + 2 * m * (m + 1) / (n - m - 1) if n > m + 1 else math.inf

    def p_values(self) -> dict[Term, float]:
        """Return the two-sided p of each term.

        Raises:
            AnalysisError: for a saturated model.
        """
        self.require_error_df("p-values")
        return dict(zip(self.terms, np.asarray(self.results.pvalues)[self.n_blocks :].tolist(), strict=True))

    def require_error_df(self, wish: str) -> None:
        """Raise an ``AnalysisError`` when the model is saturated."""
        if self.error_df == 0:
            raise AnalysisError(
                f"The model is saturated: {self.matrix.shape[1]} coefficients from {len(self.y)} runs leave no degree "
                f"of freedom for the error, so there are no {wish}. Choose a smaller model, add centre points or "
                "replicates, or use main_effects, which judges saturated designs by Lenth's method."
            )

    def vif(self) -> dict[Term, float]:
        """Return the variance inflation factor of each term, 1/(1 − R²ⱼ) in coded units."""
        columns = self.matrix[:, 1:] - self.matrix[:, 1:].mean(axis=0)
        if not columns.shape[1]:
            return {}
        correlation = np.corrcoef(columns, rowvar=False).reshape(columns.shape[1], -1)
        inflation = np.diag(np.linalg.inv(correlation))[self.n_blocks - 1 :]
        return dict(zip(self.terms, inflation.tolist(), strict=True))

    def coefficient_table(self) -> pd.DataFrame:
        """Return term, coded coefficient, standard error, t, p and VIF."""
        labels = ["Constant", *(f"Block {i + 1}" for i in range(self.n_blocks - 1)), *self.labels()]
        blank = [math.nan] * self.n_blocks
        error = np.asarray(self.results.bse) if self.error_df else np.full(len(labels), math.nan)
        t = self.coefficients / error
        p = 2 * stats.t.sf(np.abs(t), self.error_df) if self.error_df else np.full(len(labels), math.nan)
        columns = {"Term": labels, "Coef": self.coefficients, "SE Coef": error, "t": t, "p": p}
        return pd.DataFrame({**columns, "VIF": [*blank, *self.vif().values()]})

    def labels(self) -> list[str]:
        """Return the labels of the terms."""
        return [term.label(self.runs.names) for term in self.terms]

    def row(self, coded: Array) -> Array:
        """Return rows of X for coded points (m, k), averaged over blocks."""
        points = np.atleast_2d(np.asarray(coded, dtype=float))
        blocks = np.zeros((len(points), self.n_blocks - 1))
        terms = model_matrix(points, self.terms, constant=False)
        return np.column_stack([np.ones(len(points)), blocks, terms])

    def predict(self, coded: Array) -> Array:
        """Return predictions, shape (m,), at coded points (m, k)."""
        return self.row(coded) @ self.coefficients

    def standard_error(self, coded: Array) -> Array:
        """Return the standard error of the predicted mean, shape (m,), at coded points (m, k)."""
        rows = self.row(coded)
        covariance = np.linalg.inv(self.matrix.T @ self.matrix) * self.s**2
        return np.sqrt(np.einsum("ij,jk,ik->i", rows, covariance, rows))

    def with_terms(self, terms: Sequence[Term]) -> FittedModel:
        """Return the fit of other terms to the same runs."""
        return FittedModel(self.runs, self.response, tuple(terms))


def block_matrix(runs: RunTable) -> Array:
    """Return the constant and the block contrasts (+1 own block, −1 last block), shape (n, number of blocks)."""
    contrasts = np.vstack([np.eye(runs.n_blocks - 1), -np.ones((1, runs.n_blocks - 1))])[runs.block]
    return np.column_stack([np.ones(len(runs)), contrasts])


def residual_ss(matrix: Array, y: Array) -> float:
    """Return the sum of squared residuals of the least-squares fit of y on any matrix, rank-deficient or not."""
    coefficients = np.linalg.lstsq(matrix, y, rcond=None)[0]
    residual = y - matrix @ coefficients
    return float(residual @ residual)
