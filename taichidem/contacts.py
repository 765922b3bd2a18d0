"""Find out which listed pairs touch, and turn each contact into forces by the law."""

from typing import Any

import taichi as ti

from taichidem.contact import Body, Contact, Holding, Wrench, applied, vec3
from taichidem.integrate import rotate
from taichidem.pushes import Pushes
from taichidem.shapes.sphere import Place
from taichidem.state import OnTables, Status

SAME_POINT = 1e-7  # share of the radius within which two points of walls are one point
LARGEST_OVERLAP = 0.5  # share of the radius beyond which a contact law means nothing


@ti.data_oriented
class Contacts(OnTables):
    """The force evaluation of one element with all its listed partners, and the sums over a body."""

    def __init__(self, state, law, shape, wall_motion) -> None:
        super().__init__(state)
        self.pushes: Any = None if self.single else Pushes(state)
        self.wall_motion = wall_motion
        self.law = law
        self.shape = shape

    @ti.func
    def body_of(self, e):
        """Return the body an element belongs to."""
        i = e
        if ti.static(not self.single):
            i = self.owned[e].body
        return i

    @ti.func
    def place(self, e):
        """Return where an element is."""
        position = vec3(0.0)
        if ti.static(self.single):
            position = self.bodies[e].position
        else:
            position = self.owned[e].position
        return Place(row=e, position=position, radius=self.elements[e].radius)

    @ti.func
    def follow(self, e):
        """Put an element where its body now is, and empty what partners will add to it."""
        if ti.static(not self.single):
            i = self.owned[e].body
            offset = rotate(self.rotors[i].orientation, self.owned[e].offset)
            self.owned[e].position = self.bodies[i].position + offset
            self.loads[e].force = vec3(0.0)
            self.loads[e].torque = vec3(0.0)

    @ti.func
    def arm(self, e, i):
        """Return the vector from a body's centre to one of its elements; zero for single spheres."""
        arm = vec3(0.0)
        if ti.static(not self.single):
            arm = self.owned[e].position - self.bodies[i].position
        return arm

    @ti.func
    def body_load(self, w, i, radius):
        """Return the wrench of the body effects on a body."""
        mass = 1.0 / self.bodies[i].inverse_mass
        b = Body(
            position=self.bodies[i].position,
            velocity=self.bodies[i].velocity,
            spin=self.bodies[i].spin,
            mass=mass,
            radius=radius,
            time=self.worlds[w].step * self.worlds[w].dt,
            gravity=vec3(0.0),
        )
        return self.law.body_wrench(w, b)

    @ti.func
    def inverse_mass_along(self, i, arm, normal):
        """Return 1/m + (r × n)·I⁻¹ (r × n), how much a push along n at the arm r moves the point it acts on [1/kg]."""
        turn = arm.cross(normal)
        return self.bodies[i].inverse_mass + turn.dot(applied(self.rotors[i].mobility, turn))

    @ti.func
    def mass_to_stop(self, w, s, kept, i, partner, j, c, own_only: ti.template(), pushed: ti.template()):
        """Return the mass that the contact in slot s decelerates, which rotation makes smaller than that of the bodies [kg].

        With it the dashpot, made for two centres on the line of the push, realises the coefficient of restitution off it.
        """
        mass = c.mass
        with_body = ti.cast(partner >= 0, ti.i32)
        if ti.static(self.single):
            inverse = self.inverse_mass_along(i, c.lever_i, c.normal)
            if with_body == 1:
                inverse += self.inverse_mass_along(j, c.lever_j, c.normal)
            mass = 1.0 / inverse
        else:
            evaluation = self.worlds[w].evaluation
            is_new = ti.cast(self.slots[kept].stamp < evaluation - 1, ti.i32)
            mass = self.pushes.mass(s, i, j, with_body, c, evaluation, is_new)
            turn_i, turn_j = c.lever_i.cross(c.normal), c.normal.cross(c.lever_j)
            if ti.static(own_only):
                pushed[s].kept = kept
                pushed[s].normal = c.normal
                pushed[s].turn_i = turn_i
                pushed[s].turn_j = turn_j
            else:
                self.pushes.note(s, i, j, with_body, c.normal, turn_i, turn_j, evaluation)
        return mass

    @ti.func
    def hold_curvature(self, w, slot, c: ti.template(), is_new):
        """Let R* follow the curvature slowly.

        Within an impact it stays nearly as it was at touch, so that the force nearly has a potential; a body that rolls from its
        tip to its side has its curvature there all the same.
        """
        if not is_new:
            share = self.worlds[w].curvature_share
            c.radius_i = self.axes[slot].radius_i + share * (c.radius_i - self.axes[slot].radius_i)
            c.radius_j = self.axes[slot].radius_j + share * (c.radius_j - self.axes[slot].radius_j)
        self.axes[slot].radius_i = c.radius_i
        self.axes[slot].radius_j = c.radius_j
        c.radius = self.shape.combined(c.radius_i, c.radius_j)

    @ti.func
    def memory_slot(self, e, element, slot, counts):
        """Return the slot that keeps a contact's memory: a face within a flat patch shares that of the patch."""
        kept = slot
        patch = self.wall_elements[element].patch
        if counts == 2 and patch >= 0:
            for s in range(self.elements[e].slots_from, slot):
                if self.slots[s].partner == -1 - patch:
                    kept = s
        return kept

    @ti.func
    def same_point(self, point, first, second, radius):
        """Return 1 if a wall's point is one of two that the element touches already."""
        one, two = point - first, point - second
        near = SAME_POINT * radius
        return ti.cast(ti.min(one.dot(one), two.dot(two)) < near * near, ti.i32)

    @ti.func
    def act(self, w, e, dt, own_only: ti.template(), pushed: ti.template()):
        """Evaluate every pair that element e owns.

        With `own_only` the reaction on partners is left in the table `pushed` (a row per slot) for a later gathering;
        otherwise it is added to the partners straight away, which needs one thread per world.
        """
        i = self.body_of(e)
        a = self.place(e)
        arm_i = self.arm(e, i)
        velocity = self.bodies[i].velocity
        spin = self.bodies[i].spin
        inverse_mass = self.bodies[i].inverse_mass
        evaluation = self.worlds[w].evaluation
        reach = self.worlds[w].reach
        flow = 0.0
        time = self.worlds[w].step * self.worlds[w].dt
        total = Wrench(force=vec3(0.0), torque=vec3(0.0))
        spoken, spoken_before = vec3(1e300), vec3(1e300)
        if ti.static(self.single):
            total = self.body_load(w, e, self.shape.size(a))
        for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
            partner = self.slots[s].partner
            kept = s
            j = 0
            c = Contact(inverse_mass_i=inverse_mass, spin_i=spin, dt=dt)
            c.radius = self.slots[s].radius
            c.mass = self.slots[s].mass
            if partner >= 0:
                self.shape.touch(s, a, self.place(partner), c, reach)
                if c.touching == 1:
                    j = self.body_of(partner)
                    c.lever_i += arm_i
                    c.lever_j += self.arm(partner, j)
                    c.spin_j = self.bodies[j].spin
                    c.inverse_mass_j = self.bodies[j].inverse_mass
                    c.velocity = velocity - self.bodies[j].velocity + spin.cross(c.lever_i) - c.spin_j.cross(c.lever_j)
            else:
                element = -1 - partner
                near = self.shape.touch_wall(s, a, element, time, c, reach)
                if c.touching == 1:
                    kept = self.memory_slot(e, element, s, near.counts)
                    if kept != s and self.slots[kept].stamp == evaluation:
                        c.touching = 0  # another facet of this flat patch has spoken for it
                    if self.same_point(near.point, spoken, spoken_before, a.radius) == 1:
                        c.touching = 0  # straight over an edge rounding may let face and corner, or two walls, speak
                if c.touching == 1:
                    spoken_before = spoken
                    spoken = near.point
                    c.lever_i += arm_i
                    c.lever_j = self.wall_motion.arm(element, near.point)
                    c.spin_j = self.wall_motion.spin(element)
                    c.velocity = velocity + spin.cross(c.lever_i) - self.wall_motion.velocity(element, near.point)
            if ti.static(own_only):
                pushed[s].force = vec3(0.0)
                pushed[s].torque = vec3(0.0)
                pushed[s].change = 0.0
                if ti.static(not self.single):
                    pushed[s].kept = -1
            if c.touching == 1:
                if ti.static(self.kind == "superquadric"):
                    self.hold_curvature(w, kept, c, self.slots[kept].stamp < evaluation - 1)
                if ti.static(not self.round):
                    c.mass = self.mass_to_stop(w, s, kept, i, partner, j, c, own_only, pushed)
                if self.slots[kept].stamp < evaluation - 1:
                    self.law.forget(kept)
                self.slots[kept].stamp = evaluation
                smaller = self.shape.thickness(a)
                if partner >= 0:
                    smaller = ti.min(smaller, self.shape.thickness(self.place(partner)))
                if c.overlap > LARGEST_OVERLAP * smaller:
                    self.worlds[w].status = int(Status.OVERLAP)
                    ti.atomic_max(self.worlds[w].largest_overlap, c.overlap)
                h = Holding(held_i=0.0)
                if ti.static(self.carries):
                    h.held_i = self.amounts[i].held
                    h.size_i = self.labels[i].radius
                    if partner >= 0:
                        h.held_j = self.amounts[j].held
                        h.size_j = self.labels[j].radius
                part = self.law.contact_wrench(self.slots[s].row, kept, c, h)
                total.force += part.force
                total.torque += c.lever_i.cross(part.force) + part.torque
                reaction = c.lever_j.cross(part.force) + part.torque
                flow += h.change_i
                if ti.static(own_only):
                    pushed[s].force = part.force
                    pushed[s].torque = reaction
                    pushed[s].change = h.change_j
                elif partner < 0:
                    self.wall_motion.feel(-1 - partner, part.force, reaction)
                else:
                    # Plain assignment: `+=` on a table is atomic in Taichi, even where one thread owns the world.
                    self.loads[partner].force = self.loads[partner].force - part.force
                    self.loads[partner].torque = self.loads[partner].torque - reaction
                    if ti.static(self.carries):
                        self.flows[partner].change = self.flows[partner].change + h.change_j
        if ti.static(not own_only):
            # Partners come after their owners, so all reactions on e are in by now.
            total.force += self.loads[e].force
            total.torque += self.loads[e].torque
        self.loads[e].force = total.force
        self.loads[e].torque = total.torque
        if ti.static(self.carries):
            flow += self.release_lost(e, evaluation, own_only, pushed)
            self.flows[e].change = flow + (0.0 if ti.static(own_only) else self.flows[e].change)
            if ti.static(self.single and not own_only):
                self.settle_amount(e)

    @ti.func
    def release_lost(self, e, evaluation, own_only: ti.template(), pushed: ti.template()):
        """Give back what contacts held that were there in the last evaluation and are not in this one.

        A pair may part beyond the reach in one step, a mesh hands a grain from face to edge, and a wall may be taken away.
        The skin keeps such a pair listed for the evaluation that finds it gone.
        """
        flow = 0.0
        for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
            if self.slots[s].stamp == evaluation - 1:
                partner = self.slots[s].partner
                h = Holding(held_i=0.0)
                self.law.release(s, h, partner < 0)
                flow += h.change_i
                if ti.static(own_only):
                    pushed[s].change = h.change_j
                elif partner >= 0:
                    self.flows[partner].change = self.flows[partner].change + h.change_j
        return flow

    @ti.func
    def settle_amount(self, e):
        """Let a body take over what its contacts changed of the amount it carries; no contact of it is left to ask."""
        i = self.body_of(e)
        self.amounts[i].held = self.amounts[i].held + self.flows[e].change
        self.flows[e].change = 0.0

    @ti.func
    def collect(self, w):
        """Add up, for every composed body, the body effects and what its elements receive."""
        base = self.worlds[w].body_base
        for i in range(base, base + self.worlds[w].bodies):
            total = self.body_load(w, i, self.labels[i].radius)
            self.rotors[i].force = total.force
            self.rotors[i].torque = total.torque
        base = self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements):
            i = self.owned[e].body
            self.rotors[i].force = self.rotors[i].force + self.loads[e].force
            self.rotors[i].torque = self.rotors[i].torque + self.loads[e].torque
            if ti.static(self.carries):
                self.settle_amount(e)
