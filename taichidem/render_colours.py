"""The quantities by which the grains of a picture are coloured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from taichidem.errors import InputError, unknown_name
from taichidem.grains import Array, Grains, rotation_matrices
from taichidem.snapshot import Snapshot

MOST = 0.98  # share of the grains up to whose value the colours of a quantity with a long tail reach


@dataclass(frozen=True)
class Quantity:
    """What a grain is coloured by.

    Args:
        label: name and unit, beside the colour bar.
        of: snapshot → one value a grain in that unit, (n,).
        tail: whether few grains have values far above the others'; the highest two in a hundred then share a colour,
            and colours begin at 0.
        whole: whether the values are whole numbers.
    """

    label: str
    of: Callable[[Snapshot], Array]
    tail: bool = False
    whole: bool = False


@dataclass(frozen=True)
class Shown:
    """What colours the grains of one picture: its label, one value a grain, and whether these are whole numbers."""

    label: str
    values: Array
    limits: tuple[float, float]
    whole: bool = False


def _length(vectors: Array) -> Array:
    return np.linalg.norm(vectors, axis=1)


def _tilt(seen: Snapshot) -> Array:
    """Return the angle between each grain's third principal axis and the vertical [deg], 0 to 90."""
    upward = rotation_matrices(seen.orientation)[:, 2, 2]
    return np.degrees(np.arccos(np.clip(np.abs(upward), 0.0, 1.0)))


def _material(seen: Snapshot) -> Array:
    """Return the number of each grain's material; that of its first element where these differ."""
    if seen.forms.material is None:
        raise InputError(
            "Grains can't be coloured by material: this snapshot doesn't hold it. Take one of a simulation, or give "
            "forms with material."
        )
    first = np.unique(seen.forms.body, return_index=True)[1]
    return np.asarray(seen.forms.material, float)[first]


#: Name → quantity. Units fit grains of millimetres; labels are short, since they stand beside the picture's edge.
QUANTITIES: dict[str, Quantity] = {
    "height": Quantity("height [mm]", lambda s: 1e3 * s.position[:, 2]),
    "speed": Quantity("speed [m/s]", lambda s: _length(s.velocity), tail=True),
    "vertical_velocity": Quantity("velocity z [m/s]", lambda s: s.velocity[:, 2]),
    "spin": Quantity("spin [rad/s]", lambda s: _length(s.spin), tail=True),
    # That of rotation is left out: a snapshot holds no moments of inertia.
    "kinetic_energy": Quantity("½ m v² [µJ]", lambda s: 1e6 * 0.5 * s.mass * _length(s.velocity) ** 2, tail=True),
    "force": Quantity("force [mN]", lambda s: 1e3 * _length(s.force), tail=True),
    "mass": Quantity("mass [mg]", lambda s: 1e6 * s.mass),
    # Of the sphere of equal volume.
    "diameter": Quantity("diameter [mm]", lambda s: 2e3 * s.radius),
    "tilt": Quantity("tilt [deg]", _tilt),
    # Liquid in m³; what an effect of your own lets grains carry in the unit that it declares.
    "carried": Quantity("carried [SI]", lambda s: s.carried),
    "material": Quantity("material", _material, whole=True),
    "identity": Quantity("identity", lambda s: s.identity.astype(float), whole=True),
}


def quantity_named(name: str) -> Quantity:
    """Return a quantity by its name; raises InputError, which lists those that are there, where there is none."""
    if name not in QUANTITIES:
        raise unknown_name("quantity to colour by", name, QUANTITIES)
    return QUANTITIES[name]


def limits_of(values: Array, quantity: Quantity) -> tuple[float, float]:
    """Return the lowest and highest value that colours tell apart."""
    if not quantity.tail:
        return float(values.min()), float(values.max())
    return 0.0, float(np.quantile(values, MOST))


def shown(grains: Grains | Snapshot, colour_by: str | None, values: Any, value_name: str) -> Shown:
    """Return what colours a picture: the values given, or the quantity named, or the height.

    Raises:
        InputError: values and a name, an unknown name, values that are not finite numbers, one a grain, or a quantity
            that grains alone don't have.
    """
    if values is not None:
        if colour_by is not None:
            raise InputError(f"colour_by {colour_by!r} and values were both given. Give one of them.")
        given = np.asarray(values, dtype=np.float64)
        count = len(grains.position)
        if given.shape != (count,) or not np.isfinite(given).all():
            raise InputError(f"values given: shape {given.shape}. Allowed: finite numbers of shape ({count},).")
        return Shown(value_name, given, (float(given.min()), float(given.max())))
    quantity = quantity_named(colour_by or "height")
    if isinstance(grains, Snapshot):
        numbers = quantity.of(grains)
    elif colour_by in (None, "height"):
        numbers = 1e3 * grains.position[:, 2]
    else:
        raise InputError(
            f"colour_by given: {colour_by!r} for grains without velocities. Give the snapshot itself, or `values`."
        )
    return Shown(quantity.label, numbers, limits_of(numbers, quantity), quantity.whole)
