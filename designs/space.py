"""Factors with name, unit, low and high, and the space they span: the one place where values are coded."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from designs.errors import DesignError, nearest_hint

Array = npt.NDArray[np.float64]

#: Columns that the run table uses itself; a factor can't have these names.
RESERVED_COLUMNS = ("run", "std_order", "run_order", "block", "point_type", "seed")

#: How the names of columns with coded values begin, where a table has them beside the natural ones.
CODED_PREFIX = "coded "


@dataclass(frozen=True)
class Factor:
    """One quantity that a design varies.

    Coded values are x = (v − (low + high)/2) / ((high − low)/2), with v replaced by ln v when ``log`` is true,
    so that low is −1, high is +1 and the centre is 0.

    Args:
        name: column name; not one of ``RESERVED_COLUMNS``.
        low, high: the values coded −1 and +1, in ``unit``.
        unit: unit as text, for people and tables.
        levels: the only values the factor can take (for example catalogue sizes), from low to high.
        log: code the logarithm; needs low > 0.
        lowest, highest: physical bounds, in ``unit``; no run may lie outside them (a restitution above 1, say).

    Raises:
        DesignError: for numbers that are not finite, low ≥ high, levels outside [low, high], bounds inside it.
    """

    name: str
    low: float
    high: float
    unit: str = ""
    levels: tuple[float, ...] | None = None
    log: bool = False
    lowest: float | None = None
    highest: float | None = None

    def __post_init__(self) -> None:
        _check_name(self.name)
        for field in ("low", "high", "lowest", "highest"):
            value = getattr(self, field)
            if value is not None or field in ("low", "high"):
                object.__setattr__(self, field, _number(self.name, field, value))
        self._check_range()
        if self.levels is not None:
            self._check_levels()

    def _check_range(self) -> None:
        if not self.low < self.high:
            raise DesignError(
                f"Factor {self.name!r} has low = {self.low:g} and high = {self.high:g}; low must be below high. "
                "Swap them, or leave a constant out of the factors."
            )
        if self.log and self.low <= 0:
            raise DesignError(
                f"Factor {self.name!r} has log = true and low = {self.low:g}; a logarithm needs low > 0. "
                "Raise low or drop log."
            )
        too_low = self.lowest is not None and self.low < self.lowest
        too_high = self.highest is not None and self.high > self.highest
        if too_low or too_high:
            raise DesignError(
                f"Factor {self.name!r} ranges over {self.low:g} … {self.high:g}, outside its own physical bounds "
                f"{_bounds_text(self)}. Narrow the range or correct lowest/highest."
            )

    def _check_levels(self) -> None:
        levels = tuple(sorted({_number(self.name, "levels", level) for level in self.levels or ()}))
        if len(levels) < 2 or levels[0] != self.low or levels[-1] != self.high:
            raise DesignError(
                f"Factor {self.name!r} has levels {levels}; they need at least two values and must start at "
                f"low = {self.low:g} and end at high = {self.high:g}."
            )
        object.__setattr__(self, "levels", levels)

    def to_natural(self, coded: Array) -> Array:
        """Return natural values [unit] of coded ones, same shape."""
        points = np.asarray(coded, dtype=float)
        low, high = (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)
        value = (low + high) / 2 + points * (high - low) / 2
        # The last bits go: 0.1 + 0.5·0.5 must print as 0.35, and low and high must come back as they were given.
        value = _significant(np.exp(value)) if self.log else np.round(value, _decimals(self.low, self.high))
        return np.where(points == -1.0, self.low, np.where(points == 1.0, self.high, value))

    def to_coded(self, natural: Array) -> Array:
        """Return coded values of natural ones [unit], same shape."""
        low, high = (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)
        value = np.asarray(natural, dtype=float)
        if self.log and (value <= 0).any():
            raise DesignError(f"Factor {self.name!r} has log = true; the value {value.min():g} has no logarithm.")
        return ((np.log(value) if self.log else value) - (low + high) / 2) / ((high - low) / 2)

    def from_unit(self, unit_values: Array) -> Array:
        """Return coded values of points in [0, 1); a factor with levels gets each level equally often."""
        if self.levels is None:
            return 2.0 * np.asarray(unit_values, dtype=float) - 1.0
        index = np.minimum((np.asarray(unit_values) * len(self.levels)).astype(int), len(self.levels) - 1)
        return self.to_coded(np.asarray(self.levels)[index])


@dataclass(frozen=True)
class FactorSpace:
    """An ordered set of factors with different names.

    Raises:
        DesignError: for no factor at all or a name used twice (also when only capitals differ).
    """

    factors: tuple[Factor, ...]

    def __init__(self, factors: Iterable[Factor]) -> None:
        object.__setattr__(self, "factors", tuple(factors))
        if not self.factors:
            raise DesignError("A factor space needs at least one factor; none was given. Add one with name, low, high.")
        seen: dict[str, str] = {}
        for name in self.names:
            if name.lower() in seen:
                raise DesignError(
                    f"Factor name {name!r} is given twice (as {seen[name.lower()]!r} before); names must differ by "
                    "more than capitals. Rename one."
                )
            seen[name.lower()] = name

    def __len__(self) -> int:
        return len(self.factors)

    def __iter__(self) -> Iterator[Factor]:
        return iter(self.factors)

    def __getitem__(self, name: str) -> Factor:
        for factor in self.factors:
            if factor.name == name:
                return factor
        raise DesignError(f"Unknown factor {name!r}. {nearest_hint(name, self.names)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Factor names in order."""
        return tuple(factor.name for factor in self.factors)

    def to_natural(self, coded: Array) -> pd.DataFrame:
        """Return natural values, one named column per factor, of coded points of shape (n, k)."""
        points = np.asarray(coded, dtype=float)
        return pd.DataFrame({f.name: f.to_natural(points[:, i]) for i, f in enumerate(self.factors)})

    def to_coded(self, natural: pd.DataFrame) -> Array:
        """Return coded points of shape (n, k) of a table that has one column per factor."""
        missing = [name for name in self.names if name not in natural.columns]
        if missing:
            raise DesignError(
                f"The table has no column for factor {missing[0]!r}. {nearest_hint(missing[0], natural.columns)}"
            )
        return np.column_stack([f.to_coded(natural[f.name].to_numpy(dtype=float)) for f in self.factors])

    def subset(self, names: Sequence[str]) -> FactorSpace:
        """Return the space of the named factors only, in the order given."""
        return FactorSpace(self[name] for name in names)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> FactorSpace:
        """Return the space written as ``{name: {"low": …, "high": …, "unit": …}}``.

        Raises:
            DesignError: for a factor without low or high, or with a key that no factor has.
        """
        return cls(_factor_from_dict(name, entry) for name, entry in data.items())

    @classmethod
    def from_toml(cls, path: str | Path) -> FactorSpace:
        """Return the space of a TOML file with one table ``[factors.NAME]`` per factor (low, high, unit, …)."""
        data = _read_toml(Path(path))
        factors = data.get("factors")
        if not isinstance(factors, dict) or not factors:
            raise DesignError(
                f"{path} has no table [factors.NAME]. Write one per factor, for example\n"
                '[factors.static_friction]\nlow = 0.1\nhigh = 0.6\nunit = ""'
            )
        return cls.from_dict(factors)


