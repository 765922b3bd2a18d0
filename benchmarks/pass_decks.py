"""The bulk tests of a pass as input scripts for LIGGGHTS: the same grains, walls, laws, step and durations.

The rain starts from the very places that ours starts from; the funnel's stream is inserted by LIGGGHTS itself. Planes, and
walls that no grain can pass the end of, are LIGGGHTS' primitives, which are its fastest; the others are triangle meshes of
our own walls.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from taichidem.bodies import Bodies
from taichidem.errors import InputError
from taichidem.experiments import Experiment, hopper_discharge, rotating_drum
from taichidem.procedure import World
from taichidem.scene import Model
from taichidem.walls import Cylinder, Disc, Mesh, Plane, Wall

LAW = "model hertz tangential history"
LAWS = {"normal_hertz", "tangential_mindlin", "body_gravity"}  # what LAW and gravity stand for
SKIN = 0.3  # of the diameter
RESOLUTION = 64  # sides of a round wall
# Walls that may as well be infinite, as no grain gets around their ends.
ENDLESS = {"bulk_density": ("cup wall", "cup bottom"), "hopper_discharge": ("bin",)}
INTEGRATE = [
    "fix motion all nve/sphere",
    "thermo_style custom step atoms",
    "thermo 100000000",
    "thermo_modify lost ignore norm no",
]
LOOK = ["dump last all custom 1 last.dump id x y z", "run 0"]
STREAM_SEEDS = (32452843, 15485863, 15485867)  # LIGGGHTS asks for large primes


class Filling(World):
    """A world without a simulation, that keeps what a procedure puts into it before its first wait."""

    bodies: Bodies

    def insert(self, bodies: Bodies) -> None:
        """Keep the bodies."""
        self.bodies = bodies

    def present(self):  # type: ignore[no-untyped-def]
        """Return no grains."""
        return Bodies.spheres(np.empty((0, 3)), np.empty(0), 1.0)


@dataclass(frozen=True)
class Case:
    """A test to be written as an input script."""

    test: Experiment
    model: Model
    seed: int

    @property
    def step(self) -> float:
        """The time step [s], ours."""
        return self.test.scene(self.model).dt

    def steps(self, seconds: float) -> int:
        """Return whole steps of a duration [s]."""
        return round(seconds / self.step)

    def run(self, seconds: float) -> str:
        """Return the command that lets a duration [s] pass."""
        return f"run {self.steps(seconds)}"

    def rained(self) -> Bodies:
        """Return the grains as our procedure rains them."""
        world = Filling(None, 0, np.random.default_rng(self.seed))  # type: ignore[arg-type]
        next(self.test.procedure(world, self.model))
        return world.bodies


def label(name: str) -> str:
    """Return a wall's name as LIGGGHTS takes it."""
    return name.replace(" ", "_")


def primitive(test: Experiment, wall: Wall) -> str | None:
    """Return a wall as a primitive, or None where it has to be a mesh."""
    if isinstance(wall, Plane):
        axis = int(np.argmax(np.abs(wall.normal)))
        return f"{'xyz'[axis]}plane {wall.point[axis]:.17g}"
    if wall.name not in ENDLESS.get(test.name, ()):
        return None
    if isinstance(wall, Cylinder):
        return f"zcylinder {wall.radius:.17g} 0.0 0.0"
    assert isinstance(wall, Disc)
    return f"zplane {wall.centre[2]:.17g}"


def walls(case: Case, folder: Path) -> list[str]:
    """Return the commands for the walls, and write their meshes."""
    import pyvista

    lines, meshes = [], []
    for wall in case.test.walls(case.model):
        name, plain = label(wall.name), primitive(case.test, wall)
        if plain:
            lines.append(f"fix {name} all wall/gran {LAW} primitive type 2 {plain}")
            continue
        points, facets = wall.surface(RESOLUTION)
        mesh = Mesh(material=wall.material, vertices=points, facets=facets)  # without triangles that have no area
        surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.facets)
        surface.save(folder / f"{name}.stl", binary=False)
        lines.append(f"fix {name} all mesh/surface file {name}.stl type 2")
        meshes.append(name)
    if meshes:
        lines.append(f"fix meshes all wall/gran {LAW} mesh n_meshes {len(meshes)} meshes {' '.join(meshes)}")
    return lines


def head(case: Case) -> list[str]:
    """Return the commands up to the grains: units, lists, an empty domain with two types, grain and wall."""
    lower, upper = case.test.scene(case.model).domain
    box = " ".join(f"{low:.17g} {high:.17g}" for low, high in zip(lower, upper, strict=True))
    return [
        "atom_style granular",
        "atom_modify map array",
        "boundary f f f",
        "newton off",
        "communicate single vel yes",
        "units si",
        f"region domain block {box} units box",
        f"neighbor {SKIN * case.test.settings.diameter:.17g} bin",
        "neigh_modify delay 0 every 1 check yes",
    ]


