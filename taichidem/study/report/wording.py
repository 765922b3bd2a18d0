"""Numbers, units and names as people read them."""

from __future__ import annotations

import math
from typing import Any

MISSING = "–"
MINUS = "−"
MOST_DIGITS = 6  # a number with more digits before or zeros after the point is written with a power of ten
_PM, _TIMES = "\u00a0±\u00a0", "\u00a0×\u00a0"  # no line breaks within a number
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWERS = {"^2": "²", "^3": "³", "^-1": "⁻¹", "^-2": "⁻²", "^-3": "⁻³"}


def number(value: float | None, digits: int = 4) -> str:
    """Return a number with some significant digits, −, and a power of ten where it is very large or small."""
    if value is None or not math.isfinite(value):
        return MISSING
    if value == 0:
        return "0"
    exponent = _exponent(value, digits)
    if not -5 < exponent < MOST_DIGITS:
        return f"{_signed(value / 10.0**exponent, digits - 1)}{_TIMES}10{str(exponent).translate(_SUPERSCRIPTS)}"
    text = _signed(value, max(digits - 1 - exponent, 0))
    return text.rstrip("0").rstrip(".") if "." in text else text


def plus_minus(value: float | None, u: float | None) -> str:
    """Return value ± u, the uncertainty with two significant digits and the value to the same place."""
    if value is None or u is None or not u > 0 or not math.isfinite(value) or not math.isfinite(u):
        return number(value)
    exponent = max(_exponent(value, 4) if value else _exponent(u, 2), _exponent(u, 2))
    if -5 < exponent < MOST_DIGITS:
        places = 1 - _exponent(u, 2)
        return f"{_signed(round(value, places), max(places, 0))}{_PM}{_signed(round(u, places), max(places, 0))}"
    scale = 10.0**exponent
    places = max(1 - _exponent(u / scale, 2), 0)
    power = f"10{str(exponent).translate(_SUPERSCRIPTS)}"
    return f"({_signed(value / scale, places)}{_PM}{_signed(u / scale, places)}){_TIMES}{power}"


def standardised(value: float | None) -> str:
    """Return an error in standard uncertainties, with its sign."""
    if value is None or not math.isfinite(value):
        return MISSING
    if abs(value) >= 1e5:
        return number(value, 2)
    text = f"{abs(value):.1f}"
    return text if float(text) == 0 else ("+" if value > 0 else MINUS) + text


def size(value: float | None, places: int = 1) -> str:
    """Return a number with fixed places, such as an RMS error; a very large one with a power of ten."""
    if value is None or not math.isfinite(value):
        return MISSING
    return number(value, 3) if abs(value) >= 1e6 else _signed(value, places)


def probability(p: float | None) -> str:
    """Return a p-value; below 0.001 only that."""
    if p is None or not math.isfinite(p):
        return MISSING
    if p < 0.001:
        return "< 0.001"
    return f"{p:.3f}" if p < 0.1 else f"{p:.2f}"


def unit(text: str) -> str:
    """Return a unit with raised powers; nothing for a pure number."""
    if text == "1":
        return ""
    for plain, raised in sorted(_POWERS.items(), key=lambda item: -len(item[0])):
        text = text.replace(plain, raised)
    return "°" if text == "deg" else text


def with_unit(text: str, of: str) -> str:
    """Return a number's text followed by its unit."""
    shown = unit(of)
    if not shown or text == MISSING:
        return text
    if "±" in text and not text.startswith("(") and shown in ("°", "%"):
        return f"({text}){shown}"
    return f"{text}{shown}" if shown == "°" else f"{text}\u00a0{shown}"


def duration(seconds: float | None) -> str:
    """Return a wall time in the units one would say it in."""
    if seconds is None or not math.isfinite(seconds):
        return MISSING
    if seconds < 90:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"


def spoken(name: str) -> str:
    """Return a name of the program as words: rolling_friction as "rolling friction"."""
    return name.replace("_", " ")


def listed(names: list[str], last: str = "and") -> str:
    """Return names as in a sentence: a, b and c."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}" if names else ""


def plain(value: Any) -> str:
    """Return any value of a settings table as text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, 6)
    if isinstance(value, list):
        return ", ".join(plain(v) for v in value) or MISSING
    if isinstance(value, dict):
        return ", ".join(f"{spoken(str(k))} {plain(v)}" for k, v in value.items()) or MISSING
    return MISSING if value is None else str(value)


def _exponent(value: float, digits: int) -> int:
    """Return the power of ten of a number's first digit, after rounding to so many digits."""
    return int(f"{abs(value):.{digits - 1}e}".partition("e")[2])


def _signed(value: float, places: int) -> str:
    text = f"{abs(value):.{places}f}"
    return (MINUS if value < 0 and float(text) else "") + text
