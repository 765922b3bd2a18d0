"""Which measurement to make next: the one that parts rival explanations most, or lets the data see more.

Rivals A and B predict a measurement x as S_A ± s_A and S_B ± s_B, s from what their own re-calibration leaves open; measured
with u they lie d(x) = |S_A − S_B|/√(u² + s_A² + s_B²) standard uncertainties apart. Of all that could be measured, that with
the largest Σ min(d, 3) between the best explanation and its rivals comes first: it rules out most of them. Neither side is taken
to be true beforehand.

Without rivals the measurement is proposed that adds most to what the data could show: the mean over the effects of
ln √(j_kᵀ M j_k).

Source: Atkinson & Fedorov (1975), doi 10.1093/biomet/62.1.57, for designs that discriminate between models.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.missing_effect.fit import STEP, Fit, Simulator
from analysis.missing_effect.problem import NO_EFFECT, Array
from analysis.missing_effect.score import TINY, projection, signatures
from analysis.missing_effect.search import Search, Trial

NEW_TEST, REPEAT, PARAMETER = "new_test", "repeat", "measure_parameter"
SHARPER = 0.5  # what four times as many repeats leave of an uncertainty
DIRECT = 0.05  # of its range: how well a parameter can be measured directly, if nothing better is known
LEAST_GAIN = 0.05  # in the mean logarithm of what can be seen, below which no measurement is worth proposing
LEAST_SEPARATION = 1.0  # standard uncertainties
ENOUGH = 3.0  # standard uncertainties, beyond which two predictions are apart, and farther is no better


@dataclass(frozen=True)
class Option:
    """Something that could be measured.

    Attributes:
        kind: `NEW_TEST`, `REPEAT` or `PARAMETER`.
        label: of the response or key of the parameter.
        u: standard uncertainty that is assumed: a guess for new tests, less than now for repeats.
    """

    kind: str
    label: str
    u: float


@dataclass(frozen=True)
class Proposal:
    """The measurement to make next.

    Attributes:
        option: what.
        between: numbers of two effects that it parts; -1 stands for no effect. Empty where it is to see more.
        separation: how far apart they predict it, in standard uncertainties; or the gain in what can be seen.
        predictions: effect number → predicted value.
    """

    option: Option
    between: tuple[int, ...]
    separation: float
    predictions: dict[int, float]


@dataclass(frozen=True)
class Outlook:
    """What one fitted model predicts for everything that could be measured.

    Attributes:
        values: predictions (n,).
        variance: what the surrogate leaves of them, squared (n,).
        slope: derivatives by the fit's parameters and shares (n, p + effects).
        covariance: of those.
    """

    values: Array
    variance: Array
    slope: Array
    covariance: Array

    @property
    def spread(self) -> Array:
        """Standard uncertainty of the predictions, that of the parameters included (n,)."""
        return np.sqrt(self.variance + np.einsum("ij,jk,ik->i", self.slope, self.covariance, self.slope))


def options(found: Search, new_labels: Sequence[str], new_u: Sequence[float]) -> tuple[Option, ...]:
    """Return everything that could be measured next."""
    problem = found.problem
    new = [Option(NEW_TEST, label, u) for label, u in zip(new_labels, new_u, strict=True)]
    again = [Option(REPEAT, label, SHARPER * u) for label, u in zip(problem.labels, problem.u.tolist(), strict=True)]
    direct = [
        Option(PARAMETER, p.key, SHARPER * p.u if p.u is not None else DIRECT * (p.high - p.low))
        for p in problem.parameters
    ]
    return (*new, *again, *direct)


def outlook(found: Fit, new: Simulator | None) -> Outlook:
    """Return what a fitted model predicts for every option: new tests, measured responses, parameters."""
    slopes = found.problem.natural_slope(found.x)
    of_parameters = np.hstack([np.diag(slopes), np.zeros((len(slopes), len(found.effects)))])
    parts = [(found.simulated, found.variance, found.slope)]
    parts.append((found.problem.natural(found.x), np.zeros(len(slopes)), of_parameters))
    if new is not None:
        parts.insert(0, _new_responses(found, new))
    values, variance, slope = zip(*parts, strict=True)
    return Outlook(np.concatenate(values), np.concatenate(variance), np.vstack(slope), found.covariance)


def _new_responses(found: Fit, new: Simulator) -> tuple[Array, Array, Array]:
    size, p = len(found.x) + len(found.effects), len(found.x)
    x, share = np.repeat(found.x[None], size + 1, axis=0), np.repeat(found.share[None], size + 1, axis=0)
    x[np.arange(1, p + 1), np.arange(p)] += STEP
    share[np.arange(p + 1, size + 1), list(found.effects)] += STEP
    values = new.mean(x, share)
    return values[0], new.variance(x[:1], share[:1])[0], (values[1:] - values[0]).T / STEP


def part_rivals(trials: Sequence[Trial], new: Simulator | None, wanted: tuple[Option, ...]) -> Proposal | None:
    """Return the measurement that parts the first of these models best from the others, or None where none does."""
    first, *others = (outlook(t.fit, new) for t in trials)
    u = np.array([option.u for option in wanted])
    apart = np.stack([np.abs(first.values - v.values) / np.sqrt(u**2 + first.spread**2 + v.spread**2) for v in others])
    best = int(np.minimum(apart, ENOUGH).sum(axis=0).argmax())
    rival = int(apart[:, best].argmax())
    if apart[rival, best] < LEAST_SEPARATION:
        return None
    names = [t.effects[0] if t.effects else NO_EFFECT for t in trials]
    values = [float(v.values[best]) for v in (first, *others)]
    parted = (names[0], names[rival + 1])
    return Proposal(wanted[best], parted, float(apart[rival, best]), dict(zip(names, values, strict=True)))


def see_more(base: Fit, simulator: Simulator, new: Simulator | None, wanted: tuple[Option, ...]) -> Proposal | None:
    """Return the measurement that adds most to what the data could show, or None where none adds anything."""
    view, changes = outlook(base, new), _changes(base, simulator, new, len(wanted))
    sigma = np.sqrt(view.variance + np.array([option.u for option in wanted]) ** 2)
    slope, known = base.weighted_slope, signatures(base, simulator, 1.0)
    before = _power(slope[:, base.free], known)
    seen = before > TINY
    gains = np.zeros(len(wanted))
    for i in range(len(wanted) if seen.any() else 0):
        more = np.vstack([slope, view.slope[i] / sigma[i]])[:, base.free]
        after = _power(more, np.hstack([known, changes[:, i : i + 1] / sigma[i]]))
        gains[i] = float(np.mean(0.5 * np.log(after[seen] / before[seen])))
    best = int(gains.argmax())
    if gains[best] < LEAST_GAIN:
        return None
    return Proposal(wanted[best], (), float(gains[best]), {NO_EFFECT: float(view.values[best])})


def _changes(base: Fit, simulator: Simulator, new: Simulator | None, count: int) -> Array:
    """Return what every effect at full share does to each option (K, count); nothing to parameters."""
    k = len(base.problem.candidates)
    x, share = np.repeat(base.x[None], k, axis=0), np.eye(k)
    parts = [] if new is None else [new.mean(x, share) - new.mean(base.x[None], base.share[None])]
    known = np.hstack([*parts, simulator.mean(x, share) - base.simulated])
    return np.hstack([known, np.zeros((k, count - known.shape[1]))])


def _power(slope: Array, change: Array) -> Array:
    """Return j_kᵀ M j_k for standardised derivatives (r, p) and changes (K, r)."""
    left = change @ projection(slope)
    return np.einsum("kr,kr->k", left, change)
