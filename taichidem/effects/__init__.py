"""Physical effects, one per file: import it here and it is a force, a factor and a hypothesis."""

from taichidem.effects.air_drag import AirDrag
from taichidem.effects.air_drag_linear import AirDragLinear
from taichidem.effects.base_tilt import BaseTilt
from taichidem.effects.body_gravity import BodyGravity
from taichidem.effects.cohesion_area import CohesionArea
from taichidem.effects.cohesion_dmt import CohesionDmt
from taichidem.effects.cohesion_jkr import CohesionJkr
from taichidem.effects.electrostatic_charge import ElectrostaticCharge
from taichidem.effects.elongation import Elongation
from taichidem.effects.kinetic_friction import KineticFriction
from taichidem.effects.liquid_bridge import LiquidBridge
from taichidem.effects.normal_elastoplastic import NormalElastoplastic
from taichidem.effects.normal_hertz import NormalHertz
from taichidem.effects.normal_viscoelastic import NormalViscoelastic
from taichidem.effects.rolling_constant_torque import RollingConstantTorque
from taichidem.effects.rolling_spring_dashpot import RollingSpringDashpot
from taichidem.effects.size_spread import SizeSpread
from taichidem.effects.tangential_mindlin import TangentialMindlin
from taichidem.effects.twisting_resistance import TwistingResistance
from taichidem.effects.wall_adhesion import WallAdhesion

BUILT_IN = {
    effect.name: effect
    for effect in (
        NormalHertz,
        NormalViscoelastic,
        NormalElastoplastic,
        TangentialMindlin,
        RollingConstantTorque,
        RollingSpringDashpot,
        BodyGravity,
        AirDrag,
        AirDragLinear,
        CohesionArea,
        CohesionDmt,
        CohesionJkr,
        WallAdhesion,
        ElectrostaticCharge,
        LiquidBridge,
        KineticFriction,
        TwistingResistance,
        BaseTilt,
        SizeSpread,
        Elongation,
    )
}

__all__ = [
    "BUILT_IN",
    "AirDrag",
    "AirDragLinear",
    "BaseTilt",
    "BodyGravity",
    "CohesionArea",
    "CohesionDmt",
    "CohesionJkr",
    "ElectrostaticCharge",
    "Elongation",
    "KineticFriction",
    "LiquidBridge",
    "NormalElastoplastic",
    "NormalHertz",
    "NormalViscoelastic",
    "RollingConstantTorque",
    "RollingSpringDashpot",
    "SizeSpread",
    "TangentialMindlin",
    "TwistingResistance",
    "WallAdhesion",
]
