"""The midway point of two superquadrics: where scaled copies of both first meet. Slow and sure."""

import taichi as ti

from taichidem.contact import mat3, vec3
from taichidem.shapes.homogeneous import nested_norm

HALVINGS = 50
MOST_STEPS = 60  # of Newton's method for one weight
SMALLEST_SHARE = 1e-8  # of a Newton step, below which the point is as low as it gets
SMOOTHING = 1e-9  # share of the mean bending added to each direction, since flat faces do not bend

# Half the square of the scale at which a body's copy passes through a point, with slope and bending [1, 1/m, 1/m²].
Level = ti.types.struct(value=ti.f64, slope=vec3, bend=mat3)


@ti.func
def level(axes, dual, rotation, away):
    """Return G²/2 at a place given from the body's centre, G the scale of the copy through it."""
    norm = nested_norm(1.0 / axes, dual[0] / (dual[0] - 1.0), dual[1] / (dual[1] - 1.0), rotation.transpose() @ away)
    slope = rotation @ norm.gradient
    one, two = rotation @ norm.along_1, rotation @ norm.along_2
    bend = norm.bend_1 * one.outer_product(one) + norm.bend_2 * two.outer_product(two)
    return Level(
        value=0.5 * norm.value * norm.value,
        slope=norm.value * slope,
        bend=norm.value * bend + slope.outer_product(slope),
    )


@ti.func
def midway_point(forms: ti.template(), i_row, j_row, rotors: ti.template(), apart):
    """Return the point where copies of both bodies at one scale touch, from the centre of i [m], and the normal there from j to i.

    (1 − λ) G_i² + λ G_j² is convex, so Newton's method with halved steps finds its lowest point for each weight λ; there
    G_i grows and G_j falls with λ, so halving an interval of weights finds where they are equal.

    Args:
        forms, rotors: tables of the superquadrics and of their rotation.
        i_row, j_row: where the two stand in them.
        apart: centre of i from that of j [m].
    """
    unit = mat3([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    low, high = 0.0, 1.0
    best = -0.5 * apart  # from the centre of i
    normal = apart.normalized()
    for _halving in range(HALVINGS):
        weight = 0.5 * (low + high)
        lowest, share = 1e300, 1.0
        step = vec3(0.0)
        above = 0  # 1 where the copy of i at the lowest point is larger than that of j
        for _newton in range(MOST_STEPS):
            if share > SMALLEST_SHARE:
                point = best + share * step
                i = level(forms[i_row].axes, forms[i_row].dual, rotors[i_row].rotation, point)
                j = level(forms[j_row].axes, forms[j_row].dual, rotors[j_row].rotation, point + apart)
                value = (1.0 - weight) * i.value + weight * j.value
                if value < lowest:
                    best, lowest, share = point, value, 1.0
                    slope = (1.0 - weight) * i.slope + weight * j.slope
                    bend = (1.0 - weight) * i.bend + weight * j.bend
                    step = -((bend + SMOOTHING * bend.trace() * unit).inverse() @ slope)
                    normal = j.slope.normalized() - i.slope.normalized()
                    above = ti.cast(i.value > j.value, ti.i32)
                else:
                    share *= 0.5
        if above == 1:
            high = weight  # less weight on j brings the point nearer to i
        else:
            low = weight
    return best, normal.normalized()
