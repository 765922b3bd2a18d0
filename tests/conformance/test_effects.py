"""What every built-in effect must obey; a new effect is on trial here as soon as it stands in `BUILT_IN`."""

import math

import numpy as np
import pytest
import taichi as ti

from taichidem.arena import Arena
from taichidem.contact import Body, Contact, vec3
from taichidem.effects import (
    BUILT_IN,
    NormalHertz,
    RollingConstantTorque,
    RollingSpringDashpot,
    TangentialMindlin,
)
from taichidem.effects.base import BodyEffect, ContactEffect, SetupEffect, Stage
from taichidem.effects.law import Law
from taichidem.errors import CompositionError, InputError
from taichidem.materials import Material, MaterialPair
from taichidem.scene import Model

SOFT = Material("soft", 2500.0, 1e7, 0.3)
PAIR = MaterialPair(SOFT, SOFT)
CONTACT = [e for e in BUILT_IN.values() if issubclass(e, ContactEffect)]
RADIUS, MASS, DT = 0.01, 0.01, 1e-6

# Columns of the table that prescribes the motion of a pair, and of what the law answers.
NORMAL, OVERLAP, VELOCITY, SPIN_I, SPIN_J = 0, 3, 4, 7, 10


@ti.data_oriented
class Bench:
    """Feed prescribed contact states to a law, one after the other, with one memory."""

    def __init__(self, effects):
        self.arena = Arena()
        self.law = Law(tuple(effects))
        past = [self.arena.table(1, members) for members in self.law.memories]
        self.law.allocate(self.arena, 1, 1, past)
        self.arena.seal()
        self.effects = effects
        for bound in self.law.contact_bound:
            for name, value in bound.effect.kernel_coefficients(PAIR).items():
                bound.given.get_member_field(name)[0] = value

    def run(self, states, wall=0, dt=DT):
        """Return force (n, 3), torque (n, 3) on side i for states (n, 13)."""
        states = np.ascontiguousarray(np.atleast_2d(states), dtype=float)
        out = np.zeros((len(states), 6))
        self._run(states, out, wall, dt)
        return out[:, :3], out[:, 3:]

    @ti.kernel
    def _run(self, states: ti.types.ndarray(), out: ti.types.ndarray(), wall: ti.i32, dt: ti.f64):
        self.law.forget(0)
        ti.loop_config(serialize=True)
        for k in range(states.shape[0]):
            c = Contact(touching=1, dt=dt, inverse_mass_i=1.0 / MASS, radius_i=RADIUS)
            c.normal = vec3(states[k, 0], states[k, 1], states[k, 2])
            c.overlap = states[k, 3]
            c.velocity = vec3(states[k, 4], states[k, 5], states[k, 6])
            c.spin_i = vec3(states[k, 7], states[k, 8], states[k, 9])
            c.spin_j = vec3(states[k, 10], states[k, 11], states[k, 12])
            c.radius = RADIUS
            c.mass = MASS
            if wall == 0:
                c.inverse_mass_j = 1.0 / MASS
                c.radius_j = RADIUS
                c.radius = 0.5 * RADIUS
                c.mass = 0.5 * MASS
            part = self.law.contact_wrench(0, 0, c)
            for axis in ti.static(range(3)):
                out[k, axis] = part.force[axis]
                out[k, 3 + axis] = part.torque[axis]


PLAUSIBLE = {
    "normal_hertz": {"restitution": 0.6},
    "tangential_mindlin": {"static_friction": 0.4},
    "rolling_constant_torque": {"rolling_friction": 0.2},
    "rolling_spring_dashpot": {"rolling_friction": 0.2, "rolling_damping": 0.3},
}
_benches = {}


def bench(kind, **values):
    """Return a bench for an effect on top of the normal force it needs."""
    key = (kind, tuple(sorted(values.items())))
    if key not in _benches:
        middle = {p.name: sum(p.plausible) / 2 for p in kind.parameters}
        effect = kind(**{**middle, **PLAUSIBLE.get(kind.name, {}), **values})
        _benches[key] = Bench([effect] if effect.family == "normal" else [NormalHertz(restitution=1.0), effect])
    return _benches[key]


