"""Spheres that make a spheroid, and how far their union is from one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from taichidem.shapes.union_properties import union_moments

TOUCHING = 1e-9  # a gap below this share of the two radii is a contact and not a gap
MOST_RINGS = 8  # more are never the best choice for the few hundred spheres that a grain can have
_STATIONS = 20001


@dataclass(frozen=True)
class ShapeError:
    """How far a body of spheres is from the spheroid it stands for, at the same length or width.

    Attributes:
        volume: relative error of the volume, below 0 where something is missing.
        inertia: relative error of the moment of inertia across the axis, the mean over all directions, at equal density.
        largest_gap: largest distance between the two surfaces, measured across the long direction, over the short semi-axis.
        rms_gap: its root mean square, evenly weighted along the long direction.
    """

    volume: float
    inertia: float
    largest_gap: float
    rms_gap: float


def prolate_spheres(length: float, count: int, width: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (m, 3) and radii (m,) of spheres inscribed in a prolate spheroid, evenly spaced along z.

    r(z) = a √(1 − z²/(c² − a²)); the outermost, at z = ±(c² − a²)/c, touch the tips with r = a²/c

    Args:
        length: semi-axis c along z [m]; width: semi-axis a [m], at most c.
        count: number of spheres; a single one sits in the middle.
    """
    share = np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)
    far = (length**2 - width**2) / length
    centres = np.zeros((count, 3))
    centres[:, 2] = share * far
    return centres, width * np.sqrt(1 - share**2 * (length**2 - width**2) / length**2)


