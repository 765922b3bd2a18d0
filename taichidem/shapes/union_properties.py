"""Volume and moments of a union of spheres, exact for every arrangement.

Gauss's theorem turns the moments of the solid into moments of its surface, which is made of pieces of the spheres; Stokes's
theorem turns those into integrals along the circles that bound the pieces. Nothing is sampled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from taichidem.shapes.union_arcs import Arcs, exposed_arcs, spread_directions

COINCIDENT = 1e-13  # a sphere that stands out of another by less, relative to its radius, adds nothing
GRAZING = 1e-12  # spheres that overlap by less, relative to the smaller radius, only touch: the lens is nil, its edge all noise
# On a third of a circle twelve points integrate what is needed, trigonometric polynomials of degree 3, to the last bit.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True)
class Moments:
    """Moments of a solid of density 1.

    Attributes:
        volume: [m³].
        centre: centre of mass [m], (3,).
        second: ∫ x xᵀ dV about the centre of mass [m⁵], (3, 3).
    """

    volume: float
    centre: np.ndarray
    second: np.ndarray

    @property
    def tensor(self) -> np.ndarray:
        """Inertia over the mass about the centre of mass [m²], (tr S 1 − S) / V, (3, 3)."""
        return (np.trace(self.second) * np.eye(3) - self.second) / self.volume


def union_moments(centres: np.ndarray, radii: np.ndarray) -> Moments:
    """Return the moments of a union of spheres, which need not hang together.

    ∫ f dV = 1/(k + 3) ∮ f x·n dA for f homogeneous of degree k, over the parts of the spheres that lie in no other

    Args:
        centres: [m], (m, 3); radii: [m], (m,), above 0.
    """
    outer = _outer(centres, radii)
    origin = centres[outer].mean(axis=0)
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for i in outer:
        others = outer[outer != i]
        c, r = centres[i] - origin, radii[i]
        n0, n1, n2, n3 = _exposed(centres[others] - centres[i], radii[others], r)
        # x = c + r n and x·n = r + c·n: the moments of n, weighted with x·n
        w0, w1, w2 = r * n0 + c @ n1, r * n1 + n2 @ c, r * n2 + n3 @ c
        mixed = np.outer(c, w1)
        volume += r**2 / 3 * w0
        first += r**2 / 4 * (c * w0 + r * w1)
        second += r**2 / 5 * (np.outer(c, c) * w0 + r * (mixed + mixed.T) + r**2 * w2)
    shift = first / volume
    second = 0.5 * (second + second.T) - volume * np.outer(shift, shift)
    return Moments(float(volume), origin + shift, second)


def _outer(centres: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Return the numbers of the spheres that lie in no single other one, of coincident spheres the first."""
    kept: list[int] = []
    for i in np.argsort(-radii, kind="stable"):
        apart = np.linalg.norm(centres[kept] - centres[i], axis=1)
        if not np.any(apart + radii[i] <= radii[kept] + COINCIDENT * radii[i]):
            kept.append(int(i))
    return np.sort(np.array(kept))


def _exposed(others: np.ndarray, radii: np.ndarray, radius: float) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """Return ∫ 1, n, n n, n n n dω over the part of a sphere about 0 that lies in no other sphere.

    With ν the normal of the boundary within the sphere:
    2 ∫ n = −∮ ν,  3 ∫ n n = 1 ∫ 1 − ∮ n ν,  4 ∫ nₐ n n = 2 sym(eₐ ∫ n) − ∮ n n νₐ
    """
    distance = np.linalg.norm(others, axis=1)
    # r² − R² as a product: as a difference it would drown d² where spheres nearly coincide.
    level = (distance**2 + (radius - radii) * (radius + radii)) / (2 * distance * radius)
    if np.any(level <= -1):
        return 0.0, np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3, 3))
    cut = (level < 1) & (radius + radii - distance > GRAZING * np.minimum(radius, radii))
    arcs = exposed_arcs(others[cut] / distance[cut, None], level[cut])
    n0 = _solid_angle(arcs)
    normal, outward, ds = _along(arcs)
    one = np.eye(3)
    n1 = -0.5 * ds @ outward
    n2 = (one * n0 - np.einsum("p,pj,pa->ja", ds, normal, outward)) / 3
    spread = np.einsum("aj,k->ajk", one, n1) + np.einsum("ak,j->ajk", one, n1)
    n3 = (spread - np.einsum("p,pj,pk,pa->ajk", ds, normal, normal, outward)) / 4
    return n0, n1, 0.5 * (n2 + n2.T), n3


def _along(arcs: Arcs) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points n of the arcs, ν there (into the cap that covers, away from what is exposed) and weights ds."""
    angle = (arcs.start + 0.5 * arcs.length)[:, None] + 0.5 * arcs.length[:, None] * _NODES
    about = arcs.around(angle)
    level, sine = arcs.level[:, None, None], arcs.sine[:, None, None]
    axis = arcs.axis[:, None, :]
    ds = 0.5 * (arcs.sine * arcs.length)[:, None] * _WEIGHTS
    return (level * axis + sine * about).reshape(-1, 3), (sine * axis - level * about).reshape(-1, 3), ds.reshape(-1)


def _solid_angle(arcs: Arcs) -> float:
    """Return ∫ 1 dω: what lies between the boundary and an apex, counted with its sign.

    Each arc gives a geodesic triangle with the apex and the segment between the chord and the arc. A triangle's angle,
    and so the sum, is known up to 4π; that leaves open only whether nothing or all is exposed, which some points tell.
    """
    whole = 4 * math.pi
    first, last = arcs.point(0.0), arcs.point(1.0)
    apex = _apex(first)
    height = 1 + first @ apex + last @ apex + np.einsum("pi,pi->p", first, last)
    triangle = 2 * np.arctan2(np.cross(first, last) @ apex, height)
    low, high = 1 - arcs.level, 1 + arcs.level
    chord = 2 * np.arctan2(low * np.sin(arcs.length), high + low * np.cos(arcs.length))
    area = float(-np.sum(triangle + low * arcs.length - chord)) % whole
    if min(area, whole - area) > 1e-6:
        return area
    bare = arcs.bare_share() > 0.5
    rest = area if area < 1 else area - whole
    return rest + whole if bare else rest


def _apex(points: np.ndarray) -> np.ndarray:
    """Return a direction whose opposite is far from all points, where a triangle's angle isn't defined."""
    choice = spread_directions(29)
    if len(points) == 0:
        return choice[0]
    return choice[np.argmax((1 + choice @ points.T).min(axis=1))]
