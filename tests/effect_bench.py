"""Feed prescribed contact states to a law, one after the other, and read what it answers."""

import numpy as np
import taichi as ti

from taichidem.arena import Arena
from taichidem.contact import Body, Contact, Holding, vec3
from taichidem.effects import BodyGravity, NormalHertz, TangentialMindlin
from taichidem.effects.law import Law
from taichidem.materials import Material, MaterialPair

SOFT = Material("soft", 2500.0, 1e7, 0.3)
PAIR = MaterialPair(SOFT, SOFT)
RADIUS, DT = 0.01, 1e-6
HELD = 1e-9  # [m³] or whatever amount the bodies of a contact carry

# Columns of the table that prescribes the motion of a pair, and of what the law answers.
NORMAL, OVERLAP, VELOCITY, SPIN_I, SPIN_J = 0, 3, 4, 7, 10


@ti.data_oriented
class Bench:
    """A law with one row of coefficients and one memory."""

    def __init__(self, effects, pair=PAIR):
        self.arena = Arena()
        self.law = Law(tuple(effects))
        self.past = [self.arena.table(1, members) for members in self.law.memories]
        self.law.allocate(self.arena, 1, 1, self.past)
        self.arena.seal()
        self.effects = effects
        self.set(effects, pair)

    def set(self, effects, pair=PAIR):
        """Give the law the values of effects of the same composition."""
        own = {e.composition: e for e in effects}
        for bound in self.law.contact_bound:
            for name, value in own[bound.effect.composition].kernel_coefficients(pair).items():
                bound.given.get_member_field(name)[0] = value
        for bound in self.law.body_bound:
            for name, value in own[bound.effect.composition].kernel_coefficients().items():
                bound.given.get_member_field(name)[0] = value

    def run(self, states, wall=0, dt=DT, radius=RADIUS, held=HELD):
        """Return force (n, 3) and torque (n, 3) on side i for states (n, 13)."""
        out = self.answers(states, wall, dt, radius, held)
        return out[:, :3], out[:, 3:6]

    def answers(self, states, wall=0, dt=DT, radius=RADIUS, held=HELD):
        """Return force, torque, and the change of what both sides carry, (n, 8); the contact is new at the first state.

        What the sides carry follows from the changes, starting at `held` each.
        """
        states = np.ascontiguousarray(np.atleast_2d(states), dtype=float)
        out = np.zeros((len(states), 8))
        self._run(states, out, wall, dt, radius, SOFT.density * 4 / 3 * np.pi * radius**3, held)
        return out

    @ti.kernel
    def _run(
        self,
        states: ti.types.ndarray(),
        out: ti.types.ndarray(),
        wall: ti.i32,
        dt: ti.f64,
        radius: ti.f64,
        mass: ti.f64,
        held: ti.f64,
    ):
        self.law.forget(0)
        ti.loop_config(serialize=True)
        for _ in range(1):
            held_i, held_j = held, held
            if wall == 1:
                held_j = 0.0
            for k in range(states.shape[0]):
                c = Contact(touching=1, dt=dt, inverse_mass_i=1.0 / mass, radius_i=radius)
                c.normal = vec3(states[k, 0], states[k, 1], states[k, 2])
                c.overlap = states[k, 3]
                c.velocity = vec3(states[k, 4], states[k, 5], states[k, 6])
                c.spin_i = vec3(states[k, 7], states[k, 8], states[k, 9])
                c.spin_j = vec3(states[k, 10], states[k, 11], states[k, 12])
                c.radius = radius
                c.mass = mass
                if wall == 0:
                    c.inverse_mass_j = 1.0 / mass
                    c.radius_j = radius
                    c.radius = 0.5 * radius
                    c.mass = 0.5 * mass
                h = Holding(held_i=held_i, held_j=held_j, size_i=c.radius_i, size_j=c.radius_j)
                part = self.law.contact_wrench(0, 0, c, h)
                for axis in ti.static(range(3)):
                    out[k, axis] = part.force[axis]
                    out[k, 3 + axis] = part.torque[axis]
                out[k, 6] = h.change_i
                out[k, 7] = h.change_j
                held_i += h.change_i
                held_j += h.change_j

    def energies(self, overlaps, effect, radius=RADIUS, wall=0):
        """Return the energy [J] that a conservative effect of the law declares for overlaps (n,) [m]."""
        out = np.zeros(len(overlaps))
        bound = next(b for b in self.law.contact_bound if b.effect.name == effect.name)
        self._energies(bound.effect, bound.given, np.ascontiguousarray(overlaps), out, radius, wall)
        return out

    @ti.kernel
    def _energies(
        self,
        effect: ti.template(),
        given: ti.template(),
        overlaps: ti.types.ndarray(),
        out: ti.types.ndarray(),
        radius: ti.f64,
        wall: ti.i32,
    ):
        for k in range(out.shape[0]):
            c = Contact(overlap=overlaps[k], radius=radius, radius_i=radius, inverse_mass_i=1.0)
            if wall == 0:
                c.radius = 0.5 * radius
                c.radius_j = radius
                c.inverse_mass_j = 1.0
            out[k] = effect.energy(given[0], c)

    def push(self, velocity, radius=RADIUS, mass=1.0):
        """Return the force (3,) of the body effects on a body that moves with a velocity."""
        out = np.zeros(3)
        self._push(np.asarray(velocity, float), radius, mass, out)
        return out

    @ti.kernel
    def _push(self, velocity: ti.types.ndarray(), radius: ti.f64, mass: ti.f64, out: ti.types.ndarray()):
        for _ in range(1):
            b = Body(velocity=vec3(velocity[0], velocity[1], velocity[2]), mass=mass, radius=radius)
            part = self.law.body_wrench(0, b)
            for axis in ti.static(range(3)):
                out[axis] = part.force[axis]


