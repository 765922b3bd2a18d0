"""Move bodies: velocity Verlet for the centre, and for rotation with a symplectic splitting about the principal axes.

Inside a run the second half kick of one step and the first of the next are done in one pass; they stay two additions, so
that a run cut into pieces gives the same bits as an uncut one.
"""

import taichi as ti

from taichidem.contact import Wrench, vec3, vec4
from taichidem.state import OnTables


@ti.func
def rotate(q, v):
    """Return a body-frame vector in the world frame; q = (w, x, y, z) a unit quaternion."""
    u = vec3(q[1], q[2], q[3])
    return v + 2.0 * u.cross(u.cross(v) + q[0] * v)


@ti.func
def rotate_back(q, v):
    """Return a world-frame vector in the body frame."""
    return rotate(vec4(q[0], -q[1], -q[2], -q[3]), v)


@ti.func
def multiply(a, b):
    """Return the product of two quaternions."""
    return vec4(
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@ti.func
def free_rotation(q, momentum, inertia, dt):
    """Return the orientation after a torque-free turn with angular momentum [kg m²/s] given in the world frame.

    Five rotations about principal axes (x, y, z, y, x) of angle L_k/I_k times dt/2, dt/2, dt, dt/2, dt/2: second order,
    reversible, and |L| is kept to round-off because the world-frame momentum is never touched.
    Source: Dullweber, Leimkuhler & McLachlan (1997), doi 10.1063/1.474310.
    """
    turned = q
    for part in ti.static(range(5)):
        axis = ti.static(2 - abs(part - 2))
        share = ti.static(1.0 if axis == 2 else 0.5)
        local = rotate_back(turned, momentum)
        half = 0.5 * share * dt * local[axis] / inertia[axis]
        spin = vec4(ti.cos(half), 0.0, 0.0, 0.0)
        spin[axis + 1] = ti.sin(half)
        turned = multiply(turned, spin)
    return turned / turned.norm()


@ti.data_oriented
class Integrator(OnTables):
    """Advance bodies; knows whether all of them are single spheres."""

    def __init__(self, state) -> None:
        super().__init__(state)

    @ti.func
    def load(self, i):
        """Return the wrench on a body."""
        total = Wrench(force=vec3(0.0), torque=vec3(0.0))
        if ti.static(self.single):
            total.force = self.loads[i].force
            total.torque = self.loads[i].torque
        else:
            total.force = self.rotors[i].force
            total.torque = self.rotors[i].torque
        return total

    @ti.func
    def kick(self, i, dt):
        """Half a step of velocity and spin."""
        total = self.load(i)
        half = 0.5 * dt
        self.bodies[i].velocity = self.bodies[i].velocity + (half * self.bodies[i].inverse_mass) * total.force
        if ti.static(self.single):
            self.bodies[i].spin = self.bodies[i].spin + (half * self.bodies[i].inverse_inertia) * total.torque
        else:
            self.rotors[i].momentum = self.rotors[i].momentum + half * total.torque
            self.set_spin(i)

    @ti.func
    def kick_and_drift(self, i, dt, kicks):
        """One or two half kicks, then a whole step of position (and orientation)."""
        total = self.load(i)
        half = 0.5 * dt
        change = (half * self.bodies[i].inverse_mass) * total.force
        velocity = self.bodies[i].velocity + change
        if kicks == 2:
            velocity = velocity + change
        self.bodies[i].velocity = velocity
        self.bodies[i].position = self.bodies[i].position + dt * velocity
        if ti.static(self.single):
            change = (half * self.bodies[i].inverse_inertia) * total.torque
            spin = self.bodies[i].spin + change
            if kicks == 2:
                spin = spin + change
            self.bodies[i].spin = spin
            self.loads[i].force = vec3(0.0)
            self.loads[i].torque = vec3(0.0)
        else:
            change = half * total.torque
            momentum = self.rotors[i].momentum + change
            if kicks == 2:
                momentum = momentum + change
            self.rotors[i].momentum = momentum
            rotor = self.rotors[i]
            self.rotors[i].orientation = free_rotation(rotor.orientation, momentum, rotor.inertia, dt)
            self.set_spin(i)

    @ti.func
    def set_spin(self, i):
        """ω = R I⁻¹ Rᵀ L."""
        rotor = self.rotors[i]
        self.bodies[i].spin = rotate(rotor.orientation, rotate_back(rotor.orientation, rotor.momentum) / rotor.inertia)
