"""The yielding contact: its curve, its memory, and Thornton's restitution of impacts."""

import math

import numpy as np
import pytest

from taichidem.effects import NormalElastoplastic, NormalHertz, TangentialMindlin
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, ball, effective_modulus, hertz_impact, scene
from tests.effect_bench import DT, PAIR, RADIUS, VELOCITY, Bench, at_rest, base_bench, bench

RATIO = 60.0  # E*/p_y
REDUCED = RADIUS / 2
MODULUS = PAIR.youngs_modulus
PRESSURE = MODULUS / RATIO
YIELD = (math.pi * PRESSURE / (2 * MODULUS)) ** 2 * REDUCED  # [m]
YIELD_FORCE = 4 / 3 * MODULUS * math.sqrt(REDUCED) * YIELD**1.5


def forces(overlaps, ratio=RATIO):
    """Return the elastic–plastic force [N] along a history of overlaps, without the dashpot."""
    return bench(NormalElastoplastic, modulus_over_yield_pressure=ratio, restitution=1.0).run(at_rest(overlaps))[0][
        :, 0
    ]


def plastic(overlap):
    """Return the force on the plastic line."""
    return YIELD_FORCE + math.pi * PRESSURE * REDUCED * (overlap - YIELD)


def unloading(overlaps, deepest):
    """Return the Hertz curve of the flattened contact, and the overlap at which it ends."""
    force = plastic(deepest)
    flatter = 4 / 3 * MODULUS * (REDUCED * deepest) ** 1.5 / force  # contact area is kept
    end = deepest - (3 * force / (4 * MODULUS * math.sqrt(flatter))) ** (2 / 3)
    return 4 / 3 * MODULUS * math.sqrt(flatter) * np.maximum(overlaps - end, 0.0) ** 1.5, end


def test_loading_is_hertz_then_a_line_without_a_kink_in_the_pressure():
    elastic = np.linspace(0.01, 1.0, 30) * YIELD
    beyond = np.linspace(1.0, 20.0, 30) * YIELD
    out = forces(np.concatenate([elastic, beyond]))
    assert out[:30] == pytest.approx(4 / 3 * MODULUS * math.sqrt(REDUCED) * elastic**1.5, rel=1e-12)
    assert out[30:] == pytest.approx(plastic(beyond), rel=1e-12)
    # Yield begins where Hertz' pressure in the middle, 3 F/(2 π a²), is the limit.
    assert 3 * YIELD_FORCE / (2 * math.pi * REDUCED * YIELD) == pytest.approx(PRESSURE)


def test_below_yield_it_is_hertz_on_the_way_back_too():
    there_and_back = np.concatenate([np.linspace(0.01, 1, 20), np.linspace(1, 0.01, 20)]) * YIELD
    hertz = base_bench(NormalHertz).run(at_rest(there_and_back))[0][:, 0]
    assert forces(there_and_back) == pytest.approx(hertz, rel=1e-10)


def test_unloading_and_loading_again_follow_the_flattened_sphere():
    deepest, deeper = 8 * YIELD, 12 * YIELD
    back, again = np.linspace(deepest, 0.1 * YIELD, 60), np.linspace(0.1 * YIELD, deepest, 60)
    on = np.linspace(deepest, deeper, 30)
    last = np.linspace(deeper, 0.1 * YIELD, 60)
    out = forces(np.concatenate([[deepest], back, again, on, last]))
    expected, end = unloading(back, deepest)
    assert 0.1 * YIELD < end < deepest
    assert out[1:61] == pytest.approx(expected, rel=1e-9, abs=1e-9 * out.max())
    assert np.all(out[1:61][back < end] == 0)  # a flat, no force, and no pull
    assert out[61:121] == pytest.approx(unloading(again, deepest)[0], rel=1e-9, abs=1e-9 * out.max())
    assert out[121:151] == pytest.approx(plastic(on), rel=1e-12)
    assert out[151:] == pytest.approx(unloading(last, deeper)[0], rel=1e-9, abs=1e-9 * out.max())


def test_work_that_is_lost_in_a_cycle():
    """∮F dδ = 2/5 F_y δ_y + (F_y + F_m)/2 (δ_m − δ_y) − 2/5 F_m (δ_m − δ_p)."""
    deepest, n = 10 * YIELD, 4000
    path = np.concatenate([np.linspace(0, deepest, n), np.linspace(deepest, 0, n)])
    middle = 0.5 * (path[1:] + path[:-1])
    lost = float((forces(middle) * np.diff(path)).sum())
    force, end = plastic(deepest), unloading(np.array([deepest]), deepest)[1]
    expected = (
        0.4 * YIELD_FORCE * YIELD + 0.5 * (YIELD_FORCE + force) * (deepest - YIELD) - 0.4 * force * (deepest - end)
    )
    assert lost == pytest.approx(expected, rel=1e-5)
    assert lost > 0.3 * force * deepest * 0.5


