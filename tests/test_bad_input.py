"""Bad input gets an error that names what was given and what is allowed, before anything runs."""

import math

import numpy as np
import pytest

from taichidem import runtime
from taichidem.bodies import Bodies
from taichidem.effects import BodyGravity, NormalHertz, TangentialMindlin
from taichidem.errors import CompositionError, InputError
from taichidem.materials import Material, rayleigh_time_step
from taichidem.scene import Model, Scene
from taichidem.simulation import Simulation
from taichidem.walls import Cone, Cylinder, Disc, Mesh, Motion, Plane
from tests.apparatus import BOX, FLOOR, RIGID, SOFT, ball, effects, scene


def said(call):
    """Return the text of the InputError that a call raises."""
    with pytest.raises(InputError) as caught:
        call()
    return str(caught.value)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: NormalHertz(restitution=1.2), ["restitution", "1.2", "above 0 to 1"]),
        (lambda: NormalHertz(restitution=0.0), ["restitution", "0.0", "above 0 to 1"]),
        (lambda: NormalHertz(restitution={"a-b": -0.1}), ["restitution of a-b", "-0.1"]),
        (lambda: NormalHertz(restitution=math.nan), ["restitution", "nan"]),
        (lambda: NormalHertz(restitutoin=0.5), ["restitutoin", "Did you mean 'restitution'"]),
        (lambda: NormalHertz(), ["restitution", "missing"]),
        (lambda: TangentialMindlin(static_friction=-0.1), ["static_friction", "-0.1", "from 0"]),
        (lambda: BodyGravity(z={"a-b": 1.0}), ["one number"]),
        (lambda: Material("a", 1000, 1e7, 0.51), ["poissons_ratio", "0.51", "0.5"]),
        (lambda: Material("a", 1000, 1e7, math.nan), ["poissons_ratio", "nan"]),
        (lambda: Material("a", -1, 1e7, 0.3), ["density", "-1", "above 0"]),
        (lambda: Material("a", 1000, 0, 0.3), ["youngs_modulus", "0", "above 0"]),
        (lambda: Material("a-b", 1000, 1e7, 0.3), ["a-b", "'-'"]),
        (lambda: Model([], []), ["at least one"]),
        (lambda: Model([SOFT, SOFT], [NormalHertz(restitution=0.5)]), ["name of its own"]),
        (lambda: Model([SOFT], [NormalHertz(restitution={"grain-gain": 0.5})]), ["gain", "Did you mean 'grain'"]),
        (lambda: Model([SOFT], [NormalHertz(restitution={"grain": 0.5})]), ["first-second"]),
        (lambda: scene(ball([0, 0, 0]), walls=[Plane(material="stel", point=(0, 0, 0), normal=(0, 0, 1))]), ["stel"]),
        (lambda: scene(None), ["no grains and no room"]),
        (lambda: scene(None, room=10), ["radius"]),
        (lambda: scene(ball([0, 0, 0]), domain=((0, 0, 0), (1, 0, 1))), ["domain", "higher corner"]),
        (lambda: scene(ball([0, 0, 0]), domain=((0, 0, 0), (1, math.inf, 1))), ["domain", "finite"]),
        (lambda: scene(ball([0, 0, 0]), time_step=0.0), ["time_step", "above 0"]),
        (lambda: scene(ball([0, 0, 0]), time_step=math.nan), ["time_step", "nan"]),
        (lambda: scene(ball([0, 0, 0]), skin=-1e-3), ["skin", "-0.001"]),
        (lambda: scene(ball([0, 0, 0]), partners=0.0), ["partners", "0.0"]),
        (lambda: Plane(material="a", point=(0, 0, 0), normal=(0, 0, 0)), ["normal", "zero"]),
        (lambda: Plane(material="a", point=(0, math.nan, 0), normal=(0, 0, 1)), ["point", "finite"]),
        (lambda: Disc(material="a", centre=(0, 0, 0), radius=-1), ["radius", "-1"]),
        (lambda: Disc(material="a", centre=(0, 0, 0), radius=1, inner_radius=2), ["inner_radius", "2"]),
        (lambda: Cylinder(material="a", base=(0, 0, 0), radius=1, height=0), ["height", "0"]),
        (lambda: Cone(material="a", base=(0, 0, 0), base_radius=0, top_radius=0, height=1), ["radii"]),
        (lambda: Motion(spin=(0, 0)), ["spin", "three finite numbers"]),
        (
            lambda: scene(
                ball([0, 0, 0]), walls=[Plane(material="rigid", point=(0, 0, 0), normal=(0, 0, 1), removed_at=math.nan)]
            ),
            ["removed_at", "nan"],
        ),
        (lambda: Bodies.spheres([[0, 0, math.nan]], 0.01, 1000), ["position", "NaN"]),
        (lambda: Bodies.spheres([[0, 0, 0]], 0.0, 1000), ["above 0"]),
        (lambda: Bodies.spheres([[0, 0, 0]], 0.01, -1000), ["above 0"]),
    ],
)
def test_bad_values(call, words):
    text = said(call)
    for word in words:
        assert word in text


