"""The force of a liquid bridge against Willett's numbers, the equation of Young and Laplace, and its own work."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from taichidem.effects import LiquidBridge, NormalHertz
from taichidem.effects.liquid_bridge import FITS, rupture_gap
from taichidem.errors import InputError
from taichidem.materials import Material, MaterialPair
from taichidem.simulation import Simulation
from tests.apparatus import SOFT, ball, reference, scene
from tests.effect_bench import PAIR, RADIUS, at_rest, bench

TENSION, FRACTION, SHARE = 0.07, 0.06, 0.19
GIFT = SHARE * FRACTION * 4 / 3 * math.pi  # of a grain, over R³; at 0.048 it lets bridges have up to 0.095 R³
TOUCH = 1e-13  # overlap [m] at which Hertz is nothing beside the pull


def willett(gap, volume, angle):
    """Return F/(2πRγ) for a gap and volume in units of R, angle [rad]: the formula written out once more."""
    x = math.log(volume)
    f1, f2, f3, f4 = (
        sum((a + b * angle + c * angle * angle) * x**k for k, (a, b, c) in enumerate(rows)) for rows in FITS
    )
    if gap <= 0:
        return math.exp(f1)
    s = math.log(0.5 * gap / math.sqrt(volume))
    return math.exp(f1 - f2 * math.exp(f3 * s + f4 * s * s))


def pulls(gaps, volume, degrees, wall=0, **values):
    """Return the pull [N] over gaps [m], in this order after a touch, of a bridge of volume [m³]."""
    given = {"surface_tension": TENSION, "liquid_fraction": FRACTION, "bridge_share": SHARE, "viscosity": 0.0}
    made = bench(LiquidBridge, **{**given, "contact_angle": degrees, **values})
    states = at_rest(np.concatenate([[TOUCH], -np.asarray(gaps, float)]))
    return -made.answers(states, wall=wall, held=volume if wall else 0.5 * volume)[1:, 0]


def by_case(rows, *columns):
    """Return the columns of a reference table as arrays, by volume and angle."""
    cases = {}
    for row in rows:
        key = float(row["V_over_R3_1"]), float(row["contact_angle_deg"])
        cases.setdefault(key, []).append([float(row[c]) for c in columns])
    return {key: np.array(values).T for key, values in cases.items()}


def test_force_against_willett_and_young_laplace():
    """Willett's own numbers to five digits; Young and Laplace within 4 % up to 0.8 of the rupture distance."""
    rows = reference("liquid_bridge_equal_spheres_force.csv")
    cases = by_case(rows, "S_over_R_1", "F_over_2piRgamma_young_laplace_1", "F_willett_full_1")
    assert len(cases) == 12
    for (volume, degrees), (gap, exact, fit) in cases.items():
        pull = pulls(gap * RADIUS, volume * RADIUS**3, degrees) / (2 * math.pi * RADIUS * TENSION)
        assert gap[0] == 0.0
        assert pull[1:] == pytest.approx(fit[1:], rel=2e-5)
        assert pull[0] == pytest.approx(exact[0], rel=0.03)
        stable = gap < 0.85 * rupture_gap(volume, math.radians(degrees))
        assert stable.sum() >= 8
        assert pull[stable] == pytest.approx(exact[stable], rel=0.04)
        assert pull == pytest.approx(exact, rel=0.13)
        assert pull == pytest.approx(exact, abs=0.03 * exact[0])


@pytest.mark.parametrize(
    ("volume", "degrees", "gap", "exact"),
    [
        (1e-4, 0, 0.00928318, 0.252294),
        (1e-4, 20, 0.0109034, 0.193934),
        (0.05, 40, 0.0, 0.568342),
        (1e-3, 40, 0.0, 0.693855),
    ],
)
def test_force_against_single_solutions_of_young_laplace(volume, degrees, gap, exact):
    """Solutions for equal spheres, obtained by integrating the equation; they would not forgive θ in place of θ²."""
    pull = pulls([gap * RADIUS], volume * RADIUS**3, degrees)[0]
    assert pull == pytest.approx(2 * math.pi * RADIUS * TENSION * exact, rel=0.03)


