"""Polynomial terms in coded factors: their names, their columns, their hierarchy."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from designs.errors import DesignError, nearest_hint
from designs.space import Array

MODELS = ("linear", "interactions", "pure_quadratic", "quadratic")


@dataclass(frozen=True, order=True)
class Term:
    """A product of coded factors, x₁^p₁ · x₂^p₂ · …, written as its powers (one per factor, all 0 = constant)."""

    powers: tuple[int, ...]

    @property
    def order(self) -> int:
        """Sum of the powers."""
        return sum(self.powers)

    @property
    def kind(self) -> str:
        """``constant``, ``linear``, ``square``, ``2-way interaction``, ``3-way interaction`` … or ``higher``."""
        if self.order == 0:
            return "constant"
        if self.order == 1:
            return "linear"
        if max(self.powers) == 1:
            return f"{self.order}-way interaction"
        return "square" if self.order == 2 else "higher"

    def label(self, names: Sequence[str]) -> str:
        """Return the name people know from statistics packages: ``F``, ``F*D``, ``F*F``."""
        parts = [name for name, power in zip(names, self.powers, strict=True) for _ in range(power)]
        return "*".join(parts) or "Constant"

    def column(self, coded: Array) -> Array:
        """Return the term's values, shape (n,), at coded points of shape (n, k)."""
        return np.prod(coded ** np.asarray(self.powers), axis=1)

    def contains(self, other: Term) -> bool:
        """Return whether the other term divides this one and differs from it (hierarchy: F*D contains F)."""
        return self != other and all(mine >= its for mine, its in zip(self.powers, other.powers, strict=True))


def model_terms(n_factors: int, model: str) -> list[Term]:
    """Return the terms of a named model, without the constant: linear, then squares, then interactions.

    Raises:
        DesignError: for a model that has no such name.
    """
    if model not in MODELS:
        raise DesignError(f"Unknown model {model!r}. {nearest_hint(model, MODELS)}")
    terms = [_term(n_factors, (i,)) for i in range(n_factors)]
    if model in ("pure_quadratic", "quadratic"):
        terms += [_term(n_factors, (i, i)) for i in range(n_factors)]
    if model in ("interactions", "quadratic"):
        terms += interaction_terms(n_factors, 2)
    return terms


def interaction_terms(n_factors: int, order: int) -> list[Term]:
    """Return all products of ``order`` different factors, in the order AB, AC, …, BC, …."""
    return [_term(n_factors, chosen) for chosen in itertools.combinations(range(n_factors), order)]


def model_matrix(coded: Array, terms: Iterable[Term], *, constant: bool = True) -> Array:
    """Return the columns of the terms at coded points (n, k), shape (n, p), the constant first."""
    points = np.asarray(coded, dtype=float)
    columns = [np.ones(len(points))] if constant else []
    columns += [term.column(points) for term in terms]
    return np.column_stack(columns) if columns else np.empty((len(points), 0))


def parse_term(label: str, names: Sequence[str]) -> Term:
    """Return the term written as ``F``, ``F*D`` or ``F*F``.

    Raises:
        DesignError: for a factor that isn't there, with the nearest name.
    """
    powers = [0] * len(names)
    for part in label.split("*"):
        if part.strip() not in names:
            raise DesignError(f"Unknown factor {part.strip()!r} in term {label!r}. {nearest_hint(part.strip(), names)}")
        powers[list(names).index(part.strip())] += 1
    return Term(tuple(powers))


def _term(n_factors: int, factors: Sequence[int]) -> Term:
    return Term(tuple(list(factors).count(i) for i in range(n_factors)))