def test_a_time_step_above_the_limit_must_be_forced():
    rayleigh = rayleigh_time_step(0.01, SOFT)
    assert scene(ball([0, 0, 0])).dt == pytest.approx(0.2 * rayleigh)
    assert scene(ball([0, 0, 0]), time_step=0.299 * rayleigh).dt == 0.299 * rayleigh
    text = said(lambda: scene(ball([0, 0, 0]), time_step=1.36 * rayleigh))
    assert "1.36" in text
    assert "force_time_step" in text
    assert scene(ball([0, 0, 0]), time_step=1.36 * rayleigh, force_time_step=True).dt == 1.36 * rayleigh
    # The smallest grain decides.
    both = ball([[0, 0, 0], [1, 0, 0]], np.array([0.01, 0.001]))
    assert scene(both).dt == pytest.approx(0.02 * rayleigh)
    said(lambda: scene(both, time_step=0.2 * rayleigh))


def test_rayleigh_time_published():
    """Glass of 10 mm 12.93 µs, steel of 10 µm 10.63 ns."""
    assert rayleigh_time_step(0.01, Material("glass", 2800, 4.8e10, 0.2)) == pytest.approx(12.93e-6, rel=1e-3)
    assert rayleigh_time_step(1e-5, Material("steel", 7850, 2.08e11, 0.3)) == pytest.approx(10.63e-9, rel=1e-3)


def test_a_pair_without_a_value():
    model = [NormalHertz(restitution={"grain-grain": 0.5})]
    text = said(lambda: scene(ball([0, 0, 0]), law=model))
    assert "grain-rigid" in text
    assert "one number for every pair" in text
    # Walls do not touch walls: 'rigid-rigid' is not asked for, and the order of a pair does not matter.
    scene(ball([0, 0, 0]), law=[NormalHertz(restitution={"grain-grain": 0.5, "rigid-grain": 0.5})])


def test_unknown_grain_material():
    model = Model([SOFT, RIGID], effects())
    text = said(lambda: Scene(model=model, bodies=ball([0, 0, 0]), domain=BOX, grain_materials=("gran",)))
    assert "gran" in text
    assert "Did you mean 'grain'" in text


def test_grains_of_a_material_that_is_not_there():
    """A number beyond the model, or a material that was said to be of walls only."""
    model = Model([SOFT, RIGID], effects())
    for number, allowed in ((2, ()), (-1, ()), (1, ("grain",))):
        grains = Bodies.spheres([0, 0, 0], 0.01, 1000.0, material=number)
        text = said(lambda g=grains, a=allowed: Scene(model=model, bodies=g, domain=BOX, grain_materials=a))
        assert "material" in text


def test_no_room():
    simulation = Simulation(scene(ball([0, 0, 0]), room=2))
    text = said(lambda: simulation.insert(ball([[1, 0, 0], [2, 0, 0]])))
    assert "room for 2" in text
    simulation.insert(ball([1, 0, 0]))
    assert len(simulation.snapshot().mass) == 2


