"""The fitted polynomial written in natural units."""

from __future__ import annotations

import itertools
import math

import numpy as np

from analysis.regression import FittedModel
from designs.space import Array, Factor
from designs.terms import Term


def uncoded_coefficients(fit: FittedModel) -> dict[Term, float]:
    """Return the coefficients in natural units, the constant (all powers 0) included.

    Each coded factor is replaced by x = (v − c)/h, with v the natural value (its logarithm for a log factor), c the
    centre and h the half range, and the products are multiplied out:
    x^p = h^−p Σ_q (p over q) v^q (−c)^(p−q).
    """
    coefficients = np.array([fit.constant, *fit.term_coefficients.values()])
    return {term: float(row @ coefficients) for term, row in _uncoding(fit).items()}


def uncoded_standard_errors(fit: FittedModel) -> dict[Term, float]:
    """Return the standard errors of the coefficients in natural units, √(m s² (XᵀX)⁻¹ mᵀ); NaN for a saturated model.

    m is the row that makes the coefficient from the coded ones, which blocks leave alone.
    """
    kept = [0, *range(fit.n_blocks, fit.matrix.shape[1])]
    covariance = (np.linalg.inv(fit.matrix.T @ fit.matrix) * fit.s**2)[np.ix_(kept, kept)]
    return {term: float(np.sqrt(max(float(row @ covariance @ row), 0.0))) for term, row in _uncoding(fit).items()}


def _uncoding(fit: FittedModel) -> dict[Term, Array]:
    """Return natural term → what each coded coefficient (the constant first) adds to its coefficient."""
    size = 1 + len(fit.terms)
    result: dict[Term, Array] = {Term((0,) * len(fit.runs.space)): np.eye(1, size)[0]}
    for place, term in enumerate(fit.terms, 1):
        parts = [_powers(f, power) for f, power in zip(fit.runs.space, term.powers, strict=True)]
        for chosen in itertools.product(*(range(len(part)) for part in parts)):
            row = result.setdefault(Term(tuple(chosen)), np.zeros(size))
            row[place] += math.prod(part[q] for part, q in zip(parts, chosen, strict=True))
    return dict(sorted(result.items(), key=lambda item: (item[0].order, max(item[0].powers), _reverse(item[0]))))


def _reverse(term: Term) -> tuple[int, ...]:
    return tuple(-power for power in term.powers)


def _powers(factor: Factor, power: int) -> list[float]:
    low, high = (math.log(factor.low), math.log(factor.high)) if factor.log else (factor.low, factor.high)
    centre, half = (low + high) / 2, (high - low) / 2
    return [math.comb(power, q) * (-centre) ** (power - q) / half**power for q in range(power + 1)]


def equation(fit: FittedModel, digits: int = 5) -> str:
    """Return the equation as text, ``y = 7.6448 + 51.36 F − 49.28 F*F``, for natural values (mean over blocks)."""
    names = [f"ln({f.name})" if f.log else f.name for f in fit.runs.space]
    text = f"{fit.response} ="
    for i, (term, value) in enumerate(uncoded_coefficients(fit).items()):
        sign = ("− " if value < 0 else "") if i == 0 else ("− " if value < 0 else "+ ")
        label = "" if term.order == 0 else f" {term.label(names)}"
        text += f" {sign}{abs(value):.{digits}g}{label}"
    return text
