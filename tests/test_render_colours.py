"""What colours the grains of a picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from taichidem.errors import InputError
from taichidem.grains import Grains
from taichidem.render import heap_picture
from taichidem.render_colours import QUANTITIES
from taichidem.render_heap import HeapLook
from taichidem.shapes import Forms, Superquadric
from tests.experiments.planted import snapshot

ROD = Superquadric.spheroid(2.5, 0.003)


def seen_grains(**values):
    """Return a snapshot of three grains in a row along y."""
    position = np.array([[0, -0.01, 0.004], [0, 0, 0.004], [0, 0.01, 0.004]])
    bodies = ROD.bodies(position, 1000.0)
    orientation = np.array([[1, 0, 0, 0], [np.sqrt(0.5), np.sqrt(0.5), 0, 0], [np.cos(0.2), np.sin(0.2), 0, 0]])
    return snapshot(position, forms=replace(Forms.of([bodies]), material=None), orientation=orientation, **values)


def test_quantities_have_the_units_they_say():
    velocity = np.array([[0, 0, -2.0], [0, 0, 0], [3.0, 0, 4.0]])
    seen = seen_grains(velocity=velocity, spin=velocity * 10, force=velocity, carried=np.array([0, 1e-9, 0]))
    expected = {
        "height": [4, 4, 4],
        "speed": [2, 0, 5],
        "vertical_velocity": [-2, 0, 4],
        "spin": [20, 0, 50],
        "kinetic_energy": [200, 0, 1250],
        "force": [2000, 0, 5000],
        "mass": [100, 100, 100],
        "diameter": [6, 6, 6],
        "tilt": [0, 90, np.degrees(0.4)],
        "carried": [0, 1e-9, 0],
        "identity": [0, 1, 2],
    }
    assert set(expected) == set(QUANTITIES) - {"material"}
    for name, values in expected.items():
        assert QUANTITIES[name].of(seen) == pytest.approx(values, abs=1e-9), name


def test_materials_come_from_what_was_inserted():
    density, at = 1000.0, np.array([[0, 0, 0.01], [0, 0.01, 0.01]])
    forms = Forms.of([ROD.bodies(at[:1], density, material=1), ROD.bodies(at[1:], density, material=0)])
    seen = snapshot(at, forms=forms.rows(np.array([0, 1])))
    assert QUANTITIES["material"].of(seen) == pytest.approx([1, 0])
    with pytest.raises(InputError, match="doesn't hold it"):
        heap_picture(seen_grains(), colour_by="material")


def test_grains_have_the_colour_of_their_value():
    look = HeapLook(azimuth_deg=0, size=(400, 300))
    image = heap_picture(seen_grains(), colour_by="identity", look=look)[:, :330].astype(int)  # left of the colour bar
    violet = (image[:, :, 2] > image[:, :, 1] + 25) & (image[:, :, 0] < 120)
    yellow = (image[:, :, 0] > image[:, :, 2] + 80) & (image[:, :, 1] > image[:, :, 2] + 60)
    assert np.count_nonzero(violet) > 200 < np.count_nonzero(yellow)
    assert np.nonzero(violet)[1].max() < np.nonzero(yellow)[1].min()
    by_name = heap_picture(seen_grains(), colour_by="tilt", look=look)
    by_value = heap_picture(
        seen_grains(),
        values=QUANTITIES["tilt"].of(seen_grains()),
        value_name=QUANTITIES["tilt"].label,
        look=look,
    )
    assert np.array_equal(by_name, by_value)


def test_colours_that_are_not_there_are_refused():
    with pytest.raises(InputError, match=r"Unknown quantity to colour by 'sped'. Allowed: carried, .* 'speed'"):
        heap_picture(seen_grains(), colour_by="sped")
    with pytest.raises(InputError, match="Give the snapshot itself"):
        heap_picture(Grains.of(seen_grains()), colour_by="speed")
    with pytest.raises(InputError, match="Give one of them"):
        heap_picture(seen_grains(), colour_by="speed", values=[1, 2, 3])