def test_rupture_distance():
    """Willett's equation 15 exactly; the end of the stable Young–Laplace branch within 4 %."""
    rows = reference("liquid_bridge_rupture_distance.csv")
    cases = by_case(rows, "S_rupture_over_R_young_laplace_1", "S_willett_2000_eq15_1")
    for (volume, degrees), ((exact,), (formula,)) in cases.items():
        gaps = formula * RADIUS * np.array([0.5, 0.9999, 1.0001, 0.9])
        pull = pulls(gaps, volume * RADIUS**3, degrees)
        assert np.all(pull[:2] > 0)
        assert not np.any(pull[2:])  # once broken it does not come back within the old reach
        assert formula == pytest.approx(exact, rel=0.04)
        assert rupture_gap(volume, math.radians(degrees)) == pytest.approx(formula, rel=1e-5)


def test_the_pull_is_steady_where_the_fit_is_cut():
    """From pressed to touching to just apart: one value, though the fit is singular at S = 0."""
    gaps = np.array([-1e-7, 0.0, 1e-9, 1e-7, 2.1e-7, 3e-7, 1e-6, 1e-5])
    volume, s = 1e-2 * RADIUS**3, 2 * math.sqrt(1e-2) * RADIUS
    pull = pulls(gaps[1:], volume, 20)
    assert pull[0] == pytest.approx(2 * math.pi * RADIUS * TENSION * willett(0.0, 1e-2, math.radians(20)), rel=1e-12)
    assert gaps[3] < 1e-4 * s < gaps[4]
    assert np.all(np.diff(pull) <= 0)
    assert pull[:5] == pytest.approx(pull[0], rel=1e-6)
    assert pull[-1] < pull[0] * (1 - 1e-6)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 50.0])
def test_at_a_wall_it_pulls_as_a_sphere_on_a_plate(degrees):
    """The Derjaguin radius of a plane is 2 R: F → 4π R γ cos θ for little liquid, and Willett's form with 2 R else."""
    angle = math.radians(degrees)
    for volume in (1.3e-5, 1e-3):  # over (2 R)³
        gaps = np.array([0.0, 0.2, 0.7]) * rupture_gap(volume, angle)
        pull = pulls(2 * RADIUS * gaps, volume * (2 * RADIUS) ** 3, degrees, wall=1)
        twin = [willett(gap, volume, angle) for gap in gaps]
        assert pull == pytest.approx(4 * math.pi * RADIUS * TENSION * np.array(twin), rel=1e-6)
        far = np.array([1.001 * 2 * RADIUS * rupture_gap(volume, angle)])
        assert pulls(far, volume * (2 * RADIUS) ** 3, degrees, wall=1)[0] == 0.0
    little = pulls([0.0], 1.3e-5 * (2 * RADIUS) ** 3, degrees, wall=1)[0]
    assert little == pytest.approx(4 * math.pi * RADIUS * TENSION * math.cos(angle), rel=0.04)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 50.0])
def test_little_liquid_pulls_with_the_closed_form(degrees):
    """F → 2π R γ cos θ as V → 0; with less than 1e-5 R³ there is no bridge, and nothing is taken."""
    limit = 2 * math.pi * RADIUS * TENSION * math.cos(math.radians(degrees))
    for volume in (1.001e-5, 3e-5):
        assert pulls([0.0], volume * RADIUS**3, degrees)[0] == pytest.approx(limit, rel=0.045)
    assert pulls([0.0], 0.999e-5 * RADIUS**3, degrees)[0] == 0.0
    made = bench(LiquidBridge, liquid_fraction=FRACTION, bridge_share=SHARE)
    assert not np.any(made.answers(at_rest([TOUCH]), held=0.4e-5 * RADIUS**3)[:, 6:])


def test_unequal_spheres_pull_with_the_radius_of_derjaguin():
    """R = 2 R₁R₂/(R₁ + R₂), not half of it; both give what the smaller one can."""
    first, second, angle = 0.010, 0.004, math.radians(20.0)
    grains = ball([[0, 0, 1.0], [first + second - 1e-12, 0, 1.0]], radius=np.array([first, second]))
    law = [
        NormalHertz(restitution=1.0),
        LiquidBridge(surface_tension=TENSION, liquid_fraction=FRACTION, bridge_share=SHARE, contact_angle=20.0),
    ]
    simulation = Simulation(scene(grains, walls=(), law=law, time_step=1e-9))
    simulation.run_steps(1)
    now = simulation.snapshot()
    radius, volume = 2 * first * second / (first + second), 2 * GIFT * second**3
    expected = 2 * math.pi * radius * TENSION * willett(0.0, volume / radius**3, angle)
    assert now.force[0, 0] == pytest.approx(expected, rel=1e-6)
    films = FRACTION * 4 / 3 * math.pi * np.array([first, second]) ** 3
    assert films - now.carried == pytest.approx([volume / 2] * 2, rel=1e-12)