def laws(case: Case) -> list[str]:
    """Return the contact law with the model's numbers, the step and gravity.

    Raises:
        InputError: a model with other effects than these laws.
    """
    names = {effect.name for effect in case.model.effects}
    if names != LAWS:
        raise InputError(
            f"The model has the effects {sorted(names)}; scripts for LIGGGHTS are written for {sorted(LAWS)} only."
        )
    grain, wall = case.test.grain(case.model).material, case.test.wall_material(case.model)
    other = next(m for m in case.model.materials if m.name == wall)
    values = {p: v for e in case.model.effects for p, v in e.values.items()}
    own, cross = f"{grain.name}-{grain.name}", f"{grain.name}-{wall}"
    lines = [
        f"fix modulus all property/global youngsModulus peratomtype {grain.youngs_modulus:.17g} {other.youngs_modulus:.17g}",
        f"fix ratio all property/global poissonsRatio peratomtype {grain.poissons_ratio:.17g} {other.poissons_ratio:.17g}",
    ]
    for fix, name, parameter in (
        ("rebound", "coefficientRestitution", "restitution"),
        ("rub", "coefficientFriction", "static_friction"),
    ):
        pp, pw = values[parameter][own], values[parameter][cross]
        lines.append(f"fix {fix} all property/global {name} peratomtypepair 2 {pp:.17g} {pw:.17g} {pw:.17g} {pw:.17g}")
    fall = np.array([values[axis] for axis in "xyz"])
    return [
        *lines,
        f"pair_style gran {LAW}",
        "pair_coeff * *",
        f"timestep {case.step:.17g}",
        f"fix weight all gravity {np.linalg.norm(fall):.17g} vector {' '.join(f'{g:.17g}' for g in fall)}",
    ]


def rain(case: Case, folder: Path) -> list[str]:
    """Return the command that reads the rained grains, and write them: id, type, diameter, density, x, y, z."""
    bodies, d = case.rained(), case.test.settings.diameter
    density = case.test.grain(case.model).material.density
    lower, upper = case.test.scene(case.model).domain
    text = f"rain\n\n{len(bodies)} atoms\n2 atom types\n\n"
    text += "".join(f"{lower[k]:.17g} {upper[k]:.17g} {'xyz'[k]}lo {'xyz'[k]}hi\n" for k in range(3)) + "\nAtoms\n\n"
    for k, (x, y, z) in enumerate(bodies.position, 1):
        text += f"{k} 1 {d:.17g} {density:.17g} {x:.17g} {y:.17g} {z:.17g}\n"
    (folder / "rain.data").write_text(text)
    return ["read_data rain.data"]


def thrown(case: Case) -> str:
    """Return the command that gives the rained grains their velocity."""
    return "velocity all set " + " ".join(f"{v:.17g}" for v in case.rained().velocity[0])


def ledge(case: Case) -> list[str]:
    """Settle, take the front wall away, flow."""
    s = case.test.settings
    return [thrown(case), case.run(s.settle_time), "unfix front", case.run(s.flow_time)]


def bulk_density(case: Case) -> list[str]:
    """Settle."""
    return [thrown(case), case.run(case.test.settings.settle_time)]


def fixed_funnel(case: Case) -> list[str]:
    """Let a stream of grains appear in batches, settle."""
    s = case.test.settings
    first, second, third = STREAM_SEEDS
    density = case.test.grain(case.model).material.density
    batches = math.ceil(s.particles / (s.stream_rate * s.batch_interval) - 1e-9)
    return [
        f"region stream cylinder z 0.0 0.0 {s.stream_radius:.17g} {s.stream_bottom:.17g} {s.stream_top:.17g} units box",
        f"fix grain all particletemplate/sphere {second} atom_type 1 density constant {density:.17g} radius constant "
        f"{s.diameter / 2:.17g}",
        f"fix grains all particledistribution/discrete {third} 1 grain 1.0",
        f"fix stream all insert/rate/region seed {first} distributiontemplate grains nparticles {s.particles} particlerate "
        f"{s.stream_rate:.17g} insert_every {case.steps(s.batch_interval)} overlapcheck yes all_in yes vel constant 0.0 0.0 "
        f"{-s.drop_velocity:.17g} region stream",
        case.run(batches * s.batch_interval),
        case.run(s.settle_time),
    ]


def hopper(case: Case) -> list[str]:
    """Settle, open the outlet, count what is above it every 0.01 s until nothing is or the time is over."""
    s, interval = case.test.settings, hopper_discharge.SAMPLE_INTERVAL
    looks = int(s.flow_time / interval + 1e-9)
    return [
        thrown(case),
        case.run(s.settle_time),
        "unfix slide",
        "region above block INF INF INF INF 0.0 INF units box",
        "variable count equal count(all,above)",
        "variable now equal step*dt",
        'print "look ${now} ${count}"',
        "run 0",
        f"variable k loop {looks}",
        "label flow",
        f"run {case.steps(interval)} pre no post no",
        'print "look ${now} ${count}"',
        'if "${count} == 0" then "jump in.deck empty"',
        "next k",
        "jump in.deck flow",
        "label empty",
    ]


def drum(case: Case) -> list[str]:
    """Settle, turn, keep a frame every 0.05 s."""
    s = case.test.settings
    turn = f"rotate origin 0.0 0.0 0.0 axis 0.0 1.0 0.0 period {2 * math.pi / s.speed:.17g}"
    return [
        thrown(case),
        case.run(s.settle_time),
        *[f"fix turn_{label(p)} all move/mesh mesh {label(p)} {turn}" for p in rotating_drum.PARTS],
        case.run(s.spin_up_time),
        f"dump frames all custom {case.steps(rotating_drum.SAMPLE_INTERVAL)} frames.dump id x y z",
        case.run(s.averaging_time),
        "undump frames",
    ]


PROCEDURES: dict[str, Callable[[Case], list[str]]] = {
    "ledge": ledge,
    "bulk_density": bulk_density,
    "fixed_funnel": fixed_funnel,
    "hopper_discharge": hopper,
    "rotating_drum": drum,
}


def deck(case: Case, folder: Path) -> str:
    """Return the input script of a test, and write the files that it reads."""
    grains = ["create_box 2 domain"] if case.test.name == "fixed_funnel" else rain(case, folder)
    procedure = PROCEDURES[case.test.name](case)
    return "\n".join([*head(case), *grains, *laws(case), *walls(case, folder), *INTEGRATE, *procedure, *LOOK, ""])
