"""What a set of coded points can and can't tell: alias structure, D-efficiency, power."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from designs.errors import DesignError
from designs.space import Array
from designs.terms import Term, interaction_terms, model_matrix, model_terms

_SHOWN_ALIASES = 6
_SMALL_ALIAS = 0.05


def d_efficiency(coded: Array, model: str = "linear") -> float:
    """Return the D-efficiency in per cent, 100 · |XᵀX|^(1/p) / n, with X in coded units.

    100 % is an orthogonal two-level design; 0 means that the points can't carry the model.

    Args:
        coded: points, shape (n, k).
        model: a name of ``designs.terms.MODELS``.
    """
    matrix = model_matrix(coded, model_terms(coded.shape[1], model))
    n, p = matrix.shape
    if n < p or np.linalg.matrix_rank(matrix) < p:
        return 0.0
    _, log_determinant = np.linalg.slogdet(matrix.T @ matrix)
    return float(100.0 * np.exp(log_determinant / p) / n)


def alias_table(coded: Array, names: Sequence[str]) -> pd.DataFrame:
    """Return how two-factor interactions bias the main effects, A = (X₁ᵀX₁)⁻¹ X₁ᵀX₂, and one another.

    One row per pair: ``term``, ``alias``, ``coefficient`` (1 or −1: can't be told apart; 1/3: partly).
    Interactions are listed against each other only where they coincide.
    Source: Box & Draper, "Empirical Model-Building and Response Surfaces", ch. 3 (1987).
    """
    k = coded.shape[1]
    main, interactions = model_terms(k, "linear"), interaction_terms(k, 2)
    fitted, omitted = model_matrix(coded, main), model_matrix(coded, interactions, constant=False)
    bias = np.linalg.pinv(fitted) @ omitted
    rows = [
        (term.label(names), alias.label(names), bias[i + 1, j])
        for i, term in enumerate(main)
        for j, alias in enumerate(interactions)
        if abs(bias[i + 1, j]) > 1e-9
    ]
    rows += _coinciding(interactions, omitted, names)
    return pd.DataFrame(rows, columns=["term", "alias", "coefficient"])


def _coinciding(terms: Sequence[Term], columns: Array, names: Sequence[str]) -> list[tuple[str, str, float]]:
    centred = columns - columns.mean(axis=0)
    norms = np.linalg.norm(centred, axis=0)
    norms[norms == 0] = np.inf
    correlation = (centred / norms).T @ (centred / norms)
    return [
        (terms[i].label(names), terms[j].label(names), float(np.sign(correlation[i, j])))
        for i, j in itertools.combinations(range(len(terms)), 2)
        if abs(correlation[i, j]) > 1 - 1e-9
    ]


def alias_text(table: pd.DataFrame, names: Sequence[str]) -> str:
    """Return the alias table as lines such as ``A = A + B*C − 0.33 C*D``, at most six aliases ≥ 0.05 a line."""
    if table.empty:
        return "Main effects and two-factor interactions are all clear of one another."
    large = table[table["coefficient"].abs() >= _SMALL_ALIAS]
    lines = ["Aliases below 0.05 are left out."] if len(large) < len(table) else []
    for term, group in large.groupby("term", sort=False):
        shown = group.iloc[:_SHOWN_ALIASES]
        parts = [_signed(c, a) for a, c in zip(shown["alias"], shown["coefficient"], strict=True)]
        more = len(group) - len(shown)
        lines.append(f"{term} = {term} {' '.join(parts)}" + (f" … and {more} more" if more else ""))
    clear = [name for name in names if name not in set(table["term"])]
    if clear:
        lines.append(f"Clear of two-factor interactions: {', '.join(clear)}")
    return "\n".join(lines)


def _signed(coefficient: float, label: str) -> str:
    sign = "+" if coefficient > 0 else "−"
    size = abs(coefficient)
    return f"{sign} {label}" if abs(size - 1) < 1e-9 else f"{sign} {size:.2f} {label}"


def power_table(
    coded: Array, names: Sequence[str], *, effect: float, noise: float, alpha: float = 0.05, model: str = "linear"
) -> pd.DataFrame:
    """Return the chance of seeing an effect of the given size in each term.

    The test is F(1, n − p) with non-centrality λ = (effect/2)² / (σ² [(XᵀX)⁻¹]ⱼⱼ); the effect is the change of
    the response from low to high, so its coded coefficient is half of it.

    Args:
        coded: points, shape (n, k).
        names: factor names, length k.
        effect: change of the response from low to high, in its unit.
        noise: standard deviation σ of one run, in the same unit.
        alpha: significance level, between 0 and 1.
        model: a name of ``designs.terms.MODELS``.

    Returns:
        A table with ``term`` and ``power`` (NaN where no degree of freedom is left for the error).

    Raises:
        DesignError: for noise ≤ 0, alpha outside (0, 1), or a model that the points can't carry.
    """
    if not noise > 0 or not 0 < alpha < 1:
        raise DesignError(f"Power was asked for noise = {noise:g}, alpha = {alpha:g}; both must be > 0 and alpha < 1.")
    terms = model_terms(coded.shape[1], model)
    matrix = model_matrix(coded, terms)
    n, p = matrix.shape
    if np.linalg.matrix_rank(matrix) < p:
        raise DesignError(f"{n} runs can't carry the {p} terms of the {model} model; ask for a smaller model.")
    variance = np.diag(np.linalg.inv(matrix.T @ matrix))[1:]
    labels = [term.label(names) for term in terms]
    if n == p:
        return pd.DataFrame({"term": labels, "power": np.nan})
    critical = stats.f.isf(alpha, 1, n - p)
    power = stats.ncf.sf(critical, 1, n - p, (effect / 2) ** 2 / (noise**2 * variance))
    return pd.DataFrame({"term": labels, "power": power})
