"""Units at the edges: a number is SI already, a text such as "6 mm" is converted, a mismatch is an error."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from taichidem.errors import InputError


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def to_si(value: object, unit: str, name: str = "value") -> float:
    """Return a quantity in an SI unit.

    Args:
        value: a number, taken to be in `unit` already, or a text such as "6 mm" or "20 rpm".
        unit: such as "m", "kg/m^3", "rad/s"; "1" for a pure number; "deg" stays degrees.
        name: what the value is, for the message.

    Raises:
        InputError: no number, not finite, or a unit of another dimension.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(f"{name} is {value!r}; give a number in {unit} or a text such as '6 {unit}'.")
    number = _convert(value, unit, name) if isinstance(value, str) else float(value)
    if not math.isfinite(number):
        raise InputError(f"{name} is {value!r}; give a finite number in {unit}.")
    return number


def _convert(text: str, unit: str, name: str) -> float:
    import pint

    try:
        return float(text)  # a number by itself is in the unit asked for, typed or not
    except ValueError:
        pass
    try:
        quantity = _registry()(text)
        # 15 digits are as many as a text and a float have in common: "72 mm" is 0.072 to the last bit.
        return float(f"{quantity.to('' if unit == '1' else unit).magnitude:.15g}")
    except pint.DimensionalityError as error:
        raise InputError(f"{name} is {text!r}, in {error.units1}; it needs a unit that converts to {unit}.") from error
    except Exception as error:
        raise InputError(
            f"{name} is {text!r}, which is no quantity; write a number and a unit such as '6 {unit}'."
        ) from error


def quantity(unit: str, meaning: str, default: Any = ..., **bounds: float) -> Any:
    """Return a pydantic field for a quantity: its unit, what it means, bounds such as `gt=0`."""
    extra = {"unit": unit}
    return Field(default, description=meaning, json_schema_extra=extra, validate_default=True, **bounds)  # type: ignore[call-overload, arg-type]


def in_unit(unit: str) -> Any:
    """Return the annotated type of a quantity kept in `unit`."""
    return Annotated[float, BeforeValidator(lambda value: to_si(value, unit))]


def several_in_unit(unit: str) -> Any:
    """Return the annotated type of one or more quantities kept in `unit`: a number, a text, a list, or texts with commas."""

    def convert(value: object) -> tuple[float, ...]:
        parts = value.split(",") if isinstance(value, str) else value
        return tuple(to_si(part, unit) for part in (parts if isinstance(parts, (list, tuple)) else [parts]))

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