def oblate_spheres(
    height: float, share: np.ndarray, counts: np.ndarray, width: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (m, 3) and radii (m,) of spheres inscribed in an oblate spheroid, in rings about z.

    r(s) = c √(1 − s²/(a² − c²)) at a distance s from the axis; those at s = (a² − c²)/a touch the edge with r = c²/a

    Args:
        height: semi-axis c along z [m]; width: semi-axis a [m], at least c.
        share: s of each ring over the farthest, (k,), 0 to 1; counts: number of spheres in each ring, (k,).
    """
    angle = np.concatenate([2 * math.pi * np.arange(count) / count for count in counts])
    share = np.repeat(share, counts)
    s = share * (width**2 - height**2) / width
    centres = np.column_stack([s * np.cos(angle), s * np.sin(angle), np.zeros(len(s))])
    return centres, height * np.sqrt(1 - share**2 * (width**2 - height**2) / width**2)


def spheroid_spheres(aspect_ratio: float, count: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Return centres and radii whose union hangs together and has the aspect ratio, length along z over width, or None.

    With a sphere in the middle the union has the aspect ratio of the spheroid that it is inscribed in. Without one it is
    thinner there than the spheroid, so the spheroid has another ratio √x. With q the innermost spheres' share of
    the way to the outermost, squared, x² = A² (x (1 − q) + q) where A > 1 and q x² + (1 − q) x = A² where A < 1.

    Args:
        aspect_ratio: A, above 0; count: number of spheres, 1 or more.
    """
    if count == 1:
        return prolate_spheres(1.0, 1) if aspect_ratio == 1 else None
    if aspect_ratio < 1:
        made = [spheres for spheres in _ring_choices(aspect_ratio, count) if not apart(*spheres)]
        return min(
            made, key=lambda spheres: _rms(_oblate_gaps(spheres[0], spheres[1], aspect_ratio, 1.0, 2000)), default=None
        )
    q, square = 0.0 if count % 2 else (count - 1) ** -2, aspect_ratio**2
    x = 0.5 * (square * (1 - q) + math.sqrt(square**2 * (1 - q) ** 2 + 4 * square * q))
    spheres = prolate_spheres(math.sqrt(x), count)
    return None if apart(*spheres) else spheres


def _ring_choices(aspect_ratio: float, count: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield ways to share spheres between rings: about an inscribed middle one, about none, about one as thick as the whole."""
    for rings in range(1, MOST_RINGS + 1):
        about_one = _rings(aspect_ratio, count, np.arange(rings + 1) / rings)
        open_share = (np.arange(rings) + 0.5) / (rings - 0.5)
        about_none, filled = (_rings(aspect_ratio, number, open_share) for number in (count, count - 1))
        if about_one is not None:
            yield about_one
        if about_none is not None and np.linalg.norm(about_none[0][0]) <= about_none[1][0] * (1 + TOUCHING):
            yield about_none  # with no hole in the middle
        if filled is not None:
            yield np.vstack([np.zeros(3), filled[0]]), np.append(filled[1][0], filled[1])


def _rings(aspect_ratio: float, count: int, share: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return spheres in rings at shares of the way to the outermost, in proportion to them but three at least, or None."""
    counts = np.maximum(3, np.round(count * share / share.sum())).astype(int)
    counts[share == 0] = 1
    counts[-1] += count - counts.sum()
    if counts[-1] < counts[-2:-1].max(initial=3):
        return None
    q = share[0] ** 2
    x = aspect_ratio**2 if q == 0 else (math.sqrt((1 - q) ** 2 + 4 * q * aspect_ratio**2) - (1 - q)) / (2 * q)
    return oblate_spheres(math.sqrt(x), share, counts)


def apart(centres: np.ndarray, radii: np.ndarray) -> tuple[int, int, float] | None:
    """Return two spheres of a union that doesn't hang together and the gap between them [m], or None.

    They are the nearest two of which one hangs together with the first sphere and the other doesn't.
    """
    from scipy.sparse.csgraph import connected_components

    gap = np.linalg.norm(centres[:, None] - centres, axis=2) - radii[:, None] - radii
    _, group = connected_components(gap <= TOUCHING * (radii[:, None] + radii), directed=False)
    mine, other = np.flatnonzero(group == group[0]), np.flatnonzero(group != group[0])
    if len(other) == 0:
        return None
    gaps = gap[np.ix_(mine, other)]
    i, j = np.unravel_index(gaps.argmin(), gaps.shape)
    return int(mine[i]), int(other[j]), float(gaps[i, j])


def shape_error(centres: np.ndarray, radii: np.ndarray, length: float, width: float) -> ShapeError:
    """Return how far a union of spheres is from the spheroid about z with semi-axes c = length and a = width [m].

    Args:
        centres: [m], (m, 3), about the spheroid's centre; radii: [m], (m,).
    """
    union = union_moments(centres, radii)
    volume = 4 / 3 * math.pi * width**2 * length
    across = union.volume * union.tensor.diagonal()[:2].mean()
    signed = (
        _prolate_gaps(centres, radii, length, width) if length >= width else _oblate_gaps(centres, radii, length, width)
    )
    gaps = np.abs(signed)
    return ShapeError(
        volume=float(union.volume / volume - 1),
        inertia=float(across / (volume * (width**2 + length**2) / 5) - 1),
        largest_gap=float(gaps.max()),
        rms_gap=_rms(gaps),
    )


def _rms(gaps: np.ndarray) -> float:
    return float(np.sqrt(np.mean(gaps**2)))


def _prolate_gaps(centres: np.ndarray, radii: np.ndarray, length: float, width: float) -> np.ndarray:
    """Return gaps across the axis over the width at even stations along it."""
    z = np.linspace(-length, length, _STATIONS)
    union = np.sqrt(np.max(np.maximum(radii**2 - (z[:, None] - centres[:, 2]) ** 2, 0.0), axis=1))
    return np.sqrt(np.maximum(1 - (z / length) ** 2, 0.0)) - union / width


def _oblate_gaps(
    centres: np.ndarray, radii: np.ndarray, length: float, width: float, stations: int = _STATIONS
) -> np.ndarray:
    """Return gaps along the axis over the half length at points spread evenly over the equator's disc."""
    step = np.arange(stations) + 0.5
    s, turn = width * np.sqrt(step / stations), math.pi * (1 + math.sqrt(5)) * step
    points = np.column_stack([s * np.cos(turn), s * np.sin(turn)])
    square = radii**2 - np.sum((points[:, None] - centres[:, :2]) ** 2, axis=2)
    return np.sqrt(np.maximum(1 - (s / width) ** 2, 0.0)) - np.sqrt(np.max(np.maximum(square, 0.0), axis=1)) / length
