"""What a contact is: the structs that shapes fill, effects read, and the engine adds up."""

import taichi as ti

vec2 = ti.types.vector(2, ti.f64)
vec3 = ti.types.vector(3, ti.f64)
vec4 = ti.types.vector(4, ti.f64)
mat3 = ti.types.matrix(3, 3, ti.f64)

# A symmetric matrix: its diagonal, and the entries (1, 2), (2, 0), (0, 1).
Symmetric = ti.types.struct(diagonal=vec3, rest=vec3)


@ti.func
def applied(matrix, v):
    """Return a symmetric matrix times a vector."""
    d, r = matrix.diagonal, matrix.rest
    return vec3(
        d[0] * v[0] + r[2] * v[1] + r[1] * v[2],
        r[2] * v[0] + d[1] * v[1] + r[0] * v[2],
        r[1] * v[0] + r[0] * v[1] + d[2] * v[2],
    )


@ti.func
def solved(matrix, v):
    """Return the solution x of a symmetric, positive matrix times x = v."""
    d, r = matrix.diagonal, matrix.rest
    first = vec3(d[1] * d[2] - r[0] * r[0], r[0] * r[1] - r[2] * d[2], r[2] * r[0] - d[1] * r[1])
    second = d[0] * d[2] - r[1] * r[1]
    third = d[0] * d[1] - r[2] * r[2]
    mixed = r[2] * r[1] - d[0] * r[0]
    inverse = 1.0 / (d[0] * first[0] + r[2] * first[1] + r[1] * first[2])
    return inverse * vec3(
        first.dot(v),
        first[1] * v[0] + second * v[1] + mixed * v[2],
        first[2] * v[0] + mixed * v[1] + third * v[2],
    )


@ti.func
def is_positive(matrix):
    """Return whether a symmetric matrix is positive definite, by its leading minors."""
    d, r = matrix.diagonal, matrix.rest
    second = d[0] * d[1] - r[2] * r[2]
    third = d[2] * second + r[1] * (r[2] * r[0] - d[1] * r[1]) - r[0] * (d[0] * r[0] - r[2] * r[1])
    return d[0] > 0.0 and second > 0.0 and third > 0.0


# One touching pair. Side i is the element that owns the pair, side j its partner (an element or a wall).
Contact = ti.types.struct(
    touching=ti.i32,
    normal=vec3,  # unit vector from j to i
    overlap=ti.f64,  # [m], may be negative for effects that act before touch
    lever_i=vec3,  # [m] from the centre of body i to the contact point
    lever_j=vec3,
    radius_i=ti.f64,  # [m] radius of curvature at the contact
    radius_j=ti.f64,  # 0 at a wall, which is flat and has no radius
    inverse_mass_i=ti.f64,  # [1/kg]
    inverse_mass_j=ti.f64,  # 0 at a wall, which moves as it is told
    velocity=vec3,  # [m/s] of i relative to j at the contact point
    spin_i=vec3,  # [rad/s]
    spin_j=vec3,
    radius=ti.f64,  # [m] R* = R_i R_j / (R_i + R_j), at a wall R_i
    mass=ti.f64,  # [kg] m* = m_i m_j / (m_i + m_j), at a wall m_i
    dt=ti.f64,  # [s]
    # Written by the normal effect for those that come after it; an adhesion with a profile of its own may replace all but
    # the normal force and its damping:
    normal_force=ti.f64,  # [N] with damping, positive when pushing apart
    elastic_force=ti.f64,  # [N] without damping
    contact_radius=ti.f64,  # [m] a = √(R* δ)
    normal_stiffness=ti.f64,  # [N/m] secant, F_elastic / δ
    normal_damping=ti.f64,  # [N s/m]
    # Written by cohesion and by effects that change sliding:
    friction_load=ti.f64,  # [N] added to the normal force in Coulomb's cap, such as a pull-off force
    friction_loss=ti.f64,  # [1] share by which the coefficient of friction is lower at this moment
    # Written by the tangential effect:
    tangential_stiffness=ti.f64,  # [N/m]
)

# What the two bodies of a contact carry of an effect's amount (liquid, say), and what the contact changes of it.
# `size` is the radius of the sphere of a body's volume [m], 0 for a wall.
Holding = ti.types.struct(held_i=ti.f64, held_j=ti.f64, size_i=ti.f64, size_j=ti.f64, change_i=ti.f64, change_j=ti.f64)

# A force on i at the contact point and a couple on i; j receives the opposite of both.
Wrench = ti.types.struct(force=vec3, torque=vec3)

# What a body effect sees.
Body = ti.types.struct(
    position=vec3,
    velocity=vec3,
    spin=vec3,
    mass=ti.f64,
    radius=ti.f64,  # [m] of the sphere of equal volume
    time=ti.f64,
    gravity=vec3,  # [m/s²] written by gravity for the effects that come after it
)
