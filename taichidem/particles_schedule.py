"""The schedule over particles: a launch per stage, every thread on one world.

Each element evaluates the pairs it owns and leaves the reaction in a row per slot; then every element gathers the
reactions of the pairs in which it is the partner. That sum runs over slots in ascending order, as it does where one
thread walks through the world, so both schedules give the same bits.
"""

import taichi as ti

from taichidem.contact import vec3
from taichidem.state import OnTables, Status


@ti.data_oriented
class ParticlesSchedule(OnTables):
    """Kernels that advance one world by one step, parallel over its elements."""

    def __init__(self, engine) -> None:
        super().__init__(engine.state)
        self.integrator, self.contacts = engine.integrator, engine.contacts
        self.neighbours, self.wall_motion = engine.neighbours, engine.wall_motion
        self.reactions, self.incoming = engine.state.reactions, engine.state.incoming
        self.inbound = engine.state.inbound

    def advance(self, w: int, steps: int) -> None:
        """Advance a world by a number of steps, or until it stops."""
        evaluated = False
        if self.is_fresh(w):
            self.rebuild(w)
            evaluated = self.evaluate(w, 0.0)
        dt = self.step_of(w)
        for s in range(steps):
            if not self.is_running(w):
                break
            if self.drift(w, min(s, 1) + 1):
                self.rebuild(w)
            evaluated = self.evaluate(w, dt)
        if self.is_running(w):
            self.finish(w)
        if evaluated:
            self.gather_walls(w)

    def rebuild(self, w: int) -> None:
        """Rebuild a world's lists: sorting on one thread, the search for pairs on all."""
        self.prepare(w)
        self.count(w)
        self.reserve(w)
        self.fill(w)
        self.link(w)

    def evaluate(self, w: int, dt: float) -> bool:
        """Evaluate all contacts and body effects of a world; return False where it had stopped before."""
        if not self.is_running(w):
            return False
        self.act(w, dt)
        if not self.single:
            self.note_pushes(w)
        self.gather(w)
        if self.has_loaded_wall(w):
            self.gather_walls(w)
        if not self.single:
            self.collect(w)
        return True

    @ti.kernel
    def is_fresh(self, w: ti.i32) -> ti.i32:
        return self.worlds[w].fresh

    @ti.kernel
    def is_running(self, w: ti.i32) -> ti.i32:
        return self.worlds[w].status == int(Status.RUNNING)

    @ti.kernel
    def step_of(self, w: ti.i32) -> ti.f64:
        return self.worlds[w].dt

    @ti.kernel
    def drift(self, w: ti.i32, kicks: ti.i32) -> ti.i32:
        """Move walls and bodies; return 1 if the lists must be rebuilt."""
        dt = self.worlds[w].dt
        self.worlds[w].step = self.worlds[w].step + 1
        self.wall_motion.move(w, dt)
        self.worlds[w].stale = 0
        if self.worlds[w].wall_travel > 0.5 * self.worlds[w].skin:
            self.worlds[w].stale = 1
        base = self.worlds[w].body_base
        for i in range(base, base + self.worlds[w].bodies):
            self.integrator.kick_and_drift(i, dt, kicks)
            if ti.static(self.single):
                if self.neighbours.stale(w, i) == 1:
                    self.worlds[w].stale = 1
        if ti.static(not self.single):
            first = self.worlds[w].element_base
            for e in range(first, first + self.worlds[w].elements):
                self.contacts.follow(e)
                if self.neighbours.stale(w, e) == 1:
                    self.worlds[w].stale = 1
        return self.worlds[w].stale

    @ti.kernel
    def prepare(self, w: ti.i32):
        """Sort bodies and elements by cell, on one thread: the order must not depend on timing."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            self.neighbours.prepare(w)
            self.worlds[w].fresh = 0

    @ti.kernel
    def count(self, w: ti.i32):
        """Count, for every element, the slots it may need."""
        base = self.worlds[w].element_base
        slots = self.worlds[w].slot_base
        for e in range(base, base + self.worlds[w].elements):
            self.elements[e].slots_to = self.neighbours.fill(w, e, slots, False) - slots

    @ti.kernel
    def reserve(self, w: ti.i32):
        """Give every element its range of slots."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            base = self.worlds[w].element_base
            cursor = self.worlds[w].slot_base
            end = cursor + self.worlds[w].slot_capacity
            for e in range(base, base + self.worlds[w].elements):
                self.elements[e].slots_from = cursor
                cursor += self.elements[e].slots_to
                if cursor > end:
                    self.worlds[w].status = int(Status.LIST_FULL)
                    cursor = end
            self.worlds[w].slots = cursor - self.worlds[w].slot_base

    @ti.kernel
    def fill(self, w: ti.i32):
        """List the pairs and carry their memory over."""
        base = self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements):
            self.neighbours.fill(w, e, self.elements[e].slots_from, True)

    @ti.kernel
    def link(self, w: ti.i32):
        """List, for every element, the slots in which it is the partner, in ascending order."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            base = self.worlds[w].element_base
            last = base + self.worlds[w].elements
            for e in range(base, last):
                self.inbound[e].end = 0
            for e in range(base, last):
                for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
                    partner = self.slots[s].partner
                    if partner >= 0:
                        self.inbound[partner].end = self.inbound[partner].end + 1
            cursor = self.worlds[w].slot_base
            for e in range(base, last):
                self.inbound[e].start = cursor
                cursor += self.inbound[e].end
                self.inbound[e].end = self.inbound[e].start
            for e in range(base, last):
                for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
                    partner = self.slots[s].partner
                    if partner >= 0:
                        self.incoming[self.inbound[partner].end].slot = s
                        self.inbound[partner].end = self.inbound[partner].end + 1
            self.neighbours.finish(w)

    @ti.kernel
    def act(self, w: ti.i32, dt: ti.f64):
        """Let every element evaluate the pairs it owns."""
        self.worlds[w].evaluation = self.worlds[w].evaluation + 1
        base = self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements):
            self.contacts.act(w, e, dt, True, self.reactions)

    @ti.kernel
    def note_pushes(self, w: ti.i32):
        """Sum up what the contacts of composed bodies push together, in the order of the slots, on one thread."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            evaluation = self.worlds[w].evaluation
            base = self.worlds[w].element_base
            for e in range(base, base + self.worlds[w].elements):
                for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
                    push = self.reactions[s]
                    if push.kept >= 0:
                        i, j, with_body = self.contacts.body_of(e), 0, 0
                        if self.slots[s].partner >= 0:
                            j, with_body = self.contacts.body_of(self.slots[s].partner), 1
                        self.contacts.pushes.note(s, i, j, with_body, push.normal, push.turn_i, push.turn_j, evaluation)

    @ti.kernel
    def gather(self, w: ti.i32):
        """Let every element add up the reactions of the pairs that others own."""
        base = self.worlds[w].element_base
        for e in range(base, base + self.worlds[w].elements):
            force = vec3(0.0)
            torque = vec3(0.0)
            for k in range(self.inbound[e].start, self.inbound[e].end):
                slot = self.incoming[k].slot
                force = force - self.reactions[slot].force
                torque = torque - self.reactions[slot].torque
            self.loads[e].force = self.loads[e].force + force
            self.loads[e].torque = self.loads[e].torque + torque
            if ti.static(self.carries):
                change = 0.0
                for k in range(self.inbound[e].start, self.inbound[e].end):
                    change = change + self.reactions[self.incoming[k].slot].change
                self.flows[e].change = self.flows[e].change + change
                if ti.static(self.single):
                    self.contacts.settle_amount(e)

    @ti.kernel
    def has_loaded_wall(self, w: ti.i32) -> ti.i32:
        found = 0
        first = self.worlds[w].first_wall
        ti.loop_config(serialize=True)
        for k in range(first, first + self.worlds[w].walls):
            if self.walls[k].inverse_mass > 0.0 and self.wall_motion.present(w, k):
                found = 1
        return found

    @ti.kernel
    def gather_walls(self, w: ti.i32):
        """Add up what the walls feel, in the order of the slots, on one thread."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            self.wall_motion.forget_forces(w)
            base = self.worlds[w].element_base
            for e in range(base, base + self.worlds[w].elements):
                for s in range(self.elements[e].slots_from, self.elements[e].slots_to):
                    if self.slots[s].partner < 0:
                        self.wall_motion.feel(
                            -1 - self.slots[s].partner, self.reactions[s].force, self.reactions[s].torque
                        )

    @ti.kernel
    def collect(self, w: ti.i32):
        """Sum over the elements of composed bodies."""
        ti.loop_config(serialize=True)
        for _ in range(1):
            self.contacts.collect(w)

    @ti.kernel
    def finish(self, w: ti.i32):
        """The second half kick of the last step."""
        dt = self.worlds[w].dt
        base = self.worlds[w].body_base
        for i in range(base, base + self.worlds[w].bodies):
            self.integrator.kick(i, dt)
