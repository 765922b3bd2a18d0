"""The nested norm that superquadrics are made of, with its slope and its bending."""

import taichi as ti

from taichidem.contact import vec3

TINY = 1e-12  # share of the largest component below which a component counts as this; the norm bends without bound at 0

# A norm at a vector: its value, its gradient, and its second derivatives k₁ α αᵀ + k₂ β βᵀ.
Norm = ti.types.struct(value=ti.f64, gradient=vec3, bend_1=ti.f64, along_1=vec3, bend_2=ti.f64, along_2=vec3)


@ti.func
def nested_norm(scale, power_1, power_2, v):
    """Return N(v) = (q^p₁ + |s_z v_z|^p₁)^(1/p₁), q = (|s_x v_x|^p₂ + |s_y v_y|^p₂)^(1/p₂), with its derivatives.

    With s the semi-axes and p = n/(n − 1) it is the support function of a superquadric of exponents n, whose gradient is the
    support point and whose bending are the radii of curvature; with one over the semi-axes and p = n it is the factor by which
    the superquadric must be enlarged to reach v.
    """
    signs = ti.select(v < 0.0, -scale, scale)
    reach = signs * v
    largest = ti.max(reach[0], reach[1], reach[2])
    part = ti.max(reach / largest, TINY)
    u, w, z = part[0], part[1], part[2]
    u_p, w_p, z_p = u**power_2, w**power_2, z**power_1
    q_p = u_p + w_p
    q = q_p ** (1.0 / power_2)
    q_q = q**power_1
    h_p = q_q + z_p
    h = h_p ** (1.0 / power_1)
    slope_q = (q_q / h_p) * (h / q)
    slope_z = (z_p / h_p) * (h / z)
    slope_u = (u_p / q_p) * (q / u)
    slope_w = (w_p / q_p) * (q / w)
    gradient = vec3(slope_q * slope_u, slope_q * slope_w, slope_z) * signs
    # Of a norm of two numbers of degree one the second derivatives are k (z dq − q dz)², and so on inwards.
    bend_1 = (power_1 - 1.0) * (h / (h_p * h_p)) * (q_q / (q * q)) * (z_p / (z * z)) / largest
    bend_2 = (power_2 - 1.0) * slope_q * (q / (q_p * q_p)) * (u_p / (u * u)) * (w_p / (w * w)) / largest
    along_1 = vec3(z * slope_u, z * slope_w, -q) * signs
    along_2 = vec3(w, -u, 0.0) * signs
    return Norm(value=h * largest, gradient=gradient, bend_1=bend_1, along_1=along_1, bend_2=bend_2, along_2=along_2)