def _check_name(name: str) -> None:
    if not isinstance(name, str) or not name.strip() or name != name.strip():
        raise DesignError(f"A factor is named {name!r}; a name is text without blanks at its ends.")
    if "*" in name:
        raise DesignError(f"A factor is named {name!r}; '*' stands for products of factors (F*D). Rename it.")
    if name.lower() in RESERVED_COLUMNS:
        raise DesignError(
            f"A factor is named {name!r}; {', '.join(RESERVED_COLUMNS)} are columns of the run table. Rename it."
        )


def _number(name: str, field: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if isinstance(value, bool) or not math.isfinite(number):
        raise DesignError(f"Factor {name!r} has {field} = {value!r}; a finite number is needed.")
    return number


def _bounds_text(factor: Factor) -> str:
    low = "−∞" if factor.lowest is None else f"{factor.lowest:g}"
    high = "∞" if factor.highest is None else f"{factor.highest:g}"
    return f"{low} … {high}"


def _decimals(low: float, high: float) -> int:
    """Return the decimals that leave 14 digits of the larger end, or 12 of the range where that is finer."""
    return max(14 - math.ceil(math.log10(max(abs(low), abs(high)))), 12 - math.floor(math.log10(high - low)))


def _significant(value: Array) -> Array:
    return np.array([float(f"{v:.14g}") for v in value.ravel()]).reshape(value.shape)


def _factor_from_dict(name: str, entry: Any) -> Factor:
    allowed = ("low", "high", "unit", "levels", "log", "lowest", "highest")
    if not isinstance(entry, Mapping):
        raise DesignError(f"Factor {name!r} is given as {entry!r}; write a table with low and high.")
    for key in entry:
        if key not in allowed:
            raise DesignError(f"Factor {name!r} has an unknown key {key!r}. {nearest_hint(key, allowed)}")
    settings = dict(entry)
    levels = settings.pop("levels", None)
    if levels is not None:
        numbers = [_number(name, "levels", level) for level in levels]
        settings.setdefault("low", min(numbers))
        settings.setdefault("high", max(numbers))
        settings["levels"] = tuple(numbers)
    for key in ("low", "high"):
        if key not in settings:
            raise DesignError(f"Factor {name!r} has no {key}; every factor needs low and high (or levels).")
    return Factor(name, **settings)


def parse_toml(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text.

    Raises:
        DesignError: for text that is not valid TOML.
    """
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib  # type: ignore[import-not-found]
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise DesignError(f"This is not valid TOML: {error}.") from None


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return parse_toml(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DesignError(f"There is no file {path}. Give the path of a TOML file with the factors.") from None
    except (DesignError, UnicodeDecodeError) as error:
        raise DesignError(f"{path} can't be read. {error}") from None
