"""Bulk tests, one per file."""

from taichidem.experiments.base import Experiment, Observable, Outcome, Settings
from taichidem.experiments.bulk_density import BulkDensity
from taichidem.experiments.fixed_funnel import FixedFunnel
from taichidem.experiments.free_fall import FreeFall
from taichidem.experiments.hopper_discharge import HopperDischarge
from taichidem.experiments.ledge import Ledge
from taichidem.experiments.lifting_cylinder import LiftingCylinder
from taichidem.experiments.rebound import Rebound
from taichidem.experiments.rolling_ball import RollingBall
from taichidem.experiments.rotating_drum import RotatingDrum
from taichidem.experiments.shear_box import ShearBox

BUILT_IN = {
    experiment.name: experiment
    for experiment in (
        Ledge,
        BulkDensity,
        FixedFunnel,
        HopperDischarge,
        RotatingDrum,
        Rebound,
        RollingBall,
        FreeFall,
        ShearBox,
        LiftingCylinder,
    )
}

__all__ = [
    "BUILT_IN",
    "BulkDensity",
    "Experiment",
    "FixedFunnel",
    "FreeFall",
    "HopperDischarge",
    "Ledge",
    "LiftingCylinder",
    "Observable",
    "Outcome",
    "Rebound",
    "RollingBall",
    "RotatingDrum",
    "Settings",
    "ShearBox",
]
