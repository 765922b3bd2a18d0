"""The columns of an engine's tables."""

import taichi as ti

from taichidem.contact import Symmetric, mat3, vec2, vec3, vec4

WORLD = {
    # bodies, elements and slots: first row of the region, rows of one half, active first row, rows in use
    "first_body": ti.i32,
    "body_capacity": ti.i32,
    "body_base": ti.i32,
    "bodies": ti.i32,
    "first_element": ti.i32,
    "element_capacity": ti.i32,
    "element_base": ti.i32,
    "elements": ti.i32,
    "elements_before": ti.i32,  # of the last rebuild
    "first_slot": ti.i32,
    "slot_capacity": ti.i32,
    "slot_base": ti.i32,
    "slots": ti.i32,
    # cells
    "lower": vec3,
    "upper": vec3,
    "cell_size": ti.f64,
    "first_cell": ti.i32,
    "cells_x": ti.i32,
    "cells_y": ti.i32,
    "cells_z": ti.i32,
    # walls and coefficients
    "first_wall": ti.i32,
    "walls": ti.i32,
    "first_wall_element": ti.i32,
    "wall_elements": ti.i32,
    "plain_elements": ti.i32,
    "first_mesh": ti.i32,
    "meshes": ti.i32,
    "first_row": ti.i32,
    "materials": ti.i32,
    # time
    "step": ti.i32,
    "target": ti.i32,
    "dt": ti.f64,
    "curvature_share": ti.f64,  # of its change that R* of superquadrics takes over in a step
    "evaluation": ti.i32,
    "fresh": ti.i32,
    "stale": ti.i32,
    # lists
    "skin": ti.f64,
    "reach": ti.f64,
    "largest_radius": ti.f64,
    "wall_travel": ti.f64,
    "rebuilds": ti.i32,
    "left": ti.i32,
    # health
    "status": ti.i32,
    "largest_overlap": ti.f64,
}

BODY = {"position": vec3, "velocity": vec3, "spin": vec3, "inverse_mass": ti.f64, "inverse_inertia": ti.f64}
ROTOR = {
    "orientation": vec4,  # unit quaternion (w, x, y, z), body frame → world
    "momentum": vec3,  # angular momentum, world frame [kg m²/s]
    "inverse_inertia": vec3,  # one over the principal moments [1/(kg m²)]
    "force": vec3,
    "torque": vec3,
    "rotation": mat3,  # of the orientation, body frame → world
    "mobility": Symmetric,  # R I⁻¹ Rᵀ [1/(kg m²)]; contacts read it together with the form, so it lies beside it
}
LOAD = {"force": vec3, "torque": vec3}
ELEMENT = {
    "radius": ti.f64,
    "listed_at": vec3,  # position when the lists were built
    "slots_from": ti.i32,
    "slots_to": ti.i32,
    "material": ti.i32,
    "came_from": ti.i32,
    "cell": ti.i32,
}
OWNED = {"body": ti.i32, "offset": vec3, "position": vec3}
FORM = {  # of a superquadric
    "spread": Symmetric,  # R diag(a², b², c²) Rᵀ [m²]
    "ellipsoid": ti.i32,  # both exponents are 2
    "size": ti.f64,  # radius of the sphere of equal volume [m]
    "product": ti.f64,  # a b c [m³]
    "axes": vec3,  # [m]
    "dual": vec2,  # m₁ and m₂, m = n/(n − 1)
}
LABEL = {"identity": ti.i32, "radius": ti.f64, "moved_to": ti.i32, "cell": ti.i32}
# Pairs of bodies that may touch at several points: a list for the body with the lower row, and what the contacts of the last
# two evaluations push together, each in a row of its own.
LISTED_PAIRS = {"pairs_from": ti.i32}  # of a body, −1 for none
PAIR = {"other": ti.i32, "next": ti.i32}  # a body or −1 − wall
PAIR_OF = {"pair": ti.i32, "mass": ti.f64}  # mass: that the contact had to stop in the last evaluation [kg]
PUSH = {
    "stamp": ti.i32,  # evaluation that it sums up
    "normal": vec3,  # sum of the normals, towards the body that lists the pair
    "turn_first": vec3,  # sum of r × n of that body, and of the other one [m]
    "turn_second": vec3,
}
SLOT = {
    "partner": ti.i32,  # an element, or −1 − wall element
    "row": ti.i32,  # of the effects' coefficients
    "stamp": ti.i32,  # evaluation in which the pair last touched
    "radius": ti.f64,  # R* and m*, which don't change while a pair is listed
    "mass": ti.f64,
}
# Of a pair of superquadrics: the last contact normal, or a direction in which they are apart, 0 where none is known; and the
# radii of curvature [m] that the contact goes by.
AXIS = {"axis": vec3, "radius_i": ti.f64, "radius_j": ti.f64}
REACTION = {"force": vec3, "torque": vec3, "change": ti.f64}
OWN_PUSH = {
    "kept": ti.i32,
    "normal": vec3,
    "turn_i": vec3,
    "turn_j": vec3,
}  # kept: slot of the memory, −1 where nothing touches
WALL = {
    "origin": vec3,
    "velocity": vec3,
    "spin": vec3,
    "first_row": vec3,
    "second_row": vec3,
    "third_row": vec3,
    "extent": ti.f64,
    "removed_at": ti.f64,
    "force": vec3,  # [N] of the grains on the wall, as of the last evaluation
    "torque": vec3,  # [N m] about the centre of its motion
    "load": ti.f64,  # [N] along `guide`, for a wall that is pushed instead of told its speed
    "guide": vec3,
    "inverse_mass": ti.f64,  # [1/kg] 0 for a wall that moves as it is told
    "material": ti.i32,
    "moves": ti.i32,
    "turned": ti.i32,
}
# Elements of a world: first those that every grain looks at, then facets, then flat patches (row -1), which only
# keep the contact memory that the facets of one plane share.
WALL_ELEMENT = {"kind": ti.i32, "row": ti.i32, "wall": ti.i32, "patch": ti.i32}

# A mesh's facets by cell of a grid in its own frame, so that the lists hold however the mesh moves.
MESH = {
    "wall": ti.i32,
    "lower": vec3,
    "cell_size": ti.f64,
    "cells_x": ti.i32,
    "cells_y": ti.i32,
    "cells_z": ti.i32,
    "first_cell": ti.i32,
}
MESH_CELL = {"start": ti.i32}
MESH_FACET = {"element": ti.i32}
CORNER_EDGE = {"along": vec3}
