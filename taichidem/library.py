"""Starting materials and models with their sources."""

from __future__ import annotations

from taichidem.effects import BodyGravity, NormalHertz, RollingConstantTorque, TangentialMindlin
from taichidem.materials import Material
from taichidem.scene import Model

#: [Pa]. The real one, 1.3 GPa, wants eleven times smaller steps and moves the heap by +0.7° ± 0.6° (docs/reproduce_paper.md).
SOFT_POLYPROPYLENE_MODULUS = 1e7

# Settings of `fixed_funnel` for the heaps of the paper: a cup of 100 mm, measured over rings.
PAPER_HEAP = {
    "diameter": "6 mm",
    "cup_radius": "50 mm",
    "rim_height": "30 mm",
    "stream_radius": "15 mm",
    "stream_bottom": "65 mm",
    "stream_top": "105 mm",
    "stream_rate": 600.0,
    "batch_interval": "20 ms",
    "drop_velocity": "0.3 m/s",
    "particles": 2500,
    "settle_time": "0.6 s",
    "longest_settle_time": "2 s",
    "method": "rings",
    "fit_from": 0.4,
    "fit_to": 0.92,
}
# The same with the real grains, half as large: eight times as many, at eight times the rate.
PAPER_FINE_HEAP = PAPER_HEAP | {"diameter": "3 mm", "particles": 20000, "stream_rate": 4800.0}


def polypropylene(
    *,
    static_friction: float = 0.52,
    restitution: float = 0.55,
    density: float = 910.0,
    youngs_modulus: float = SOFT_POLYPROPYLENE_MODULUS,
    rolling_friction: float = 0.05,
    poissons_ratio: float = 0.36,
    wall_restitution: float = 0.55,
    wall_static_friction: float = 0.26,
    wall_rolling_friction: float = 0.246,
) -> Model:
    """Return the paper's polypropylene granules on steel, at its optimum unless told otherwise.

    Args:
        static_friction, restitution, rolling_friction: between granules [1]. The paper's "dynamic friction" is rolling
            friction.
        density: [kg/m³].
        youngs_modulus: of the granules [Pa]; softened by default, 1.3 GPa in reality.
        poissons_ratio: of the granules [1].
        wall_restitution, wall_static_friction, wall_rolling_friction: of granules against steel [1].

    Source: Sudsawat, Chongchitpaisan & Arunyanart (2023), doi 10.21303/2461-4262.2023.002968.
    """
    grain = Material("polypropylene", density, youngs_modulus, poissons_ratio)
    steel = Material("steel", 7800.0, 198e9, 0.3)
    same, other = "polypropylene-polypropylene", "polypropylene-steel"
    return Model(
        (grain, steel),
        (
            NormalHertz(restitution={same: restitution, other: wall_restitution}),
            TangentialMindlin(static_friction={same: static_friction, other: wall_static_friction}),
            RollingConstantTorque(rolling_friction={same: rolling_friction, other: wall_rolling_friction}),
            BodyGravity(),
        ),
    )
