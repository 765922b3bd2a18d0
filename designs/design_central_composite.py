"""Central composite designs: circumscribed, inscribed, face-centred."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from designs.base import DesignGenerator, Points, check_choice, check_whole
from designs.errors import DesignError
from designs.generators import fraction, generators_for, resolution_of
from designs.space import Array, FactorSpace
from designs.stack import stacked_blocks

_KINDS = ("circumscribed", "inscribed", "face_centred")
_ALPHAS = ("rotatable", "spherical", "orthogonal_blocks", "orthogonal_quadratic")


@dataclass(frozen=True, kw_only=True)
class CentralComposite(DesignGenerator):
    """Central composite: cube, star points at ±α on each axis and centre points, for a full quadratic model.

    With n_f cube runs, n_c and n_s centre runs in the cube and star blocks, N runs in all:
    rotatable α = n_f^¼; spherical α = √k; orthogonal_blocks α = √(n_f (2k + n_s) / (2 (n_f + n_c)));
    orthogonal_quadratic α = √((√(N n_f) − n_f) / 2), which makes the squares orthogonal to one another.

    Args:
        kind: ``circumscribed`` (the star lies outside low … high), ``inscribed`` (the star is at low and high, the
            cube inside), ``face_centred`` (α = 1, three levels).
        alpha: one of the names above or a number > 0; face_centred takes none.
        centre_points: total number, or for blocks two numbers, cube and star; default 6 (5 for two factors), in
            blocks (4, 2) (for two factors (3, 3)).
        blocks: 1; 2 = cube and star; 3 = two halves of the cube, split by the sign of the product of all factors,
            and the star.
        halvings: halve the cube so many times (0 = full); what is left must have resolution V.

    Source: Box & Wilson, J. R. Stat. Soc. B 13 (1951) 1; Box & Hunter, Ann. Math. Stat. 28 (1957) 195,
    doi 10.1214/aoms/1177707047.
    """

    kind: str = "circumscribed"
    alpha: str | float | None = None
    centre_points: int | tuple[int, int] | None = None
    blocks: int = 1
    halvings: int = 0

    name: ClassVar[str] = "central_composite"
    model: ClassVar[str] = "quadratic"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice(self, "kind", self.kind, _KINDS)
        check_whole(self, "halvings", self.halvings, at_least=0)
        if self.blocks not in (1, 2, 3):
            raise DesignError(f"central_composite has blocks = {self.blocks!r}; 1, 2 (cube, star) or 3 are possible.")
        self._check_alpha()
        self._check_centre_points()

    def _check_alpha(self) -> None:
        if self.kind == "face_centred":
            if self.alpha not in (None, 1, 1.0):
                raise DesignError(
                    f"central_composite has kind = 'face_centred', which means α = 1, and alpha = {self.alpha!r}. "
                    "Drop alpha, or choose kind = 'circumscribed' or 'inscribed'."
                )
        elif isinstance(self.alpha, str):
            check_choice(self, "alpha", self.alpha, [*_ALPHAS, "a number"])
        elif self.alpha is not None and not (math.isfinite(self.alpha) and self.alpha > 0):
            raise DesignError(f"central_composite has alpha = {self.alpha!r}; a name or a number > 0 is needed.")

    def _check_centre_points(self) -> None:
        pair = isinstance(self.centre_points, tuple)
        if self.centre_points is not None and pair != (self.blocks > 1):
            raise DesignError(
                f"central_composite has centre_points = {self.centre_points!r} and blocks = {self.blocks}; one block "
                "takes one total, more blocks take two numbers, cube and star (for example 4,2)."
            )
        for count in self.centre_points if isinstance(self.centre_points, tuple) else (self.centre_points or 0,):
            check_whole(self, "centre_points", count, at_least=0)

    def points(self, space: FactorSpace, rng: np.random.Generator) -> Points:
        """Return cube, star, centre in this order; in blocks, each block with its centre points."""
        k = len(space)
        if not 2 <= k <= 12:
            raise DesignError(f"central_composite works for 2 to 12 factors; {k} were given. Screen first.")
        cube, (in_cube, in_star) = self._cube(k), self._centres(k)
        alpha = self._alpha(len(cube), k, in_cube, in_star)
        star = np.kron(np.eye(k), np.array([[-1.0], [1.0]])) * alpha
        if self.kind == "inscribed":
            cube, star = cube / max(alpha, 1.0), star / max(alpha, 1.0)
        notes = (f"Star points at α = {alpha:.4g}" + (" (scaled into the box)." if self.kind == "inscribed" else "."),)
        centre = np.zeros((in_cube + in_star, k))
        if self.blocks == 1:
            return stacked_blocks([[("factorial", cube), ("axial", star), ("centre", centre)]], notes)
        star_block = [("axial", star), ("centre", centre[:in_star])]
        return stacked_blocks([*self._cube_blocks(cube, centre[:in_cube]), star_block], notes)

    def _cube(self, k: int) -> Array:
        words = generators_for(k, self.halvings)
        if words is None or (self.halvings and resolution_of(k, words) < 5):
            raise DesignError(
                f"central_composite in {k} factors can't halve its cube {self.halvings} times: what is left must have "
                "resolution V to carry all interactions. Use fewer halvings (5 to 7 factors allow 1, 8 and more 2)."
            )
        return fraction(k, words)

    def _centres(self, k: int) -> tuple[int, int]:
        if isinstance(self.centre_points, tuple):
            return self.centre_points
        if self.blocks > 1:
            return (3, 3) if k == 2 else (4, 2)
        return 0, self.centre_points if self.centre_points is not None else (5 if k == 2 else 6)

    def _cube_blocks(self, cube: Array, centre: Array) -> list[list[tuple[str, Array]]]:
        if self.blocks == 2:
            return [[("factorial", cube), ("centre", centre)]]
        if self.halvings or cube.shape[1] < 3 or len(centre) % 2:
            raise DesignError(
                "central_composite splits only a full cube of 3 or more factors into two blocks, with an even number "
                "of cube centre points. Use blocks = 2, or halvings = 0 and an even number."
            )
        # The sign, not the product: an inscribed cube lies at ±1/α.
        sign, half = np.sign(np.prod(cube, axis=1)), len(centre) // 2
        return [[("factorial", cube[sign == s]), ("centre", centre[:half])] for s in (-sign[-1], sign[-1])]

    def _alpha(self, n_f: int, k: int, n_c: int, n_s: int) -> float:
        if self.kind == "face_centred":
            return 1.0
        if isinstance(self.alpha, (int, float)):
            return float(self.alpha)
        total = n_f + 2 * k + n_c + n_s
        formulas = {
            "rotatable": n_f**0.25,
            "spherical": math.sqrt(k),
            "orthogonal_blocks": math.sqrt(n_f * (2 * k + n_s) / (2 * (n_f + n_c))),
            "orthogonal_quadratic": math.sqrt((math.sqrt(total * n_f) - n_f) / 2),
        }
        return formulas[self.alpha or ("rotatable" if self.blocks == 1 else "orthogonal_blocks")]

    def possible_runs(self, space: FactorSpace) -> Iterable[int]:
        """Return the runs with 0 to 20 centre points."""
        k = len(space)
        return [2 ** (k - self.halvings) + 2 * k + centre for centre in range(21)]

    def outside_advice(self) -> str:
        """Return the cure for a star point outside a physical bound."""
        return (
            "Use kind = 'face_centred' (star points on the faces) or 'inscribed' (star points at low and high), "
            "or narrow the range of the factor."
        )
