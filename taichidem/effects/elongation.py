"""Grains that are longer or flatter than spheres."""

from functools import lru_cache
from typing import Any, ClassVar

from taichidem.effects.base import Parameter, SetupEffect
from taichidem.effects.probe import ProbeScale
from taichidem.errors import InputError
from taichidem.shapes.base import GrainShape
from taichidem.shapes.superquadric import Superquadric

FORMS = ("superquadric", "multisphere")
FEWEST_SPHERES = 2


class Elongation(SetupEffect):
    """Spheroids of the spheres' volume in place of spheres, turned at random when they come.

    a = R α^(−1/3) across, c = R α^(2/3) along the axis of revolution, so a² c = R³; mass as of the sphere,
    I = m (a² + c²)/5 about the two axes across and 2/5 m a² about that of revolution

    α is length over width: above 1 the grains are elongated, below 1 flat. Option `form`: "superquadric", the smooth
    spheroid, or "multisphere", so many `spheres` (an option too) in a row, or in rings where grains are flat, which imitate
    it. A few spheres imitate roughly: what they do to friction and packing is partly their bumps.

    Expected behaviour: at α = 1.5 the polypropylene of the library made heaps, poured or left by a lifted tube, 5° to 6°
    steeper, sheared at a fifth more stress and packed 3 % denser; a drum and a discharge hardly changed, and the slope
    that stays behind a ledge was 4° flatter. Limits: one form for all grains of a world, smooth and convex. Tests of a
    single ball (rebound, rolling ball, free fall) stay tests of a ball of the same volume.
    """

    name: ClassVar[str] = "elongation"
    title: ClassVar[str] = "Elongated or flat grains"
    family: ClassVar[str] = "elongation"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            name="aspect_ratio",
            unit="1",
            low=0.2,
            high=5.0,
            plausible=(1.0, 2.0),
            vanishing=1.0,
            per_pair=False,
            meaning="Length of a grain along its axis of revolution over its width.",
        ),
    )
    visible_as: ClassVar[str] = "steeper heaps, more strength in shear and a denser packing at nearly the same flow"
    source: ClassVar[str] = (
        "volume and inertia of a spheroid; the denser packing: Donev et al. (2004), doi 10.1126/science.1093010"
    )

    def __init__(self, form: str = "superquadric", spheres: int = 3, **values: Any) -> None:
        super().__init__(**values)
        if form not in FORMS:
            raise InputError(f"elongation.form is {form!r}; allowed: {', '.join(FORMS)}.")
        if isinstance(spheres, bool) or not isinstance(spheres, int) or spheres < FEWEST_SPHERES:
            raise InputError(f"elongation.spheres is {spheres!r}; give a whole number from {FEWEST_SPHERES}.")
        self.form = form
        self.spheres = spheres

    @classmethod
    def strongest(cls, scale: ProbeScale) -> dict[str, Any]:
        """Return grains half as long again as they are wide."""
        return {"aspect_ratio": 1.5}

    def grain_shape(self) -> GrainShape | None:
        return spheroid(self.value("aspect_ratio"), self.form, self.spheres)


@lru_cache(maxsize=256)  # a model asks again and again, and the moments of overlapping spheres take a while
def spheroid(aspect_ratio: float, form: str = "superquadric", spheres: int = 3) -> GrainShape | None:
    """Return a spheroid in one of the forms, None where it is a sphere.

    Args:
        aspect_ratio: length over width.
        form: "superquadric" or "multisphere".
        spheres: of a multisphere.

    Raises:
        InputError: a ratio not above 0, or a number of spheres that can't make it.
    """
    if aspect_ratio == 1.0:
        return None
    if form == "superquadric":
        return Superquadric.spheroid(aspect_ratio)
    from taichidem.shapes.multisphere import Multisphere

    return Multisphere.spheroid(aspect_ratio, spheres)