def cycle_work(volume, angle):
    """Return the work of pulling equal spheres apart, ∫ F dS from touch to rupture [J]."""
    end = rupture_gap(volume, angle)
    area = quad(willett, 1e-7 * end, end, args=(volume, angle), limit=200)[0] + 1e-7 * end * willett(0, volume, angle)
    return 2 * math.pi * RADIUS**2 * TENSION * area


@pytest.mark.parametrize("forms", ["touch", "reach"])
@pytest.mark.parametrize("degrees", [0.0, 40.0])
def test_work_of_a_cycle(forms, degrees):
    """Formed at touch the bridge takes ∫ F dS of its rupture; formed within reach it pays it back on the way in."""
    angle = math.radians(degrees)
    expected = cycle_work(2 * GIFT, angle)
    ends = 1.2 * RADIUS * rupture_gap(2 * GIFT, angle) * np.linspace(-1, 1, 40001)
    gaps = np.abs(0.5 * (ends[1:] + ends[:-1]))
    gaps[np.argmin(gaps)] = -TOUCH
    given = {"surface_tension": TENSION, "liquid_fraction": FRACTION, "bridge_share": SHARE, "viscosity": 0.0}
    made = bench(LiquidBridge, forms=forms, contact_angle=degrees, **given)
    out = made.answers(at_rest(-gaps), held=2 * GIFT * RADIUS**3)
    steps = np.diff(np.abs(ends))
    work = out[:, 0] * steps
    assert work[steps > 0].sum() == pytest.approx(-expected, rel=2e-3)
    assert work[steps < 0].sum() == pytest.approx(expected if forms == "reach" else 0.0, rel=2e-3, abs=1e-3 * expected)
    taken = out[:, 6:].cumsum(axis=0)
    assert taken[20000] == pytest.approx([-GIFT * RADIUS**3] * 2)
    assert taken[-1] == pytest.approx([0.0, 0.0], abs=1e-25)


def rebounds(speeds, **values):
    """Return the speed with which two elastic wet spheres part after a head-on impact, by their approach speed."""
    law = [NormalHertz(restitution=1.0), LiquidBridge(surface_tension=TENSION, liquid_fraction=FRACTION, **values)]
    scenes = []
    for speed in speeds:
        grains = ball([[-0.0101, 0, 0], [0.0101, 0, 0]], velocity=[[speed / 2, 0, 0], [-speed / 2, 0, 0]])
        scenes.append(scene(grains, walls=(), law=law, time_step=2e-6))
    simulation = Simulation(scenes)
    simulation.run(np.array([0.02 / s + 0.02 for s in speeds]))
    simulation.check()
    ends = [simulation.snapshot(k) for k in range(len(speeds))]
    return np.array([now.velocity[1, 0] - now.velocity[0, 0] for now in ends]), ends


def test_a_wet_impact_loses_the_work_of_its_bridge():
    """½ m* (v² − v'²) = ∫ F dS; below the speed at which that is all there is, grains stay together."""
    volume = 2 / 6 * FRACTION * 4 / 3 * math.pi
    mass = 0.5 * SOFT.density * 4 / 3 * math.pi * RADIUS**3
    critical = math.sqrt(2 * cycle_work(volume, 0.0) / mass)
    speeds = critical * np.array([0.9, 1.1, 2.0])
    after, ends = rebounds(speeds)
    assert after[1:] == pytest.approx(np.sqrt(speeds[1:] ** 2 - critical**2), rel=5e-3)
    film = FRACTION * 4 / 3 * math.pi * RADIUS**3
    assert np.linalg.norm(np.diff(ends[0].position, axis=0)) < 2 * RADIUS * (1 + rupture_gap(volume, 0.0) / 2)
    assert ends[0].carried == pytest.approx([film * 5 / 6] * 2)  # it still holds
    assert ends[1].carried == pytest.approx([film] * 2, rel=1e-14)
    slower, _ = rebounds(speeds[1:], viscosity=0.05)
    assert np.all(slower < 0.95 * after[1:])


