"""What every registered effect must obey; a new one is on trial here as soon as it stands in the registry."""

import math

import numpy as np
import pytest

from taichidem import plugins
from taichidem.effects.base import BodyEffect, ContactEffect, SetupEffect, Stage
from taichidem.errors import CompositionError, InputError
from taichidem.materials import Material, MaterialPair
from taichidem.scene import Model
from tests.effect_bench import (
    DT,
    HELD,
    OVERLAP,
    PAIR,
    RADIUS,
    SOFT,
    SPIN_I,
    SPIN_J,
    VELOCITY,
    at_rest,
    base_bench,
    bench,
    beneath,
    body_bench,
    history,
    middle,
    partners_of,
    reach_of,
    rotation,
    turned,
    work,
)

EVERY = [plugins.get("effect", name) for name in plugins.names("effect")]
CONTACT = [e for e in EVERY if issubclass(e, ContactEffect)]
BODY = [e for e in EVERY if issubclass(e, BodyEffect)]


def named(kinds):
    return pytest.mark.parametrize("kind", kinds, ids=lambda k: k.name)


def deepest_gap(kind):
    """Return a gap [m] that a history should reach, where the effect can act before touch."""
    return 0.8 * reach_of(kind)


@named(EVERY)
def test_declaration_is_complete(kind):
    assert kind.name == kind.name.lower()
    assert " " not in kind.name
    assert kind.title
    assert kind.source
    assert kind.visible_as
    assert "Expected behaviour" in kind.__doc__
    assert kind.parameters
    for p in kind.parameters:
        assert p.unit
        assert p.meaning.endswith(".")
        assert p.low <= p.plausible[0] < p.plausible[1] <= p.high
        assert p.vanishing is None or p.low <= p.vanishing <= p.high
        assert p.default is None or p.low <= p.default <= p.high
    names = [p.name for p in kind.parameters]
    assert len(set(names)) == len(names)
    assert issubclass(kind, (ContactEffect, BodyEffect, SetupEffect))
    effect = middle(kind)
    if not issubclass(kind, SetupEffect):
        assert kind.similarity is not None
        assert kind.similarity.kept
    if issubclass(kind, ContactEffect):
        assert kind.stage in Stage
        given = effect.kernel_coefficients(PAIR)
        assert set(given) == set(kind.coefficients)
        assert all(math.isfinite(v) for v in given.values())
        assert len({m.name for m in kind.memory}) == len(kind.memory)
        assert 0 <= effect.reach(PAIR, RADIUS) < 10 * RADIUS
    elif issubclass(kind, BodyEffect):
        assert set(effect.kernel_coefficients()) == set(effect.coefficients)


def test_names_are_unique():
    assert len({k.name for k in EVERY}) == len(EVERY)


@named([k for k in EVERY if k.name not in ("normal_hertz", "body_gravity")])
def test_every_effect_can_vanish(kind):
    """It is a hypothesis of the diagnosis only if there is a value at which it does nothing."""
    assert any(p.vanishing is not None for p in kind.parameters)


@named([k for k in CONTACT if any(p.vanishing is not None for p in k.parameters)])
def test_contact_effects_do_nothing_at_their_vanishing_value(kind):
    none = {p.name: p.vanishing for p in kind.parameters if p.vanishing is not None}
    for seed in range(3):
        states = history(seed, deepest_gap=deepest_gap(kind))
        out = bench(kind, **none).answers(states)
        plain = base_bench(kind).answers(states)
        scale = np.abs(plain).max()
        assert np.abs(out - plain).max() <= 1e-9 * scale


@named(CONTACT)
def test_grains_out_of_reach_feel_nothing(kind):
    apart = history(5)
    apart[:, OVERLAP] = -1.01 * reach_of(kind) - (1e-9 if reach_of(kind) else 0.0)
    if kind.stage == Stage.ADHESION and not reach_of(kind):
        apart[:, OVERLAP] = -1e-12
    out = bench(kind).answers(apart)
    assert not np.any(out)


@named(CONTACT)
@pytest.mark.parametrize("seed", range(4))
def test_swapping_the_sides_swaps_the_wrench(kind, seed):
    """Action = reaction, through a whole history: seen from j, force and couple are the opposite."""
    states = history(seed, deepest_gap=deepest_gap(kind))
    swapped = states.copy()
    swapped[:, :3] *= -1
    swapped[:, VELOCITY : VELOCITY + 3] *= -1
    swapped[:, SPIN_I : SPIN_I + 3] = states[:, SPIN_J : SPIN_J + 3]
    swapped[:, SPIN_J : SPIN_J + 3] = states[:, SPIN_I : SPIN_I + 3]
    out, other = bench(kind).answers(states), bench(kind).answers(swapped)
    assert np.abs(out[:, :3]).max() > 0
    assert other[:, :3] == pytest.approx(-out[:, :3], rel=1e-12, abs=1e-12 * np.abs(out[:, :3]).max())
    assert other[:, 3:6] == pytest.approx(-out[:, 3:6], rel=1e-12, abs=1e-12 * max(np.abs(out[:, 3:6]).max(), 1e-300))
    assert other[:, [7, 6]] == pytest.approx(out[:, 6:8], rel=1e-12, abs=1e-12 * HELD)


