"""Call the contact search of superquadrics on many pairs at once, outside any simulation."""

import numpy as np
import taichi as ti

from taichidem import runtime
from taichidem.bodies import Bodies
from taichidem.contact import Contact, vec3
from taichidem.effects import NormalHertz
from taichidem.engine import Engine
from taichidem.engine_io import Exchange
from taichidem.shapes import Superquadric
from taichidem.state import Sizes
from taichidem.walls import PlaneKind

PAIRS = 1 << 15  # of one call
_NAMES = ("touching", "overlap", "radius_i", "radius_j")
_VECTORS = ("normal", "lever_i", "lever_j")  # the normal also of pairs that are apart


@ti.data_oriented
class PairSearch:
    """Bodies 2k and 2k + 1 of one world are pair k, whose slot is k."""

    def __init__(self):
        runtime.start()
        counts = dict.fromkeys(Sizes.__dataclass_fields__, 1)
        sizes = Sizes(**{**counts, "bodies": 2 * PAIRS, "elements": 2 * PAIRS, "slots": PAIRS, "worlds": 8})
        self.engine = Engine((NormalHertz(restitution=1.0),), sizes, "superquadric", (PlaneKind,))
        self.exchange = Exchange(self.engine)
        self.contacts = self.engine.contacts
        self.shape = self.engine.contacts.shape
        self.axes = self.engine.state.axes

    def __call__(self, bodies, reach=0.0, start=None, general=False):
        """Return what the search finds for pairs of bodies, by name.

        Args:
            reach: gap [m] up to which they count as touching.
            start: normals (n, 3) to begin from; from the line of centres where left out.
            general: treat ellipsoids as any other superquadric.
        """
        n = len(bodies) // 2
        assert n <= PAIRS
        self.engine.access["worlds"].write(0, [{}])
        self.exchange.insert(0, bodies, 0)
        if general:
            self.engine.state.forms.get_member_field("ellipsoid").fill(0)
        out = np.zeros((n, len(_NAMES) + 3 * len(_VECTORS)))
        self._search(n, reach, np.zeros((n, 3)) if start is None else np.ascontiguousarray(start, float), out)
        found = {name: out[:, k] for k, name in enumerate(_NAMES)}
        first = len(_NAMES)
        found |= {name: out[:, first + 3 * k : first + 3 * k + 3] for k, name in enumerate(_VECTORS)}
        found["touching"] = found["touching"] == 1
        return found

    @ti.kernel
    def _search(self, n: ti.i32, reach: ti.f64, start: ti.types.ndarray(), out: ti.types.ndarray()):
        for k in range(n):
            self.axes[k].axis = vec3(start[k, 0], start[k, 1], start[k, 2])
            c = Contact(dt=0.0)
            self.shape.touch(k, self.contacts.place(2 * k), self.contacts.place(2 * k + 1), c, reach)
            out[k, 0] = c.touching
            out[k, 1] = c.overlap
            out[k, 2] = c.radius_i
            out[k, 3] = c.radius_j
            for axis in ti.static(range(3)):
                out[k, 4 + axis] = self.axes[k].axis[axis]
                out[k, 7 + axis] = c.lever_i[axis]
                out[k, 10 + axis] = c.lever_j[axis]


def random_quaternions(rng, n):
    q = rng.normal(size=(n, 4))
    return q / np.linalg.norm(q, axis=1)[:, None]


def superquadrics(axes, exponents, position, orientation, density=1000.0):
    """Return bodies of a form each: semi-axes (n, 3), exponents (n, 2)."""
    n = len(axes)
    kinds, number = np.unique(np.hstack([axes, exponents]), axis=0, return_inverse=True)
    forms = [Superquadric(*kind) for kind in kinds.tolist()]
    volume = np.array([form.volume for form in forms])[number]
    inertia = np.array([form.inertia for form in forms])[number]
    bounds = np.array([form.bounding_radius for form in forms])[number]
    return Bodies(
        position=position,
        velocity=np.zeros((n, 3)),
        spin=np.zeros((n, 3)),
        orientation=orientation,
        mass=density * volume,
        inertia=density * volume[:, None] * inertia,
        radius=(3 * volume / (4 * np.pi)) ** (1 / 3),
        element_body=np.arange(n),
        element_offset=np.zeros((n, 3)),
        element_radius=bounds,
        element_material=np.zeros(n, int),
        element_axes=axes,
        element_exponents=exponents,
    )


def rotated(q, v):
    """Return vectors (n, 3) turned by quaternions (n, 4)."""
    u = q[:, 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + q[:, :1] * v)


def supports(bodies, directions):
    """Return the support points of bodies from their centres in world directions, all (n, 3), by NumPy."""
    q = bodies.orientation
    back = q * [1, -1, -1, -1]
    d = np.abs(local := rotated(back, directions)) * bodies.element_axes
    m1, m2 = (bodies.element_exponents / (bodies.element_exponents - 1)).T
    largest = d.max(axis=1)
    u, v, w = np.maximum((d / largest[:, None]), 1e-300).T
    s = np.maximum(u, v)
    qn = s * ((u / s) ** m2 + (v / s) ** m2) ** (1 / m2)
    t = np.maximum(qn, w)
    h = t * ((qn / t) ** m1 + (w / t) ** m1) ** (1 / m1)
    outer = (qn / h) ** (m1 - 1)
    shares = np.column_stack([outer * (u / qn) ** (m2 - 1), outer * (v / qn) ** (m2 - 1), (w / h) ** (m1 - 1)])
    return rotated(q, np.sign(local) * bodies.element_axes * shares)


def overlap_along(bodies, normals):
    """Return δ(n) of the pairs of bodies for normals from j to i, and the gap vector between the support points."""
    i, j = (take(bodies, slice(k, None, 2)) for k in (0, 1))
    apart = i.position - j.position
    point_i, point_j = supports(i, -normals), supports(j, normals)
    offset = apart + point_i - point_j
    return -(offset * normals).sum(1), offset


def take(bodies, rows):
    """Return some rows of single-element bodies."""
    arrays = {name: getattr(bodies, name)[rows] for name in vars(bodies) if name != "element_body"}
    return Bodies(element_body=np.arange(len(arrays["mass"])), **arrays)
