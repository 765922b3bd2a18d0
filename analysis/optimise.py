"""The best setting inside the box: largest, smallest, on target, or a compromise of several responses."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import pandas as pd
from scipy import optimize, stats
from scipy.stats import qmc

from analysis.canonical import setting_text
from analysis.desirability import Goal, overall, parse_goals
from analysis.errors import AnalysisError
from analysis.hold_values import coded_hold_values
from analysis.model_choice import ModelAnalyser
from analysis.regression import FittedModel
from analysis.report import Report
from designs.errors import nearest_hint
from designs.space import Array, FactorSpace

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_GRID_POWER = 11
_POLISHED = 8
_ON_BOUND = 1e-4


@dataclass(frozen=True, kw_only=True)
class Optimise(ModelAnalyser):
    """Optimum inside low … high: maximise, minimise or hit a target; several responses by desirability.

    One response: the extreme of ŷ, or the point with ŷ = target that is nearest to the centre. Several: the largest
    overall desirability D = (Π dᵢ^rᵢ)^(1/Σ rᵢ) (Derringer & Suich). At the optimum each response gets a confidence
    interval of its mean, ŷ ± t s_ŷ, and a prediction interval of one new run, ŷ ± t √(s² + s_ŷ²). Factors that are in
    no model stay at the centre, unless they are held elsewhere.

    Args:
        goals: such as ``aor_deg:target=30.18:low=29:high=31, density:maximise``; default: maximise the response.
        hold: factors that the search leaves where they are told to stay, in natural units and inside low … high, such as
            ``B=910, D=0.55``; the others are searched.

    Source: Derringer & Suich, J. Quality Technol. 12 (1980) 214, doi 10.1080/00224065.1980.11980968.
    """

    selection: str = "backward"
    goals: str | Sequence[Goal] | None = None
    hold: str | Mapping[str, float] | None = None

    name: ClassVar[str] = "optimise"
    n_responses: ClassVar[tuple[int, int | None]] = (1, None)

    def analyse(
        self,
        table: pd.DataFrame,
        *,
        responses: Sequence[str] = (),
        factors: Sequence[str] | None = None,
        space: FactorSpace | None = None,
    ) -> Report:
        """Return the best setting and what to expect there."""
        names = self.check_responses(responses)
        goals = self._goals(names)
        fits = [
            self.select(table, name, factors, space, others=[other for other in names if other != name]).fit
            for name in names
        ]
        held = coded_hold_values(self.hold, fits[0].runs.space)
        active = _active(fits)
        goals = [goal.bounded(fit.y) if len(fits) > 1 else goal for goal, fit in zip(goals, fits, strict=True)]
        point, desirability = _best(fits, goals, _free(active, held, fits[0]), held)
        setting, expected = _setting_table(fits[0], point, active, held), self._expected(fits, goals, point)
        sentences = (*_sentences(setting, expected, goals, desirability), *_extrapolation(fits, point))
        numbers = dict(zip(setting["Factor"], setting["Natural"], strict=True))
        numbers |= dict(zip(expected["Response"], expected["Predicted"], strict=True))
        if desirability is not None:
            numbers["desirability"] = desirability
        tables = {"setting": setting, "expected": expected}
        subject = ", ".join(goal.text() for goal in goals)
        return Report(self.name, subject, tables, numbers, sentences, _advice(setting), {"fits": fits, "point": point})

    def figures(self, report: Report) -> dict[str, Figure]:
        """Return contours of each response with the optimum marked."""
        from analysis.plot_surface import contours

        figures: dict[str, Figure] = {}
        for fit in report.details["fits"]:
            for name, figure in contours(fit, mark=report.details["point"]).items():
                figures[f"{fit.response}_{name}"] = figure
        return figures

    def _goals(self, names: Sequence[str]) -> list[Goal]:
        if self.goals is None:
            return [Goal(name) for name in names]
        goals = parse_goals(self.goals) if isinstance(self.goals, str) else list(self.goals)
        by_name = {goal.response: goal for goal in goals}
        for goal in goals:
            if goal.response not in names:
                raise AnalysisError(
                    f"There is a goal for {goal.response!r}, which isn't among the responses. "
                    f"{nearest_hint(goal.response, names)}"
                )
        missing = [name for name in names if name not in by_name]
        if missing:
            raise AnalysisError(f"Response {missing[0]!r} has no goal. Add one, for example {missing[0]}:maximise.")
        return [by_name[name] for name in names]

    def _expected(self, fits: Sequence[FittedModel], goals: Sequence[Goal], point: Array) -> pd.DataFrame:
        rows = []
        for fit, goal in zip(fits, goals, strict=True):
            fit.require_error_df("intervals")
            value, error = float(fit.predict(point)[0]), float(fit.standard_error(point)[0])
            t = float(stats.t.ppf(1 - self.alpha / 2, fit.error_df))
            wide = t * float(np.hypot(fit.s, error))
            row = {"Response": fit.response, "Goal": goal.text(), "Predicted": value, "SE": error}
            row |= {"CI low": value - t * error, "CI high": value + t * error}
            row |= {"PI low": value - wide, "PI high": value + wide}
            if len(fits) > 1:
                row["Desirability"] = float(goal.desirability(np.array(value)))
            rows.append(row)
        return pd.DataFrame(rows)


def _active(fits: Sequence[FittedModel]) -> list[int]:
    k = len(fits[0].runs.space)
    return [i for i in range(k) if any(term.powers[i] for fit in fits for term in fit.terms)]


def _free(active: Sequence[int], held: Mapping[int, float], fit: FittedModel) -> list[int]:
    """Return the factors to search."""
    if not active:
        raise AnalysisError(
            "No factor is in any of the models, so nothing can be optimised. Look at main_effects first."
        )
    free = [i for i in active if i not in held]
    if not free:
        names = ", ".join(fit.runs.names[i] for i in active)
        raise AnalysisError(f"Every factor of the models is held ({names}), so nothing can be searched. Free one.")
    return free


def _best(
    fits: Sequence[FittedModel], goals: Sequence[Goal], free: Sequence[int], held: Mapping[int, float]
) -> tuple[Array, float | None]:
    """Return the best coded point, shape (k,), and the overall desirability (None for one response)."""
    base = np.zeros(len(fits[0].runs.space))
    base[list(held)] = list(held.values())

    def spread(points: Array) -> Array:
        full = np.tile(base, (len(points), 1))
        full[:, list(free)] = points
        return full

    def cost(points: Array) -> Array:
        predicted = [fit.predict(spread(points)) for fit in fits]
        if len(fits) > 1:
            return -overall(goals, [goal.desirability(y) for goal, y in zip(goals, predicted, strict=True)])
        return _single_cost(goals[0], predicted[0])

    best = _minimise(cost, len(free))
    if len(fits) == 1 and goals[0].kind == "target":
        best = _nearest_on_target(
            lambda p: float(fits[0].predict(spread(p[None, :]))[0]), float(goals[0].target or 0), best
        )
    desirability = float(-cost(best[None, :])[0]) if len(fits) > 1 else None
    return spread(best[None, :])[0], desirability


def _single_cost(goal: Goal, predicted: Array) -> Array:
    if goal.kind == "target":
        return (predicted - float(goal.target or 0.0)) ** 2
    return -predicted if goal.kind == "maximise" else predicted


def _minimise(cost: Callable[[Array], Array], dimensions: int) -> Array:
    """Return the point of the box −1 … 1 with the smallest cost: a fixed Sobol' grid, its best points polished."""
    unit = qmc.Sobol(d=dimensions, scramble=False).random_base2(_GRID_POWER)
    grid = np.vstack([np.zeros((1, dimensions)), 2 * unit - 1])
    starts = grid[np.argsort(cost(grid), kind="stable")[:_POLISHED]]
    bounds = [(-1.0, 1.0)] * dimensions
    ends = [_polish(cost, start, bounds) for start in starts]
    return min(ends, key=lambda end: (round(float(cost(end[None, :])[0]), 12), float(end @ end)))


