"""An infinite plane, solid behind it."""

import math
from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichidem.contact import vec3
from taichidem.shapes.sphere import Nearest
from taichidem.walls.base import Vector, Wall, finite_vector, frame_of, unit_vector


@dataclass(frozen=True, kw_only=True)
class Plane(Wall):
    """An infinite plane through `point` [m]; grains live on the side to which `normal` points."""

    point: Vector
    normal: Vector
    picture_size: float = 0.1

    def __post_init__(self) -> None:
        finite_vector("Plane.point", self.point)
        unit_vector("Plane.normal", self.normal)

    def kind(self) -> str:
        return PlaneKind.name

    def rows(self) -> list[dict]:
        local = np.asarray(self.point, float) - np.asarray(self.motion.centre, float)
        return [{"point": local, "normal": unit_vector("Plane.normal", self.normal)}]

    def extent(self) -> float:
        return math.inf

    def surface(self, resolution: int = 64) -> tuple[np.ndarray, np.ndarray]:
        first, second, _ = frame_of(unit_vector("Plane.normal", self.normal)) * self.picture_size
        centre = np.asarray(self.point, float)
        corners = np.array(
            [centre - first - second, centre + first - second, centre + first + second, centre - first + second]
        )
        return corners, np.array([[0, 1, 2], [0, 2, 3]])


@ti.data_oriented
class PlaneKind:
    """The kernel side of planes."""

    name = "plane"
    bend = -1  # endless, with one normal
    columns = {"point": vec3, "normal": vec3}

    def __init__(self, table) -> None:
        self.table = table

    @ti.func
    def nearest(self, k, position, radius):
        """Return the foot of the perpendicular; the distance is negative behind the plane."""
        normal = self.table[k].normal
        distance = (position - self.table[k].point).dot(normal)
        return Nearest(point=position - distance * normal, normal=normal, distance=distance, counts=1)
