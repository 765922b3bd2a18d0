"""What a superquadric shows in a direction: support point, extent, radii of curvature."""

import taichi as ti

from taichidem.contact import applied, vec3
from taichidem.shapes.homogeneous import nested_norm
from taichidem.state import OnTables

SMALLEST_CURVATURE_RADIUS, LARGEST_CURVATURE_RADIUS = 0.2, 4.0  # of the radius of the sphere of equal volume
SMALL_MOVE = 1e-5  # of the size, of a support point, below which surfaces are taken as bent evenly

# What a superquadric shows in a direction: its support point from its centre [m], the extent along the direction [m], and
# how the point moves as the direction turns towards t₁ and t₂, the matrix of radii of curvature [m].
Side = ti.types.struct(extent=ti.f64, point=vec3, r_11=ti.f64, r_12=ti.f64, r_22=ti.f64)


@ti.func
def tangents(n):
    """Return two directions that complete a unit vector to a right-handed frame.

    Source: Duff et al. (2017), JCGT 6(1).
    """
    sign = ti.select(n[2] < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return vec3(1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]), vec3(b, sign + n[1] * n[1] * a, -n[1])


@ti.data_oriented
class SuperquadricForm(OnTables):
    """The geometry of the elements in the table of forms."""

    @ti.func
    def combined(self, radius_i, radius_j):
        """Return R* of two radii of curvature, of which that of a wall is 0 [m]."""
        radius = radius_i
        if radius_j > 0.0:
            radius = radius_i * radius_j / (radius_i + radius_j)
        return radius

    @ti.func
    def pair_radius(self, a, b):
        """Return 0: R* depends on where the bodies touch."""
        return 0.0

    @ti.func
    def thickness(self, a):
        """Return what overlaps are measured against, the smallest semi-axis [m]."""
        return self.forms[a.row].axes.min()

    @ti.func
    def size(self, a):
        """Return the radius of the sphere of equal volume [m]."""
        return self.forms[a.row].size

    @ti.func
    def side(self, row, direction, first, second):
        """Return what an element shows in a direction; `first` and `second` are tangents to it."""
        s = Side(extent=0.0)
        if self.forms[row].ellipsoid == 1:
            spread = self.forms[row].spread
            away = applied(spread, direction)
            s.extent = ti.sqrt(direction.dot(away))
            inverse = 1.0 / s.extent
            s.point = inverse * away
            along = applied(spread, first)
            one, two = s.point.dot(first), s.point.dot(second)
            s.r_11 = inverse * (along.dot(first) - one * one)
            s.r_12 = inverse * (along.dot(second) - one * two)
            s.r_22 = inverse * (second.dot(applied(spread, second)) - two * two)
        else:
            turn = self.rotors[row].rotation
            back = turn.transpose()
            dual = self.forms[row].dual
            norm = nested_norm(self.forms[row].axes, dual[0], dual[1], back @ direction)
            s.extent = norm.value
            s.point = turn @ norm.gradient
            along_1, along_2 = turn @ norm.along_1, turn @ norm.along_2
            one, two = along_1.dot(first), along_1.dot(second)
            three, four = along_2.dot(first), along_2.dot(second)
            s.r_11 = norm.bend_1 * one * one + norm.bend_2 * three * three
            s.r_12 = norm.bend_1 * one * two + norm.bend_2 * three * four
            s.r_22 = norm.bend_1 * two * two + norm.bend_2 * four * four
        return s

    @ti.func
    def curvature_radius(self, row, s):
        """Return one over the root of Gauss' curvature, within limits [m]."""
        return self.limited(row, ti.sqrt(ti.max(s.r_11 * s.r_22 - s.r_12 * s.r_12, 0.0)))

    @ti.func
    def limited(self, row, radius):
        """Return a radius of curvature within limits: for contacts faces are not flat for ever, nor edges sharp [m]."""
        size = self.forms[row].size
        return ti.min(ti.max(radius, SMALLEST_CURVATURE_RADIUS * size), LARGEST_CURVATURE_RADIUS * size)

    @ti.func
    def step_on_surface(self, row, point, moved, sign, normal, step):
        """Return the step of the direction to the normal of a surface where its support point is to move.

        Of a flat face the point moves far while the direction hardly turns, and how far it turns bends strongly: what is
        nearly linear there is not how the point follows the direction, but the direction the point. Both agree for small moves.
        """
        new = step
        if moved > SMALL_MOVE * self.forms[row].size:
            away = sign * self.outward(row, point) - normal
            new = away - away.dot(normal) * normal
        return new

    @ti.func
    def norm_at(self, row, point):
        """Return the scale of the copy of an element through a place given from its centre, with its slope in the body frame."""
        dual = self.forms[row].dual
        back = self.rotors[row].rotation.transpose()
        return nested_norm(
            1.0 / self.forms[row].axes, dual[0] / (dual[0] - 1.0), dual[1] / (dual[1] - 1.0), back @ point
        )

    @ti.func
    def scale_through(self, row, point):
        """Return by which factor an element must be enlarged to reach a place given from its centre."""
        return self.norm_at(row, point).value

    @ti.func
    def outward(self, row, point):
        """Return the normal of the enlarged copy of an element that passes through a place given from its centre."""
        return (self.rotors[row].rotation @ self.norm_at(row, point).gradient).normalized()