def test_a_contact_that_opened_begins_as_new():
    """Also where another effect keeps its memory across a gap."""
    out = forces(np.array([10 * YIELD, -YIELD, 0.5 * YIELD]))
    assert out[1] == 0
    assert out[2] == pytest.approx(4 / 3 * MODULUS * math.sqrt(REDUCED) * (0.5 * YIELD) ** 1.5, rel=1e-12)


def test_friction_sees_the_contact_radius_of_the_flat():
    """k_t = 8 G* a with a² = R* δ while loading and a² = R_p (δ − δ_p) while unloading, no jump between."""
    deepest = 10 * YIELD
    force = plastic(deepest)
    flatter = 4 / 3 * MODULUS * (REDUCED * deepest) ** 1.5 / force
    end = unloading(np.array([deepest]), deepest)[1]
    partly = end + 0.3 * (deepest - end)
    law = [NormalElastoplastic(modulus_over_yield_pressure=RATIO), TangentialMindlin(static_friction=5.0)]
    for history, expected in (
        ([deepest], math.sqrt(REDUCED * deepest)),
        ([deepest, deepest], math.sqrt(REDUCED * deepest)),
        ([deepest, partly], math.sqrt(flatter * (partly - end))),
    ):
        states = at_rest(history)
        states[-1, VELOCITY + 1] = -1e-3
        made = _bench_of(law)
        shear = made.run(states)[0][-1, 1]
        assert shear == pytest.approx(8 * PAIR.shear_modulus * expected * 1e-3 * DT, rel=1e-9)


_made = {}


def _bench_of(law):
    key = tuple(e.composition for e in law)
    if key not in _made:
        _made[key] = Bench(law)
    _made[key].set(law)
    return _made[key]


@pytest.mark.parametrize("attraction", [True, False])
def test_dashpot_follows_the_contact_radius(attraction):
    """F − F_el = −2 √(5/6) β √(2 E* a m*) v on either branch, cut at zero on demand."""
    deepest, speed, e = 10 * YIELD, 0.05, 0.5
    beta = -math.log(e) / math.hypot(math.pi, math.log(e))
    effect = NormalElastoplastic(attraction=True, modulus_over_yield_pressure=RATIO, restitution=e)
    mass = PAIR.first.density * 4 / 3 * math.pi * RADIUS**3 / 2
    states = at_rest([deepest, 0.95 * deepest])
    states[:, VELOCITY] = [-speed, speed]
    force, end = unloading(np.array([0.95 * deepest]), deepest)
    widths = [math.sqrt(REDUCED * deepest), math.sqrt(REDUCED * deepest * (0.95 * deepest - end) / (deepest - end))]
    damping = 2 * math.sqrt(5 / 6) * beta * np.sqrt(2 * MODULUS * np.array(widths) * mass)
    expected = np.array([plastic(deepest), force[0]]) + damping * [speed, -speed]
    if attraction:
        assert _bench_of([effect]).run(states)[0][:, 0] == pytest.approx(expected, rel=1e-9)
    else:
        states[-1, VELOCITY] = 50.0
        cut = NormalElastoplastic(attraction=False, modulus_over_yield_pressure=RATIO, restitution=e)
        assert _bench_of([effect]).run(states)[0][-1, 0] < 0
        assert _bench_of([cut]).run(states)[0][-1, 0] == 0


MASS = SOFT.density * 4 / 3 * math.pi * RADIUS**3


def yield_speed(ratio, modulus=None, radius=RADIUS, mass=MASS):
    """Return V_y [m/s], by default of a sphere against a rigid wall."""
    modulus = modulus or effective_modulus(SOFT)
    return (math.pi / (2 * modulus)) ** 2 * math.sqrt(8 * math.pi * radius**3 / (15 * mass)) * (modulus / ratio) ** 2.5


def thornton(q):
    """Return e for q = V_y/V below 1."""
    bracket = q / (q + 2 * np.sqrt(1.2 - 0.2 * q * q))
    return np.sqrt(6 * math.sqrt(3) / 5) * np.sqrt(1 - q * q / 6) * bracket**0.25


def impacts(speeds, ratio, restitution=1.0, *, attraction=True, steps=4000):
    """Return the realised restitution of a sphere against a wall for each speed."""
    law = [NormalElastoplastic(attraction=attraction, modulus_over_yield_pressure=ratio, restitution=restitution)]
    worlds, durations = [], []
    for speed in speeds:
        duration = hertz_impact(effective_modulus(SOFT), RADIUS, MASS, speed)[2]
        bodies = ball([0, 0, RADIUS], velocity=(0, 0, -speed))
        worlds.append(scene(bodies, law=law, time_step=duration / steps, force_time_step=True))
        durations.append(duration)
    simulation = Simulation(worlds)
    simulation.run([12 * d for d in durations])
    simulation.check()
    return np.array([simulation.snapshot(k).velocity[0, 2] / v for k, v in enumerate(speeds)])


