"""The contact search of superquadrics, between two of them and at walls.

Two convex bodies touch along the direction n in which they overlap least,

    δ(n) = h_i(−n) + h_j(n) − (x_i − x_j)·n → min,  h the support functions,

where the surfaces face each other: their support points lie on one line along n. So the force is the slope of an energy of
δ, and a frictionless collision keeps it, which the midway point between two scaled copies (Podlozhnyuk et al. 2017, doi
10.1007/s40571-016-0131-6) does only to first order in the overlap. Newton's method on the unit sphere finds n, from that of
the last step; where it fails, from the midway point (superquadric_midway.py).
"""

import taichi as ti

from taichidem.contact import Symmetric, applied, solved, vec3
from taichidem.shapes.homogeneous import nested_norm
from taichidem.shapes.sphere import Nearest
from taichidem.shapes.superquadric_midway import midway_point
from taichidem.state import OnTables

MOST_TRIALS = 40  # of Newton's method, its halved steps counted; a contact of the last step needs one or two
LONGEST_STEP = 0.3  # [rad]
# Steps [rad] below which a last one is taken without looking again; what is left is of second order.
LAST_STEP_ELLIPSOID = 1e-5
LAST_STEP = 1e-10
ROUND_OFF = 1e-15  # of the size, within which two overlaps are equal
SMALL_MOVE = 1e-5  # of the size, of a support point, below which surfaces are taken as bent evenly
MOST_EASY_TRIALS = 8
MOST_AT_WALL = 40
STILL = 1e-10  # change of the normal at a wall below which it is found
SMALLEST_CURVATURE_RADIUS, LARGEST_CURVATURE_RADIUS = 0.2, 4.0  # of the radius of the sphere of equal volume


@ti.func
def others(v):
    """Return the products (y z, z x, x y) of a vector's components."""
    return vec3(v[1] * v[2], v[2] * v[0], v[0] * v[1])