def test_grains_that_the_scene_did_not_announce():
    """Larger ones would slip through the cells, smaller ones make the step too long."""
    simulation = Simulation(scene(ball([0, 0, 0]), room=5))
    for radius in (0.02, 0.002):
        text = said(lambda r=radius: simulation.insert(ball([1, 0, 0], r)))
        assert "radius" in text
    assert len(simulation.snapshot().mass) == 1


def test_grains_outside_the_domain():
    text = said(lambda: Simulation(scene(ball([0, 0, 20.0]))))
    assert "domain" in text


def test_composed_bodies_that_make_no_sense():
    good = {
        "position": np.zeros((1, 3)),
        "velocity": np.zeros((1, 3)),
        "spin": np.zeros((1, 3)),
        "orientation": np.array([[1.0, 0, 0, 0]]),
        "mass": np.ones(1),
        "inertia": np.ones((1, 3)),
        "radius": np.ones(1),
        "element_body": np.zeros(2, int),
        "element_offset": np.zeros((2, 3)),
        "element_radius": np.ones(2),
        "element_material": np.zeros(2, int),
    }
    Bodies(**good)
    assert "orientation" in said(lambda: Bodies(**{**good, "orientation": np.array([[2.0, 0, 0, 0]])}))
    assert "element_body" in said(lambda: Bodies(**{**good, "element_body": np.array([0, 1])}))
    assert "shape" in said(lambda: Bodies(**{**good, "spin": np.zeros((2, 3))}))


def test_restitution_too_small_for_its_law():
    """A clipped dashpot can't be made stiff without bound: the error names the effect, not a root finder."""
    model = [NormalHertz(restitution=1e-9, attraction=False)]
    assert "restitution" in said(lambda: scene(ball([0, 0, 0]), law=model))


def write(path, text):
    path.write_text(text)
    return path


def test_stl(tmp_path):
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex {} 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    cases = {
        "missing.stl": (None, "no such file"),
        "empty.stl": ("", "empty.stl"),
        "none.stl": ("solid a\nendsolid a\n", "facets"),
        "flat.stl": ("solid a\n" + facet.format("0") + "endsolid a\n", "facets"),
        "nan.stl": ("solid a\n" + facet.format("nan") + "endsolid a\n", ""),
        "text.stl": ("this is no surface\n" * 20, "text.stl"),
    }
    for name, (text, word) in cases.items():
        path = tmp_path / name
        if text is not None:
            write(path, text)
        assert word in said(lambda p=path: Mesh.from_stl(p, material="rigid")), name
    good = write(tmp_path / "good.stl", "solid a\n" + facet.format("1") + "endsolid a\n")
    assert len(Mesh.from_stl(good, material="rigid").facets) == 1
    assert "scale" in said(lambda: Mesh.from_stl(good, scale=0.0, material="rigid"))


def test_mesh_arrays():
    points = np.array([[0, 0, 0], [1.0, 0, 0], [0, 1, 0]])
    assert "finite" in said(lambda: Mesh(material="a", vertices=points * math.nan, facets=np.array([[0, 1, 2]])))
    assert "vertex 3" in said(lambda: Mesh(material="a", vertices=points, facets=np.array([[0, 1, 3]])))
    assert "triangle" in said(lambda: Mesh(material="a", vertices=points, facets=np.zeros((0, 3), int)))


def test_scenes_and_schedules():
    assert "at least one" in said(lambda: Simulation([]))
    assert "schedule" in said(lambda: Simulation(scene(ball([0, 0, 0])), schedule="grains"))
    with pytest.raises(CompositionError, match="different effects"):
        Simulation([scene(ball([0, 0, 0])), scene(ball([0, 0, 0]), law=effects(constant=0.1))])
    simulation = Simulation(scene(ball([0, 0, 1]), walls=[FLOOR]))
    for duration in (math.nan, -1.0, math.inf):
        assert "duration" in said(lambda d=duration: simulation.run(d))


def test_the_runtime_refuses_another_setting():
    running = runtime.start()
    assert "threads" in said(lambda: runtime.start(threads=running.threads + 1))
    assert "arch" in said(lambda: runtime.start(arch="cuda" if running.arch == "cpu" else "cpu"))