@named(CONTACT)
@pytest.mark.parametrize("seed", range(4))
def test_turning_the_frame_turns_the_answer(kind, seed):
    states, matrix = history(seed, deepest_gap=deepest_gap(kind)), rotation(seed)
    force, torque = bench(kind).run(states)
    turned_force, turned_torque = bench(kind).run(turned(states, matrix))
    assert turned_force == pytest.approx(force @ matrix.T, abs=1e-11 * np.abs(force).max())
    assert turned_torque == pytest.approx(torque @ matrix.T, abs=1e-11 * max(np.abs(torque).max(), 1e-300))


def closed_path(kind, seed):
    """Return a path that ends where it began: from out of reach to touch, press, shear, roll and twist, and back.

    The load changes while shear and rolling are held, so that a memory that stores the wrong thing gains energy.
    """
    rng = np.random.default_rng(seed)
    n = 400
    far, low, high = -1.5 * reach_of(kind) - 1e-6, 0.3e-4, 1.5e-4
    legs = []

    def leg(start, end, slip=0.0, roll=0.0, twist=0.0):
        states = np.zeros((n, 13))
        states[:, 0] = 1.0
        ends = np.linspace(start, end, n + 1)
        states[:, OVERLAP] = 0.5 * (ends[1:] + ends[:-1])
        states[:, VELOCITY] = -(end - start) / (n * DT)
        states[:, VELOCITY + 1] = slip / (n * DT)
        states[:, SPIN_I] = twist / (n * DT)
        states[:, SPIN_I + 2] = roll / (n * DT)
        legs.append(states)

    slip, roll, twist = rng.uniform(0.1, 1.0, 3) * [1e-6, 2e-4, 2e-4]
    leg(far, low)
    leg(low, high)
    leg(high, high, slip, roll, twist)
    leg(high, low)
    leg(low, low, -slip, -roll, -twist)
    for _ in range(3):  # to and fro at low load, to take out what a spring may still hold
        leg(low, low, -slip, -roll, -twist)
        leg(low, low, slip, roll, twist)
    leg(low, far)
    return np.vstack(legs)


@named(CONTACT)
@pytest.mark.parametrize("seed", range(6))
def test_never_creates_energy(kind, seed):
    """Along a closed path of gap, load, slip, rolling and twist the work on the pair is not positive at its end."""
    undamped = {p.name: 0.0 for p in kind.parameters if p.name.endswith("damping") or p.name == "viscosity"}
    states = closed_path(kind, seed)
    done = work(states, *bench(kind, **undamped).run(states))
    if kind.family != "normal":
        plain = done - work(states, *base_bench(kind).run(states))
        done = plain if not kind.needs else done
    gained = done.sum()
    assert gained <= 2e-3 * np.abs(done).sum(), f"{gained / np.abs(done).sum():.2%} of the turnover was gained"


@named([k for k in CONTACT if k.conservative])
def test_conservative_force_is_the_slope_of_its_energy(kind):
    """F = −dE/d(distance) = dE/dδ along the normal, at rest, from touch to compression and over the gap that it reaches."""
    still = {"restitution": 1.0} if kind.name == "normal_hertz" else {}
    overlaps = np.concatenate(
        [np.linspace(-0.9 * reach_of(kind), -1e-7, 40)[: 40 if reach_of(kind) else 0], np.linspace(1e-5, 2e-4, 40)]
    )
    made = bench(kind, **still)
    wall = partners_of(kind)
    force = made.run(at_rest(overlaps), wall)[0][:, 0]
    if kind.family != "normal":
        force = force - base_bench(kind).run(at_rest(overlaps), wall)[0][:, 0]
    step = 1e-9
    slope = made.energies(overlaps + step, kind, wall=wall) - made.energies(overlaps - step, kind, wall=wall)
    slope /= 2 * step
    assert np.abs(force).max() > 0
    assert slope == pytest.approx(force, rel=1e-4, abs=1e-6 * np.abs(force).max())


