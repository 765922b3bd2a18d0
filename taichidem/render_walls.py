"""Turn descriptions of walls into surfaces that can be drawn and saved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from taichidem.errors import InputError, unknown_name

Wall: TypeAlias = pv.PolyData | Mapping[str, Any]
AROUND = 256


def wall_surfaces(walls: Iterable[Wall]) -> list[pv.PolyData]:
    """Return the surfaces of walls.

    Parameters
    ----------
    walls : surfaces, or mappings with the key "kind" and, in metres,
        "cylinder": radius, low, high (ends along the axis);
        "cone": radius_low, radius_high, low, high;
        "disc": radius; "plane": size (edge of the square that is drawn);
        "mesh": points (n, 3) and faces (m, 3), or triangles (m, 3, 3).
        All but "mesh" may have centre (default the origin) and axis or normal (default +z).

    Raises
    ------
    InputError : an unknown kind, a missing length, or one that isn't allowed.
    """
    return [wall_surface(wall) for wall in walls]


def wall_surface(wall: Wall) -> pv.PolyData:
    """Return the surface of one wall; see `wall_surfaces`."""
    if isinstance(wall, pv.PolyData):
        return wall
    kind = str(wall.get("kind"))
    if kind == "mesh":
        return _mesh(wall)
    if kind not in _LOCAL:
        raise unknown_name("wall kind", kind, [*_LOCAL, "mesh"])
    surface = _LOCAL[kind](wall)
    points = np.asarray(surface.points, dtype=float) @ _turn(_vector(wall, "axis", (0.0, 0.0, 1.0))).T
    surface.points = points + _vector(wall, "centre", (0.0, 0.0, 0.0))
    return surface


def cup_walls(radius: float, height: float, floor: float = 0.0) -> list[dict[str, Any]]:
    """Return the walls of an upright open cup: its side and its floor [m]."""
    return [
        {"kind": "cylinder", "radius": radius, "low": floor, "high": floor + height},
        {"kind": "disc", "radius": radius, "centre": (0.0, 0.0, floor)},
    ]


def _frustum(low: tuple[float, float], high: tuple[float, float]) -> pv.PolyData:
    """Return the side of a frustum about z given radius and height of both ends."""
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    rings = [
        np.stack([radius * np.cos(turn), radius * np.sin(turn), np.full(AROUND, z)], 1) for radius, z in (low, high)
    ]
    here = np.arange(AROUND)
    after = (here + 1) % AROUND
    faces = np.stack([here, after, after + AROUND, here + AROUND], axis=1)
    return pv.PolyData.from_regular_faces(np.vstack(rings), faces)


def _cylinder(wall: Mapping[str, Any]) -> pv.PolyData:
    radius = _length(wall, "radius")
    low, high = _ends(wall)
    return _frustum((radius, low), (radius, high))


def _cone(wall: Mapping[str, Any]) -> pv.PolyData:
    low, high = _ends(wall)
    return _frustum((_length(wall, "radius_low"), low), (_length(wall, "radius_high"), high))


def _disc(wall: Mapping[str, Any]) -> pv.PolyData:
    turn = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    rim = _length(wall, "radius") * np.stack([np.cos(turn), np.sin(turn), np.zeros(AROUND)], axis=1)
    here = np.arange(AROUND) + 1
    faces = np.stack([np.zeros(AROUND, int), here, np.roll(here, -1)], axis=1)
    return pv.PolyData.from_regular_faces(np.vstack([np.zeros((1, 3)), rim]), faces)


def _plane(wall: Mapping[str, Any]) -> pv.PolyData:
    half = _length(wall, "size") / 2.0
    corners = np.array([[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]])
    return pv.PolyData.from_regular_faces(corners, np.array([[0, 1, 2, 3]]))


def _mesh(wall: Mapping[str, Any]) -> pv.PolyData:
    if "triangles" in wall:
        points = np.asarray(wall["triangles"], dtype=float).reshape(-1, 3)
        faces = np.arange(len(points)).reshape(-1, 3)
    else:
        points = np.asarray(wall.get("points"), dtype=float)
        faces = np.asarray(wall.get("faces"))
    shaped = points.ndim == 2 and points.shape[1] == 3 and faces.ndim == 2 and faces.shape[1] == 3
    if not shaped or len(faces) == 0 or not np.isfinite(points).all():
        raise InputError(
            f"Mesh wall given: points {points.shape}, faces {faces.shape}. Allowed: finite points (n, 3) with faces "
            "(m, 3), or triangles (m, 3, 3), m ≥ 1."
        )
    if faces.min() < 0 or faces.max() >= len(points):
        raise InputError(f"Mesh wall given: faces name points {faces.min()}–{faces.max()} of {len(points)}.")
    return pv.PolyData.from_regular_faces(points, faces)


_LOCAL: dict[str, Callable[[Mapping[str, Any]], pv.PolyData]] = {
    "cone": _cone,
    "cylinder": _cylinder,
    "disc": _disc,
    "plane": _plane,
}


def _length(wall: Mapping[str, Any], name: str) -> float:
    value = wall.get(name)
    if not isinstance(value, (int, float, np.number)) or not np.isfinite(value) or value <= 0:
        raise InputError(f"{name} of a {wall.get('kind')} wall given: {value!r}. Allowed: a positive length in metres.")
    return float(value)


def _ends(wall: Mapping[str, Any]) -> tuple[float, float]:
    low, high = wall.get("low"), wall.get("high")
    numbers = all(isinstance(end, (int, float, np.number)) and np.isfinite(end) for end in (low, high))
    if not numbers or not low < high:  # type: ignore[operator]
        raise InputError(
            f"Ends of a {wall.get('kind')} wall given: low={low!r}, high={high!r}. Allowed: low < high [m]."
        )
    return float(low), float(high)  # type: ignore[arg-type]


def _vector(wall: Mapping[str, Any], name: str, usual: tuple[float, float, float]) -> NDArray[np.float64]:
    given = wall.get(name, wall.get("normal", usual) if name == "axis" else usual)
    vector = np.asarray(given, dtype=float)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InputError(f"{name} of a {wall.get('kind')} wall given: {given!r}. Allowed: three finite numbers.")
    return vector


def _turn(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a rotation that carries +z to `axis`, shape (3, 3)."""
    length = float(np.linalg.norm(axis))
    if length == 0.0:
        raise InputError("axis of a wall given: (0, 0, 0). Allowed: a vector that isn't zero.")
    along = axis / length
    # Any direction not along the axis will do: walls of revolution look the same about it.
    helper = np.eye(3)[int(np.argmin(np.abs(along)))]
    across = np.cross(helper, along)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(along, across), along], axis=1)
