"""What the tests of experiments share: the bench's granules, small settings, and end states of known geometry."""

from __future__ import annotations

import numpy as np

from taichidem.effects import BodyGravity, NormalHertz, TangentialMindlin
from taichidem.materials import Material
from taichidem.scene import Model
from taichidem.shapes import Forms
from taichidem.simulation import Snapshot

GRANULE = Material("granule", 910.0, 5e6, 0.36)
WALL = Material("wall", 7800.0, 50e6, 0.3)


def granules(*more, restitution=0.6, friction=0.40):
    """Return the granules of the bench, with further effects."""
    return Model(
        (GRANULE, WALL),
        (
            NormalHertz(restitution=restitution),
            TangentialMindlin(static_friction={"granule-granule": friction, "granule-wall": 0.30}),
            BodyGravity(),
            *more,
        ),
    )


# Settings with which each experiment of the protocol runs in a second or two.
SMALL = {
    "ledge": {
        "length": "60 mm",
        "width": "24 mm",
        "particles": 160,
        "rain_top": "210 mm",
        "settle_time": 0.4,
        "flow_time": 0.5,
    },
    "bulk_density": {
        "cup_radius": "18 mm",
        "cup_height": "15 mm",
        "particles": 110,
        "rain_top": "190 mm",
        "settle_time": 0.4,
    },
    "hopper_discharge": {
        "outlet_diameter": "24 mm",
        "bin_radius": "18 mm",
        "particles": 150,
        "rain_height": "200 mm",
        "settle_time": 0.4,
        "flow_time": 0.6,
    },
    "rotating_drum": {
        "radius": "36 mm",
        "length": "24 mm",
        "particles": 75,
        "speed": "20 rpm",
        "settle_time": 0.3,
        "spin_up_time": 0.3,
        "averaging_time": 0.2,
    },
    "rebound": {"speed": "1 m/s"},
    "shear_box": {
        "length": "36 mm",
        "width": "30 mm",
        "lower_height": "12 mm",
        "particles": 150,
        "normal_stresses": [1000.0, 3000.0],
        "shear_displacement": "4 mm",
        "shear_speed": "30 mm/s",
        "settle_time": 0.3,
        "consolidation_time": 0.1,
    },
    "lifting_cylinder": {
        "cylinder_radius": "18 mm",
        "plate_radius": "36 mm",
        "particles": 330,
        "settle_time": 0.5,
        "lift_speed": "0.2 m/s",
        "rest_time": 0.3,
    },
    "free_fall": {"time": "0.2 s, 0.4 s", "floor": True, "release_height": 0.3},
}


def snapshot(position, radius=0.003, mass=1e-4, **values) -> Snapshot:
    """Return grains at rest at given centres [m]."""
    position = np.asarray(position, float)
    n = len(position)
    held = dict.fromkeys(("velocity", "spin", "force", "torque"), np.zeros((n, 3)))
    held |= {"mass": np.full(n, mass), "radius": np.full(n, radius), "identity": np.arange(n)}
    held |= {"orientation": np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), "position": position}
    held["forms"] = Forms.spheres(held["radius"])
    return Snapshot(
        **{**held, "carried": np.zeros(n), "time": 0.0, "kinetic_energy": 0.0, "left": 0, "rebuilds": 0, **values}
    )
