"""The shape under [particle] of a study file: what form the grains have, at the size that `diameter` says."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from taichidem.effects.elongation import FORMS, spheroid
from taichidem.shapes.base import GrainShape
from taichidem.shapes.superquadric import Superquadric
from taichidem.study.problems import Problems

#: Keys that belong to each shape, beside those of every particle.
KEYS: Mapping[str, tuple[str, ...]] = {
    "sphere": (),
    "spheroid": ("aspect_ratio", "form", "spheres"),
    "superquadric": ("axes", "exponents"),
    "multisphere": ("file", "unit", "centres", "radii"),
}


def read_shape(table: Mapping[str, Any], folder: Path, problems: Problems) -> GrainShape | None:
    """Return the form of the grains, None for spheres or after noting what is wrong.

    Args:
        table: the section [particle].
        folder: of the study, to which the name of a file is relative.
        problems: where faults are noted.
    """
    shape = table.get("shape", "sphere")
    if not isinstance(shape, str) or shape not in KEYS:
        problems.add("particle.shape", f"particle.shape is {shape!r}; allowed: {', '.join(KEYS)}.")
        return None
    readers: Mapping[str, Callable[[], GrainShape | None]] = {
        "sphere": lambda: None,
        "spheroid": lambda: _spheroid(table, problems),
        "superquadric": lambda: _superquadric(table, problems),
        "multisphere": lambda: _multisphere(table, folder, problems),
    }
    with problems.catching("particle.shape"):
        return readers[shape]()
    return None


def _spheroid(table: Mapping[str, Any], problems: Problems) -> GrainShape | None:
    form, spheres = table.get("form", "superquadric"), table.get("spheres", 3)
    ratio = None
    if "aspect_ratio" in table:
        ratio = problems.quantity("particle.aspect_ratio", table["aspect_ratio"], "1")
    else:
        problems.missing("particle.aspect_ratio", "give length over width, such as 1.5; below 1 the grains are flat.")
    if form not in FORMS:
        problems.add("particle.form", f"particle.form is {form!r}; allowed: {', '.join(FORMS)}.")
        return None
    if isinstance(spheres, bool) or not isinstance(spheres, int):
        problems.add("particle.spheres", f"particle.spheres is {spheres!r}; give a whole number.")
        return None
    if "spheres" in table and form != "multisphere":
        problems.add("particle.spheres", 'it belongs to form = "multisphere"; leave it out, or give that form.')
    return None if ratio is None else spheroid(ratio, form, spheres)


def _superquadric(table: Mapping[str, Any], problems: Problems) -> GrainShape | None:
    if "axes" not in table:
        problems.missing("particle.axes", "give three semi-axes, such as [1, 1, 1.5]; only their ratios count.")
        return None
    axes = _numbers("particle.axes", table["axes"], 3, problems)
    exponents = _numbers("particle.exponents", table.get("exponents", [2, 2]), 2, problems)
    return None if axes is None or exponents is None else Superquadric(*axes, *exponents)


def _multisphere(table: Mapping[str, Any], folder: Path, problems: Problems) -> GrainShape | None:
    from taichidem.shapes.multisphere import Multisphere

    if "file" in table:
        for name in ("centres", "radii"):
            if name in table:
                problems.add(f"particle.{name}", f"particle.{name} is given beside particle.file. Leave one out.")
        given = table["file"]
        if not isinstance(given, str):
            problems.add("particle.file", f"particle.file is {given!r}; give the name of a file, such as 'grain.csv'.")
            return None
        with problems.catching("particle.file"):
            return multisphere_of_file(folder / given, str(table.get("unit", "m")))
        return None
    if not {"centres", "radii"} <= table.keys():
        problems.missing("particle.file", "give a file such as 'grain.csv', or lists of centres and radii.")
        return None
    radii = _numbers("particle.radii", table["radii"], None, problems)
    rows = table["centres"] if isinstance(table["centres"], list) else [table["centres"]]
    centres = [_numbers("particle.centres", row, 3, problems) for row in rows]
    if radii is None or None in centres:
        return None
    return Multisphere(centres, radii)


def multisphere_of_file(path: Path, unit: str = "m") -> GrainShape:
    """Return the grain of a file of spheres; its unit matters to nothing but how the grain is printed.

    Raises:
        InputError: a file that can't be read.
    """
    from taichidem.shapes.multisphere import Multisphere

    return Multisphere.from_file(path, unit)


def _numbers(key: str, given: object, count: int | None, problems: Problems) -> list[float] | None:
    """Return a list of numbers, or None after noting why it is none."""
    if not isinstance(given, list) or not given or (count is not None and len(given) != count):
        problems.add(key, f"{key} is {given!r}; give a list of {count or 'one or more'} numbers.")
        return None
    found = [problems.quantity(key, value, "1") for value in given]
    return None if None in found else [float(value) for value in found if value is not None]
