"""The paper's heap at a point of its factors, with grains of 6 mm and of 3 mm."""

from __future__ import annotations

from collections.abc import Mapping

from taichidem.coarse_graining import CoarseGraining
from taichidem.experiments import FixedFunnel
from taichidem.library import PAPER_FINE_HEAP, polypropylene
from taichidem.paper.published import FACTORS
from taichidem.scene import Model

SCALE = 2.0  # of the coarse grains, 6 mm for 3 mm
ARGUMENTS = {
    "A": "poissons_ratio",
    "B": "density",
    "D": "restitution",
    "E": "wall_restitution",
    "F": "static_friction",
    "G": "wall_static_friction",
    "H": "rolling_friction",
    "I": "wall_rolling_friction",
}  # of `polypropylene`


def model_at(levels: Mapping[str, float], *, stiffness: float) -> Model:
    """Return the model of polypropylene on steel at some levels of the paper's factors; the others keep their fixed values.

    Args:
        levels: letter → value in the paper's units.
        stiffness: share of Young's modulus C that is left to the grains.
    """
    every = {factor.letter: factor.fixed for factor in FACTORS} | dict(levels)
    modulus = 1e9 * every.pop("C") * stiffness
    return polypropylene(youngs_modulus=modulus, **{ARGUMENTS[letter]: value for letter, value in every.items()})


def fine_heap() -> FixedFunnel:
    """Return the heap of 3 mm grains, measured in pictures."""
    return FixedFunnel(**PAPER_FINE_HEAP | {"method": "pictures"})


def coarse_heap() -> FixedFunnel:
    """Return the same pour with grains of 6 mm."""
    heap = CoarseGraining(SCALE).experiment(fine_heap())
    assert isinstance(heap, FixedFunnel)
    return heap


def similar_heap() -> FixedFunnel:
    """Return the pour of 6 mm grains from so high that they strike the heap with the real grains' v²/(g d).

    That is twice the energy over mass: 0.71 J/kg instead of 0.36 J/kg, for grains that appear with 0.3 m/s some 32 mm above
    the top. From the same height, grains twice as large make a steeper heap (docs/performance.md).
    """
    return FixedFunnel(**coarse_heap().settings.model_dump() | {"stream_bottom": "100 mm", "stream_top": "140 mm"})
