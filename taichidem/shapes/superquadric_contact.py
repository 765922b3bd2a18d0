"""The contact search of superquadrics, between two of them and at walls.

Two convex bodies touch along the direction n in which they overlap least,

    δ(n) = h_i(−n) + h_j(n) − (x_i − x_j)·n → min,  h the support functions,

where the surfaces face each other: their support points lie on one line along n. So the force is the slope of an energy of
δ, and a frictionless collision keeps it, which the midway point between two scaled copies (Podlozhnyuk et al. 2017, doi
10.1007/s40571-016-0131-6) does only to first order in the overlap. Newton's method on the unit sphere finds n, from that of
the last step; where it fails, from the midway point (superquadric_midway.py).
"""

import taichi as ti

from taichidem.contact import Symmetric, applied, is_positive, solved, vec3
from taichidem.shapes.superquadric_form import SuperquadricForm, tangents
from taichidem.shapes.superquadric_midway import midway_point
from taichidem.shapes.superquadric_wall import SuperquadricAtWall

MOST_TRIALS = 40  # of Newton's method, its shortened steps counted; a contact of the last step needs one or two
MOST_EASY_TRIALS = 8
LONGEST_STEP = 0.3  # [rad]
# Steps [rad] below which a last one is taken without looking again; what is left is of second order.
LAST_STEP_ELLIPSOID = 1e-5
LAST_STEP = 1e-10
ROUND_OFF = 1e-15  # of the size, within which two overlaps are equal


@ti.func
def others(v):
    """Return the products (y z, z x, x y) of a vector's components."""
    return vec3(v[1] * v[2], v[2] * v[0], v[0] * v[1])


@ti.func
def newton_step(i, j, overlap, one, two):
    """Return the step of the direction towards both tangents [rad], what it lowers the overlap by [m], and how that bends.

    The overlap bends by the sum of the radii of curvature, less itself, as directions lie on a sphere. Where that is not
    positive both ways (the last answer is 0) a place without a slope is no least overlap, and the step is one of the sum alone.

    Args:
        one, two: distance of the support points across the direction, along its tangents [m].
    """
    r_11, r_12, r_22 = i.r_11 + j.r_11, i.r_12 + j.r_12, i.r_22 + j.r_22
    b_11, b_22 = r_11 - overlap, r_22 - overlap
    convex = ti.cast(b_11 > 0.0 and b_11 * b_22 > r_12 * r_12, ti.i32)
    if convex == 1:
        r_11, r_22 = b_11, b_22
    least = 1e-12 * (r_11 + r_22) * (r_11 + r_22) + 1e-300
    inverse = 1.0 / ti.max(r_11 * r_22 - r_12 * r_12, least)
    p = inverse * (r_22 * one - r_12 * two)
    q = inverse * (r_11 * two - r_12 * one)
    return p, q, 0.5 * (p * one + q * two), convex


@ti.func
def way_down(i, j):
    """Return the direction, along both tangents, in which the overlap bends least: where there is no slope, the way down."""
    angle = 0.5 * ti.atan2(2.0 * (i.r_12 + j.r_12), i.r_11 + j.r_11 - i.r_22 - j.r_22)
    return -ti.sin(angle), ti.cos(angle)


@ti.data_oriented
class SuperquadricContact(SuperquadricForm):
    """The contact search; R* follows from the curvature where they touch."""

    name = "superquadric"

    def __init__(self, state, wall_motion) -> None:
        super().__init__(state)
        self.at_wall = SuperquadricAtWall(state, wall_motion)

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
            found, start = 0, normal
            if ellipsoids:
                found = self.between_ellipsoids(a.row, b.row, apart, reach, normal, c)
            if found == 0:
                normal = start
                self.between_any(a.row, b.row, apart, reach, normal, c)
            self.axes[slot].axis = normal
            if c.touching == 1:
                c.normal = normal
                c.lever_j = c.lever_i + apart
                c.radius = self.combined(c.radius_i, c.radius_j)

    @ti.func
    def between_ellipsoids(self, i, j, apart, reach, normal: ti.template(), c: ti.template()):
        """Search from a good start; return 1 if the contact or a gap was found, 0 where more care is needed.

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
                step, square = vec3(0.0), 2.0
                if is_positive(bend):
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
                    c.radius_i = self.limited(i, self.forms[i].product * inverse_i * inverse_i)
                    c.radius_j = self.limited(j, self.forms[j].product * inverse_j * inverse_j)
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
                p, q, gain, convex = newton_step(i, j, overlap, offset.dot(first), offset.dot(second))
                # Each support point moves by its own radii of curvature times the step.
                moved_i = -((i.r_11 * p + i.r_12 * q) * first + (i.r_12 * p + i.r_22 * q) * second)
                moved_j = (j.r_11 * p + j.r_12 * q) * first + (j.r_12 * p + j.r_22 * q) * second
                step = p * first + q * second
                if not ellipsoids:
                    step = self.step_on_surfaces(a_row, b_row, i, j, moved_i, moved_j, normal, step)
                length = step.norm()
                if length < last_step and convex == 0 and trial < MOST_TRIALS:
                    # Level, but no least overlap, as two long bodies crosswise may be along their centres.
                    aside, along = way_down(i, j)
                    step = LONGEST_STEP * (aside * first + along * second)
                    normal = (best + step).normalized()
                elif length < last_step:
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
    def step_on_surfaces(self, row_i, row_j, i, j, moved_i, moved_j, normal, step):
        """Return the step of the direction that `step_on_surface` finds on the flatter of two surfaces."""
        row, point, moved, sign = row_i, i.point + moved_i, moved_i.norm(), -1.0
        if moved_j.norm() > moved:
            row, point, moved, sign = row_j, j.point + moved_j, moved_j.norm(), 1.0
        return self.step_on_surface(row, point, moved, sign, normal, step)

    @ti.func
    def fill(self, row_i, row_j, i, j, c: ti.template()):
        """Note the contact of two elements and its radii of curvature."""
        c.touching = 1
        c.radius_i = self.curvature_radius(row_i, i)
        c.radius_j = self.curvature_radius(row_j, j)

    @ti.func
    def touch_wall(self, slot, a, element, time, c: ti.template(), reach):
        """Fill the geometry of the contact with a wall, and return its point."""
        return self.at_wall.touch(slot, a, element, time, c, reach)
