"""Every registered design passes the one conformance suite, those of outside packages included."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from designs import BUILT_IN, DesignError, LatinHypercube, Points
from designs.base import DesignGenerator
from designs.conformance import check_generator
from taichidem import plugins


@pytest.mark.parametrize("name", [plugin.name for plugin in plugins.listing("design") if plugin.usable])
def test_registered_design_conforms(name):
    check_generator(plugins.get("design", name))


def test_all_built_in_designs_are_registered():
    assert set(BUILT_IN) <= set(plugins.names("design"))
    assert all(BUILT_IN[name].name == name for name in BUILT_IN)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Faulty(DesignGenerator):
    """A design that does everything right until a test spoils it."""

    name = "faulty"

    def points(self, space, rng):
        grid = np.vstack([-np.ones((3, len(space))), rng.choice([-1.0, 1.0], (9, len(space)))])
        return Points(grid, ("factorial",) * len(grid))


def spoiled(**methods):
    return type(
        "Spoiled", (Faulty,), {"name": "spoiled", "__doc__": "A design with a fault that must be found.", **methods}
    )


def no_chance(self, space, rng):
    return Points(np.random.default_rng().uniform(-1, 1, (9, len(space))), ("x",) * 9)


def outside(self, space, rng):
    return Points(2 * np.ones((5, len(space))), ("factorial",) * 5)


def one_point(self, space, rng):
    return Points(np.zeros((6, len(space))), ("centre",) * 6)


def wordless(self, space, rng):
    raise DesignError("no")


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ({"points": no_chance}, "same seed gave another design"),
        ({"points": outside}, "outside low"),
        ({"points": one_point}, "not estimable"),
        ({"points": wordless}, "doesn't name the design"),
        ({"name": "Not A Name"}, "bad name"),
        ({"__doc__": "Short."}, "docstring"),
        ({"settings": classmethod(lambda cls: {})}, "hides the common settings"),
    ],
)
def test_the_suite_finds_faults(fault, words):
    with pytest.raises(AssertionError, match=words):
        check_generator(spoiled(**fault))


def test_the_suite_finds_a_number_of_runs_that_is_ignored():
    class Deaf(LatinHypercube):
        """A Latin hypercube that doesn't listen to the number of runs."""

        name = "deaf"

        def _counted(self, space, points):
            return dataclasses.replace(points, coded=points.coded[:10], point_type=points.point_type[:10])

    with pytest.raises(AssertionError, match="asked for 13 runs, got 10"):
        check_generator(Deaf)
