"""One compiled engine: a law, a shape and its tables, advanced in one of two schedules.

`worlds`: the outermost loop runs over worlds and each advances many steps inside one launch; one thread owns a world, so
the third law needs no atomics. For the small worlds of bulk tests.
`particles` (particles_schedule.py): the outermost loop runs over elements, a launch per stage. For one big heap, or a GPU.
Both call the same functions and give the same bits.
"""

import taichi as ti

from taichidem.arena import Arena
from taichidem.bodies import Kind
from taichidem.contact import vec3
from taichidem.contacts import Contacts
from taichidem.effects.law import Law
from taichidem.integrate import Integrator
from taichidem.neighbours import Neighbours
from taichidem.particles_schedule import ParticlesSchedule
from taichidem.shapes.sphere import Sphere
from taichidem.shapes.superquadric_contact import SuperquadricContact
from taichidem.state import Sizes, State, Status
from taichidem.tables import TableAccess
from taichidem.wall_motion import WallMotion

# Taichi's CPU backend gives a thread at least 512 iterations of a loop, so that without idle lanes one thread would run
# every world (transforms/make_cpu_multithreaded_range_for.cpp, minimal_block_range). On a GPU one lane is enough.
CPU_LANES = 512


@ti.data_oriented
class Engine:
    """Tables and kernels for one composition of effects, reused for every scene that fits."""

    def __init__(
        self,
        effects: tuple,
        sizes: Sizes,
        kind: Kind,
        wall_kinds: tuple,
        schedule: str = "worlds",
        lanes: int = CPU_LANES,
    ) -> None:
        self.arena = Arena()
        self.law = Law(effects)
        self.sizes = sizes
        self.wall_kinds = wall_kinds
        self.kind = kind
        self.single = kind != "multisphere"
        self.lanes = lanes
        gathering = schedule == "particles"
        self.state = State(self.arena, sizes, kind, self.law.memories, wall_kinds, gathering, self.law.carries)
        self.law.allocate(self.arena, sizes.pair_rows, sizes.worlds, self.state.past)
        self.wall_motion = WallMotion(self.state)
        self.integrator = Integrator(self.state)
        search = SuperquadricContact if kind == "superquadric" else Sphere
        shape = search(self.state, self.wall_motion)
        self.contacts = Contacts(self.state, self.law, shape, self.wall_motion)
        self.neighbours = Neighbours(self.state, self.law, self.contacts, self.wall_motion)
        self.worlds = self.state.worlds
        self.arena.seal()
        self.access = self._access()
        self.particles = ParticlesSchedule(self) if schedule == "particles" else None
        self.user: object = None  # the simulation that holds it now
        self.archive: object = None  # access to all that changes, made for the first checkpoint

    def _access(self) -> dict:
        """Return how Python writes and reads each table."""
        state, law = self.state, self.law
        tables = {"worlds": state.worlds, "walls": state.walls, "wall_elements": state.wall_elements}
        tables |= {
            name: getattr(state, name) for name in ("corner_edges", "sides", "meshes", "mesh_cells", "mesh_facets")
        }
        tables |= state.geometry
        access: dict = {name: TableAccess(table, state.members[name]) for name, table in tables.items()}
        for group, bounds in (("contact", law.contact_bound), ("body", law.body_bound)):
            access[group] = [TableAccess(b.given, dict.fromkeys(b.effect.coefficients, ti.f64)) for b in bounds]
        return access

    @ti.kernel
    def set_target(self, w: ti.i32, step: ti.i32):
        """Let a world run up to a step."""
        self.worlds[w].target = step

    @ti.func
    def running(self, w):
        """Return 1 while a world has steps to do and nothing stopped it."""
        return self.worlds[w].status == int(Status.RUNNING) and self.worlds[w].step < self.worlds[w].target

    @ti.kernel
    def advance_worlds(self, worlds: ti.i32, limit: ti.i32):
        """Advance every world by at most `limit` steps towards its target, a thread per world."""
        for k in range(worlds * self.lanes):
            w = k // self.lanes
            if k % self.lanes == 0 and self.running(w):
                todo = ti.min(limit, self.worlds[w].target - self.worlds[w].step)
                for s in range(todo + 1):
                    if self.worlds[w].status == int(Status.RUNNING):
                        self.step(w, s)
                if self.worlds[w].status == int(Status.RUNNING):
                    self.finish(w)

    @ti.func
    def step(self, w, s):
        """One time step; turn 0 only evaluates the forces of a world whose grains have just been set."""
        dt = 0.0
        stale = self.worlds[w].fresh
        evaluate = stale
        if s > 0:
            dt = self.worlds[w].dt
            evaluate = 1
            stale = self.drift(w, dt, ti.min(s, 2))
        if stale == 1:
            self.neighbours.build(w)
            self.worlds[w].fresh = 0
        if evaluate == 1 and self.worlds[w].status == int(Status.RUNNING):
            self.forces(w, dt)

    @ti.func
    def drift(self, w, dt, kicks):
        """Move every body and wall; return 1 if the lists must be rebuilt."""
        self.worlds[w].step = self.worlds[w].step + 1
        self.wall_motion.move(w, dt)
        stale = 0
        if self.worlds[w].wall_travel > 0.5 * self.worlds[w].skin:
            stale = 1
        base = self.worlds[w].body_base
        for i in range(base, base + self.worlds[w].bodies):
            self.integrator.kick_and_drift(i, dt, kicks)
            if ti.static(self.single):
                stale |= self.neighbours.stale(w, i)
        if ti.static(not self.single):
            base = self.worlds[w].element_base
            for e in range(base, base + self.worlds[w].elements):
                self.contacts.follow(e)
                stale |= self.neighbours.stale(w, e)
        return stale

    @ti.func
    def forces(self, w, dt):
        """Evaluate all contacts and body effects of a world."""
        self.worlds[w].evaluation = self.worlds[w].evaluation + 1
        base = self.worlds[w].element_base
        last = base + self.worlds[w].elements
        if dt == 0.0:  # nothing was moved, so nothing has emptied the sums
            for e in range(base, last):
                self.contacts.loads[e].force = vec3(0.0)
                self.contacts.loads[e].torque = vec3(0.0)
            self.wall_motion.forget_forces(w)
        for e in range(base, last):
            self.contacts.act(w, e, dt, False, 0)
        if ti.static(not self.single):
            self.contacts.collect(w)

    @ti.func
    def finish(self, w):
        """The second half kick of the last step, so that velocities are those of the present time."""
        base = self.worlds[w].body_base
        for i in range(base, base + self.worlds[w].bodies):
            self.integrator.kick(i, self.worlds[w].dt)
