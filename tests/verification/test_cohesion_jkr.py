"""The JKR curve, its hysteresis, and what it leaves to friction and rolling, in prescribed contact states."""

import math

import numpy as np
import pytest

from taichidem.effects import (
    CohesionDmt,
    CohesionJkr,
    NormalHertz,
    RollingConstantTorque,
    RollingSpringDashpot,
    TangentialMindlin,
)
from taichidem.effects.cohesion_jkr import tabor_parameter
from taichidem.errors import CompositionError
from taichidem.materials import Material, MaterialPair
from taichidem.scene import Model
from tests.apparatus import effective_modulus, effective_shear_modulus, reference
from tests.effect_bench import DT, PAIR, RADIUS, SOFT, SPIN_I, VELOCITY, Bench, at_rest, bench

MODULUS = effective_modulus(SOFT, SOFT)
ENERGY = 1.0  # [J/m²]
PULL_OFF = 1.5 * math.pi * ENERGY * RADIUS / 2  # between grains [N]
A0 = (9 * math.pi * ENERGY * (RADIUS / 2) ** 2 / (2 * MODULUS)) ** (1 / 3)
LENGTH = A0**2 / (RADIUS / 2)  # of the overlaps
TEAR = 0.2751606 * LENGTH  # the gap of the reference table


def curve(a, energy, radius, modulus=MODULUS):
    """Return overlap [m] and force [N] for a contact radius, straight from the two equations."""
    overlap = a**2 / radius - np.sqrt(2 * math.pi * energy * a / modulus)
    return overlap, 4 * modulus * a**3 / (3 * radius) - np.sqrt(8 * math.pi * energy * modulus * a**3)


def pressed_first(overlaps):
    """Return states at rest that begin in touch, so that the contact has formed."""
    return at_rest(np.concatenate([[1e-5], overlaps]))


def forces(overlaps, energy=ENERGY, wall=0):
    return bench(CohesionJkr, work_of_adhesion=energy).run(pressed_first(overlaps), wall)[0][1:, 0]


@pytest.mark.parametrize("energy", [1e-140, 1e-60, 1e-30, 1e-12, 1e-6, 1e-3, 1.0, 50.0])
@pytest.mark.parametrize("wall", [0, 1])
def test_the_whole_curve_for_any_work_of_adhesion(energy, wall):
    radius = RADIUS if wall else RADIUS / 2
    a0 = (9 * math.pi * energy * radius**2 / (2 * MODULUS)) ** (1 / 3)
    # From just above the fold, where the force changes as the root of the distance to it, to far above.
    a = np.sort(np.concatenate([np.linspace(0.304 * a0, 3 * a0, 200), np.geomspace(3 * a0, 1.5e-3, 100)]))[::-1]
    a = a[a <= 1.5e-3]
    overlap, force = curve(a, energy, radius)
    pull_off = 1.5 * math.pi * energy * radius
    assert overlap.min() < -0.275 * a0**2 / radius
    error = forces(overlap, energy, wall) - force
    assert np.all(np.abs(error) <= 1e-11 * pull_off + 1e-13 * np.abs(force))


def test_what_is_too_small_for_floats_is_hertz():
    overlaps = np.concatenate([np.geomspace(1e-3, 1e-300, 200), [0.0, -1e-300, -1e-9]])
    hertz = bench(CohesionJkr, work_of_adhesion=0.0).answers(at_rest(overlaps))
    for energy in (1e-323, 1e-280, 1e-150, 1e-140, 1e-60):
        answer = bench(CohesionJkr, work_of_adhesion=energy).answers(at_rest(overlaps))
        assert answer == pytest.approx(hertz, rel=1e-13, abs=10 * energy)


def test_points_of_the_dimensionless_table():
    rows = reference("jkr_force_curve_dimensionless.csv")
    columns = ("delta_R_over_a0sq_1", "F_over_Fc_compressive_positive_1", "a_over_a0_1")
    overlap, force, radius = np.array([[float(row[c]) for c in columns] for row in rows]).T
    order = np.argsort(-overlap)[:-1]  # without the fold itself, which six digits may miss
    assert len(order) > 5
    assert forces(overlap[order] * LENGTH) == pytest.approx(force[order] * PULL_OFF, rel=2e-5, abs=2e-5 * PULL_OFF)
    assert radius[order][0] > 1 > radius[order][-1]