def _polish(cost: Callable[[Array], Array], start: Array, bounds: list[tuple[float, float]]) -> Array:
    def single(x: Array) -> float:
        return float(cost(x[None, :])[0])

    first = optimize.minimize(single, start, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-15, "gtol": 1e-10})
    # Desirability has kinks, where gradients mislead; a simplex goes on from there.
    second = optimize.minimize(
        single, first.x, method="Nelder-Mead", bounds=bounds, options={"xatol": 1e-8, "fatol": 1e-12, "maxiter": 400}
    )
    return np.clip(second.x if second.fun < first.fun else first.x, -1.0, 1.0)


def _nearest_on_target(predict: Callable[[Array], float], target: float, start: Array) -> Array:
    """Return the point with ŷ = target that is nearest to the centre; the start when the target is out of reach."""
    if abs(predict(start) - target) > 1e-6 * max(abs(target), 1e-300):
        return start
    found = optimize.minimize(
        lambda x: float(x @ x),
        start,
        jac=lambda x: 2 * x,
        method="SLSQP",
        bounds=[(-1.0, 1.0)] * len(start),
        constraints={"type": "eq", "fun": lambda x: predict(x) - target},
        options={"ftol": 1e-14, "maxiter": 200},
    )
    good = found.success and abs(predict(found.x) - target) < 1e-6 * max(abs(target), 1e-300)
    return found.x if good and found.x @ found.x <= start @ start else start


