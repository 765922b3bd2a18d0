"""Pluggable generators of designed experiments.

Make a factor space, choose a generator, generate a design::

    space = FactorSpace([Factor("friction", 0.1, 0.6), Factor("restitution", 0.3, 0.97, highest=1.0)])
    design = CentralComposite(kind="face_centred").generate(space, seed=1)
    design.to_csv("runs.csv")
"""

from __future__ import annotations

from designs.base import DesignGenerator, Points
from designs.design import Design
from designs.design_box_behnken import BoxBehnken
from designs.design_central_composite import CentralComposite
from designs.design_d_optimal import DOptimal
from designs.design_definitive_screening import DefinitiveScreening
from designs.design_fractional_factorial import FractionalFactorial
from designs.design_full_factorial import FullFactorial
from designs.design_halton import Halton
from designs.design_latin_hypercube import LatinHypercube
from designs.design_plackett_burman import PlackettBurman
from designs.design_sobol import Sobol
from designs.errors import DesignError
from designs.space import RESERVED_COLUMNS, Factor, FactorSpace

#: The built-in generators by name.
BUILT_IN: dict[str, type[DesignGenerator]] = {
    generator.name: generator
    for generator in (
        FullFactorial,
        FractionalFactorial,
        PlackettBurman,
        DefinitiveScreening,
        CentralComposite,
        BoxBehnken,
        DOptimal,
        LatinHypercube,
        Sobol,
        Halton,
    )
}

__all__ = [
    "BUILT_IN",
    "RESERVED_COLUMNS",
    "BoxBehnken",
    "CentralComposite",
    "DOptimal",
    "DefinitiveScreening",
    "Design",
    "DesignError",
    "DesignGenerator",
    "Factor",
    "FactorSpace",
    "FractionalFactorial",
    "FullFactorial",
    "Halton",
    "LatinHypercube",
    "PlackettBurman",
    "Points",
    "Sobol",
]