def examples():
    """Return the reference's cases, each with a pair of materials and the index of its partner."""
    for row in reference("jkr_examples.csv"):
        numbers = {k: float(v) for k, v in row.items() if k != "case"}
        wall = int("wall" in row["case"])
        yield row["case"], wall, numbers


def test_reference_cases():
    for case, wall, n in examples():
        modulus, radius = n["E_eff_Pa"], n["R_eff_m"]
        solid = Material("solid", 2500.0, 2 * modulus * (1 - 0.25**2), 0.25)
        pair = MaterialPair(solid, solid)
        effect = CohesionJkr(work_of_adhesion=n["work_of_adhesion_J_m2"])
        made = bench(CohesionJkr)
        made.set([NormalHertz(restitution=1.0), effect], pair)
        tear, floor = n["delta_pulloff_disp_control_m"], n["delta_at_max_tension_m"]
        below = tear * (1 - np.geomspace(1, 1e-5, 2000))  # from 0 down to the tear, dense there
        overlaps = np.concatenate([[n["delta_zero_load_m"], floor], below, [tear * (1 + 1e-5)]])
        force = made.run(at_rest(overlaps), wall, radius=radius if wall else 2 * radius)[0][:, 0]
        pull_off = n["pulloff_force_N"]
        assert force[0] == pytest.approx(0.0, abs=1e-4 * pull_off), case
        assert force[1] == pytest.approx(-pull_off, rel=1e-5), case
        assert force[1:].min() == pytest.approx(-pull_off, rel=1e-5), case
        assert force[2] == pytest.approx(-8 / 9 * pull_off, rel=1e-5), case
        assert force[-2] == pytest.approx(-5 / 9 * pull_off, rel=0.02), case
        assert force[-1] == 0.0, case
        assert effect.reach(pair, radius) == pytest.approx(-tear, rel=1e-5), case
        work = np.trapezoid(force[2:-1], below)
        assert work == pytest.approx(n["separation_work_from_delta0_J"], rel=1e-3), case
        assert math.sqrt(2 * work / n["m_eff_kg"]) == pytest.approx(n["sticking_velocity_m_s"], rel=1e-3), case
        found = tabor_parameter(n["work_of_adhesion_J_m2"], radius, modulus)
        assert found == pytest.approx(n["tabor_parameter_z0_0p165nm"], rel=1e-5), case


def test_named_points_without_the_reference_files():
    at = np.array([1 / 3, 0.0, -0.1322834, -0.27516]) * LENGTH
    wanted = np.array([0.0, -8 / 9, -1.0, -5 / 9]) * PULL_OFF
    assert forces(at) == pytest.approx(wanted, abs=3e-3 * PULL_OFF)
    assert forces(at)[:3] == pytest.approx(wanted[:3], abs=1e-6 * PULL_OFF)
    assert CohesionJkr(work_of_adhesion=ENERGY).reach(PAIR, RADIUS / 2) == pytest.approx(TEAR, rel=1e-6)


def test_a_contact_forms_at_touch_and_tears_at_its_distance():
    gap = TEAR * np.array([-0.9, -1e-9, 0.0, -0.5, -0.999, -1.001, -0.999, -0.1, 1e-9, -0.9])
    force = bench(CohesionJkr, work_of_adhesion=ENERGY).run(at_rest(gap))[0][:, 0]
    alive = np.array([0, 0, 1, 1, 1, 0, 0, 0, 1, 1], bool)
    assert np.array_equal(force != 0, alive)
    assert np.all(force[alive] < -5 / 9 * PULL_OFF)


@pytest.mark.parametrize("overlap", [2e-5, 0.0, -0.2 * LENGTH])
def test_friction_is_capped_by_the_force_and_twice_the_pull_off(overlap):
    """Thornton & Yin: μ (F + 2 F_c), while F may pull."""
    effects = [
        NormalHertz(restitution=1.0),
        TangentialMindlin(static_friction=0.4),
        CohesionJkr(work_of_adhesion=ENERGY),
    ]
    states = pressed_first(np.full(50, overlap))
    states[:, VELOCITY + 1] = 10.0
    force = Bench(effects).run(states)[0]
    normal = forces(np.array([overlap]))[0]
    assert force[-1, 0] == pytest.approx(normal, rel=1e-12)
    assert force[-1, 1] == pytest.approx(-0.4 * (normal + 2 * PULL_OFF), rel=1e-9)