def test_viscous_force_by_nase():
    """F_n = 6π η R*² v/S, F_t = 6π η R* (8/15 ln(R*/S) + 0.9588) v, for S no less than ε R*, while a bridge lives."""
    viscosity, reduced, speed = 0.2, RADIUS / 2, np.array([0.3, -0.2, 0.1])
    made = bench(
        LiquidBridge,
        surface_tension=0.0,
        liquid_fraction=FRACTION,
        bridge_share=SHARE,
        viscosity=viscosity,
        smallest_gap=0.02,
        contact_angle=0.0,
    )
    gaps = np.array(
        [0.1 * reduced, -TOUCH, 0.1 * reduced, 0.02 * reduced, 0.001 * reduced, -TOUCH, 0.3 * reduced, RADIUS]
    )
    states = at_rest(-gaps)
    states[:, 4:7] = speed
    force = made.answers(states, held=0.02 * RADIUS**3)[:, :3]
    assert not np.any(force[0])  # no bridge before touch
    assert not np.any(force[-1])  # nor after rupture
    for gap, found in zip(gaps[1:-1], force[1:-1], strict=True):
        s = max(gap, 0.02 * reduced)
        shear = 8 / 15 * math.log(reduced / s) + 0.9588
        expected = -6 * math.pi * viscosity * reduced * np.array([reduced / s, shear, shear]) * speed
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_a_bridge_that_was_formed_keeps_what_it_was_formed_with():
    """Neither more liquid on the grains nor a new touch changes a living bridge."""
    made = bench(LiquidBridge, liquid_fraction=FRACTION, bridge_share=SHARE, contact_angle=0.0, viscosity=0.0)
    gap = 0.1 * RADIUS
    out = made.answers(at_rest([TOUCH, -gap, TOUCH, -gap, -0.9 * RADIUS, -gap, TOUCH]), held=3e-3 * RADIUS**3)
    assert out[:, 6] / RADIUS**3 == pytest.approx([-3e-3, 0, 0, 0, 3e-3, 0, -3e-3], abs=1e-15)
    assert np.all(out[:, 7] == out[:, 6])
    at_wall = made.answers(at_rest([TOUCH, -0.9 * RADIUS]), wall=1, held=3e-3 * RADIUS**3)
    assert at_wall[:, 6:] / RADIUS**3 == pytest.approx(np.array([[-3e-3, 0], [3e-3, 0]]), abs=1e-15)


def test_films_go_by_volume():
    given = LiquidBridge(surface_tension=TENSION, liquid_fraction=FRACTION)
    films = given.initial_amounts(np.ones(2), np.array([RADIUS, 2 * RADIUS]))
    assert films == pytest.approx(FRACTION * 4 / 3 * math.pi * np.array([1, 8]) * RADIUS**3)


def test_reach_is_the_largest_rupture_distance():
    effect = LiquidBridge(surface_tension=TENSION, liquid_fraction=FRACTION, bridge_share=SHARE, contact_angle=40.0)
    longest = effect.reach(PAIR, RADIUS)
    assert longest == pytest.approx(RADIUS * rupture_gap(2 * GIFT, math.radians(40.0)))
    for smaller in (1.0, 0.6, 0.2):  # unequal pairs, and a wall, reach no farther
        radius = 2 * smaller / (1 + smaller)
        assert radius * rupture_gap(2 * GIFT * (smaller / radius) ** 3, math.radians(40.0)) <= longest / RADIUS + 1e-12
    assert 2 * rupture_gap(GIFT / 8, math.radians(40.0)) <= longest / RADIUS
    assert LiquidBridge(surface_tension=TENSION, liquid_fraction=0.0).reach(PAIR, RADIUS) == 0.0


def test_settings_that_make_no_sense_are_refused():
    with pytest.raises(InputError, match=r"forms is 'near'; allowed are 'touch' and 'reach'"):
        LiquidBridge(forms="near", surface_tension=TENSION, liquid_fraction=0.01)
    with pytest.raises(
        InputError, match=r"liquid_fraction 0\.09 and .*bridge_share 0\.1.*holds up to 0\.1.*up to 0\.0716"
    ):
        LiquidBridge(surface_tension=TENSION, liquid_fraction=0.09)
    with pytest.raises(InputError, match=r"liquid_fraction is one number for the whole model"):
        LiquidBridge(surface_tension=TENSION, liquid_fraction={"a-a": 0.01})


def test_angles_may_differ_between_pairs():
    effect = LiquidBridge(surface_tension=TENSION, liquid_fraction=0.01, contact_angle={"soft-soft": 30.0})
    assert effect.kernel_coefficients(PAIR)["rupture"] == pytest.approx(1 + math.radians(30.0) / 2)
    with pytest.raises(InputError, match="contact_angle has no value for the pair 'soft-hard'"):
        effect.kernel_coefficients(MaterialPair(PAIR.first, Material("hard", 2500.0, 1e9, 0.3)))