def history(seed, n=60):
    """Return a wild but smooth motion of a pressed pair: load, slip, rolling, twist and a turning normal."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, n)[:, None]
    wave = [rng.normal(size=3) * np.sin(2 * np.pi * (t * rng.uniform(0.5, 2) + rng.uniform())) for _ in range(4)]
    normal = np.array([1.0, 0.2, -0.3]) + 0.2 * wave[0]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    overlap = 1e-4 * (1.2 + np.sin(2 * np.pi * t * 1.5 + rng.uniform(0, 6)))
    return np.hstack([normal, overlap, 0.5 * wave[1], 30 * wave[2], 30 * wave[3]])


def rotation(seed):
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
    out = states.copy()
    for first in (NORMAL, VELOCITY, SPIN_I, SPIN_J):
        out[:, first : first + 3] = states[:, first : first + 3] @ matrix.T
    return out


@pytest.mark.parametrize("kind", BUILT_IN.values(), ids=lambda k: k.name)
def test_declaration_is_complete(kind):
    assert kind.name == kind.name.lower()
    assert " " not in kind.name
    assert kind.title
    assert kind.source
    assert kind.visible_as
    assert "Expected behaviour" in kind.__doc__
    for p in kind.parameters:
        assert p.unit
        assert p.meaning.endswith(".")
        assert p.low <= p.plausible[0] < p.plausible[1] <= p.high
        assert p.vanishing is None or p.low <= p.vanishing <= p.high
        assert p.default is None or p.low <= p.default <= p.high
    names = [p.name for p in kind.parameters]
    assert len(set(names)) == len(names)
    assert issubclass(kind, (ContactEffect, BodyEffect, SetupEffect))
    effect = kind(**{p.name: sum(p.plausible) / 2 for p in kind.parameters})
    if issubclass(kind, ContactEffect):
        assert kind.stage in Stage
        given = effect.kernel_coefficients(PAIR)
        assert set(given) == set(kind.coefficients)
        assert all(math.isfinite(v) for v in given.values())
        assert len({m.name for m in kind.memory}) == len(kind.memory)
    elif issubclass(kind, BodyEffect):
        assert set(effect.kernel_coefficients()) == set(effect.coefficients)


def test_names_are_unique():
    assert len({k.name for k in BUILT_IN.values()}) == len(BUILT_IN.values())


@pytest.mark.parametrize("kind", CONTACT, ids=lambda k: k.name)
def test_vanishes_at_its_vanishing_value_and_without_overlap(kind):
    strength = {p.name: p.vanishing for p in kind.parameters if p.vanishing is not None}
    if strength:
        alone = Bench([NormalHertz(restitution=1.0)])
        for seed in range(3):
            force, torque = bench(kind, **strength).run(history(seed))
            plain, _ = alone.run(history(seed))
            assert np.array_equal(force, plain)
            assert not np.any(torque)
    apart = history(5)
    apart[:, OVERLAP] = 0.0
    force, torque = bench(kind).run(apart)
    assert not np.any(force)
    assert not np.any(torque)


@pytest.mark.parametrize("kind", CONTACT, ids=lambda k: k.name)
@pytest.mark.parametrize("seed", range(4))
def test_swapping_the_sides_swaps_the_wrench(kind, seed):
    """Action = reaction, through a whole history: seen from j, force and couple are the opposite."""
    states = history(seed)
    swapped = states.copy()
    swapped[:, NORMAL : NORMAL + 3] *= -1
    swapped[:, VELOCITY : VELOCITY + 3] *= -1
    swapped[:, SPIN_I : SPIN_I + 3] = states[:, SPIN_J : SPIN_J + 3]
    swapped[:, SPIN_J : SPIN_J + 3] = states[:, SPIN_I : SPIN_I + 3]
    force, torque = bench(kind).run(states)
    other_force, other_torque = bench(kind).run(swapped)
    assert np.abs(force).max() > 0
    assert other_force == pytest.approx(-force, rel=1e-12, abs=1e-12 * np.abs(force).max())
    assert other_torque == pytest.approx(-torque, rel=1e-12, abs=1e-12 * max(np.abs(torque).max(), 1e-300))


@pytest.mark.parametrize("kind", CONTACT, ids=lambda k: k.name)
@pytest.mark.parametrize("seed", range(4))
def test_turning_the_frame_turns_the_answer(kind, seed):
    states, matrix = history(seed), rotation(seed)
    force, torque = bench(kind).run(states)
    turned_force, turned_torque = bench(kind).run(turned(states, matrix))
    assert turned_force == pytest.approx(force @ matrix.T, abs=1e-12 * np.abs(force).max())
    assert turned_torque == pytest.approx(torque @ matrix.T, abs=1e-11 * max(np.abs(torque).max(), 1e-300))


def power(kind, states, wall=0):
    """Return the work done on the pair [J] in each step by force and couple."""
    force, torque = bench(kind).run(states, wall=wall)
    return DT * (
        (force * states[:, VELOCITY : VELOCITY + 3]).sum(1)
        + (torque * (states[:, SPIN_I : SPIN_I + 3] - states[:, SPIN_J : SPIN_J + 3])).sum(1)
    )


def cycle(kind, seed):
    """Return a closed path: press, shear and roll in some order, and back to the start along another order.

    The load changes while shear and rolling are held, so that a memory that stores the wrong thing gains energy.
    """
    rng = np.random.default_rng(seed)
    n = 400
    low, high = 0.3e-4, 1.5e-4
    legs = []

    def leg(start, end, slip=0.0, roll=0.0):
        states = np.zeros((n, 13))
        states[:, 0] = 1.0
        states[:, OVERLAP] = np.linspace(start, end, n + 1)[1:] * 0.5 + np.linspace(start, end, n + 1)[:-1] * 0.5
        states[:, VELOCITY] = -(end - start) / (n * DT)
        states[:, VELOCITY + 1] = slip / (n * DT)
        states[:, SPIN_I + 2] = roll / (n * DT)
        legs.append(states)

    slip, roll = rng.uniform(0.1, 1.0) * 1e-6, rng.uniform(0.1, 1.0) * 2e-4
    leg(low, high)
    leg(high, high, slip, roll)
    leg(high, low)
    leg(low, low, -slip, -roll)
    for _ in range(3):  # to and fro at low load, to take out what a spring may still hold
        leg(low, low, -slip, -roll)
        leg(low, low, slip, roll)
    return np.vstack(legs)


@pytest.mark.parametrize("kind", CONTACT, ids=lambda k: k.name)
@pytest.mark.parametrize("seed", range(6))
def test_never_creates_energy(kind, seed):
    """Along a closed path of load, slip and rolling the work on the pair is never positive at its end."""
    options = {"rolling_damping": 0.0} if kind is RollingSpringDashpot else {}
    made = bench(kind, **options)
    states = cycle(kind, seed)
    force, torque = made.run(states)
    normal_only = force[:, 0] * states[:, VELOCITY]
    work = (force * states[:, VELOCITY : VELOCITY + 3]).sum(1)
    work = work + (torque * (states[:, SPIN_I : SPIN_I + 3] - states[:, SPIN_J : SPIN_J + 3])).sum(1)
    if kind.family != "normal":
        work = work - normal_only  # the elastic normal force returns what it took
    total = DT * np.cumsum(work)
    turnover = DT * np.abs(work).sum()
    gained = max(total[-1], (total - 0).max())
    assert gained <= 2e-3 * turnover, f"{gained / turnover:.2%} of the turnover was gained"


@pytest.mark.parametrize("kind", [NormalHertz], ids=lambda k: k.name)
def test_conservative_force_is_the_slope_of_its_energy(kind):
    """F = −dE/dδ, with E = 2/5 F δ of Hertz, and the force itself by the closed form."""
    overlaps = np.linspace(1e-5, 2e-4, 40)
    states = np.zeros((40, 13))
    states[:, 0] = 1.0
    states[:, OVERLAP] = overlaps
    force, _ = bench(kind, restitution=1.0).run(states)
    modulus = PAIR.youngs_modulus
    assert force[:, 0] == pytest.approx(4 / 3 * modulus * math.sqrt(RADIUS / 2) * overlaps**1.5, rel=1e-12)
    energy = 8 / 15 * modulus * math.sqrt(RADIUS / 2) * overlaps**2.5
    assert np.gradient(energy, overlaps, edge_order=2)[1:-1] == pytest.approx(force[1:-1, 0], rel=2e-2)
    assert modulus == pytest.approx(0.5 * 1e7 / (1 - 0.3**2))


def test_moduli_of_unlike_materials():
    """E 400 and 600 with ν 0.2 must give 250 (known defect elsewhere), and G* by its own formula."""
    pair = MaterialPair(Material("a", 1.0, 400.0, 0.2), Material("b", 1.0, 600.0, 0.2))
    assert pair.youngs_modulus == pytest.approx(250.0)
    assert pair.shear_modulus == pytest.approx(1 / (1.8 * 2.4 / 400 + 1.8 * 2.4 / 600))


def test_history_turns_with_the_pair():
    """Sheared, then turned rigidly about any axis by a whole turn: no new force, none lost, the same direction."""
    made = bench(TangentialMindlin, static_friction=5.0)
    n = 20000
    for axis in ([0, 0, 1.0], [1.0, 0, 0], [0.6, 0, 0.8]):
        axis = np.array(axis)
        shear = np.zeros((50, 13))
        shear[:, 0] = 1.0
        shear[:, OVERLAP] = 1e-4
        shear[:, VELOCITY + 1 : VELOCITY + 3] = [0.01, 0.02]
        angles = 2 * np.pi * np.arange(1, n + 1) / n
        start = np.array([1.0, 0, 0])
        along = (axis @ start) * axis
        across = start - along
        turn = np.zeros((n, 13))
        turn[:, :3] = along + np.cos(angles)[:, None] * across + np.sin(angles)[:, None] * np.cross(axis, across)
        turn[:, OVERLAP] = 1e-4
        turn[:, SPIN_I : SPIN_I + 3] = turn[:, SPIN_J : SPIN_J + 3] = 2 * np.pi / (n * DT) * axis
        force, torque = made.run(np.vstack([shear, turn]))
        before, after = force[49], force[-1]
        assert np.linalg.norm(before[1:]) > 0
        # First order in the angle per step: a whole turn in n steps leaves 2 π²/n.
        assert after[1:] == pytest.approx(before[1:], abs=2.2 * np.pi**2 / n * np.linalg.norm(before[1:]))
        assert not np.any(torque)


@pytest.mark.parametrize("kind", [RollingConstantTorque, RollingSpringDashpot], ids=lambda k: k.name)
def test_rolling_couple_has_its_cap_and_no_part_along_the_normal(kind):
    states = history(3)
    states[:, :3] = [0, 0, 1.0]
    states[:, OVERLAP] = 1e-4
    states[:, SPIN_I : SPIN_I + 3] = [400.0, 300.0, 70.0]
    states[:, SPIN_J : SPIN_J + 3] = [0.0, 0.0, -70.0]  # a twist alone, which must not turn the couple
    _, torque = bench(kind).run(np.vstack([states] * 20))
    elastic = 4 / 3 * PAIR.youngs_modulus * math.sqrt(RADIUS / 2) * 1e-6
    assert np.all(torque[:, 2] == 0)
    assert torque[-1] == pytest.approx(-0.2 * RADIUS / 2 * elastic * np.array([0.8, 0.6, 0]), rel=1e-9)


@pytest.mark.parametrize("attraction", [False, True])
def test_friction_never_uses_an_attractive_normal_force(attraction):
    """Separating fast while still overlapping: Coulomb's limit is zero, not the size of a pull."""
    made = Bench([NormalHertz(restitution=0.1, attraction=attraction), TangentialMindlin(static_friction=0.5)])
    states = np.zeros((50, 13))
    states[:, 0] = 1.0
    states[:, OVERLAP] = 1e-5
    states[:, VELOCITY] = 20.0
    states[:, VELOCITY + 1] = 1.0
    force, _ = made.run(states)
    assert (force[0, 0] < 0) == attraction
    assert np.all(force[:, 1:] == 0)