def contact_radius(overlap):
    """Return a [m] by bisection of the second equation."""
    low, high = 0.3029 * A0, 10 * A0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if curve(middle, ENERGY, RADIUS / 2)[0] < overlap else (low, middle)
    return low


@pytest.mark.parametrize("overlap", [2e-5, -0.2 * LENGTH])
def test_tangential_stiffness_is_that_of_the_contact_radius(overlap):
    """k_t = 8 G* a with the a of JKR, and a held force falls with it as the contact is drawn apart."""
    effects = [
        NormalHertz(restitution=1.0),
        TangentialMindlin(static_friction=5.0),
        CohesionJkr(work_of_adhesion=ENERGY),
    ]
    later = overlap - 0.05 * LENGTH
    states = pressed_first(np.array([overlap] * 6 + [later]))
    states[1:6, VELOCITY + 1] = 1e-2
    force = Bench(effects).run(states)[0]
    stiffness = 8 * effective_shear_modulus(SOFT, SOFT) * contact_radius(overlap)
    assert force[5, 1] == pytest.approx(-5 * stiffness * 1e-2 * DT, rel=1e-9)
    shrunk = contact_radius(later) / contact_radius(overlap)
    assert shrunk < 0.99
    assert force[7, 1] == pytest.approx(shrunk * force[6, 1], rel=1e-9)


@pytest.mark.parametrize("overlap", [2e-5, -0.2 * LENGTH])
def test_rolling_is_capped_and_stiff_as_the_adhering_contact(overlap):
    base = [NormalHertz(restitution=1.0), CohesionJkr(work_of_adhesion=ENERGY)]
    states = pressed_first(np.full(8, overlap))
    states[1:, SPIN_I + 2] = 1.0
    constant = Bench([*base, RollingConstantTorque(rolling_friction=0.1)]).run(states)[1]
    load = forces(np.array([overlap]))[0] + 2 * PULL_OFF
    assert constant[-1, 2] == pytest.approx(-0.1 * RADIUS / 2 * load, rel=1e-9)
    spring = Bench([*base, RollingSpringDashpot(rolling_friction=0.1, rolling_damping=0.0)]).run(states)[1]
    stiffness = 2.25 * 4 / 3 * MODULUS * contact_radius(overlap) * (0.1 * RADIUS / 2) ** 2
    assert np.diff(spring[3:, 2]) == pytest.approx(np.full(5, -stiffness * DT), rel=1e-6)


@pytest.mark.parametrize("restitution", [0.05, 0.5, 1.0])
def test_damping_is_finite_and_smooth_at_first_touch(restitution):
    """A dashpot made from F/δ is no number there; this one is Hertz's, which begins at 0 with the overlap."""
    overlaps = np.concatenate([-np.geomspace(1e-6, 1e-15, 10), [0.0], np.geomspace(1e-300, 1e-8, 60)])
    states = at_rest(overlaps)
    states[:, VELOCITY] = -1.0
    both = Bench([NormalHertz(restitution=restitution), CohesionJkr(work_of_adhesion=ENERGY)]).run(states)[0][:, 0]
    alone = Bench([NormalHertz(restitution=restitution)]).run(states)[0][:, 0]
    assert np.all(np.isfinite(both))
    assert not np.any(both[:10])
    assert both[10] == pytest.approx(-8 / 9 * PULL_OFF, rel=1e-9)
    elastic = Bench([NormalHertz(restitution=1.0), CohesionJkr(work_of_adhesion=ENERGY)]).run(states)[0][:, 0]
    hertz = Bench([NormalHertz(restitution=1.0)]).run(states)[0][:, 0]
    assert both - elastic == pytest.approx(alone - hertz, abs=1e-12 * PULL_OFF)
    assert np.abs(np.diff(both[10:40])).max() < 1e-6 * PULL_OFF


def test_other_normal_laws_and_a_second_cohesion_are_refused():
    class Linear(NormalHertz):
        name = "normal_linear"

    for cohesion in (CohesionJkr, CohesionDmt):
        with pytest.raises(CompositionError, match=rf"'{cohesion.name}' needs normal_hertz or .*holds normal_linear"):
            Model([SOFT], [Linear(restitution=0.5), cohesion(work_of_adhesion=0.1)])
    with pytest.raises(CompositionError, match="family 'cohesion'"):
        Model([SOFT], [NormalHertz(restitution=0.5), CohesionJkr(work_of_adhesion=1), CohesionDmt(work_of_adhesion=1)])
