"""Where a superquadric meets a wall of any kind.

A small sphere that touches the surface from inside, where the body's normal is n, has a nearest point of the wall and a
normal there. Where both normals are one the body overlaps the wall most, or is nearest to it. So every kind of wall works with
every shape, and which of the facets, edges and corners of a mesh counts is decided as for spheres.
"""

import taichi as ti

from taichidem.contact import vec3
from taichidem.shapes.superquadric_form import SuperquadricForm, tangents

MOST_TRIALS = 60
LONGEST_STEP = 0.3  # [rad]
STILL = 1e-8  # difference of the normals of body and wall below which they are one
NEARLY_STILL = 1e-3  # below which a search that does not end is believed
INNER_SPHERE = 0.8  # radius of the sphere inside, of the smallest semi-axis
BESIDE = 1e-4  # of that radius, how far beside it the wall is asked again
SMALLEST_SHARE = 1e-3  # of a step
MOST_SWEEPS = 60
SHORTEST = 1e-4  # of the radius of the sphere inside, a step down the scale
TRUSTED = 1.2  # the body's own normal is taken where it tells of so many times the overlap that the search found
NEARLY_EQUAL = 1.0 - 1e-12  # cosine of two directions that lead to the same end

# Where a search ends: the wall's point and normal, the overlap along it, whether this wall element answers for the point, and
# the radius of curvature of the body.
Meeting = ti.types.struct(point=vec3, normal=vec3, overlap=ti.f64, counts=ti.i32, curvature=ti.f64)


