"""How far grains reach in a direction: what must be known of a form to find it a place, or to lower a lid onto it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from taichidem.bodies import Bodies
from taichidem.shapes.forms import Forms
from taichidem.snapshot import Snapshot

NO_PART = (0.0, 0.0, 0.0, -np.inf)  # offset and radius of a sphere that reaches nowhere
INVERSE = np.array([1.0, -1.0, -1.0, -1.0])  # times a unit quaternion: the rotation back
TOUCH = 1e-9  # of their distance, by which hulls must be clear of each other
LOOKS = 12  # at a pair


@dataclass(frozen=True)
class Outlines:
    """The outlines of grains about their centres.

    Attributes:
        radius: of the sphere about each grain [m], (n,).
        size: radius of the sphere of equal volume [m], (n,).
        orientation: of the grains, (n, 4), or None where all are spheres.
        parts: what each grain is made of: offsets (n, m, 3) and radii (n, m) of spheres [m], radius −∞ where a grain has
            fewer than m; or None.
        quadrics: of superquadrics: semi-axes [m] and exponents (n, 5), or None.
    """

    radius: np.ndarray
    size: np.ndarray
    orientation: np.ndarray | None = None
    parts: np.ndarray | None = None
    quadrics: np.ndarray | None = None

    @classmethod
    def of(cls, grains: Outlines | Bodies | Snapshot | np.ndarray) -> Outlines:
        """Return the outlines of bodies, of the grains of a snapshot, or of spheres given by their radii."""
        if isinstance(grains, Outlines):
            return grains
        if not isinstance(grains, (Bodies, Snapshot)):
            radii = np.asarray(grains, float)
            return cls(radii, radii)
        forms = grains.forms if isinstance(grains, Snapshot) else Forms.of([grains])
        if forms.round:
            return cls(forms.radius, grains.radius)
        if forms.axes is not None:
            assert forms.exponents is not None
            quadrics = np.column_stack([forms.axes, forms.exponents])
            return cls(forms.radius, grains.radius, grains.orientation, quadrics=quadrics)
        parts = _padded(forms, len(grains.radius))
        bounds = (np.linalg.norm(parts[:, :, :3], axis=2) + parts[:, :, 3]).max(axis=1)
        return cls(bounds, grains.radius, grains.orientation, parts=parts)

    def rows(self, chosen: np.ndarray) -> Outlines:
        """Return the outlines of some grains alone, in the order given."""
        kept: dict[str, Any] = {name: None if held is None else held[chosen] for name, held in vars(self).items()}
        return Outlines(**kept)

    def joined(self, more: Outlines) -> Outlines:
        """Return these and more outlines as one; spheres beside forms become forms."""
        one, two = self._like(more), more._like(self)
        if one.parts is not None and two.parts is not None:
            most = max(one.parts.shape[1], two.parts.shape[1])
            one, two = replace(one, parts=_widened(one.parts, most)), replace(two, parts=_widened(two.parts, most))
        joined: dict[str, Any] = {
            n: None if v is None else np.concatenate([v, getattr(two, n)]) for n, v in vars(one).items()
        }
        return Outlines(**joined)

    def farthest(self, chosen: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Return the point of each grain that lies farthest along a direction, from its centre, (k, 3) [m].

        Of superquadrics ∂h/∂u of h(u) = ‖(‖(a u_x, b u_y)‖_m₂, c u_z)‖_m₁ with m = n/(n − 1).

        Args:
            chosen: numbers of the grains, (k,).
            direction: unit vectors in the frame of the world, (k, 3).
        """
        if self.orientation is None:
            return self.radius[chosen][:, None] * direction
        turn = self.orientation[chosen]
        u = _turned(turn * INVERSE, direction)
        if self.parts is not None:
            parts = self.parts[chosen]
            last = (np.einsum("kmi,ki->km", parts[:, :, :3], u) + parts[:, :, 3]).argmax(axis=1)
            ends = parts[np.arange(len(chosen)), last]
            return _turned(turn, ends[:, :3]) + ends[:, 3:] * direction
        assert self.quadrics is not None
        return _turned(turn, _end_of_quadric(self.quadrics[chosen], u))

    def reach(self, chosen: np.ndarray, direction: np.ndarray) -> np.ndarray:
        """Return how far grains reach from their centres along unit vectors, (k,) [m]; arguments as of `farthest`."""
        if self.orientation is None:
            return self.radius[chosen]
        return np.einsum("ki,ki->k", self.farthest(chosen, direction), direction)

    def both_ways(self, axis: int) -> tuple[np.ndarray, np.ndarray]:
        """Return how far each grain reaches from its centre down and up an axis of the world (0, 1, 2), (n,) [m]."""
        every = np.arange(len(self.radius))
        up: np.ndarray = np.broadcast_to(np.eye(3)[axis], (len(every), 3))
        return self.reach(every, -up), self.reach(every, up)

    def meets(self, chosen: np.ndarray, way: np.ndarray, others: Outlines, partner: np.ndarray) -> np.ndarray:
        """Return whether the hulls of grains meet those of their partners, (k,); the spheres about them do.

        Gilbert's algorithm: v is a point of the set of all ways from a grain to its partner, first that from centre to
        centre. Where the whole set lies beyond a plane across v, they are clear of each other; else v moves towards the
        end of the set against v. What isn't clear after some rounds counts as meeting.

        Args:
            chosen, partner: numbers of the grains here and among the others, (k,).
            way: from centre to centre [m], (k, 3).

        Source: Gilbert (1966), doi 10.1137/0304007.
        """
        meeting = np.ones(len(chosen), bool)
        if self.orientation is None and others.orientation is None:
            return meeting
        left, v = np.arange(len(chosen)), np.array(way, float)
        for _ in range(LOOKS):
            length = np.linalg.norm(v, axis=1)
            moving = length > TOUCH * np.linalg.norm(way[left], axis=1)
            left, v = left[moving], v[moving]
            u = v / length[moving][:, None]
            end = way[left] + others.farthest(partner[left], -u) - self.farthest(chosen[left], u)
            clear = np.einsum("ki,ki->k", end, u) > TOUCH * length[moving]
            meeting[left[clear]] = False
            left, v, end = left[~clear], v[~clear], end[~clear]
            step = end - v
            square = np.maximum(np.einsum("ki,ki->k", step, step), 1e-300)
            v = v - np.clip(np.einsum("ki,ki->k", v, step) / square, -1.0, 0.0)[:, None] * step
        return meeting

    def _like(self, other: Outlines) -> Outlines:
        """Return the same outlines in the way that another set is described, where these are spheres."""
        if self.orientation is not None or other.orientation is None:
            return self
        n = len(self.radius)
        turned = replace(self, orientation=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)))
        if other.quadrics is not None:
            return replace(turned, quadrics=np.column_stack([self.radius] * 3 + [np.full(n, 2.0)] * 2))
        assert other.parts is not None
        parts = np.zeros((n, 1, 4))
        parts[:, 0, 3] = self.radius
        return replace(turned, parts=parts)