@ti.func
def newton_step(i, j, overlap, one, two):
    """Return the step of the direction towards both tangents [rad] and what it lowers the overlap by [m].

    Args:
        one, two: distance of the support points across the direction, along its tangents [m].
    """
    # The overlap bends by the sum of the radii of curvature, less itself, as directions lie on a sphere.
    r_11, r_12, r_22 = i.r_11 + j.r_11, i.r_12 + j.r_12, i.r_22 + j.r_22
    if overlap < 0.5 * ti.min(r_11, r_22):
        r_11 -= overlap
        r_22 -= overlap
    least = 1e-12 * (r_11 + r_22) * (r_11 + r_22) + 1e-300
    inverse = 1.0 / ti.max(r_11 * r_22 - r_12 * r_12, least)
    p = inverse * (r_22 * one - r_12 * two)
    q = inverse * (r_11 * two - r_12 * one)
    return p, q, 0.5 * (p * one + q * two)


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
class SuperquadricContact(OnTables):
    """The contact search; R* follows from the curvature where they touch."""

    name = "superquadric"

    def __init__(self, state, wall_motion) -> None:
        super().__init__(state)
        self.wall_motion = wall_motion

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
    def touch(self, slot, a, b, c: ti.template(), reach):
        """Fill the geometry of the contact between two superquadrics whose gap is below `reach` [m]."""
        c.touching = 0
        apart = a.position - b.position
        limit = a.radius + b.radius + reach
        square = apart.dot(apart)
        if square < limit * limit and square > 0.0:
            normal = self.axes[slot].axis
            if normal.dot(normal) == 0.0:
                normal = apart * (1.0 / ti.sqrt(square))
            ellipsoids = self.forms[a.row].ellipsoid + self.forms[b.row].ellipsoid == 2
            found = 0
            if ellipsoids:
                found = self.between_ellipsoids(a.row, b.row, apart, reach, normal, c)
            if found == 0:
                self.between_any(a.row, b.row, apart, reach, normal, c)
            self.axes[slot].axis = normal
            c.normal = normal
            c.lever_j = c.lever_i + apart
            c.radius = c.radius_i * c.radius_j / (c.radius_i + c.radius_j)

    @ti.func
    def between_ellipsoids(self, i, j, apart, reach, normal: ti.template(), c: ti.template()):
        """Search from a good start, without any care; return 1 if the contact or a gap was found.

        An ellipsoid's support point is A n/h, h = √(n·A n), it moves by (A − s s ᵀ)/h as n turns, and R = a b c/h².
        """
        found, trial = 0, 0
        spread_i, spread_j = self.forms[i].spread, self.forms[j].spread
        while trial < MOST_EASY_TRIALS and found == 0:
            away_i, away_j = applied(spread_i, normal), applied(spread_j, normal)
            extent_i, extent_j = ti.sqrt(normal.dot(away_i)), ti.sqrt(normal.dot(away_j))
            overlap = extent_i + extent_j - apart.dot(normal)
            if overlap < -reach:
                found = 1
            else:
                inverse_i, inverse_j = 1.0 / extent_i, 1.0 / extent_j
                point_i, point_j = -inverse_i * away_i, inverse_j * away_j
                offset = apart + point_i - point_j
                across = offset + overlap * normal
                # The radii of curvature of both, less the overlap as directions lie on a sphere; along n anything but 0.
                stiff = extent_i + extent_j
                bend = Symmetric(
                    diagonal=inverse_i * (spread_i.diagonal - point_i * point_i)
                    + inverse_j * (spread_j.diagonal - point_j * point_j)
                    + stiff * normal * normal
                    - overlap,
                    rest=inverse_i * (spread_i.rest - others(point_i))
                    + inverse_j * (spread_j.rest - others(point_j))
                    + stiff * others(normal),
                )
                step = solved(bend, across)
                step -= step.dot(normal) * normal
                square = step.dot(step)
                if square < LAST_STEP_ELLIPSOID * LAST_STEP_ELLIPSOID:
                    found = 1
                    c.touching = 1
                    c.overlap = overlap - 0.5 * step.dot(across)
                    moved = inverse_j * (applied(spread_j, step) - point_j.dot(step) * point_j)
                    moved -= inverse_i * (applied(spread_i, step) - point_i.dot(step) * point_i)
                    c.lever_i = 0.5 * (point_i + point_j + moved - apart)
                    volume_i, volume_j = self.forms[i].axes, self.forms[j].axes
                    c.radius_i = self.limited(i, volume_i[0] * volume_i[1] * volume_i[2] * inverse_i * inverse_i)
                    c.radius_j = self.limited(j, volume_j[0] * volume_j[1] * volume_j[2] * inverse_j * inverse_j)
                if square < 1.0:
                    normal = (normal + step).normalized()
                else:
                    trial = MOST_EASY_TRIALS
            trial += 1
        return found

    @ti.func
    def between_any(self, a_row, b_row, apart, reach, normal: ti.template(), c: ti.template()):
        """Search with care: no step is taken that doesn't lower the overlap, and the midway point helps where all else fails."""
        ellipsoids = self.forms[a_row].ellipsoid + self.forms[b_row].ellipsoid == 2
        last_step = LAST_STEP_ELLIPSOID if ellipsoids else LAST_STEP
        size = ti.min(self.forms[a_row].size, self.forms[b_row].size)
        # The direction of least overlap so far, and the share that is tried of the step from there.
        best, lowest, step, share = normal, 1e300, vec3(0.0), 1.0
        meeting, common = vec3(0.0), normal  # the midway point and its normal, once they are asked for
        trial, searching = 0, 1
        while searching == 1:
            if trial == MOST_TRIALS:
                meeting, common = midway_point(self.forms, a_row, b_row, self.rotors, apart)
            if trial == MOST_TRIALS or trial == 2 * MOST_TRIALS:
                normal, lowest = common, 1e300
            first, second = tangents(normal)
            i = self.side(a_row, -normal, first, second)
            j = self.side(b_row, normal, first, second)
            overlap = i.extent + j.extent - apart.dot(normal)
            if overlap < -reach:
                best, searching = normal, 0  # the bodies are apart in this direction
            elif trial == 2 * MOST_TRIALS:
                best, searching = normal, 0
                self.fill(a_row, b_row, i, j, c)
                c.overlap = overlap
                c.lever_i = meeting
            elif overlap > lowest + ROUND_OFF * size:
                share *= 0.3
                normal = (best + share * step).normalized()
            else:
                best, lowest, share = normal, overlap, 1.0
                offset = apart + i.point - j.point
                p, q, gain = newton_step(i, j, overlap, offset.dot(first), offset.dot(second))
                # Each support point moves by its own radii of curvature times the step.
                moved_i = -((i.r_11 * p + i.r_12 * q) * first + (i.r_12 * p + i.r_22 * q) * second)
                moved_j = (j.r_11 * p + j.r_12 * q) * first + (j.r_12 * p + j.r_22 * q) * second
                step = p * first + q * second
                if not ellipsoids:
                    step = self.step_on_surface(a_row, b_row, i, j, moved_i, moved_j, normal, step)
                length = step.norm()
                if length < last_step:
                    best, searching = (normal + step).normalized(), 0
                    self.fill(a_row, b_row, i, j, c)
                    c.overlap = overlap - gain
                    c.lever_i = 0.5 * (i.point + moved_i + j.point + moved_j - apart)
                else:
                    step *= ti.min(1.0, LONGEST_STEP / length)
                    normal = (best + step).normalized()
            trial += 1
        normal = best

    @ti.func
    def step_on_surface(self, row_i, row_j, i, j, moved_i, moved_j, normal, step):
        """Return the step of the direction to the normal of the flatter surface where its support point is to move.

        Of a flat face the point moves far while the direction hardly turns, and how far it turns bends strongly: what is
        nearly linear there is not how the point follows the direction, but the direction the point. Both agree for small moves.
        """
        row, point, sign = row_i, i.point + moved_i, -1.0
        moved = moved_i.norm()
        if moved_j.norm() > moved:
            row, point, sign = row_j, j.point + moved_j, 1.0
            moved = moved_j.norm()
        new = step
        if moved > SMALL_MOVE * self.forms[row].size:
            turn = self.rotors[row].rotation
            dual = self.forms[row].dual
            inverse = 1.0 / self.forms[row].axes
            norm = nested_norm(inverse, dual[0] / (dual[0] - 1.0), dual[1] / (dual[1] - 1.0), turn.transpose() @ point)
            away = sign * (turn @ norm.gradient).normalized() - normal
            new = away - away.dot(normal) * normal
        return new

    @ti.func
    def fill(self, row_i, row_j, i, j, c: ti.template()):
        """Note the contact of two elements and its radii of curvature."""
        c.touching = 1
        c.radius_i = self.curvature_radius(row_i, i)
        c.radius_j = self.curvature_radius(row_j, j)

    @ti.func
    def touch_wall(self, slot, a, element, time, c: ti.template(), reach):
        """Fill the geometry of the contact with a wall, and return its point.

        The body is replaced by the sphere that fits its surface where it is nearest to the wall, until that sphere's own
        nearest point of the wall lies where the body is nearest: so every kind of wall works with every shape, and which of
        the facets, edges and corners of a mesh counts is decided as for spheres. Aitken's relaxation makes it converge
        where the fit jumps, as at edges under flat faces.
        """
        c.touching = 0
        near = self.wall_motion.nearest(element, a.position, a.radius, time)
        if near.distance < a.radius + reach:
            normal = self.axes[slot].axis
            if normal.dot(normal) == 0.0:
                normal = near.normal
            size = self.forms[a.row].size
            change, share = vec3(0.0), 1.0
            searching = 1
            trial = 0
            while searching == 1:
                first, second = tangents(normal)
                s = self.side(a.row, -normal, first, second)
                radius = 0.5 * (s.r_11 + s.r_22)
                radius = ti.min(ti.max(radius, SMALLEST_CURVATURE_RADIUS * size), LARGEST_CURVATURE_RADIUS * size)
                surface = a.position + s.point
                near = self.wall_motion.nearest(element, surface + radius * normal, radius, time)
                new = near.normal - normal
                trial += 1
                if new.dot(new) < STILL * STILL or trial == MOST_AT_WALL:
                    searching = 0
                    c.overlap = radius - near.distance
                    if near.counts and c.overlap > -reach:
                        c.touching = 1
                        c.normal = near.normal
                        c.lever_i = near.point - a.position
                        c.lever_j = vec3(0.0)
                        c.radius_i = self.curvature_radius(a.row, s)
                        c.radius_j = 0.0
                        c.radius = c.radius_i
                elif trial > 1:
                    turn = new - change
                    share = ti.min(ti.max(-share * change.dot(turn) / ti.max(turn.dot(turn), 1e-300), 0.02), 2.0)
                change = new
                normal = (normal + share * new).normalized()
            self.axes[slot].axis = normal
        return near
