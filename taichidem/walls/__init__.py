"""Rigid walls that may move, turn and be removed: plane, disc, cylinder, cone, triangle mesh."""

from taichidem.walls.base import Motion, Wall
from taichidem.walls.facet import FacetKind
from taichidem.walls.mesh import Mesh
from taichidem.walls.plane import Plane, PlaneKind
from taichidem.walls.revolved import Cone, Cylinder, Disc, RevolvedKind, cup

KINDS = (PlaneKind, RevolvedKind, FacetKind)

__all__ = [
    "KINDS",
    "Cone",
    "Cylinder",
    "Disc",
    "FacetKind",
    "Mesh",
    "Motion",
    "Plane",
    "PlaneKind",
    "RevolvedKind",
    "Wall",
    "cup",
]