def highest_point(snapshot: Snapshot) -> float:
    """Return the height of the highest point of any grain [m]."""
    return float((snapshot.position[:, 2] + Outlines.of(snapshot).both_ways(2)[1]).max())


def _widened(parts: np.ndarray, most: int) -> np.ndarray:
    """Return the parts of bodies with room for so many each."""
    wide = np.full((len(parts), most, 4), NO_PART)
    wide[:, : parts.shape[1]] = parts
    return wide


def _padded(forms: Forms, bodies: int) -> np.ndarray:
    """Return offsets and radii of each body's spheres side by side, (n, m, 4)."""
    counts = np.bincount(forms.body, minlength=bodies)
    starts = np.cumsum(counts) - counts
    parts = np.full((bodies, int(counts.max(initial=1)), 4), NO_PART)
    place = np.arange(len(forms.body)) - starts[forms.body]
    parts[forms.body, place] = np.column_stack([forms.offset, forms.radius])
    return parts


def _turned(quaternion: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return vectors turned by rotations, q v q*."""
    axis = quaternion[:, 1:]
    twice = 2 * np.cross(axis, v)
    return v + quaternion[:, :1] * twice + np.cross(axis, twice)


def _end_of_quadric(held: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the points of superquadrics, semi-axes and exponents (k, 5), that lie farthest along u in their frames."""
    axes = held[:, :3]
    m1, m2 = (held[:, column] / (held[:, column] - 1) for column in (3, 4))
    x, y, z = np.maximum(np.abs(u) * axes, 1e-300 * axes).T
    across = _norm(x, y, m2)
    whole = _norm(across, z, m1)
    outer = (across / whole) ** (m1 - 1)
    shares = [outer * (x / across) ** (m2 - 1), outer * (y / across) ** (m2 - 1), (z / whole) ** (m1 - 1)]
    return np.sign(u) * axes * np.column_stack(shares)


def _norm(first: np.ndarray, second: np.ndarray, power: np.ndarray) -> np.ndarray:
    """Return (x^p + y^p)^(1/p) of numbers above 0."""
    largest = np.maximum(first, second)
    return largest * ((first / largest) ** power + (second / largest) ** power) ** (1 / power)
