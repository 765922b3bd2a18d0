"""Rolling: slip to roll, decay under rolling resistance, slopes, and coming to rest."""

import math

import numpy as np
import pytest

from taichidem.materials import Material
from taichidem.simulation import Simulation
from tests.apparatus import ball, effects, frames, scene

G = 9.81
AI = Material("grain", 1056.0, 4e7, 0.49)  # Ai et al. (2011), tests 1 and 2


def sunk(material, radius, weight):
    """Return the overlap [m] at which a rigid plane carries a weight [N]."""
    modulus = material.youngs_modulus / (1 - material.poissons_ratio**2)
    return (weight / (4 / 3 * modulus * math.sqrt(radius))) ** (2 / 3)


def on_slope(*, slope=0.0, material=AI, radius=0.005, speed=0.0, spin=0.0, restitution=0.5, **law):
    """Return a world with a ball at rest depth on the plane z = 0, which is inclined by turning gravity (uphill +x)."""
    mass = material.density * 4 / 3 * math.pi * radius**3
    height = radius - sunk(material, radius, mass * G * math.cos(slope))
    down = (-G * math.sin(slope), 0.0, -G * math.cos(slope))
    step = law.pop("time_step", 2e-6)
    one = ball([0, 0, height], radius, material, velocity=(speed, 0, 0), spin=(0, spin, 0))
    return scene(one, material=material, law=effects(restitution, gravity=down, **law), time_step=step)


def test_slip_to_roll():
    """t_s = 2 u₀/(7 μ g), u = 5/7 u₀; two sevenths of the energy are lost."""
    cases = [(0.03, 0.5, 0.005), (0.1, 0.2, 0.005), (1.0, 0.2, 0.05), (1.0, 0.5, 0.0025)]
    simulation = Simulation([on_slope(material=AI, radius=r, speed=u, friction=mu) for u, mu, r in cases])
    ends = np.array([2 * u / (7 * mu * G) for u, mu, _ in cases])
    before = [simulation.kinetic_energy(k) for k in range(4)]
    simulation.run(0.5 * ends)
    for world, (u, mu, _) in enumerate(cases):
        now = simulation.snapshot(world)
        assert now.velocity[0, 0] == pytest.approx(u - mu * G * now.time, rel=2e-3)
    simulation.run(3.0 * ends)
    for world, (u, _, r) in enumerate(cases):
        now = simulation.snapshot(world)
        assert now.velocity[0, 0] == pytest.approx(5 / 7 * u, rel=2e-3)
        assert now.spin[0, 1] == pytest.approx(5 / 7 * u / r, rel=2e-3)
        assert simulation.kinetic_energy(world) / before[world] == pytest.approx(5 / 7, rel=4e-3)
        # It rolled on without loss: slip ended at t_s and not later.
        distance = u * ends[world] * (1 + 5 / 7) / 2 + 5 / 7 * u * (now.time - ends[world])
        assert now.position[0, 0] == pytest.approx(distance, rel=2e-3)


@pytest.mark.parametrize("law", ["constant", "rolling"])
@pytest.mark.parametrize(("friction", "rate"), [(0.8, 5 / 7 / 1.0), (0.0, 5 / 2)])
def test_decay_of_rolling(law, friction, rate):
    """a = 5/7 μ_r g without slip; a spin that no friction couples to the motion decays at 5/2 μ_r g/R."""
    radius, ratios = 0.0026, (0.02, 0.1, 0.2)
    speed = 0.2 if friction else 0.0
    scenes = [on_slope(radius=radius, speed=speed, spin=0.2 / radius, friction=friction, **{law: mu}) for mu in ratios]
    simulation = Simulation(scenes)
    simulation.run(0.01)  # past the transient in which the rolling spring winds up
    early = [simulation.snapshot(k) for k in range(3)]
    simulation.run(0.01)
    for world, mu in enumerate(ratios):
        late = simulation.snapshot(world)
        slope = (early[world].spin[0, 1] - late.spin[0, 1]) / (late.time - early[world].time)
        assert slope == pytest.approx(rate * mu * G / radius, rel=5e-3)


def test_decay_published_number():
    assert pytest.approx(539.011, rel=1e-5) == 5 / 7 * 0.2 * G / 0.0026


def ai(slope, mu_s=0.8, mu_r=0.2, radius=0.005, v0=1.0):
    """Return slip time, speed then, stop time and stop distance of a ball that starts to slip with v0 up a slope."""
    c, s = math.cos(slope), math.sin(slope)
    slowing = G * (s + mu_s * c)
    spinning = 2.5 * G * c * (mu_s - mu_r)  # R dω/dt while it slips
    t1 = v0 / (slowing + spinning)
    v1 = v0 - slowing * t1
    rolling = 5 / 7 * G * (s + mu_r * c)
    t2 = t1 + v1 / rolling
    return t1, v1, t2, (v0 + v1) / 2 * t1 + v1 * (t2 - t1) / 2


