"""Momentum, energy, order of the integrator, and that friction and memory create nothing."""

import itertools
import math

import numpy as np
import pytest

from taichidem.bodies import Bodies
from taichidem.simulation import Simulation
from tests.apparatus import (
    BOX,
    SOFT,
    ball,
    effective_modulus,
    effective_shear_modulus,
    effects,
    frames,
    hertz_impact,
    impact_duration,
    scene,
)


def energy_of_pairs(snapshot, material=SOFT):
    """Return the elastic energy [J] of all overlapping pairs by Hertz, ∑ 2/5 · 4/3 E* √R* δ^(5/2)."""
    total = 0.0
    n = len(snapshot.mass)
    for i in range(n):
        for j in range(i + 1, n):
            overlap = snapshot.radius[i] + snapshot.radius[j]
            overlap -= np.linalg.norm(snapshot.position[i] - snapshot.position[j])
            if overlap > 0:
                radius = snapshot.radius[i] * snapshot.radius[j] / (snapshot.radius[i] + snapshot.radius[j])
                total += 0.4 * 4 / 3 * effective_modulus(material, material) * math.sqrt(radius) * overlap**2.5
    return total


def cloud(seed=1, n=40, spread=0.09, speed=1.0):
    """Return positions without overlap, velocities and spins."""
    rng = np.random.default_rng(seed)
    points = []
    while len(points) < n:
        candidate = rng.uniform(-spread / 2, spread / 2, 3)
        if all(np.linalg.norm(candidate - p) > 0.0201 for p in points):
            points.append(candidate)
    # towards the middle, so that all of them collide with several others at once
    points = np.array(points)
    velocity = -speed * points / (spread / 2) + rng.normal(0, 0.3 * speed, (n, 3))
    return points, velocity, rng.normal(0, 30.0, (n, 3))


def angular_momentum(s):
    return (s.mass[:, None] * np.cross(s.position, s.velocity)).sum(0) + (
        (0.4 * s.mass * s.radius**2)[:, None] * s.spin
    ).sum(0)


def test_momentum_of_a_collapsing_cloud():
    """Friction, damping and rolling couples of many simultaneous contacts: nothing from outside, nothing lost."""
    points, velocity, spin = cloud()
    one = ball(points, velocity=velocity, spin=spin)
    simulation = Simulation(scene(one, walls=(), law=effects(0.6, 0.5, 0.1), time_step=2e-5))
    before = simulation.snapshot()
    simulation.run(0.08)
    after = simulation.snapshot()
    assert np.abs(after.velocity - before.velocity).max() > 0.5
    scale = (before.mass[:, None] * np.abs(before.velocity)).sum()
    drift = (after.mass[:, None] * after.velocity).sum(0) - (before.mass[:, None] * before.velocity).sum(0)
    assert np.abs(drift).max() < 1e-12 * scale
    # Each force acts at one point for both sides.
    turn = np.abs(angular_momentum(after) - angular_momentum(before)).max()
    orbital = (before.mass * np.linalg.norm(np.cross(before.position, before.velocity), axis=1)).sum()
    assert turn < 1e-10 * orbital


def test_angular_momentum_of_an_oblique_pair():
    """Also for spheres of unequal size: both lever arms end at the same point."""
    radii = np.array([0.01, 0.004])
    one = ball(
        [[0, 0, 0], [0.0137, 0.002, 0.001]], radii, velocity=[[0, 0, 0], [-1, 0.7, 0.2]], spin=[[9, 0, 3], [0, 5, 1]]
    )
    simulation = Simulation(scene(one, walls=(), law=effects(0.9, 0.4, 0.05), time_step=1e-6))
    before = angular_momentum(simulation.snapshot())
    simulation.run(0.01)
    after = simulation.snapshot()
    assert np.linalg.norm(after.position[0] - after.position[1]) > 0.014
    assert np.abs(angular_momentum(after) - before).max() < 1e-10 * np.abs(before).max()


def test_energy_without_friction_and_damping():
    points, velocity, _ = cloud()
    step = hertz_impact(effective_modulus(SOFT, SOFT), 0.005, SOFT.density * 2 / 3 * math.pi * 1e-6, 4.0)[2] / 50
    one = ball(points, velocity=velocity)
    simulation = Simulation(scene(one, walls=(), law=effects(1.0, 0.0), time_step=step / 20))
    before = simulation.kinetic_energy()
    worst, stored = 0.0, 0.0
    for now in frames(simulation, 4000, every=100):
        elastic = energy_of_pairs(now[0])
        stored = max(stored, elastic / before)
        worst = max(worst, abs(now[0].kinetic_energy + elastic - before) / before)
    assert stored > 0.05
    assert worst < 1e-5


def test_energy_of_an_elastic_impact():
    """An elastic frictionless impact returns its energy: 2e-4 at t_c/50, 1e-6 at t_c/500, wherever the step falls.

    Verlet keeps a shadow energy that differs from the true one by a term in h² F'; where a contact begins within a step
    F' is of order √h, so that the energy of an impact is off by order h^(5/2), of either sign.
    """
    duration = impact_duration(SOFT, 0.01, 1.0)
    phases = np.linspace(0.0, 0.9, 10)
    worst = []
    for steps in (50, 500):
        h = duration / steps
        worlds = [scene(ball([0, 0, 0.01 + p * h], velocity=(0, 0, -1.0)), time_step=h) for p in phases]
        simulation = Simulation(worlds)
        before = simulation.kinetic_energy()
        simulation.run(3 * duration)
        assert all(simulation.snapshot(k).velocity[0, 2] > 0 for k in range(10))
        worst.append(max(abs(simulation.kinetic_energy(k) / before - 1) for k in range(10)))
    assert worst[0] < 2e-4
    assert worst[1] < 1e-6
    assert 2.2 < math.log10(worst[0] / worst[1]) < 2.8


