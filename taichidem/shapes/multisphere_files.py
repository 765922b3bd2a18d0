"""Reading the spheres of a multisphere from a text file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from taichidem.errors import InputError
from taichidem.units import to_si


def metres(unit: str, path: Path) -> float:
    """Return how many metres a file's unit has.

    Raises:
        InputError: a text that isn't a unit of length.
    """
    try:
        if not isinstance(unit, str) or not unit.strip() or unit.strip()[0].isdigit():
            raise InputError("give a unit.")
        return to_si(f"1 {unit}", "m", "unit")
    except InputError:
        raise InputError(
            f"{path}: its unit is given as {unit!r}; give a unit of length such as 'm', 'mm' or 'inch'."
        ) from None


def read_spheres(path: Path, unit: str) -> tuple[np.ndarray, np.ndarray]:
    """Return centres (m, 3) and radii (m,) [m] of a file of rows `x y z radius`.

    Raises:
        InputError: no such file, not text, a unit that is no length, no row, or a row that isn't four finite numbers.
    """
    scale = metres(unit, path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else f"can't be read as text ({error})"
        raise InputError(
            f"{path}: {reason}. Give the path of a text file with a row `x y z radius` per sphere."
        ) from None
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        parts = _parts(line)
        if not parts or (not rows and _header(parts)):
            continue
        rows.append(_row(parts, f"{path}, line {number}", line))
    if not rows:
        raise InputError(f"{path}: holds no sphere. Give a row `x y z radius` for each.")
    table = scale * np.array(rows)
    return table[:, :3], table[:, 3]


def _parts(line: str) -> list[str]:
    text = line.split("#", 1)[0].strip()
    return re.split(r"\s*[,;]\s*|\s+", text) if text else []


def _header(parts: list[str]) -> bool:
    """Return True for words; a row with even one number is meant as a sphere."""
    return not any(_is_number(part) for part in parts)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _row(parts: list[str], where: str, line: str) -> list[float]:
    if len(parts) != 4 or not all(_is_number(part) for part in parts):
        raise InputError(f"{where}: is {line.strip()!r}; give four numbers, x y z radius, with decimal points.")
    values = [float(part) for part in parts]
    if not np.all(np.isfinite(values)):
        raise InputError(f"{where}: holds a number that isn't finite in {line.strip()!r}; give x y z radius.")
    if values[3] <= 0:
        raise InputError(f"{where}: has radius {parts[3]}; give a radius above 0.")
    return values
