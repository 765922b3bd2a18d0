"""Turn walls into surfaces that can be drawn and saved."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
import pyvista as pv

from taichidem.walls.base import Wall as SceneWall

Wall: TypeAlias = pv.PolyData | SceneWall
AROUND = 256


def wall_surfaces(walls: Iterable[Wall]) -> list[pv.PolyData]:
    """Return the surfaces of walls; what is a surface already stays as it is."""
    return [wall if isinstance(wall, pv.PolyData) else wall_surface(wall) for wall in walls]


def wall_surface(wall: SceneWall) -> pv.PolyData:
    """Return the surface of one wall of a scene, at time 0 [m]."""
    points, triangles = wall.surface(AROUND)
    return pv.PolyData.from_regular_faces(np.asarray(points, dtype=float), np.asarray(triangles))
