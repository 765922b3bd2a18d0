"""Canonical analysis: where a quadratic surface is flat, what it is like there, and the way to it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pandas as pd
from scipy import optimize

from analysis.errors import AnalysisError
from analysis.model_choice import ModelAnalyser
from analysis.regression import FittedModel
from analysis.report import Report
from designs.space import Array, FactorSpace
from designs.terms import Term

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: An eigenvalue below this share of the largest is called a ridge (R's rsm uses the same share).
_RIDGE_SHARE = 0.1


@dataclass(frozen=True)
class StationaryPoint:
    """Where the gradient of the fitted quadratic vanishes.

    Args:
        fit: the model.
        active: indices of the factors in the model.
        coded: the point in coded units, shape (number of active factors,).
        eigenvalues: of the matrix B (b_ii on the diagonal, b_ij/2 beside it), largest first.
        eigenvectors: in columns, same order.
    """

    fit: FittedModel
    active: tuple[int, ...]
    coded: Array
    eigenvalues: Array
    eigenvectors: Array

    @property
    def full(self) -> Array:
        """The point with all factors, shape (k,); factors outside the model at the centre."""
        point = np.zeros(len(self.fit.runs.space))
        point[list(self.active)] = self.coded
        return point

    @property
    def natural(self) -> Array:
        """The point in natural units, shape (number of active factors,)."""
        return np.array([self.fit.runs.space.factors[i].to_natural(self.full[i : i + 1])[0] for i in self.active])

    @property
    def predicted(self) -> float:
        """The predicted response there."""
        return float(self.fit.predict(self.full)[0])

    @property
    def nature(self) -> str:
        """``maximum``, ``minimum`` or ``saddle``."""
        if (self.eigenvalues < 0).all():
            return "maximum"
        return "minimum" if (self.eigenvalues > 0).all() else "saddle"

    @property
    def inside(self) -> bool:
        """Whether the point lies within the range of the runs in every factor."""
        runs = self.fit.runs.coded
        return bool(((self.full >= runs.min(axis=0) - 1e-9) & (self.full <= runs.max(axis=0) + 1e-9)).all())

    @property
    def ridge(self) -> bool:
        """Whether the surface is nearly flat in some direction."""
        size = np.abs(self.eigenvalues)
        return bool(size.min() < _RIDGE_SHARE * size.max())

    def table(self) -> pd.DataFrame:
        """Return the point, coded and natural, one row per factor in the model."""
        factors = [self.fit.runs.space.factors[i] for i in self.active]
        return pd.DataFrame(
            {
                "Factor": [f.name for f in factors],
                "Coded": self.coded,
                "Natural": self.natural,
                "Unit": [f.unit for f in factors],
            }
        )

    def eigen_table(self) -> pd.DataFrame:
        """Return the eigenvalues, each with its eigenvector."""
        names = [self.fit.runs.names[i] for i in self.active]
        return pd.concat(
            [pd.DataFrame({"Eigenvalue": self.eigenvalues}), pd.DataFrame(self.eigenvectors.T, columns=names)], axis=1
        )

    def sentence(self) -> str:
        """Return what the point is and where."""
        where = setting_text(self.table())
        place = "inside" if self.inside else "outside"
        flat = " The surface is nearly flat along one direction (a ridge): many settings do equally well." * self.ridge
        return (
            f"The stationary point is a {self.nature} at {where}, {place} the range of the runs; predicted there: "
            f"{self.predicted:.4g}.{flat}"
        )


def setting_text(table: pd.DataFrame) -> str:
    """Return ``F = 0.52, D = 0.55 mm`` from a table with columns Factor, Natural and Unit, of which "1" is left out."""
    rows = zip(table["Factor"], table["Natural"], table["Unit"].replace("1", ""), strict=True)
    return ", ".join(f"{name} = {value:.4g} {unit}".rstrip() for name, value, unit in rows)


def quadratic_form(fit: FittedModel) -> tuple[tuple[int, ...], Array, Array]:
    """Return (active factors, b, B) of ŷ = b₀ + bᵀx + xᵀBx over the factors in the model.

    Raises:
        AnalysisError: for a model with terms above second order.
    """
    if any(term.order > 2 for term in fit.terms):
        raise AnalysisError(
            "Canonical analysis needs a model of second order; this one has higher terms. Leave them out."
        )
    active = tuple(i for i in range(len(fit.runs.space)) if any(term.powers[i] for term in fit.terms))
    linear, square = np.zeros(len(active)), np.zeros((len(active), len(active)))
    for term, value in fit.term_coefficients.items():
        where = [active.index(i) for i in _factors_of(term)]
        if len(where) == 1:
            linear[where[0]] = value
        else:
            square[where[0], where[1]] += value / 2
            square[where[1], where[0]] += value / 2
    return active, linear, square


def _factors_of(term: Term) -> list[int]:
    return [i for i, power in enumerate(term.powers) for _ in range(power)]


def stationary_point(fit: FittedModel) -> StationaryPoint | None:
    """Return the stationary point, x = −B⁻¹b/2, or None for a surface that has none (a plane or a trough)."""
    active, linear, square = quadratic_form(fit)
    if not active or np.linalg.matrix_rank(square, tol=1e-10 * max(np.abs(square).max(), 1e-300)) < len(active):
        return None
    values, vectors = np.linalg.eigh(square)
    coded = np.linalg.solve(-2.0 * square, linear)
    return StationaryPoint(fit, active, coded.astype(float), values[::-1], vectors[:, ::-1])


def steepest_path(fit: FittedModel, *, maximise: bool = True, radii: Sequence[float] | None = None) -> pd.DataFrame:
    """Return the best point on spheres of growing coded radius around the centre (ridge analysis).

    On the sphere |x| = r the best point solves (B − μI) x = −b/2 with μ above all eigenvalues of B (below, to
    minimise); without second-order terms it is the path of steepest ascent, x = r b/|b|.
    Source: Draper, Technometrics 5 (1963) 469, doi 10.1080/00401706.1963.10490126.

    Args:
        fit: the model.
        maximise: ascend, otherwise descend.
        radii: coded radii; default 0, 0.1 … 1.
    """
    active, linear, square = quadratic_form(fit)
    sign = 1.0 if maximise else -1.0
    rows = []
    for radius in [step / 10 for step in range(11)] if radii is None else radii:
        point = np.zeros(len(fit.runs.space))
        if radius > 0 and active:
            point[list(active)] = _best_on_sphere(sign * linear, sign * square, float(radius))
        natural = fit.runs.space.to_natural(point[None, :]).to_numpy()[0]
        row = {"Radius": float(radius), "Predicted": float(fit.predict(point)[0])}
        row["SE"] = float(fit.standard_error(point)[0]) if fit.error_df else np.nan
        coded = {f"coded {fit.runs.names[i]}": point[i] for i in active}
        rows.append({**row, **{fit.runs.names[i]: float(natural[i]) for i in active}, **coded})
    return pd.DataFrame(rows)


def _best_on_sphere(linear: Array, square: Array, radius: float) -> Array:
    """Return the maximum of bᵀx + xᵀBx on |x| = r."""
    values, vectors = np.linalg.eigh(square)
    turned = vectors.T @ linear
    top, size = float(values[-1]), max(float(np.linalg.norm(linear)), float(np.abs(values).max()), 1e-300)

    def excess(mu: float) -> float:
        return float(np.linalg.norm(turned / (2 * (mu - values)))) - radius

    lowest = top + 1e-12 * size
    if excess(lowest) <= 0:  # no pull along the top eigenvector: go along it to reach the sphere
        level = np.abs(values - top) < 1e-9 * size
        short: Array = np.where(level, 0.0, turned / (2 * np.maximum(lowest - values, 1e-300)))
        short[-1] = math.sqrt(max(radius**2 - float(short[:-1] @ short[:-1]), 0.0))
        return vectors @ short
    highest = top + np.linalg.norm(linear) / radius + size
    mu = optimize.brentq(excess, lowest, highest, xtol=1e-14 * size, rtol=1e-14)
    return vectors @ (turned / (2 * (mu - values)))


@dataclass(frozen=True, kw_only=True)
class Canonical(ModelAnalyser):
    """Canonical analysis: stationary point in coded and natural units, eigenvalues, its nature, and the steepest path.

    Args:
        goal: ``maximise`` or ``minimise``: which way the path goes.
    """

    goal: str = "maximise"

    name: ClassVar[str] = "canonical"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.goal not in ("maximise", "minimise"):
            raise AnalysisError(f"canonical has goal = {self.goal!r}. Allowed: maximise, minimise.")

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the canonical analysis of one response."""
        (response,) = self.check_responses(responses)
        fit = self.select(table, response, factors, space).fit
        tables = {"steepest_path": steepest_path(fit, maximise=self.goal == "maximise")}
        point = stationary_point(fit)
        if point is None:
            sentence = (
                "The model has no single stationary point (it lacks curvature in some direction); follow the path."
            )
            return Report(self.name, response, tables, {}, (sentence,), details={"fit": fit})
        tables = {"stationary_point": point.table(), "eigenvalues": point.eigen_table(), **tables}
        numbers = {"predicted": point.predicted, **{f"eigenvalue_{i + 1}": v for i, v in enumerate(point.eigenvalues)}}
        numbers |= dict(zip(point.table()["Factor"], point.table()["Natural"], strict=True))
        advice = () if point.inside else ("The stationary point lies outside the runs: follow the path with new runs.",)
        return Report(self.name, response, tables, numbers, (point.sentence(),), advice, {"fit": fit, "point": point})

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return the contours."""
        from analysis.plot_surface import contours

        return contours(report.details["fit"])
