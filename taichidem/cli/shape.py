"""The form of grains as one types it: spheroid:1.5, superquadric:1,1,1.5,2,2 or multisphere:grain.csv."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from taichidem.errors import InputError, unknown_name

if TYPE_CHECKING:
    from taichidem.shapes.base import GrainShape

#: How many numbers may follow a name.
COUNTS: dict[str, tuple[int, ...]] = {"sphere": (0,), "spheroid": (1,), "superquadric": (3, 5)}


def parse_shape(text: str | None) -> GrainShape | None:
    """Return the form that a text names, None for spheres.

    Raises:
        InputError: a text that names none, or numbers or a file that it can't have.
    """
    text = text or "sphere"
    name, _, rest = text.partition(":")
    if name == "multisphere":
        from taichidem.study.shape_section import multisphere_of_file

        return multisphere_of_file(Path(rest))
    if name not in COUNTS:
        raise unknown_name("shape", name, ["multisphere", *COUNTS])
    from taichidem.effects.elongation import spheroid
    from taichidem.shapes.superquadric import Superquadric

    numbers = _numbers(text, rest, COUNTS[name])
    if name == "superquadric":
        return Superquadric(*numbers)
    return spheroid(numbers[0]) if numbers else None


def _numbers(text: str, rest: str, counts: tuple[int, ...]) -> list[float]:
    try:
        numbers = [float(part) for part in rest.split(",")] if rest else []
        if len(numbers) in counts:
            return numbers
    except ValueError:
        pass
    wanted = " or ".join(str(count) for count in counts)
    raise InputError(
        f"shape is {text!r}; after the colon go numbers, {wanted} of them, as in spheroid:1.5 or superquadric:1,1,1.5,2,2."
    )