@ti.data_oriented
class SuperquadricAtWall(SuperquadricForm):
    """The search at walls; what it finds of a wall at rest is where the last step left it."""

    def __init__(self, state, wall_motion) -> None:
        super().__init__(state)
        self.wall_motion = wall_motion

    @ti.func
    def touch(self, slot, a, element, time, c: ti.template(), reach):
        """Fill the geometry of the contact with a wall, which does not deform, and return its point."""
        c.touching = 0
        near = self.wall_motion.nearest(element, a.position, a.radius, time)
        if near.distance < a.radius + reach:
            bend = self.wall_motion.bend(element)
            # A flat face may face a tube or rim at several points, of which each search finds one.
            several = bend == 1 and self.forms[a.row].ellipsoid == 0
            last = self.axes[slot].axis
            fresh = near.normal
            if several:
                near.point = self.most_inside(a, element, time)
            if bend >= 0:
                fresh = -self.outward(a.row, near.point - a.position)
            best = Meeting(overlap=-1e300)
            for run in range(2):
                start = last if run == 0 else fresh
                known = run == 0 and last.dot(last) > 0.0
                lost = run == 1 and (several or best.overlap <= -reach) and last.dot(fresh) < NEARLY_EQUAL
                if known or lost:
                    found = self.search(a, element, time, start)
                    if found.overlap > best.overlap:
                        best = found
            if bend >= 0 and (several or best.overlap < -1e200):
                rough = self.where_deepest(a, element, time, near.point)
                if best.overlap < -1e200 or (rough.overlap > 0.0 and rough.overlap > TRUSTED * best.overlap):
                    best = rough
            self.axes[slot].axis = best.normal
            near.point = best.point
            near.counts = best.counts
            if best.counts > 0 and best.overlap > -reach:
                c.touching = 1
                c.normal = best.normal
                c.overlap = best.overlap
                c.lever_i = best.point - a.position
                c.lever_j = vec3(0.0)
                c.radius_i = best.curvature
                c.radius_j = 0.0
                c.radius = best.curvature
        return near

    @ti.func
    def most_inside(self, a, element, time):
        """Return the wall's point that lies deepest in the body, of those nearest to its corners, edges and faces."""
        best, deepest = a.position, 1e300
        radius = INNER_SPHERE * self.thickness(a)
        for k in range(27):
            if k != 13:
                toward = vec3(k % 3 - 1.0, (k // 3) % 3 - 1.0, k // 9 - 1.0) * self.forms[a.row].axes
                toward = self.rotors[a.row].rotation @ toward
                corner = a.position + toward / self.scale_through(a.row, toward)
                place = self.wall_motion.nearest(element, corner, radius, time).point - a.position
                scale = self.scale_through(a.row, place)
                if scale < deepest:
                    deepest = scale
                    best = a.position + place
        return best

    @ti.func
    def where_deepest(self, a, element, time, start):
        """Return the meeting with the body's own normal where the wall lies deepest in it, of which there always is one.

        The point goes down the scale of the body's copies through it, along the wall.
        """
        radius = INNER_SPHERE * self.thickness(a)
        normal = -self.outward(a.row, start - a.position)
        near = self.wall_motion.nearest(element, start + 0.1 * radius * normal, radius, time)
        scale = self.scale_through(a.row, near.point - a.position)
        length, sweep = radius, 0
        while sweep < MOST_SWEEPS and length > SHORTEST * radius:
            normal = -self.outward(a.row, near.point - a.position)
            tried = self.wall_motion.nearest(element, near.point + length * normal, radius, time)
            smaller = self.scale_through(a.row, tried.point - a.position)
            if smaller < scale:
                near, scale = tried, smaller
                length *= 1.5
            else:
                length *= 0.3
            sweep += 1
        normal = -self.outward(a.row, near.point - a.position)
        first, second = tangents(normal)
        s = self.side(a.row, -normal, first, second)
        overlap = (near.point - a.position - s.point).dot(normal)
        curvature = self.curvature_radius(a.row, s)
        return Meeting(point=near.point, normal=normal, overlap=overlap, counts=near.counts, curvature=curvature)

    @ti.func
    def search(self, a, element, time, start):
        """Return where the normals of body and wall are one, by Newton's method from a direction.

        How the wall's normal follows the sphere is asked of two spheres beside it.
        """
        radius = INNER_SPHERE * self.thickness(a)
        best, normal, step, share, lowest = start, start, vec3(0.0), 1.0, 1e300
        meeting = Meeting(overlap=-1e300)
        searching, trial = 1, 0
        while searching == 1:
            first, second = tangents(normal)
            s = self.side(a.row, -normal, first, second)
            centre = a.position + s.point + radius * normal
            near = self.wall_motion.nearest(element, centre, radius, time)
            error = near.normal - normal
            square = error.dot(error)
            if square < STILL * STILL or trial == MOST_TRIALS:
                searching = 0
                if square < NEARLY_STILL * NEARLY_STILL:
                    meeting.point = near.point
                    meeting.normal = near.normal
                    meeting.counts = near.counts
                    meeting.overlap = (near.point - a.position - s.point).dot(near.normal)
                    meeting.curvature = self.curvature_radius(a.row, s)
            elif square > lowest and share > SMALLEST_SHARE:
                share *= 0.4
                normal = (best + share * step).normalized()
            else:
                best, lowest, share = normal, square, 1.0
                beside = BESIDE * radius
                one = self.wall_motion.nearest(element, centre + beside * first, radius, time).normal - near.normal
                two = self.wall_motion.nearest(element, centre + beside * second, radius, time).normal - near.normal
                p, q = sphere_step(s, radius, one / beside, two / beside, first, second, error)
                step = p * first + q * second
                if self.forms[a.row].ellipsoid == 0:
                    moved = -((s.r_11 * p + s.r_12 * q) * first + (s.r_12 * p + s.r_22 * q) * second)
                    step = self.step_on_surface(a.row, s.point + moved, moved.norm(), -1.0, normal, step)
                step *= ti.min(1.0, LONGEST_STEP / ti.max(step.norm(), 1e-300))
                normal = (best + step).normalized()
            trial += 1
        return meeting


@ti.func
def sphere_step(s, radius, one, two, first, second, error):
    """Return the step of the direction that takes the difference of the normals away, along two tangents [rad].

    Args:
        s: what the body shows.
        radius: of the sphere inside, whose centre moves by r less the radii of curvature as the direction turns [m].
        one, two: how the wall's normal changes as the centre moves along the tangents [1/m].
        error: the wall's normal less the body's.
    """
    r_11, r_12, r_22 = s.r_11 - radius, s.r_12, s.r_22 - radius
    w_11, w_12, w_21, w_22 = one.dot(first), two.dot(first), one.dot(second), two.dot(second)
    m_11, m_12 = 1.0 + w_11 * r_11 + w_12 * r_12, w_11 * r_12 + w_12 * r_22
    m_21, m_22 = w_21 * r_11 + w_22 * r_12, 1.0 + w_21 * r_12 + w_22 * r_22
    determinant = m_11 * m_22 - m_12 * m_21
    if ti.abs(determinant) < 1e-3:
        m_11, m_12, m_21, m_22, determinant = 1.0, 0.0, 0.0, 1.0, 1.0
    e_1, e_2 = error.dot(first), error.dot(second)
    return (m_22 * e_1 - m_12 * e_2) / determinant, (m_11 * e_2 - m_21 * e_1) / determinant