@pytest.mark.parametrize("ratio", [100.0, 300.0])
def test_restitution_of_impacts(ratio):
    """Elastic below the yield speed, then Thornton's closed form, exact for this law."""
    relative = np.array([0.5, 0.99, 1.2, 2.0, 5.0, 20.0, 100.0])
    e = impacts(relative * yield_speed(ratio), ratio)
    assert e[:2] == pytest.approx(1.0, abs=1e-6)
    assert e[2:] == pytest.approx(thornton(1 / relative[2:]), rel=2e-4)


def test_restitution_of_fast_impacts_falls_with_the_fourth_root_of_speed():
    ratio = 300.0
    relative = np.array([100.0, 1000.0])
    e = impacts(relative * yield_speed(ratio), ratio)
    assert math.log10(e[1] / e[0]) == pytest.approx(-0.25, abs=2e-3)
    assert e[1] == pytest.approx(1.18 * 1000**-0.25, rel=1e-2)


@pytest.mark.parametrize("attraction", [True, False])
def test_impacts_below_yield_have_the_restitution_that_was_asked_for(attraction):
    slow, fast = impacts([0.9 * yield_speed(30.0), 5 * yield_speed(30.0)], 30.0, 0.7, attraction=attraction)
    assert slow == pytest.approx(0.7, rel=2e-3)
    assert fast < 0.65  # yield and dashpot together lose more than either
    assert fast < thornton(0.2) * 0.9


def test_no_yield_at_the_vanishing_value():
    assert impacts([0.5, 5.0], 0.0, 0.6) == pytest.approx(0.6, rel=2e-3)


@pytest.mark.parametrize("ratio", [5e-324, 1e-160, 1e-4, 1.1e-4])
def test_a_yield_pressure_beyond_all_bounds_is_elastic(ratio):
    """Also one whose yield overlap no float holds: the same bits as a contact that never yields."""
    states = at_rest(np.concatenate([np.linspace(0, 2e-3, 50), np.linspace(2e-3, 0, 50)]))
    elastic = bench(NormalElastoplastic, modulus_over_yield_pressure=0.0).answers(states)
    assert np.any(elastic)
    assert np.array_equal(bench(NormalElastoplastic, modulus_over_yield_pressure=ratio).answers(states), elastic)


def test_largest_overlap_survives_list_rebuilds_and_swaps_of_sides():
    """Two balls collide while they fly together through many cells, aslant, so that now one and now the other comes first."""
    ratio, speed, drift = 100.0, 1.0, np.array([30.0, 30.0, 0.0])
    along = np.array([math.cos(0.3), -math.sin(0.3), 0.0])
    law = [NormalElastoplastic(modulus_over_yield_pressure=ratio)]
    modulus = effective_modulus(SOFT, SOFT)
    duration = hertz_impact(modulus, RADIUS / 2, MASS / 2, speed)[2]
    ends = []
    for skin in (5e-4, 2.0):
        bodies = ball([[0, 0, 0], 2 * RADIUS * along], velocity=[drift + speed / 2 * along, drift - speed / 2 * along])
        flat = ((-0.1, -0.1, -0.03), (0.4, 0.4, 0.03))  # so that cells are hardly larger than a ball
        options = {"time_step": duration / 2000, "force_time_step": True, "domain": flat}
        simulation = Simulation(scene(bodies, walls=(), law=law, skin=skin, **options))
        simulation.run(4 * duration)
        shot = simulation.snapshot()
        ends.append(shot.velocity[np.argsort(shot.position @ along)])
    assert ends[0] == pytest.approx(ends[1], rel=1e-9)
    parting = (ends[0][1] - ends[0][0]) @ along
    assert parting == pytest.approx(thornton(yield_speed(ratio, modulus, RADIUS / 2, MASS / 2)), rel=2e-3)
    assert ends[0].sum(axis=0) == pytest.approx(2 * drift, rel=1e-12, abs=1e-11)


def test_both_schedules_give_the_same_bits():
    ends = []
    for schedule in ("worlds", "particles"):
        bodies = ball([[0, 0, RADIUS], [0, 0, 3.02 * RADIUS]], velocity=[[0, 0, -1.0], [0, 0, -2.0]])
        law = [NormalElastoplastic(modulus_over_yield_pressure=100.0, restitution=0.9)]
        simulation = Simulation(scene(bodies, law=law), schedule=schedule)
        simulation.run_steps(400)
        ends.append(simulation.snapshot().velocity)
    assert np.array_equal(*ends)
    assert ends[0][1, 2] > -1.9
