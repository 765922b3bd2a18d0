"""The kernel side of triangle meshes: the nearest feature of a facet, and whether it is this facet's to count."""

import taichi as ti

from taichidem.contact import vec3
from taichidem.shapes.sphere import Nearest

OVERLAP = 1e-9  # share of the grain's radius by which faces, edges and corners overlap, so that none is ever missed

# Row 3 k + s of the table of sides: side s of facet k, and the corner where it begins.
SIDE_COLUMNS = {
    "start": vec3,
    "end": vec3,
    "inward": vec3,  # in the facet's plane, across the edge, into the facet
    "other": vec3,  # the same for the facet beyond the edge; zero at a free edge
    "flat": ti.i32,  # both facets lie in one plane
    "owned": ti.i32,  # the edge counts through this facet
    "start_corner": ti.i32,  # which corner of the facet the edge starts and ends at
    "end_corner": ti.i32,
    "corner_owned": ti.i32,
    "corner_first": ti.i32,  # rows of the edges that leave the corner
    "corner_last": ti.i32,
}


@ti.data_oriented
class FacetKind:
    """Facets of meshes; `sides` has three rows a facet, `corner_edges` the edges that leave each corner."""

    name = "facet"
    bend = 0  # flat and convex
    columns = {"normal": vec3}

    def __init__(self, table, sides, corner_edges) -> None:
        self.table = table
        self.sides = sides
        self.corner_edges = corner_edges

    @ti.func
    def nearest(self, k, position, radius):
        """Return the nearest point of a facet; `counts` is 1 if this facet answers for it, 2 if with its face."""
        normal = self.table[k].normal
        height = (position - self.sides[3 * k].start).dot(normal)
        best = Nearest(point=position - height * normal, normal=normal, distance=ti.abs(height), counts=2)
        if height < 0.0:
            best.normal = -normal
        face = 1
        edge = Nearest(point=position, normal=normal, distance=1e300, counts=0)
        for side in range(3 * k, 3 * k + 3):
            inside = (position - self.sides[side].start).dot(self.sides[side].inward)
            if inside <= 0.0:
                if inside < -OVERLAP * radius:
                    face = 0
                self._try_edge(k, side, position, OVERLAP * radius, edge)
        if face == 0:
            best = edge
        return best

    @ti.func
    def _try_edge(self, k, side, position, slack, best: ti.template()):
        start = self.sides[side].start
        end = self.sides[side].end
        along = end - start
        from_start = (position - start).dot(along)
        from_end = (position - end).dot(-along)
        point = start
        corner = self.sides[side].start_corner
        if from_start > 0.0:
            point = end
            corner = self.sides[side].end_corner
        counts = 0
        within = from_start > 0.0 and from_end > 0.0
        if within:
            point = start + (from_start / along.dot(along)) * along
            if self.sides[side].owned == 1 and (position - start).dot(self.sides[side].other) <= slack:
                counts = 1
        apart = position - point
        distance = ti.sqrt(apart.dot(apart))
        if distance < best.distance:
            best.distance = distance
            best.point = point
            if distance > 0.0:
                best.normal = apart * (1.0 / distance)
            if not within:
                counts = self._corner_counts(3 * k + corner, apart, slack)
            best.counts = counts

    @ti.func
    def _corner_counts(self, row, away, slack):
        counts = self.sides[row].corner_owned
        for e in range(self.sides[row].corner_first, self.sides[row].corner_last):
            along = self.corner_edges[e].along
            if away.dot(along) > slack * along.norm():
                counts = 0
        return counts