def test_undamped_integration_is_of_second_order():
    """Position and speed in the middle of an elastic contact, against a run with a very small step."""
    duration = impact_duration(SOFT, 0.01, 1.0)
    counts = [50, 100, 200, 400, 25600]
    worlds = [
        scene(ball([0, 0, 0.0099], velocity=(0, 0, -1.0)), time_step=0.4 * duration / n, force_time_step=True)
        for n in counts
    ]
    simulation = Simulation(worlds)
    simulation.run(0.4 * duration)
    state = [simulation.snapshot(k) for k in range(len(counts))]
    height = np.array([s.position[0, 2] for s in state])
    speed = np.array([s.velocity[0, 2] for s in state])
    for values in (height, speed):
        errors = np.abs(values[:-1] - values[-1])
        order = np.log2(errors[:-1] / errors[1:])
        assert np.all((order > 1.8) & (order < 2.2)), order


ANGLES = np.array([5, 15, 30, 45, 60, 70, 76, 80, 83, 85, 86, 87, 88])


@pytest.mark.parametrize("kind", ["wall", "pair"])
@pytest.mark.parametrize("restitution", [1.0, 0.8])
def test_friction_never_creates_energy(kind, restitution):
    """Any incidence, friction from slight to sticking: the total with the elastic energy of the contact never rises."""
    cases = [(theta, mu) for theta in np.radians(ANGLES) for mu in (0.1, 0.5, 10.0)]
    scenes = []
    for theta, mu in cases:
        velocity = np.array([math.sin(theta), 0, -math.cos(theta)]) * 2.0
        duration = impact_duration(SOFT, 0.01, velocity[2] * -1)
        if kind == "wall":
            one = ball([0, 0, 0.01], velocity=velocity)
        else:
            one = ball([[0, 0, 1], [0, 0, 1.02]], velocity=[[0, 0, 0], velocity])
        scenes.append(scene(one, law=effects(restitution, mu), time_step=duration / 1000))
    simulation = Simulation(scenes)
    before = [simulation.kinetic_energy(k) for k in range(len(cases))]
    simulation.run([4 * impact_duration(SOFT, 0.01, 2 * math.cos(t)) for t, _ in cases])
    simulation.check()
    for world, (theta, mu) in enumerate(cases):
        x = simulation.snapshot(world).position
        assert (x[0, 2] if kind == "wall" else np.linalg.norm(x[1] - x[0]) / 2) > 0.01, "they still touch"
        assert simulation.kinetic_energy(world) <= before[world] * (1 + 1e-6), (math.degrees(theta), mu)
        if restitution == 1.0 and mu == 10.0:
            # Nothing slides, but releasing the spring while unloading costs a share; it must stay a share.
            assert simulation.kinetic_energy(world) > 0.5 * before[world]


def walled(radius=0.01):
    """Return the tangential stiffness factor 8 G* √R [N/m^1.5] of a ball on a rigid plane."""
    return 8 * effective_shear_modulus(SOFT) * math.sqrt(radius)


def test_tangential_force_of_a_small_shear():
    """F_t = −8 G* a ξ while nothing slides: sign, stiffness and direction."""
    heavy = 1e-4
    one = ball([0, 0, 0.01 - heavy], velocity=(1e-3, 2e-3, 0))
    simulation = Simulation(scene(one, law=effects(1.0, 10.0), time_step=1e-8))
    simulation.run_steps(50)
    now = simulation.snapshot()
    shift = now.position[0, :2]
    overlap = 0.01 - now.position[0, 2]
    assert now.force[0, :2] == pytest.approx(-walled() * math.sqrt(overlap) * shift, rel=2e-2)
    exact = 50 * 1e-8 * np.array([1e-3, 2e-3])
    assert shift == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(("speed", "expected"), [(-1.0, "kept"), (1.0, "shrinks")])
def test_press_shear_change_load(speed, expected):
    """When only the load rises the tangential force stays; when it falls the force shrinks with the contact radius.

    The ball is so heavy that it moves as told: density 1e9 times that of the material, no gravity.
    """

    def heavy(velocity):
        return Bodies.spheres([0, 0, 0.01 - 1e-4], 0.01, 2500e9, velocity=velocity)

    simulation = Simulation(
        scene(heavy((1e-2, 0, speed)), law=effects(1.0, 10.0), time_step=1e-7, force_time_step=True)
    )
    # Slip goes on at 1 cm/s: each step adds −k_t v dt, which the test knows; what remains is the effect of the load.
    taken = [f[0] for f in frames(simulation, 60)]
    for one, two in itertools.pairwise(taken):
        a, b = (0.01 - s.position[0, 2] for s in (one, two))
        added = -walled() * math.sqrt(b) * 1e-2 * 1e-7
        share = 1.0 if expected == "kept" else math.sqrt(b / a)
        assert two.force[0, 0] == pytest.approx(one.force[0, 0] * share + added, rel=1e-9)
    assert abs(taken[-1].force[0, 0]) > 0


def test_reading_out_forces_obeys_the_third_law():
    points, velocity, spin = cloud(seed=4)
    simulation = Simulation(
        scene(ball(points, velocity=velocity, spin=spin), walls=(), law=effects(0.5, 0.5, 0.1), domain=BOX)
    )
    simulation.run(0.03)
    now = simulation.snapshot()
    assert np.abs(now.force).max() > 0
    assert np.abs(now.force.sum(0)).max() < 1e-12 * np.abs(now.force).sum()