def _setting_table(fit: FittedModel, point: Array, active: Sequence[int], held: Mapping[int, float]) -> pd.DataFrame:
    natural = fit.runs.space.to_natural(point[None, :]).iloc[0]
    rows = [
        (factor.name, point[i], float(natural.iloc[i]), factor.unit, _note(float(point[i]), i in active, i in held))
        for i, factor in enumerate(fit.runs.space)
    ]
    return pd.DataFrame(rows, columns=["Factor", "Coded", "Natural", "Unit", "Note"])


def _note(coded: float, active: bool, held: bool) -> str:
    if held:
        return "held as asked" if active else "in no model, held as asked"
    if not active:
        return "in no model, held at the centre"
    bound = "low" if coded < -1 + _ON_BOUND else "high" if coded > 1 - _ON_BOUND else ""
    return f"on the {bound} bound" if bound else ""


def _sentences(
    setting: pd.DataFrame, expected: pd.DataFrame, goals: Sequence[Goal], desirability: float | None
) -> tuple[str, ...]:
    used = setting[~setting["Note"].str.contains("held")]
    sentences = [f"Best setting: {setting_text(used)}."]
    asked = setting[setting["Note"].str.endswith("held as asked")]
    if len(asked):
        sentences.append(f"Held as asked: {setting_text(asked)}.")
    for row, goal in zip(expected.to_dict(orient="records"), goals, strict=True):
        mean = f"{row['CI low']:.4g} and {row['CI high']:.4g}"
        run = f"{row['PI low']:.4g} and {row['PI high']:.4g}"
        sentences.append(
            f"{row['Response']} there: {row['Predicted']:.4g}; mean between {mean}, one run between {run}."
        )
        if len(goals) == 1 and goal.target is not None:
            sentences.append(_target_sentence(float(row["Predicted"]), goal.target, len(used)))
    if desirability is not None:
        sentences.append(_desirability_sentence(desirability))
    bound = setting.loc[setting["Note"].str.startswith("on the"), "Factor"]
    if len(bound):
        sentences.append(f"The optimum sits on a bound of {', '.join(bound)}: the true one may lie outside.")
    return tuple(sentences)


def _extrapolation(fits: Sequence[FittedModel], point: Array) -> list[str]:
    """Return a warning for models that know less there than at any run: leverage above the largest of the runs."""
    far = [
        fit.response for fit in fits if fit.standard_error(point)[0] > fit.s * np.sqrt(fit.leverage.max()) * (1 + 1e-9)
    ]
    if not far:
        return []
    return [f"The setting is an extrapolation for {', '.join(far)}: its prediction is less certain than at any run."]


def _target_sentence(predicted: float, target: float, n_used: int) -> str:
    if abs(predicted - target) > 1e-5 * max(abs(target), 1e-300):
        return f"The target {target:g} is out of reach inside the box; this is the nearest the model comes."
    if n_used > 1:
        return "Other settings hit the target as well (a curve of them); this one is nearest to the centre."
    return "The model hits the target."


def _desirability_sentence(value: float) -> str:
    if value <= 0:
        return (
            "Overall desirability is 0: no setting meets all goals, at least one response is always outside its "
            "limits. That is a fault of the model or of the goals, not of the search."
        )
    return f"Overall desirability is {value:.3f} (1 = all goals met fully)."


def _advice(setting: pd.DataFrame) -> tuple[str, ...]:
    advice = ["Run the setting again with new seeds: results should fall inside the prediction interval."]
    if setting["Note"].str.startswith("on the").any():
        advice.append(
            "Widen the range of the factor on its bound, if that is physically possible, and repeat the design."
        )
    return tuple(advice)