@pytest.mark.parametrize("slope", [0.0, 10.0])
def test_ai_slip_roll_and_stop(slope):
    """Ai et al. tests 1 and 2: slip, roll, stop; then EPSD stays while the constant torque trembles or creeps."""
    angle = math.radians(slope)
    t1, v1, t2, distance = ai(angle)
    published = {0.0: (0.04432, 0.65217, 0.5097, 0.18836), 10.0: (0.0417995, 0.605736, 0.2751, 0.10420)}[slope]
    assert (t1, v1, t2, distance) == pytest.approx(published, rel=2e-4)
    common = {"slope": angle, "speed": 1.0, "friction": 0.8, "restitution": 0.9, "time_step": 1e-5}
    held = Simulation(on_slope(rolling=0.2, **common))
    held.run(t1)
    now = held.snapshot()
    assert now.velocity[0, 0] == pytest.approx(v1, rel=5e-3)
    held.run(t2 - t1 + 0.1)
    now = held.snapshot()
    assert now.position[0, 0] == pytest.approx(distance, rel=5e-3)
    held.run(1.0)
    later = held.snapshot()
    assert later.position[0, 0] == pytest.approx(now.position[0, 0], abs=1e-8)
    assert held.kinetic_energy() < 1e-24

    creeping = Simulation(on_slope(constant=0.2, **common))
    creeping.run(t2 + 0.1)
    now = creeping.snapshot()
    creeping.run(1.0)
    later = creeping.snapshot()
    assert creeping.kinetic_energy() > 1e-18  # the constant torque has no rest
    if slope:
        assert later.position[0, 0] < now.position[0, 0] - 1e-6


@pytest.mark.parametrize("law", ["constant", "rolling"])
def test_threshold_of_a_slope(law):
    """A ball rolls down only where tan(slope) exceeds μ_r; then a = 5/7 g (sin − μ_r cos)."""
    slopes = np.radians([4.0, 8.0, 10.0, 15.0])
    ratios = [1.02, 1.005, 0.98, 0.95]
    cases = [(angle, share * math.tan(angle)) for angle in slopes for share in ratios]
    simulation = Simulation([on_slope(slope=a, friction=2.0, **{law: mu}) for a, mu in cases])
    simulation.run(1.2)  # near the threshold a ball stops slowly after the jolt of the start
    middle = [simulation.snapshot(k) for k in range(len(cases))]
    simulation.run(0.3)
    for world, (angle, mu) in enumerate(cases):
        one, two = middle[world], simulation.snapshot(world)
        gained = one.velocity[0, 0] - two.velocity[0, 0]
        free = 5 / 7 * G * (math.sin(angle) - mu * math.cos(angle)) * (two.time - one.time)
        if mu < math.tan(angle):
            assert gained == pytest.approx(free, rel=2e-2)
        else:
            assert abs(gained) < 1e-4
            if law == "rolling":
                assert abs(two.velocity[0, 0]) < 1e-9


def test_kinetic_energy_of_a_pile_falls_to_round_off():
    """A pyramid of balls with EPSD comes to rest entirely; with the constant torque it trembles on."""
    radius = 0.005
    side = 2.02 * radius
    base = [[x * side, y * side, radius] for x in range(3) for y in range(3)]
    second = [[(x + 0.5) * side, (y + 0.5) * side, 2.5 * radius] for x in range(2) for y in range(2)]
    grains = np.array(base + second + [[side, side, 4.0 * radius]])
    material = Material("grain", 1056.0, 4e6, 0.3)

    def pile(**law):
        one = ball(grains, radius, material)
        return scene(one, material=material, law=effects(0.4, 0.6, gravity=(0, 0, -G), **law))

    resting = Simulation(pile(rolling=0.2))
    resting.run(4.0)
    assert resting.kinetic_energy() < 1e-24
    trembling = Simulation(pile(constant=0.2))
    trembling.run(4.0)
    assert trembling.kinetic_energy() > 1e-18


def test_rolling_couple_of_a_pair_turns_both_against_their_difference():
    """Two pressed spheres with one turning: couples are equal and opposite and slow the relative rotation."""
    for law in ({"rolling": 0.3}, {"constant": 0.3}):
        pair = ball([[-0.0099, 0, 0.5], [0.0099, 0, 0.5]], 0.01, spin=[[0, 0, 5.0], [0, 0, 0.0]])
        simulation = Simulation(scene(pair, law=effects(**law), time_step=1e-6))
        taken = frames(simulation, 20)
        torque = taken[-1][0].torque
        assert torque[0, 2] < 0 < torque[1, 2]
        assert torque[0] == pytest.approx(-torque[1], abs=1e-15 + 1e-12 * abs(torque[0, 2]))
