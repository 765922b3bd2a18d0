"""Surfaces of revolution of a straight line: disc, cylinder and cone, thin and two-sided, with their rims."""

import math
from dataclasses import dataclass

import numpy as np
import taichi as ti

from taichidem.contact import vec3
from taichidem.errors import InputError
from taichidem.shapes.sphere import Nearest
from taichidem.walls.base import Vector, Wall, finite_vector, frame_of, positive, unit_vector


@dataclass(frozen=True, kw_only=True)
class Revolved(Wall):
    """Base of walls made by turning the line from (ρ₁, z₁) to (ρ₂, z₂) about an axis through `origin`."""

    def profile(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
        """Return origin [m], axis, (ρ₁, z₁) and (ρ₂, z₂) [m]."""
        raise NotImplementedError(f"{type(self).__name__} must define profile")

    def kind(self) -> str:
        return RevolvedKind.name

    def rows(self) -> list[dict]:
        origin, axis, start, end = self.profile()
        local = origin - np.asarray(self.motion.centre, float)
        along = np.subtract(end, start)
        return [
            {
                "origin": local,
                "axis": axis,
                "rho": start[0],
                "height": start[1],
                "along_rho": along[0],
                "along_height": along[1],
                "inverse_square": 1 / float(along @ along),
            }
        ]

    def extent(self) -> float:
        origin, axis, start, end = self.profile()
        offset = origin - np.asarray(self.motion.centre, float)
        off_axis = np.linalg.norm(offset - (offset @ axis) * axis)
        spin = np.asarray(self.motion.spin, float)
        if off_axis < 1e-12 and np.linalg.norm(np.cross(spin, axis)) <= 1e-12 * np.linalg.norm(spin):
            return 0.0  # it turns about its own axis and stays where it is
        return float(np.linalg.norm(offset) + max(math.hypot(*start), math.hypot(*end)))

    def surface(self, resolution: int = 64) -> tuple[np.ndarray, np.ndarray]:
        origin, axis, start, end = self.profile()
        frame = frame_of(axis)
        turn = np.linspace(0, 2 * np.pi, resolution, endpoint=False)
        ring = np.cos(turn)[:, None] * frame[0] + np.sin(turn)[:, None] * frame[1]
        points = np.concatenate([origin + rho * ring + height * axis for rho, height in (start, end)])
        k = np.arange(resolution)
        n = (k + 1) % resolution
        return points, np.concatenate(
            [np.stack([k, n, n + resolution], 1), np.stack([k, n + resolution, k + resolution], 1)]
        )


@dataclass(frozen=True, kw_only=True)
class Disc(Revolved):
    """A flat disc, or a ring when `inner_radius` is above 0 [m]."""

    centre: Vector
    normal: Vector = (0.0, 0.0, 1.0)
    radius: float
    inner_radius: float = 0.0

    def __post_init__(self) -> None:
        finite_vector("Disc.centre", self.centre)
        unit_vector("Disc.normal", self.normal)
        positive("Disc.radius", self.radius)
        if not 0 <= self.inner_radius < self.radius:
            raise InputError(
                f"Disc.inner_radius is {self.inner_radius!r}; it must be from 0 to below the radius {self.radius:g} m."
            )

    def profile(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
        return (
            np.asarray(self.centre, float),
            unit_vector("Disc.normal", self.normal),
            (self.inner_radius, 0.0),
            (self.radius, 0.0),
        )


@dataclass(frozen=True, kw_only=True)
class Cylinder(Revolved):
    """An open tube from `base` [m] along `axis`."""

    base: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    radius: float
    height: float

    def __post_init__(self) -> None:
        finite_vector("Cylinder.base", self.base)
        unit_vector("Cylinder.axis", self.axis)
        positive("Cylinder.radius", self.radius)
        positive("Cylinder.height", self.height)

    def profile(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
        return (
            np.asarray(self.base, float),
            unit_vector("Cylinder.axis", self.axis),
            (self.radius, 0.0),
            (self.radius, self.height),
        )


@dataclass(frozen=True, kw_only=True)
class Cone(Revolved):
    """A cone or frustum from `base` [m] along `axis`, with a radius at each end."""

    base: Vector
    axis: Vector = (0.0, 0.0, 1.0)
    base_radius: float
    top_radius: float
    height: float

    def __post_init__(self) -> None:
        finite_vector("Cone.base", self.base)
        unit_vector("Cone.axis", self.axis)
        positive("Cone.height", self.height)
        radii = (self.base_radius, self.top_radius)
        if not all(math.isfinite(r) and r >= 0 for r in radii) or max(radii) == 0:
            raise InputError(f"Cone radii are {radii!r}; give finite numbers from 0, not both 0 (SI).")

    def profile(self) -> tuple[np.ndarray, np.ndarray, tuple[float, float], tuple[float, float]]:
        return (
            np.asarray(self.base, float),
            unit_vector("Cone.axis", self.axis),
            (self.base_radius, 0.0),
            (self.top_radius, self.height),
        )


def cup(radius: float, height: float, material: str) -> tuple[Cylinder, Disc]:
    """Return an upright open cup with its bottom at z = 0: a tube and a disc [m]."""
    tube = Cylinder(name="cup wall", material=material, base=(0.0, 0.0, 0.0), radius=radius, height=height)
    return tube, Disc(name="cup bottom", material=material, centre=(0.0, 0.0, 0.0), radius=radius)


@ti.data_oriented
class RevolvedKind:
    """The kernel side of discs, cylinders and cones: the nearest point in the half-plane of axis and grain."""

    name = "revolved"
    bend = 1  # tubes and rims bend towards grains inside
    columns = {
        "origin": vec3,
        "axis": vec3,
        "rho": ti.f64,
        "height": ti.f64,
        "along_rho": ti.f64,
        "along_height": ti.f64,
        "inverse_square": ti.f64,
    }

    def __init__(self, table) -> None:
        self.table = table

    @ti.func
    def nearest(self, k, position, radius):
        """Return the nearest point of the surface, rims included; on the axis any direction serves."""
        row = self.table[k]
        away = position - row.origin
        height = away.dot(row.axis)
        outward = away - height * row.axis
        rho = ti.sqrt(outward.dot(outward))
        if rho > 0.0:
            outward = outward * (1.0 / rho)
        else:
            helper = vec3(1.0, 0.0, 0.0)
            if ti.abs(row.axis.x) > 0.9:
                helper = vec3(0.0, 1.0, 0.0)
            outward = helper.cross(row.axis).normalized()
        share = ((rho - row.rho) * row.along_rho + (height - row.height) * row.along_height) * row.inverse_square
        share = ti.min(ti.max(share, 0.0), 1.0)
        point = (
            row.origin
            + (row.rho + share * row.along_rho) * outward
            + (row.height + share * row.along_height) * row.axis
        )
        apart = position - point
        distance = ti.sqrt(apart.dot(apart))
        normal = row.axis
        if distance > 0.0:
            normal = apart * (1.0 / distance)
        return Nearest(point=point, normal=normal, distance=distance, counts=1)
