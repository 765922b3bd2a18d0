"""Move bodies: velocity Verlet for the centre, and for rotation with a symplectic splitting about the principal axes.

Inside a run the second half kick of one step and the first of the next are done in one pass; they stay two additions, so
that a run cut into pieces gives the same bits as an uncut one.
"""

import taichi as ti

from taichidem.contact import Symmetric, Wrench, mat3, vec3, vec4
from taichidem.state import OnTables

SMALL_ANGLE = 0.02  # [rad] below which the series of sine and cosine are exact to round-off


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
def cosine_and_sinc(square):
    """Return cos √x and sin √x / √x; by series for the small angles of a time step, exact to round-off and far faster."""
    cosine = 1.0 + square * (-1.0 / 2.0 + square * (1.0 / 24.0 + square * (-1.0 / 720.0)))
    sinc = 1.0 + square * (-1.0 / 6.0 + square * (1.0 / 120.0 + square * (-1.0 / 5040.0)))
    if square > SMALL_ANGLE * SMALL_ANGLE:
        angle = ti.sqrt(square)
        cosine, sinc = ti.cos(angle), ti.sin(angle) / angle
    return cosine, sinc


@ti.func
def turned_about(q, axis: ti.template(), half):
    """Return a quaternion after a turn by twice an angle [rad] about a principal axis of the body."""
    first, second = ti.static((axis + 1) % 3 + 1, (axis + 2) % 3 + 1)
    c, sinc = cosine_and_sinc(half * half)
    s = half * sinc
    new = q
    new[0] = c * q[0] - s * q[axis + 1]
    new[axis + 1] = c * q[axis + 1] + s * q[0]
    new[first] = c * q[first] + s * q[second]
    new[second] = c * q[second] - s * q[first]
    return new


@ti.func
def turned_in_world(q, half):
    """Return a quaternion after a turn by twice a vector of angles [rad] in the world frame."""
    c, sinc = cosine_and_sinc(half.dot(half))
    v = sinc * half
    u = vec3(q[1], q[2], q[3])
    turned = c * u + q[0] * v + v.cross(u)
    return vec4(c * q[0] - v.dot(u), turned[0], turned[1], turned[2])


@ti.func
def free_rotation(q, momentum, inverse_inertia, dt):
    """Return the orientation after a torque-free turn with an angular momentum L [kg m²/s] given in the world frame.

    T = L²/(2 I_x) + (1/I_y − 1/I_x) L_y²/2 + (1/I_z − 1/I_x) L_z²/2: the first part turns the body about L and does not
    interfere with the others, which turn it about y by half a step, about z by a whole one and about y again. Exact for a
    body that is symmetric about z; for any other of second order, reversible, and without drift of the energy. |L| is kept
    to round-off because the world-frame momentum is never touched.
    Source: splitting as Dullweber, Leimkuhler & McLachlan (1997), doi 10.1063/1.474310.
    """
    half = 0.5 * dt
    excess_y, excess_z = inverse_inertia[1] - inverse_inertia[0], inverse_inertia[2] - inverse_inertia[0]
    turned = turned_in_world(q, (half * inverse_inertia[0]) * momentum)
    if excess_y != 0.0:
        turned = turned_about(turned, 1, 0.5 * half * excess_y * along_axis(turned, 1, momentum))
    turned = turned_about(turned, 2, half * excess_z * along_axis(turned, 2, momentum))
    if excess_y != 0.0:
        turned = turned_about(turned, 1, 0.5 * half * excess_y * along_axis(turned, 1, momentum))
    # One step of Newton's method for 1/|q|, which is off by round-off alone.
    return (1.5 - 0.5 * turned.dot(turned)) * turned


@ti.func
def along_axis(q, axis: ti.template(), v):
    """Return the component of a world-frame vector along a principal axis of the body."""
    first, second = ti.static((axis + 1) % 3 + 1, (axis + 2) % 3 + 1)
    k, i, j = ti.static(axis, (axis + 1) % 3, (axis + 2) % 3)
    direction = vec3(0.0)
    direction[k] = 1.0 - 2.0 * (q[first] * q[first] + q[second] * q[second])
    direction[i] = 2.0 * (q[axis + 1] * q[first] + q[0] * q[second])
    direction[j] = 2.0 * (q[axis + 1] * q[second] - q[0] * q[first])
    return direction.dot(v)


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
            inverse_inertia = self.rotors[i].inverse_inertia
            orientation = free_rotation(self.rotors[i].orientation, momentum, inverse_inertia, dt)
            self.rotors[i].orientation = orientation
            rotation = self.turn(i, orientation)
            self.bodies[i].spin = rotation @ ((rotation.transpose() @ momentum) * inverse_inertia)

    @ti.func
    def turn(self, i, orientation):
        """Let what hangs on a body's orientation follow it, the spread of an ellipsoid too; return the rotation matrix."""
        rotation = rotation_of(orientation)
        self.rotors[i].rotation = rotation
        if ti.static(self.kind == "superquadric"):
            axes = self.forms[i].axes
            x = axes[0] * vec3(rotation[0, 0], rotation[1, 0], rotation[2, 0])
            y = axes[1] * vec3(rotation[0, 1], rotation[1, 1], rotation[2, 1])
            z = axes[2] * vec3(rotation[0, 2], rotation[1, 2], rotation[2, 2])
            self.forms[i].spread = Symmetric(
                diagonal=x * x + y * y + z * z,
                rest=vec3(
                    x[1] * x[2] + y[1] * y[2] + z[1] * z[2],
                    x[2] * x[0] + y[2] * y[0] + z[2] * z[0],
                    x[0] * x[1] + y[0] * y[1] + z[0] * z[1],
                ),
            )
        return rotation

    @ti.func
    def set_spin(self, i):
        """ω = R I⁻¹ Rᵀ L."""
        rotation = self.rotors[i].rotation
        local = rotation.transpose() @ self.rotors[i].momentum
        self.bodies[i].spin = rotation @ (local * self.rotors[i].inverse_inertia)
