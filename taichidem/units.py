"""Units at the edges: a number is SI already, a text such as "6 mm" is converted, a mismatch is an error."""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from taichidem.errors import InputError


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FACTOR = r"\(*(?:[^\W\d]\w*|[%°][^\W\d]*)(?:-\d|[⁻¹²³]+|\s*(?:\^|\*\*)\s*[+-]?\d+)?\)*"
_UNIT = rf"(?:1\s*/\s*)?{_FACTOR}(?:(?:\s*[*/·]\s*|\s+){_FACTOR})*"
# A text is matched before pint sees it: pint computes, so "6,5 mm" is 65 mm to it and "6 mm 10" is 60 mm.
_QUANTITY = re.compile(rf"\s*(?P<number>{_NUMBER})\s*(?P<unit>{_UNIT})?\s*")
_BARE_POWER = re.compile(r"\b([^\W\d_]+)(-?\d)(?!\w)")  # m3, s-1
_ANGLES = ("radian", "degree", "revolution", "turn", "cycle")


def to_si(value: object, unit: str, name: str = "value") -> float:
    """Return a quantity in an SI unit.

    Args:
        value: a number, taken to be in `unit` already, or a text such as "6 mm", "910 kg/m3" or "20 rpm".
        unit: such as "m", "kg/m^3", "rad/s"; "1" for a pure number; "deg" stays degrees.
        name: what the value is, for the message.

    Raises:
        InputError: no number and unit, not finite, a unit of another dimension, or Hz for rad/s.
    """
    try:
        return _convert(value, unit)
    except InputError as error:
        raise InputError(f"{name} is {value!r}: {error}") from error


def _convert(value: object, unit: str) -> float:
    """Return a quantity in SI; an error says what is wrong with the value and leaves the value itself to the caller."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(advice(unit))
    number = _read(value, unit) if isinstance(value, str) else float(value)
    if not math.isfinite(number):
        raise InputError(f"give a finite number{_of(unit)}.")
    return number


def _of(unit: str) -> str:
    return "" if unit == "1" else f" in {unit}"


def advice(unit: str) -> str:
    """Return how a quantity is to be given, as the end of a sentence."""
    return "give a number, such as 0.5." if unit == "1" else f"give a number in {unit} or a text such as '6 {unit}'."


def _read(text: str, unit: str) -> float:
    import pint

    found = _QUANTITY.fullmatch(text)
    if found is None:
        comma = "write a decimal with a point, 6.5 and not 6,5; " if re.search(r"\d,\d", text) else ""
        raise InputError(f"this is no quantity; {comma}{advice(unit)}")
    if found["unit"] is None:
        return float(found["number"])  # a number by itself is in the unit asked for, typed or not
    try:
        given = _registry().parse_units(_BARE_POWER.sub(r"\1^\2", found["unit"]))
        in_si = (float(found["number"]) * given).to("" if unit == "1" else unit).magnitude
    except pint.DimensionalityError as error:
        raise InputError(f"this is in {error.units1}; it needs a unit that converts to {unit}.") from error
    except Exception as error:
        raise InputError(f"this is no quantity, {found['unit']!r} is no unit to use here; {advice(unit)}") from error
    if unit == "rad/s" and not any(angle in str(given) for angle in _ANGLES):  # to pint 1 Hz is 1 rad/s
        raise InputError(f"{found['unit']} leaves open whether turns or radians are counted; give rpm or rad/s.")
    # 15 digits are as many as a text and a float have in common: "72 mm" is 0.072 to the last bit.
    return float(f"{in_si:.15g}")


def quantity(unit: str, meaning: str, default: Any = ..., *, coarse_graining: float = 0.0, **bounds: float) -> Any:
    """Return a pydantic field for a quantity: its unit, what it means, bounds such as `gt=0`.

    Args:
        coarse_graining: exponent k of q′ = s^k q for grains s times as large; 0 for what belongs to the apparatus and stays.
    """
    extra: dict[str, Any] = {"unit": unit, "coarse_graining": coarse_graining}
    return Field(default, description=meaning, json_schema_extra=extra, validate_default=True, **bounds)  # type: ignore[call-overload, arg-type]


def in_unit(unit: str) -> Any:
    """Return the annotated type of a quantity kept in `unit`."""
    return Annotated[float, BeforeValidator(lambda value: _convert(value, unit))]


def _has_unit(text: str) -> bool:
    found = _QUANTITY.fullmatch(text)
    return found is not None and found["unit"] is not None


def several_in_unit(unit: str) -> Any:
    """Return the annotated type of one or more quantities kept in `unit`: a number, a text, a list, or texts with commas."""

    def convert(value: object) -> tuple[float, ...]:
        if not isinstance(value, str):
            return tuple(_convert(part, unit) for part in (value if isinstance(value, (list, tuple)) else [value]))
        parts = value.split(",")
        if len({_has_unit(part) for part in parts}) > 1:  # "6,5 s" may be meant as one decimal number
            raise InputError("give each of the values its unit, or none; a decimal has a point, write 6.5 and not 6,5.")
        return tuple(_convert(part, unit) for part in parts)

    return Annotated[tuple[float, ...], BeforeValidator(convert)]


Length = in_unit("m")
Speed = in_unit("m/s")
Duration = in_unit("s")
PerSecond = in_unit("1/s")
Number = in_unit("1")
Angle = in_unit("deg")
AngularSpeed = in_unit("rad/s")
Mass = in_unit("kg")
Durations = several_in_unit("s")
Stresses = several_in_unit("Pa")
