"""The forms of the grains of a snapshot, for pictures and files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichidem.bodies import Bodies


@dataclass(frozen=True)
class Forms:
    """The contact elements of bodies, in the order of a snapshot's rows.

    Attributes:
        body: row of the body that each element belongs to, (m,), ascending.
        offset: centre in the body's principal frame [m], (m, 3).
        radius: of the sphere, or of the sphere about a superquadric [m], (m,).
        axes: semi-axes of superquadrics along the principal axes [m], (m, 3); None where all elements are spheres.
        exponents: n₁ and n₂ of superquadrics, (m, 2); None as above.
        material: number of each element's material, (m,); None where it isn't known.
    """

    body: np.ndarray
    offset: np.ndarray
    radius: np.ndarray
    axes: np.ndarray | None = None
    exponents: np.ndarray | None = None
    material: np.ndarray | None = None

    @classmethod
    def spheres(cls, radius: np.ndarray) -> Forms:
        """Return single spheres of the given radii [m]."""
        return cls(np.arange(len(radius)), np.zeros((len(radius), 3)), np.asarray(radius, float))

    @classmethod
    def of(cls, inserted: Sequence[Bodies]) -> Forms:
        """Return the forms of all bodies that were inserted, in the order of their identities."""
        if not inserted:
            return cls.spheres(np.zeros(0))
        every = Bodies.joined(inserted)
        order = np.argsort(every.element_body, kind="stable")
        axes, exponents = every.element_axes, every.element_exponents
        return cls(
            every.element_body[order],
            every.element_offset[order],
            every.element_radius[order],
            None if axes is None else axes[order],
            None if exponents is None else exponents[order],
            every.element_material[order],
        )

    def rows(self, identity: np.ndarray) -> Forms:
        """Return the forms of some bodies alone, numbered as they stand in `identity` (n,), ascending."""
        kept = np.isin(self.body, identity)
        return Forms(
            np.searchsorted(identity, self.body[kept]),
            self.offset[kept],
            self.radius[kept],
            None if self.axes is None else self.axes[kept],
            None if self.exponents is None else self.exponents[kept],
            None if self.material is None else self.material[kept],
        )

    @property
    def round(self) -> bool:
        """True if every body is one sphere about its own centre, so that its orientation can't be seen."""
        own = np.array_equal(self.body, np.arange(len(self.radius)))
        return self.axes is None and own and not np.any(self.offset)
