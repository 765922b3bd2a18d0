"""Spheres: the contact search between two of them, and between one and the nearest point of a wall."""

import taichi as ti

from taichidem.contact import vec3

# Where an element is: its row, centre [m] and radius [m].
Place = ti.types.struct(row=ti.i32, position=vec3, radius=ti.f64)

# The nearest point of a wall to a place.
Nearest = ti.types.struct(point=vec3, normal=vec3, distance=ti.f64, counts=ti.i32)


@ti.data_oriented
class Sphere:
    """A sphere, given by its centre and radius; its curvature is the same everywhere, so R* is that of the listed pair."""

    name = "sphere"

    def __init__(self, state, wall_motion) -> None:
        self.wall_motion = wall_motion

    @ti.func
    def pair_radius(self, a, b):
        """R* = R_i R_j / (R_i + R_j); a wall has no curvature and counts as radius 0 here [m]."""
        radius = a
        if b > 0.0:
            radius = a * b / (a + b)
        return radius

    @ti.func
    def thickness(self, a):
        """Return what overlaps are measured against [m]."""
        return a.radius

    @ti.func
    def size(self, a):
        """Return the radius of the sphere of equal volume [m]."""
        return a.radius

    @ti.func
    def touch(self, slot, a, b, c: ti.template(), reach):
        """Fill the geometry of the contact between two spheres whose gap is below `reach` [m]."""
        apart = a.position - b.position
        limit = a.radius + b.radius + reach
        square = apart.dot(apart)
        c.touching = 0
        if square < limit * limit and square > 0.0:
            distance = ti.sqrt(square)
            c.touching = 1
            c.normal = apart * (1.0 / distance)
            c.overlap = a.radius + b.radius - distance
            c.lever_i = (0.5 * c.overlap - a.radius) * c.normal
            c.lever_j = (b.radius - 0.5 * c.overlap) * c.normal
            c.radius_i = a.radius
            c.radius_j = b.radius

    @ti.func
    def touch_wall(self, slot, a, element, time, c: ti.template(), reach):
        """Fill the geometry of the contact with a wall, which does not deform, and return its nearest point."""
        c.touching = 0
        near = self.wall_motion.nearest(element, a.position, a.radius, time)
        if near.counts and near.distance < a.radius + reach:
            c.touching = 1
            c.normal = near.normal
            c.overlap = a.radius - near.distance
            c.lever_i = (c.overlap - a.radius) * c.normal
            c.lever_j = vec3(0.0)
            c.radius_i = a.radius
            c.radius_j = 0.0
        return near