def middle(kind, **values):
    """Return an effect well within what is plausible, unless told otherwise."""
    return kind(**{**{p.name: 0.4 * p.plausible[0] + 0.6 * p.plausible[1] for p in kind.parameters}, **values})


def beneath(effect):
    """Return the effects that an effect stands on, without friction or losses of their own."""
    base = [] if effect.family == "normal" else [NormalHertz(restitution=1.0)]
    if "tangential" in effect.needs:
        base.append(TangentialMindlin(static_friction=0.4))
    return base


_benches = {}


def bench(kind, **values):
    """Return the bench of an effect on top of what it needs; one is compiled per composition."""
    effect = middle(kind, **values)
    effects = [*beneath(effect), effect]
    if effect.composition not in _benches:
        _benches[effect.composition] = Bench(effects)
    _benches[effect.composition].set(effects)
    return _benches[effect.composition]


def base_bench(kind):
    """Return the bench of what an effect stands on."""
    effects = beneath(middle(kind)) or [NormalHertz(restitution=1.0)]
    key = tuple(e.composition for e in effects)
    if key not in _benches:
        _benches[key] = Bench(effects)
    return _benches[key]


def body_bench(effect):
    """Return the bench of a body effect, with gravity where it is another."""
    effects = [effect] if effect.family == "gravity" else [BodyGravity(), effect]
    key = ("body", effect.composition)
    if key not in _benches:
        _benches[key] = Bench(effects)
    _benches[key].set(effects)
    return _benches[key]


def reach_of(kind):
    """Return the gap up to which an effect in the middle of what is plausible acts here [m]."""
    return middle(kind).reach(PAIR, RADIUS)


def contribution(made, states, wall=0, **scaled):
    """Return what an effect, the last one of its bench, adds to the answers of what it stands on.

    Of a normal law, which stands on nothing, that is all of its answer.
    """
    kind = type(made.effects[-1])
    out = made.answers(states, wall, **scaled)
    return out if kind.family == "normal" else out - base_bench(kind).answers(states, wall, **scaled)


def share(part, whole):
    """Return the largest of what is part of answers, in force, couple and amounts, over the largest of the whole there."""
    groups = (slice(3), slice(3, 6), slice(6, 8))
    sizes = [(np.abs(part[:, group]).max(), np.abs(whole[:, group]).max()) for group in groups]
    return max(size / of if of else np.inf for size, of in sizes if size) if np.any(part) else 0.0


def acts_on(kind, states):
    """Return at which partners an effect has a share that counts, 0 between grains and 1 at walls; the first is its own."""
    made = bench(kind)
    return [wall for wall in (0, 1) if share(contribution(made, states, wall), made.answers(states, wall)) > 1e-6]


def at_rest(overlaps):
    """Return states of a pair that is pressed along x, without any motion."""
    states = np.zeros((len(overlaps), 13))
    states[:, NORMAL] = 1.0
    states[:, OVERLAP] = overlaps
    return states


def history(seed, n=60, deepest_gap=0.0):
    """Return a wild but smooth motion of a pair: load (and gap), slip, rolling, twist and a turning normal."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, n)[:, None]
    wave = [rng.normal(size=3) * np.sin(2 * np.pi * (t * rng.uniform(0.5, 2) + rng.uniform())) for _ in range(4)]
    normal = np.array([1.0, 0.2, -0.3]) + 0.2 * wave[0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    swing = np.sin(2 * np.pi * t * 1.5 + rng.uniform(0, 6))
    overlap = np.where(swing > 0, 1e-4, deepest_gap) * swing + (2e-5 if deepest_gap == 0.0 else 0.0)
    overlap = np.maximum(overlap, 2e-6) if deepest_gap == 0.0 else overlap
    return np.hstack([normal, overlap, wave[1], 30 * wave[2], 30 * wave[3]])


def rotation(seed):
    """Return a random rotation matrix."""
    q = np.random.default_rng(seed).normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def turned(states, matrix):
    """Return states seen from a turned frame."""
    out = states.copy()
    for first in (NORMAL, VELOCITY, SPIN_I, SPIN_J):
        out[:, first : first + 3] = states[:, first : first + 3] @ matrix.T
    return out


def work(states, force, torque, dt=DT):
    """Return the work done on the pair in each step [J]."""
    spin = states[:, SPIN_I : SPIN_I + 3] - states[:, SPIN_J : SPIN_J + 3]
    return dt * ((force * states[:, VELOCITY : VELOCITY + 3]).sum(1) + (torque * spin).sum(1))
