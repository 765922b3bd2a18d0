"""Grains as they lie: where each is, what it looks like and how it is turned. What is drawn and written takes these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from taichidem.errors import InputError
from taichidem.shapes.forms import Forms
from taichidem.snapshot import Snapshot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Grains:
    """Grains of any form, of which there is at least one.

    Args:
        position: centres of mass [m], (n, 3); z is up.
        forms: what each looks like in its own frame.
        orientation: quaternions w, x, y, z that carry a grain's frame to the laboratory's, (n, 4); None for none turned.

    Raises:
        InputError: wrong shapes, no grains, values that are not finite, sizes not above 0, quaternions whose length is
            not 1 within 1 %, or forms that don't fit the number of grains.
    """

    position: Array
    forms: Forms
    orientation: Array | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", _places(self.position))
        _check_forms(self.forms, len(self.position))
        if self.orientation is not None:
            object.__setattr__(self, "orientation", _unit_quaternions(self.orientation, len(self.position)))

    @classmethod
    def of(cls, seen: Grains | Snapshot) -> Grains:
        """Return the grains of a snapshot; grains stay as they are."""
        return seen if isinstance(seen, Grains) else cls(seen.position, seen.forms, seen.orientation)

    @classmethod
    def spheres(cls, positions: Any, radii: Any) -> Grains:
        """Return spheres of given centres [m], (n, 3), and radii [m], (n,) or one number."""
        places = _places(positions)
        sizes = np.asarray(radii, dtype=np.float64)
        if sizes.shape not in ((), (len(places),)):
            raise InputError(f"radii given: shape {sizes.shape}. Allowed: ({len(places)},), or one number, in metres.")
        return cls(places, Forms.spheres(np.broadcast_to(sizes, (len(places),)).copy()))

    def rows(self, kept: NDArray[np.bool_]) -> Grains:
        """Return some of the grains, chosen by a mask (n,)."""
        turned = None if self.orientation is None else self.orientation[kept]
        return Grains(self.position[kept], self.forms.rows(np.flatnonzero(kept)), turned)

    @property
    def element_orientation(self) -> Array:
        """How each element is turned: the quaternion of its grain, (m, 4)."""
        if self.orientation is None:
            return np.tile([1.0, 0.0, 0.0, 0.0], (len(self.forms.body), 1))
        return self.orientation[self.forms.body]

    @property
    def element_centre(self) -> Array:
        """Where each element is [m], (m, 3): x + R(q) offset."""
        own = self.position[self.forms.body]
        if not np.any(self.forms.offset):
            return own
        return own + np.einsum("mij,mj->mi", rotation_matrices(self.element_orientation), self.forms.offset)

    @property
    def element_axes(self) -> Array:
        """Semi-axes of each element [m], (m, 3); those of a sphere are its radius."""
        if self.forms.axes is None:
            return np.repeat(np.asarray(self.forms.radius, float)[:, None], 3, axis=1)
        return np.asarray(self.forms.axes, float)

    @property
    def element_exponents(self) -> Array:
        """Exponents n₁ and n₂ of each element, (m, 2); 2 for spheres."""
        if self.forms.exponents is None:
            return np.full((len(self.forms.body), 2), 2.0)
        return np.asarray(self.forms.exponents, float)

    @property
    def element_is_sphere(self) -> NDArray[np.bool_]:
        """Whether each element is a true sphere, (m,); spheres beside superquadrics are described as such."""
        axes = self.element_axes
        return np.all(axes == axes[:, :1], axis=1) & np.all(self.element_exponents == 2.0, axis=1)

    @property
    def bounds(self) -> Array:
        """Lowest and highest x, y, z of the spheres about all elements [m], (2, 3)."""
        reach = np.asarray(self.forms.radius)[:, None]
        return np.stack([(self.element_centre - reach).min(axis=0), (self.element_centre + reach).max(axis=0)])

    def __len__(self) -> int:
        return len(self.position)


def rotation_matrices(quaternions: Array) -> Array:
    """Return the rotations of unit quaternions w, x, y, z, shape (n, 3, 3)."""
    w, x, y, z = np.asarray(quaternions, float).T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _places(positions: Any) -> Array:
    places = np.asarray(positions, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or len(places) == 0:
        raise InputError(f"positions given: shape {places.shape}. Allowed: (n, 3) with n ≥ 1, in metres.")
    if not np.isfinite(places).all():
        raise InputError("positions given hold NaN or infinite values. Allowed: finite ones. Leave out removed grains.")
    return places


def _unit_quaternions(orientation: Any, count: int) -> Array:
    quaternions = np.asarray(orientation, dtype=np.float64)
    if quaternions.shape != (count, 4):
        raise InputError(
            f"orientations given: shape {quaternions.shape}. Allowed: ({count}, 4), quaternions w, x, y, z."
        )
    length = np.linalg.norm(quaternions, axis=1)
    if not np.all(np.abs(length - 1.0) < 0.01):
        raise InputError(
            f"orientations given: quaternions of length {length.min():.3g} to {length.max():.3g}. Allowed: unit "
            "quaternions w, x, y, z."
        )
    return quaternions / length[:, None]


def _check_forms(forms: Forms, count: int) -> None:
    """Raise InputError unless every grain has an element, and every element a size."""
    body = np.asarray(forms.body)
    if not np.array_equal(np.unique(body), np.arange(count)):
        raise InputError(
            f"forms given: elements of {len(np.unique(body))} grains, numbered up to {body.max(initial=-1)}, for {count} "
            f"positions. Allowed: one element or more for each grain, numbered from 0 to {count - 1}."
        )
    if (forms.axes is None) != (forms.exponents is None):
        raise InputError("forms given hold one of axes and exponents. Allowed: both, or neither where all are spheres.")
    for name, shape in (("radius", ()), ("offset", (3,)), ("axes", (3,)), ("exponents", (2,))):
        values = getattr(forms, name)
        if values is not None:
            _check_element(name, np.asarray(values), (len(body), *shape))


def _check_element(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> None:
    lowest = {"radius": 0.0, "axes": 0.0, "exponents": 1.0}.get(name, -np.inf)
    said = {"radius": "radii", "offset": "offsets"}.get(name, name)
    if values.shape != shape:
        raise InputError(f"{said} of the forms given: shape {values.shape}. Allowed: {shape}, a row for each element.")
    if not (np.isfinite(values).all() and (values > lowest).all()):
        above = "" if lowest == -np.inf else f" above {lowest:g}"
        raise InputError(f"{said} given hold NaN, infinite or non-positive values. Allowed: finite numbers{above}.")
