"""The sections [particle] and [materials] of a study file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from taichidem.materials import Material, property_fault
from taichidem.shapes.base import GrainShape
from taichidem.study.problems import Problems
from taichidem.study.shape_section import KEYS, read_shape
from taichidem.units import advice

UNITS = {"density": "kg/m^3", "youngs_modulus": "Pa", "poissons_ratio": "1"}
FITTING = (1000.0, 1e7, 0.3)  # properties of some material, to check a name alone


@dataclass(frozen=True)
class Particle:
    """The grain of a study: name of its shape, diameter of the sphere of equal volume [m], name of its material, and its form
    where it is no sphere."""

    shape: str
    diameter: float
    material: str
    form: GrainShape | None = None


def read_particle(
    document: Mapping[str, Any], materials: Iterable[str], folder: Path, problems: Problems
) -> Particle | None:
    """Return the particle, or None after noting what is wrong; a file that it names is relative to the folder."""
    table = problems.table(document, "particle")
    before = len(problems.found)
    shape = table.get("shape", "sphere")
    own = KEYS.get(shape, sum(KEYS.values(), ())) if isinstance(shape, str) else ()
    problems.refuse_others(table, ("shape", "diameter", "material", *own), "particle", f"key of a {shape}")
    form = read_shape(table, folder, problems)
    diameter = None
    if "diameter" in table:
        diameter = problems.quantity("particle.diameter", table["diameter"], "m")
        if diameter is not None and diameter <= 0:
            problems.add("particle.diameter", f"particle.diameter is {table['diameter']!r}; it must be above 0.")
    else:
        problems.missing("particle.diameter", "give the diameter of the grains, such as '6 mm'.")
    material = table.get("material")
    if material is None:
        problems.missing("particle.material", f"give one of the materials: {', '.join(materials) or 'none yet'}.")
    elif material not in list(materials):
        problems.unknown("particle.material", "material", str(material), materials)
    if len(problems.found) > before or diameter is None or material is None:
        return None
    return Particle(shape, diameter, material, form)


def read_materials(document: Mapping[str, Any], problems: Problems) -> dict[str, Material]:
    """Return the materials that are in order, by name; what is wrong with the others is noted."""
    tables = problems.table(document, "materials")
    if not tables:
        problems.missing("materials", "give each material a section such as [materials.granule].")
    found = {}
    for name in tables:
        material = _read_material(name, problems.table(tables, name, f"materials.{name}"), problems)
        if material is not None:
            found[name] = material
    return found


def _read_material(name: str, table: Mapping[str, Any], problems: Problems) -> Material | None:
    path = f"materials.{name}"
    before = len(problems.found)
    problems.refuse_others(table, UNITS, path, "key")
    with problems.catching(path):
        Material(name, *FITTING)
    if "." in name:
        problems.add(path, "a material's name can't hold '.', which separates the parts of a key.")
    values = {}
    for part, unit in UNITS.items():
        key = f"{path}.{part}"
        if part not in table:
            problems.missing(key, f"{advice(unit)}")
            continue
        value = problems.quantity(key, table[part], unit)
        if value is not None:
            values[part] = value
            fault = property_fault(part, value)
            if fault:
                problems.add(key, f"{key} {fault}")
    return Material(name, **values) if len(problems.found) == before else None


def wall_material(materials: Iterable[str], grain: str) -> str | None:
    """Return the material of walls: the one called "wall", else the only one that is not the grains', else None.

    Where grains are the only material, walls are of it too.
    """
    others = [name for name in materials if name != grain]
    if "wall" in others:
        return "wall"
    if len(others) > 1:
        return None
    return others[0] if others else grain


def in_order(materials: Mapping[str, Material], grain: str) -> tuple[Material, ...]:
    """Return the grains' material first, the walls' last, others by name: the order in the file means nothing."""
    wall = wall_material(materials, grain)
    rank = {grain: 0, wall: 2} if wall != grain else {grain: 0}
    return tuple(materials[name] for name in sorted(materials, key=lambda name: (rank.get(name, 1), name)))
