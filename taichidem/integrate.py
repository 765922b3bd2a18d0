"""Move bodies: velocity Verlet for the centre, and for rotation with a symplectic splitting about the principal axes.

Inside a run the second half kick of one step and the first of the next are done in one pass; they stay two additions, so
that a run cut into pieces gives the same bits as an uncut one.
"""

import taichi as ti

from taichidem.contact import Wrench, mat3, vec3, vec4
from taichidem.state import OnTables

SMALL_ANGLE = 0.05  # [rad] below which the series of sine and cosine are exact to round-off


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
def rotation_of(q):
    """Return the matrix of a unit quaternion; its columns are the axes of the body frame in the world."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return mat3(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


@ti.func
def cosine_and_sine(angle):
    """Return both; by their series for the small angles of a time step, which is exact to round-off and many times faster."""
    square = angle * angle
    cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)))
    sine = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))))
    if square > SMALL_ANGLE * SMALL_ANGLE:
        cosine, sine = ti.cos(angle), ti.sin(angle)
    return cosine, sine


@ti.func
def free_rotation(q, momentum, inverse_inertia, dt):
    """Return the orientation after a torque-free turn with angular momentum [kg m²/s] given in the world frame.

    Five rotations about principal axes (x, y, z, y, x) of angle L_k/I_k times dt/2, dt/2, dt, dt/2, dt/2: second order,
    reversible, and |L| is kept to round-off because the world-frame momentum is never touched.
    Source: Dullweber, Leimkuhler & McLachlan (1997), doi 10.1063/1.474310.
    """
    local = rotate_back(q, momentum)
    turned = q
    for part in ti.static(range(5)):
        axis = ti.static(2 - abs(part - 2))
        first, second = ti.static((axis + 1) % 3), ti.static((axis + 2) % 3)
        share = ti.static(0.5 if axis == 2 else 0.25)
        c, s = cosine_and_sine(share * dt * local[axis] * inverse_inertia[axis])
        before = turned
        turned[0] = c * before[0] - s * before[axis + 1]
        turned[axis + 1] = c * before[axis + 1] + s * before[0]
        turned[first + 1] = c * before[first + 1] + s * before[second + 1]
        turned[second + 1] = c * before[second + 1] - s * before[first + 1]
        cosine, sine = c * c - s * s, 2.0 * c * s
        one, two = local[first], local[second]
        local[first] = cosine * one + sine * two
        local[second] = cosine * two - sine * one
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
        if ti.static(self.round):
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
            self.loads[i].force = vec3(0.0)
            self.loads[i].torque = vec3(0.0)
        if ti.static(self.round):
            change = (half * self.bodies[i].inverse_inertia) * total.torque
            spin = self.bodies[i].spin + change
            if kicks == 2:
                spin = spin + change
            self.bodies[i].spin = spin
        else:
            change = half * total.torque
            momentum = self.rotors[i].momentum + change
            if kicks == 2:
                momentum = momentum + change
            self.rotors[i].momentum = momentum
            rotor = self.rotors[i]
            self.rotors[i].orientation = free_rotation(rotor.orientation, momentum, rotor.inverse_inertia, dt)
            self.turn(i)

    @ti.func
    def turn(self, i):
        """Let what hangs on a body's orientation follow it: the rotation matrix, the spin, the spread of an ellipsoid."""
        rotation = rotation_of(self.rotors[i].orientation)
        self.rotors[i].rotation = rotation
        self.set_spin(i)
        if ti.static(self.kind == "superquadric"):
            axes = self.forms[i].axes
            scaled = rotation @ mat3([[axes[0], 0.0, 0.0], [0.0, axes[1], 0.0], [0.0, 0.0, axes[2]]])
            self.forms[i].spread = scaled @ scaled.transpose()

    @ti.func
    def set_spin(self, i):
        """ω = R I⁻¹ Rᵀ L."""
        rotation = self.rotors[i].rotation
        local = rotation.transpose() @ self.rotors[i].momentum
        self.bodies[i].spin = rotation @ (local * self.rotors[i].inverse_inertia)
