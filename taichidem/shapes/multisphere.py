"""Multispheres: rigid bodies of spheres that overlap or touch, with the mass properties of their union."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from taichidem.errors import InputError
from taichidem.shapes.base import Elements, GrainShape
from taichidem.shapes.multisphere_files import read_spheres
from taichidem.shapes.multisphere_filling import filled, read_surface
from taichidem.shapes.spheroid_spheres import ShapeError, apart, shape_error, spheroid_spheres
from taichidem.shapes.union_properties import Moments, union_moments

PRINCIPAL = 1e-12  # products of inertia below this share of the largest moment are round-off
_MOST_TRIED = 100


@dataclass(frozen=True)
class Multisphere(GrainShape):
    """A body of spheres; what several of them cover counts once in its volume, centre of mass and moments.

    Two spheres of radius R at a distance d ≤ 2 R: V = 2 · 4/3 π R³ − π (4 R + d) (2 R − d)² / 12

    Mass properties are exact for every arrangement, triple overlaps included, to round-off. The frame of the bodies made
    of it is the given one, moved to the centre of mass; it is turned only where it isn't principal already.

    Args:
        centres: of the spheres in any frame [m], (m, 3).
        radii: [m], (m,), or one number for all.

    Attributes:
        covered: union's share of the volume of the surface that was filled with it; None where no surface was.

    Raises:
        InputError: no sphere, wrong shapes, numbers that aren't finite or radii not above 0, or spheres that don't hang together.

    Source: that a union of spheres has closed forms, Gibson & Scheraga (1987), doi 10.1080/00268978700102951; the way here,
    over the exposed surface and its edges, is in `union_properties`.
    """

    centres: tuple[tuple[float, float, float], ...]
    radii: tuple[float, ...]
    covered: float | None = field(default=None, compare=False, repr=False)

    def __init__(self, centres: object, radii: object, *, covered: float | None = None) -> None:
        points, sizes = _checked(centres, radii)
        object.__setattr__(self, "centres", tuple((float(x), float(y), float(z)) for x, y, z in points))
        object.__setattr__(self, "radii", tuple(float(size) for size in sizes))
        object.__setattr__(self, "covered", covered)

    @classmethod
    def spheroid(cls, aspect_ratio: float, spheres: int, radius: float = 1.0) -> Multisphere:
        """Return spheres that make a spheroid about z, with the volume of a sphere of a radius.

        Prolate: evenly spaced along z. Oblate: in rings across z. They are inscribed in a spheroid, chosen so that the
        union's own length over width is the aspect ratio, and then scaled so that the union's own volume is 4/3 π radius³.

        Args:
            aspect_ratio: length along z over width, above 0.
            spheres: number of spheres; one makes an aspect ratio of 1, two make up to 2, where they touch.
            radius: of the sphere of equal volume [m].

        Raises:
            InputError: values that aren't numbers above 0, or too few spheres for the aspect ratio.

        Source: Favier et al. (1999), doi 10.1108/02644409910271894, for spheres along an axis.
        """
        for name, value in (("aspect_ratio", aspect_ratio), ("radius", radius)):
            if not (_number(value) and value > 0):
                raise InputError(f"{name} is {value!r}; give a finite number above 0.")
        count = _count(spheres)
        made = spheroid_spheres(aspect_ratio, count)
        if made is None:
            raise InputError(_too_few(aspect_ratio, count))
        centres, radii = made
        scale = radius / (3 * union_moments(centres, radii).volume / (4 * math.pi)) ** (1 / 3)
        return cls(scale * centres, scale * radii)

    @classmethod
    def from_file(cls, path: str | Path, unit: str = "m") -> Multisphere:
        """Return the spheres of a text file with a row `x y z radius` for each.

        Columns stand apart by commas, semicolons or blanks; what follows a `#` is a comment; a first row of words is a header.

        Args:
            path: of the file; unit: of all its numbers, such as "mm".

        Raises:
            InputError: no such file, a unit that is no length, a row that isn't four numbers, or spheres that make no body.
        """
        centres, radii = read_spheres(Path(path), unit)
        try:
            return cls(centres, radii)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None

    @classmethod
    def from_stl(cls, path: str | Path, spheres: int, unit: str = "m", seed: int = 0) -> Multisphere:
        """Return spheres that fill a closed surface of triangles from inside.

        Each sphere touches the surface from within in two places or more (a ball of the medial axis). The largest comes
        first, then always the one that adds most volume and overlaps what is there; fewer are taken where none adds any.
        Volume, centre of mass and moments are those of the union of the spheres and not those of the surface;
        `covered` tells which share of the surface's volume the union has.

        Args:
            path: of an STL file, binary or ASCII; spheres: how many at most.
            unit: of the file's coordinates, such as "mm"; seed: of the points of the surface where balls are tried.

        Raises:
            InputError: no such file, not readable as STL, a surface that isn't closed, or not a number of spheres above 0.
        """
        count = _count(spheres)
        surface = read_surface(Path(path), unit)
        centres, radii = filled(surface, count, np.random.default_rng(seed))
        return cls(centres, radii, covered=union_moments(centres, radii).volume / surface.volume)

    @property
    def volume(self) -> float:
        """Volume of the union [m³]."""
        return self._moments.volume

    @property
    def centre(self) -> np.ndarray:
        """Centre of mass of the union in the given frame [m], (3,)."""
        return self._moments.centre.copy()

    @cached_property
    def principal_rotation(self) -> np.ndarray:
        """Principal axes in the given frame, one a row, right-handed, (3, 3); the identity where that frame is principal."""
        tensor = self._moments.tensor
        products = tensor[np.triu_indices(3, 1)]
        if np.abs(products).max() <= PRINCIPAL * tensor.diagonal().max():
            return _fixed(np.eye(3))
        return _fixed(_nearest_axes(np.linalg.eigh(tensor)[1].T))

    @cached_property
    def inertia(self) -> np.ndarray:
        """Principal moments of the union over its mass [m²], (3,), in the order of `principal_rotation`."""
        turned = self.principal_rotation @ self._moments.tensor @ self.principal_rotation.T
        return _fixed(turned.diagonal().copy())

    @cached_property
    def elements(self) -> Elements:
        """The spheres about the centre of mass in the principal frame, in the given order."""
        apart_from_centre = np.array(self.centres) - self._moments.centre
        return Elements(_fixed(apart_from_centre @ self.principal_rotation.T), _fixed(np.array(self.radii)))

    def shape_error(self, aspect_ratio: float) -> ShapeError:
        """Return how far it is from the spheroid about its z axis with an aspect ratio, as long (prolate) or as wide (oblate).

        Args:
            aspect_ratio: length along z over width of the spheroid.

        Raises:
            InputError: a ratio not above 0.
        """
        if not (_number(aspect_ratio) and aspect_ratio > 0):
            raise InputError(f"aspect_ratio is {aspect_ratio!r}; give length over width, a finite number above 0.")
        offset, radii = self.elements.offset.copy(), self.elements.radius
        if aspect_ratio < 1:
            width = float((np.linalg.norm(offset[:, :2], axis=1) + radii).max())
            return shape_error(offset, radii, aspect_ratio * width, width)
        low, high = (offset[:, 2] - radii).min(), (offset[:, 2] + radii).max()
        offset[:, 2] -= 0.5 * (low + high)
        length = float(0.5 * (high - low))
        return shape_error(offset, radii, length, length / aspect_ratio)

    @cached_property
    def _moments(self) -> Moments:
        return union_moments(np.array(self.centres), np.array(self.radii))


def _checked(centres: object, radii: object) -> tuple[np.ndarray, np.ndarray]:
    try:
        points, given = np.array(centres, float), np.array(radii, float)
    except (TypeError, ValueError):
        raise InputError(
            "Multisphere has centres or radii that aren't numbers; give arrays (m, 3) and (m,) [m]."
        ) from None
    if points.size == 0:
        raise InputError("Multisphere has no sphere; give the centre and the radius of one or more.")
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(
            f"Multisphere.centres has shape {points.shape}; give (m, 3), a row x, y, z [m] for each sphere."
        )
    if given.shape not in ((), (len(points),)):
        raise InputError(
            f"Multisphere.radii has shape {given.shape} beside {len(points)} centres; give ({len(points)},) or one number [m]."
        )
    sizes = np.broadcast_to(given, (len(points),))
    if not np.all(np.isfinite(points)):
        raise InputError("Multisphere.centres holds NaN or infinite values; give finite coordinates [m].")
    wrong = np.flatnonzero(~(np.isfinite(sizes) & (sizes > 0)))
    if len(wrong):
        raise InputError(
            f"Multisphere.radii[{wrong[0]}] is {sizes[wrong[0]]:g}; a radius is a finite number above 0 [m]."
        )
    gap = apart(points, sizes)
    if gap is not None:
        raise InputError(
            f"Spheres {gap[0]} and {gap[1]} (counted from 0) are {gap[2]:.6g} m apart and nothing else joins their groups; "
            "a body has to hang together: move them, enlarge them, or add a sphere between."
        )
    return points, sizes


def _nearest_axes(axes: np.ndarray) -> np.ndarray:
    """Return principal axes (rows) in the order and with the signs that turn the given frame least, right-handed."""
    from scipy.optimize import linear_sum_assignment

    order = linear_sum_assignment(-np.abs(axes.T))[1]
    turned = axes[order]
    turned *= np.where(turned.diagonal() < 0, -1.0, 1.0)[:, None]
    if np.linalg.det(turned) < 0:
        turned[np.abs(turned.diagonal()).argmin()] *= -1
    return turned


def _fixed(array: np.ndarray) -> np.ndarray:
    """Make an array that is handed out more than once read-only."""
    array.setflags(write=False)
    return array


def _too_few(aspect_ratio: float, count: int) -> str:
    given = f"A spheroid of aspect ratio {aspect_ratio:g} can't be made of {count} sphere{'s' if count > 1 else ''}"
    tried = range(count + 1, _MOST_TRIED + 1)
    enough = next((number for number in tried if spheroid_spheres(aspect_ratio, number) is not None), None)
    why = "one makes an aspect ratio of 1 only" if count == 1 else "they would not hang together, or leave a hole"
    if enough is None:
        return (
            f"{given}: {why}. No number up to {_MOST_TRIED} does; take an aspect ratio nearer to 1, or a Superquadric."
        )
    return f"{given}: {why}. The next number that does is {enough}; or take an aspect ratio nearer to 1."


def _count(spheres: object) -> int:
    if isinstance(spheres, bool) or not isinstance(spheres, (int, np.integer)) or spheres < 1:
        raise InputError(f"spheres is {spheres!r}; give how many spheres to use, a whole number from 1.")
    return int(spheres)


def _number(value: object) -> bool:
    return isinstance(value, (int, float, np.floating, np.integer)) and math.isfinite(value)
