"""The arcs that bound the part of a sphere which other spheres leave uncovered."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

SAME = 1e-11  # caps whose axes and levels differ by less are one cap
# Edges that cross by less only touch: what lies between is of the order of the cube of the root of this, but where
# several touch in one point their crossings would be in no order.
TOUCH = 1e-12
PARALLEL = 1e-8  # below this sine of the angle between two axes only their levels tell which cap is inside the other
TURN = 2 * math.pi


@dataclass(frozen=True)
class Arcs:
    """Arcs on the unit sphere, each on the edge of a cap {n: n·axis ≥ level}, none longer than a third of a circle.

    Attributes:
        axis: of the cap, (p, 3); level: (p,).
        across: first direction in the plane of the circle, (p, 3); the second is axis × across.
        start: angle of the first point, counterclockwise about the axis from `across` [rad], (p,); length: [rad], (p,).
        cap_axis: axes of all caps, (c, 3); cap_level: (c,).
    """

    axis: np.ndarray
    level: np.ndarray
    across: np.ndarray
    start: np.ndarray
    length: np.ndarray
    cap_axis: np.ndarray
    cap_level: np.ndarray

    @property
    def sine(self) -> np.ndarray:
        """Radius of the circle, (p,)."""
        return _sine(self.level)

    def around(self, angle: np.ndarray) -> np.ndarray:
        """Return the unit vectors from the circles' centres at angles (p, q), (p, q, 3)."""
        second = np.cross(self.axis, self.across)
        return np.cos(angle)[..., None] * self.across[:, None] + np.sin(angle)[..., None] * second[:, None]

    def point(self, share: float) -> np.ndarray:
        """Return the points at a share of the arcs, (p, 3)."""
        about = self.around((self.start + share * self.length)[:, None])[:, 0]
        return self.level[:, None] * self.axis + self.sine[:, None] * about

    def bare_share(self) -> float:
        """Return the share of the sphere that no cap covers, from some points."""
        covered = spread_directions(200) @ self.cap_axis.T >= self.cap_level
        return float(np.mean(~covered.any(axis=1)))


def exposed_arcs(axis: np.ndarray, level: np.ndarray) -> Arcs:
    """Return the arcs of the caps' edges that no other cap covers.

    Args:
        axis: unit vectors, (c, 3); level: cosine of each cap's half angle, (c,), between −1 and 1.
    """
    axis, level = _distinct(axis, level)
    across = _across(axis)
    start, length, whole = _covered(axis, level, across)
    row, begin, end = _gaps(start, length, whole)
    third = (end - begin) / 3
    row = np.repeat(row, 3)
    begin = np.repeat(begin, 3) + np.tile([0.0, 1.0, 2.0], len(third)) * np.repeat(third, 3)
    return Arcs(axis[row], level[row], across[row], begin, np.repeat(third, 3), axis, level)


def spread_directions(count: int) -> np.ndarray:
    """Return unit vectors spread evenly on a spiral, (count, 3)."""
    step = np.arange(count) + 0.5
    z, turn = 1 - 2 * step / count, math.pi * (1 + math.sqrt(5)) * step
    return np.column_stack([_sine(z) * np.cos(turn), _sine(z) * np.sin(turn), z])


def _sine(level: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum((1 - level) * (1 + level), 0.0))


def _across(axis: np.ndarray) -> np.ndarray:
    least = np.eye(3)[np.abs(axis).argmin(axis=1)]
    across = np.cross(axis, least)
    return across / np.linalg.norm(across, axis=1)[:, None]