@named(CONTACT)
@pytest.mark.parametrize("factor", [2.0, 4.0])
def test_coarse_graining_keeps_what_it_promises(kind, factor):
    """Grains s times as large under the effect's rule: its wrench is the same power of s everywhere along a history."""
    rule = kind.similarity
    # A dashpot keeps its damping ratio, whose force follows another power.
    undamped = {p.name: 0.0 for p in kind.parameters if p.name.endswith("damping")}
    effect = middle(kind, **undamped)
    states = history(2, deepest_gap=deepest_gap(kind))
    large = states.copy()
    large[:, OVERLAP] *= factor**rule.overlap
    large[:, VELOCITY : VELOCITY + 3] *= factor**rule.speed
    large[:, SPIN_I:] *= factor ** (rule.speed - 1)
    time = factor ** (rule.overlap - rule.speed)
    wall = partners_of(kind)

    def contribution(made, at, **scaled):
        out = made.answers(at, wall, **scaled)
        return out if kind.family == "normal" else out - base_bench(kind).answers(at, wall, **scaled)

    small = contribution(bench(kind, **undamped), states)
    made = bench(kind, **undamped)
    made.set([*beneath(effect), effect.coarse_grained(factor)])
    big = contribution(made, large, radius=factor * RADIUS, dt=DT * time, held=HELD * factor**3)
    assert np.abs(small).max() > 0
    force, torque = np.abs(small[:, :3]).max(), np.abs(small[:, 3:6]).max()
    # Not to round-off: a memory also turns with the pair, by an angle that is no length and follows no power of its own.
    assert big[:, :3] / factor**rule.force == pytest.approx(small[:, :3], abs=5e-3 * force)
    assert big[:, 3:6] / factor ** (rule.force + 1) == pytest.approx(small[:, 3:6], abs=5e-3 * max(torque, 1e-300))


@named(BODY)
def test_body_effects_vanish_and_scale(kind):
    none = {p.name: p.vanishing for p in kind.parameters if p.vanishing is not None}
    made = body_bench(middle(kind, **none))
    alone = np.zeros(3) if kind.family == "gravity" else np.array([0.0, 0.0, -9.81])
    assert made.push([0.3, -0.2, 0.1]) == pytest.approx(alone, abs=1e-12)

    rule, effect, s = kind.similarity, middle(kind), 3.0
    mass = 4 / 3 * np.pi * RADIUS**3 * SOFT.density
    velocity = np.array([0.3, -0.2, 0.1])
    small = body_bench(effect).push(velocity, RADIUS, mass)
    assert np.any(small - mass * alone)
    big = body_bench(effect.coarse_grained(s)).push(velocity * s**rule.speed, s * RADIUS, s**3 * mass)
    assert big / s**rule.force == pytest.approx(small, rel=1e-9)


@named([k for k in EVERY if issubclass(k, SetupEffect)])
def test_set_up_effects_vanish(kind):
    none = kind(**{p.name: p.vanishing if p.vanishing is not None else p.default for p in kind.parameters})
    field = np.array([0.0, 0.0, -9.81])
    assert np.array_equal(none.gravity(field), field)
    assert none.relative_sizes() == (1.0,)
    effect = middle(kind)
    assert not np.allclose(effect.gravity(field), field) or effect.relative_sizes() != (1.0,)


@named(EVERY)
def test_errors_of_parameters(kind):
    values = {p.name: sum(p.plausible) / 2 for p in kind.parameters}
    first = kind.parameters[0]
    misspelt = first.name[:-1] + "q" if len(first.name) > 1 else "xx"
    with pytest.raises(InputError, match=r"Unknown parameter") as caught:
        kind(**values, **{misspelt: 1.0})
    assert first.name in str(caught.value)
    for p in kind.parameters:
        for bad in (p.high * 1.01 + 1, p.low - 1, math.nan, math.inf, "much", None if p.default is None else "x"):
            with pytest.raises(InputError) as caught:
                kind(**{**values, p.name: bad})
            assert f"{kind.name}.{p.name}" in str(caught.value)
        if p.default is None:
            with pytest.raises(InputError, match="missing"):
                kind(**{k: v for k, v in values.items() if k != p.name})


@named([k for k in CONTACT if k.family != "normal"])
def test_an_effect_without_what_it_needs_is_refused(kind):
    with pytest.raises(CompositionError, match="normal"):
        Model([SOFT], [middle(kind)])
    for family in kind.needs:
        if family != "normal":
            from taichidem.effects import NormalHertz

            with pytest.raises(CompositionError, match=rf"'{kind.name}' needs .*{family}"):
                Model([SOFT], [NormalHertz(restitution=0.5), middle(kind)])


@pytest.mark.parametrize("family", sorted({k.family for k in EVERY if k.family}))
def test_two_of_a_family_are_refused(family):
    kinds = [k for k in EVERY if k.family == family]
    pair = [middle(kinds[0]), middle(kinds[-1])]
    with pytest.raises(CompositionError, match=rf"both of family '{family}'"):
        Model([SOFT], [*beneath(pair[0]), *pair] if family not in ("normal", "tangential") else pair)


def test_no_classes_instead_of_effects():
    with pytest.raises(CompositionError, match="instances"):
        Model([SOFT], [EVERY[0]])


def test_moduli_of_unlike_materials():
    """E 400 and 600 with ν 0.2 must give 250 (known defect elsewhere), and G* by its own formula."""
    pair = MaterialPair(Material("a", 1.0, 400.0, 0.2), Material("b", 1.0, 600.0, 0.2))
    assert pair.youngs_modulus == pytest.approx(250.0)
    assert pair.shear_modulus == pytest.approx(1 / (1.8 * 2.4 / 400 + 1.8 * 2.4 / 600))