@pytest.mark.parametrize("kind", BUILT_IN.values(), ids=lambda k: k.name)
def test_errors_of_parameters(kind):
    middle = {p.name: sum(p.plausible) / 2 for p in kind.parameters}
    first = kind.parameters[0]
    misspelt = first.name[:-1] + "q" if len(first.name) > 1 else "xx"
    with pytest.raises(InputError, match=r"Unknown parameter") as caught:
        kind(**middle, **{misspelt: 1.0})
    assert first.name in str(caught.value)
    for p in kind.parameters:
        for bad in (p.high * 1.01 + 1, p.low - 1, math.nan, math.inf, "much", None if p.default is None else "x"):
            with pytest.raises(InputError) as caught:
                kind(**{**middle, p.name: bad})
            assert f"{kind.name}.{p.name}" in str(caught.value)
        if p.default is None:
            with pytest.raises(InputError, match="missing"):
                kind(**{k: v for k, v in middle.items() if k != p.name})


def test_composition_is_checked():
    with pytest.raises(CompositionError, match="normal"):
        Model([SOFT], [TangentialMindlin(static_friction=0.5)])
    with pytest.raises(CompositionError, match="rolling"):
        Model(
            [SOFT],
            [
                NormalHertz(restitution=0.5),
                RollingConstantTorque(rolling_friction=0.1),
                RollingSpringDashpot(rolling_friction=0.1),
            ],
        )
    with pytest.raises(CompositionError, match="instances"):
        Model([SOFT], [NormalHertz])


@ti.kernel
def _weigh(effect: ti.template(), given: ti.template(), out: ti.types.ndarray()):
    for _ in range(1):
        part = effect.wrench(given[0], Body(mass=2.0))
        for axis in ti.static(range(3)):
            out[axis] = part.force[axis]


@pytest.mark.parametrize("kind", [k for k in BUILT_IN.values() if issubclass(k, BodyEffect)], ids=lambda k: k.name)
def test_body_effects_vanish(kind):
    arena = Arena()
    table = arena.table(1, dict.fromkeys(kind().coefficients, ti.f64))
    arena.seal()
    out = np.ones(3)
    _weigh(kind(), table, out)
    assert not np.any(out)
    for name, value in kind().kernel_coefficients().items():
        table.get_member_field(name)[0] = value
    _weigh(kind(), table, out)
    assert out.tolist() == [0, 0, -2 * 9.81]
    arena.destroy()
