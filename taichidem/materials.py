"""Materials and the elastic moduli of a contact between two of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from taichidem.errors import InputError


@dataclass(frozen=True)
class Material:
    """An isotropic elastic solid.

    Args:
        name: how contacts refer to it.
        density: ρ [kg/m³], above 0.
        youngs_modulus: E [Pa], above 0.
        poissons_ratio: ν [1], −1 < ν ≤ 0.5.

    Raises:
        InputError: a value outside its physical bounds.
    """

    name: str
    density: float
    youngs_modulus: float
    poissons_ratio: float

    def __post_init__(self) -> None:
        for what in ("density", "youngs_modulus", "poissons_ratio"):
            fault = property_fault(what, getattr(self, what))
            if fault:
                raise InputError(f"Material {self.name!r}: {what} {fault}")
        if not self.name or "-" in self.name:
            raise InputError(f"Material name {self.name!r}: give a non-empty name without '-', which joins a pair.")

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + ν)) [Pa]."""
        return self.youngs_modulus / (2 * (1 + self.poissons_ratio))


def property_fault(what: str, value: float) -> str:
    """Return what is wrong with a property of a material, as the rest of a sentence, or an empty text."""
    if what == "poissons_ratio":
        return "" if -1 < value <= 0.5 else f"is {value!r}; a stable isotropic solid has -1 < ν ≤ 0.5."
    return "" if math.isfinite(value) and value > 0 else f"is {value!r}; it must be a finite number above 0 (SI)."


@dataclass(frozen=True)
class MaterialPair:
    """The two materials of a contact, first that of side i."""

    first: Material
    second: Material

    @property
    def youngs_modulus(self) -> float:
        """E* with 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂ [Pa]."""
        return 1 / sum((1 - m.poissons_ratio**2) / m.youngs_modulus for m in (self.first, self.second))

    @property
    def shear_modulus(self) -> float:
        """G* with 1/G* = (2 − ν₁)/G₁ + (2 − ν₂)/G₂ [Pa]."""
        return 1 / sum((2 - m.poissons_ratio) / m.shear_modulus for m in (self.first, self.second))


def rayleigh_time_step(radius: float, material: Material) -> float:
    """Return the time a Rayleigh wave needs to cross a sphere, dt_R = π R √(ρ/G) / (0.1631 ν + 0.8766) [s].

    Args:
        radius: R [m].
        material: of the sphere.

    Source: Li, Xu, Thornton (2005), doi 10.1016/j.powtec.2004.09.023, as used by DEM codes for the critical step.
    """
    wave = 0.1631 * material.poissons_ratio + 0.8766
    return math.pi * radius * math.sqrt(material.density / material.shear_modulus) / wave