def _distinct(axis: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drop caps that equal an earlier one: of three equal circles each would be taken for covered by another."""
    same = (np.abs(axis[:, None] - axis[None]).max(axis=2, initial=0.0) < SAME) & (
        np.abs(level[:, None] - level[None]) < SAME
    )
    first = ~np.tril(same, -1).any(axis=1)
    return axis[first], level[first]


@dataclass(frozen=True)
class _Pairs:
    """Pairs of caps j < k: sine of the angle between their axes, the direction across both, and how far apart their edges are.

    `rise_j` is the level of k less the level at which its axis meets the plane of j; over the sine it is the distance, in that
    plane, from the axis of j to the plane of k. `rise_k` is the same with the roles exchanged.
    """

    j: np.ndarray
    k: np.ndarray
    sine: np.ndarray
    across: np.ndarray
    cosine_less: np.ndarray  # 1 − cos of the angle, without loss for small angles
    rise_j: np.ndarray
    rise_k: np.ndarray

    @classmethod
    def of(cls, axis: np.ndarray, level: np.ndarray) -> _Pairs:
        j, k = np.triu_indices(len(level), 1)
        across = np.cross(axis[j], axis[k])
        sine = np.linalg.norm(across, axis=1)
        less = 0.5 * np.sum((axis[j] - axis[k]) ** 2, axis=1)
        rise = level[k] - level[j]
        return cls(j, k, sine, across, less, rise + level[j] * less, -rise + level[k] * less)


def _covered(axis: np.ndarray, level: np.ndarray, across: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return where cap k covers the edge of cap j: start and length [rad], (c, c), and a mark where it covers all of it."""
    pairs, width = _Pairs.of(axis, level), _sine(level)
    j, k = pairs.j, pairs.k
    with np.errstate(divide="ignore", invalid="ignore"):
        w = pairs.rise_j / pairs.sine
    opposed = (np.abs(axis[j] + axis[k]).max(axis=1, initial=0.0) < SAME) & (np.abs(level[j] + level[k]) < SAME)
    cross = (pairs.sine > 0) & (np.abs(w) < width[j] - TOUCH) & ~opposed
    # Of parallel edges exactly one is inside the other, also where they are equal; of opposed ones that meet nothing is left.
    parallel = (pairs.sine < PARALLEL) & (pairs.cosine_less < 1)
    whole = np.zeros((len(level), len(level)), bool)
    whole[j, k] = ~cross & np.where(parallel, level[j] > level[k], opposed | (pairs.rise_j <= 0))
    whole[k, j] = ~cross & np.where(parallel, level[k] >= level[j], opposed | (pairs.rise_k <= 0))
    return *_intervals(pairs, cross, axis, level, across), whole


def _intervals(
    pairs: _Pairs, cross: np.ndarray, axis: np.ndarray, level: np.ndarray, across: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return start and length [rad], (c, c), of what cap k covers of the edge of cap j, for the pairs whose edges cross.

    The two points where two edges cross are found once for both, so that arcs which meet there end at the same point
    even where the edges nearly coincide.
    """
    start, length = np.full((len(level), len(level)), -1.0), np.zeros((len(level), len(level)))
    j, k, sine = pairs.j[cross], pairs.k[cross], pairs.sine[cross]
    w_j, w_k, t = pairs.rise_j[cross] / sine, pairs.rise_k[cross] / sine, pairs.across[cross] / sine[:, None]
    width = _sine(level[j])
    half = np.sqrt((width - w_j) * (width + w_j))
    middle = level[j][:, None] * axis[j] + w_j[:, None] * np.cross(t, axis[j])
    first, last = middle - half[:, None] * t, middle + half[:, None] * t
    for own, other, begin, end, w in ((j, k, first, last, w_j), (k, j, last, first, w_k)):
        from_, to = _angle(axis, across, own, begin), _angle(axis, across, own, end)
        start[own, other] = from_ % TURN
        length[own, other] = _unwrapped(to - from_, 2 * np.arctan2(half, w))
    return start, length


def _angle(axis: np.ndarray, across: np.ndarray, own: np.ndarray, point: np.ndarray) -> np.ndarray:
    first = np.sum(across[own] * point, axis=1)
    return np.arctan2(np.sum(np.cross(axis[own], across[own]) * point, axis=1), first)


def _unwrapped(length: np.ndarray, about: np.ndarray) -> np.ndarray:
    """Return the length modulo a turn that is nearest to an estimate, so that nothing and all aren't confused."""
    return np.clip(length - TURN * np.round((length - about) / TURN), 0.0, TURN)


def _gaps(start: np.ndarray, length: np.ndarray, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the row, begin and end of what the intervals of each row leave of a turn."""
    count = len(start)
    starts = np.concatenate([start, start - TURN, np.full((count, 1), TURN)], axis=1)
    ends = np.concatenate([start + length, start + length - TURN, np.full((count, 1), TURN)], axis=1)
    order = np.argsort(starts, axis=1)
    starts, ends = np.take_along_axis(starts, order, 1), np.take_along_axis(ends, order, 1)
    reached = np.maximum(np.maximum.accumulate(ends, axis=1), 0.0)
    before = np.concatenate([np.zeros((count, 1)), reached[:, :-1]], axis=1)
    row, column = np.nonzero((starts > before) & ~whole.any(axis=1)[:, None])
    return row, before[row, column], starts[row, column]
