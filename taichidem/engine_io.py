"""Move bodies between NumPy arrays and the tables of an engine."""

import numpy as np
import taichi as ti

from taichidem.bodies import Bodies
from taichidem.contact import vec2, vec3, vec4
from taichidem.integrate import rotate, rotate_back
from taichidem.state import OnTables

Array = ti.types.ndarray()


@ti.data_oriented
class Exchange(OnTables):
    """The kernels that write bodies into a world and read them back."""

    def __init__(self, engine) -> None:
        super().__init__(engine.state)
        self.contacts, self.integrator = engine.contacts, engine.integrator

    def insert(self, world: int, bodies: Bodies, first_identity: int) -> None:
        """Append bodies to a world, numbered from `first_identity`; its lists are rebuilt before the next step."""
        vectors = np.concatenate([bodies.position, bodies.velocity, bodies.spin, bodies.inertia, bodies.orientation], 1)
        self._insert_bodies(world, first_identity, vectors, np.stack([bodies.mass, bodies.radius], 1))
        self._insert_elements(
            world,
            len(bodies),
            np.ascontiguousarray(bodies.element_body, dtype=np.int32),
            np.ascontiguousarray(bodies.element_material, dtype=np.int32),
            np.column_stack([bodies.element_offset, bodies.element_radius]),
            _forms(bodies),
        )

    def give(self, world: int, amounts: np.ndarray) -> None:
        """Let the bodies that will be inserted next carry amounts, (n,)."""
        if self.carries:
            self._give(world, np.ascontiguousarray(amounts, dtype=float))

    @ti.kernel
    def _give(self, w: ti.i32, amounts: Array):
        base = self.worlds[w].body_base + self.worlds[w].bodies
        for k in range(amounts.shape[0]):
            if ti.static(self.carries):
                self.amounts[base + k].held = amounts[k]

    @ti.kernel
    def _insert_bodies(self, w: ti.i32, identity: ti.i32, vectors: Array, scalars: Array):
        n = vectors.shape[0]
        base = self.worlds[w].body_base + self.worlds[w].bodies
        for k in range(n):
            i = base + k
            inertia = vec3(vectors[k, 9], vectors[k, 10], vectors[k, 11])
            spin = vec3(vectors[k, 6], vectors[k, 7], vectors[k, 8])
            self.bodies[i].position = vec3(vectors[k, 0], vectors[k, 1], vectors[k, 2])
            self.bodies[i].velocity = vec3(vectors[k, 3], vectors[k, 4], vectors[k, 5])
            self.bodies[i].spin = spin
            self.bodies[i].inverse_mass = 1.0 / scalars[k, 0]
            self.bodies[i].inverse_inertia = 1.0 / inertia[0]
            self.labels[i].identity = identity + k
            self.labels[i].radius = scalars[k, 1]
            self.labels[i].moved_to = -1
            if ti.static(not self.round):
                q = vec4(vectors[k, 12], vectors[k, 13], vectors[k, 14], vectors[k, 15])
                self.rotors[i].orientation = q
                self.rotors[i].inverse_inertia = 1.0 / inertia
                self.rotors[i].momentum = rotate(q, inertia * rotate_back(q, spin))
            if ti.static(not self.single):
                self.integrator.turn(i, self.rotors[i].orientation)
        self.worlds[w].fresh = 1

    @ti.kernel
    def _insert_elements(self, w: ti.i32, added: ti.i32, body: Array, material: Array, geometry: Array, forms: Array):
        n = body.shape[0]
        base = self.worlds[w].element_base + self.worlds[w].elements
        first_body = self.worlds[w].body_base + self.worlds[w].bodies
        for k in range(n):
            e = base + k
            i = first_body + body[k]
            self.elements[e].radius = geometry[k, 3]
            self.elements[e].material = material[k]
            self.elements[e].slots_from = 0
            self.elements[e].slots_to = 0
            self.loads[e].force = vec3(0.0)
            self.loads[e].torque = vec3(0.0)
            if ti.static(self.kind == "superquadric"):
                self.forms[e].axes = vec3(forms[k, 0], forms[k, 1], forms[k, 2])
                self.forms[e].dual = vec2(forms[k, 3], forms[k, 4])
                self.forms[e].ellipsoid = ti.cast(forms[k, 5], ti.i32)
                self.forms[e].size = forms[k, 6]
                self.integrator.turn(e, self.rotors[e].orientation)
            if ti.static(not self.single):
                offset = vec3(geometry[k, 0], geometry[k, 1], geometry[k, 2])
                self.owned[e].body = i
                self.owned[e].offset = offset
                self.owned[e].position = self.bodies[i].position + rotate(self.rotors[i].orientation, offset)
        self._count(w, added, n)

    @ti.func
    def _count(self, w, bodies, elements):
        self.worlds[w].bodies = self.worlds[w].bodies + bodies
        self.worlds[w].elements = self.worlds[w].elements + elements

    def read(self, world: int, n: int) -> dict[str, np.ndarray]:
        """Return the n bodies of a world by identity: position, velocity, spin, force, torque, orientation, mass …"""
        out = np.zeros((n, 23))
        self._read_bodies(world, out)
        out = out[np.argsort(out[:, 0], kind="stable")]
        names = {"position": 2, "velocity": 5, "spin": 8, "force": 11, "torque": 14}
        arrays = {name: out[:, k : k + 3].copy() for name, k in names.items()}
        arrays["orientation"] = out[:, 17:21].copy()
        arrays["mass"] = out[:, 21].copy()
        arrays["carried"] = out[:, 22].copy()
        arrays["identity"] = out[:, 0].astype(int)
        arrays["radius"] = out[:, 1].copy()
        return arrays

    @ti.kernel
    def _read_bodies(self, w: ti.i32, out: Array):
        base = self.worlds[w].body_base
        for k in range(out.shape[0]):
            i = base + k
            total = self.integrator.load(i)
            out[k, 0] = self.labels[i].identity
            out[k, 1] = self.labels[i].radius
            for axis in ti.static(range(3)):
                out[k, 2 + axis] = self.bodies[i].position[axis]
                out[k, 5 + axis] = self.bodies[i].velocity[axis]
                out[k, 8 + axis] = self.bodies[i].spin[axis]
                out[k, 11 + axis] = total.force[axis]
                out[k, 14 + axis] = total.torque[axis]
            out[k, 17] = 1.0
            if ti.static(not self.round):
                for axis in ti.static(range(4)):
                    out[k, 17 + axis] = self.rotors[i].orientation[axis]
            out[k, 21] = 1.0 / self.bodies[i].inverse_mass
            if ti.static(self.carries):
                out[k, 22] = self.amounts[i].held

    @ti.kernel
    def kinetic(self, w: ti.i32) -> ti.f64:
        """Return the kinetic energy of a world [J]."""
        total = 0.0
        base = self.worlds[w].body_base
        ti.loop_config(serialize=True)
        for k in range(self.worlds[w].bodies):
            i = base + k
            v = self.bodies[i].velocity
            spin = self.bodies[i].spin
            energy = 0.5 / self.bodies[i].inverse_mass * v.dot(v)
            if ti.static(self.round):
                energy += 0.5 / self.bodies[i].inverse_inertia * spin.dot(spin)
            else:
                energy += 0.5 * self.rotors[i].momentum.dot(spin)
            total += energy
        return total


def _forms(bodies: Bodies) -> np.ndarray:
    """Return what the kernel knows of superquadrics: semi-axes, dual exponents, whether it is an ellipsoid, size, (m, 7)."""
    if bodies.element_axes is None or bodies.element_exponents is None:
        return np.zeros((len(bodies.element_body), 7))
    n = bodies.element_exponents
    ellipsoid = np.all(n == 2, axis=1)
    return np.column_stack([bodies.element_axes, n / (n - 1), ellipsoid, bodies.radius])
