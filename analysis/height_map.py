"""The upper surface of a pile of spheres on a square grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class HeightMap:
    """Heights of the upper surface over the nodes of a grid that lie under a grain.

    Attributes
    ----------
    x, y : node positions [m], shape (n,).
    height : height of the highest sphere's surface over the node [m], shape (n,).
    """

    x: Array
    y: Array
    height: Array

    @property
    def distance(self) -> Array:
        """Distance of the nodes from the axis x = y = 0 [m], shape (n,)."""
        return np.hypot(self.x, self.y)

    @property
    def azimuth(self) -> Array:
        """Azimuth of the nodes, 0 ≤ φ < 2π [rad], shape (n,)."""
        return np.mod(np.arctan2(self.y, self.x), 2.0 * np.pi)


def upper_surface(centres: Array, radii: Array, spacing: float) -> HeightMap:
    """Return the upper surface z(x, y) = max over the spheres of z_i + √(R_i² − ρ_i²).

    Parameters
    ----------
    centres : sphere centres [m], shape (n, 3).
    radii : sphere radii [m], shape (n,).
    spacing : distance of the grid's nodes [m].
    """
    reach = int(np.ceil(radii.max() / spacing)) + 1
    offsets = np.arange(-reach, reach + 1)
    nearest = np.round(centres[:, :2] / spacing).astype(np.intp)
    columns = (nearest[:, 0, None] + offsets)[:, :, None]
    rows = (nearest[:, 1, None] + offsets)[:, None, :]
    across = columns * spacing - centres[:, 0, None, None]
    along = rows * spacing - centres[:, 1, None, None]
    rise = radii[:, None, None] ** 2 - across**2 - along**2
    under = rise > 0
    height = (centres[:, 2, None, None] + np.sqrt(np.where(under, rise, 0.0)))[under]
    low = nearest.min(axis=0) - reach
    size = nearest.max(axis=0) + reach + 1 - low
    node = ((columns - low[0]) * size[1] + (rows - low[1]))[under]
    surface = np.full(size[0] * size[1], -np.inf)
    np.maximum.at(surface, node, height)
    filled = np.flatnonzero(np.isfinite(surface))
    column, row = np.divmod(filled, size[1])
    return HeightMap((column + low[0]) * spacing, (row + low[1]) * spacing, surface[filled])
