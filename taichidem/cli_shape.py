"""The form of grains as one types it: spheroid:1.5, superquadric:1,1,1.5,2,2 or multisphere:grain.csv."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from taichidem.errors import InputError, unknown_name

if TYPE_CHECKING:
    from taichidem.shapes.base import GrainShape

#: Numbers that may follow a name.
COUNTS = {"spheroid": (1,), "superquadric": (3, 5)}


def parse_shape(text: str | None) -> GrainShape | None:
    """Return the form that a text names, None for spheres.

    Raises:
        InputError: a text that names none, or numbers or a file that it can't have.
    """
    name, _, rest = (text or "sphere").partition(":")
    if name == "sphere" and not rest:
        return None
    if name == "multisphere":
        from taichidem.study.shape_section import multisphere_of_file

        return multisphere_of_file(Path(rest))
    if name not in COUNTS:
        raise unknown_name("shape", name, ["sphere", "multisphere", *COUNTS])
    from taichidem.effects.elongation import spheroid
    from taichidem.shapes.superquadric import Superquadric

    numbers = _numbers(text or "", rest, COUNTS[name])
    return spheroid(*numbers) if name == "spheroid" else Superquadric(*numbers)


def _numbers(text: str, rest: str, counts: tuple[int, ...]) -> list[float]:
    try:
        numbers = [float(part) for part in rest.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in counts:
        wanted = " or ".join(str(count) for count in counts)
        raise InputError(
            f"shape is {text!r}; give {wanted} numbers after the colon, as in spheroid:1.5 or superquadric:1,1,1.5,2,2."
        )
    return numbers
