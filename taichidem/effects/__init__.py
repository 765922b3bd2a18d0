"""Physical effects, one per file: import it here and it is a force, a factor and a hypothesis."""

from taichidem.effects.base_tilt import BaseTilt
from taichidem.effects.body_gravity import BodyGravity
from taichidem.effects.cohesion_area import CohesionArea
from taichidem.effects.kinetic_friction import KineticFriction
from taichidem.effects.liquid_bridge import LiquidBridge
from taichidem.effects.normal_hertz import NormalHertz
from taichidem.effects.rolling_constant_torque import RollingConstantTorque
from taichidem.effects.rolling_spring_dashpot import RollingSpringDashpot
from taichidem.effects.size_spread import SizeSpread
from taichidem.effects.tangential_mindlin import TangentialMindlin
from taichidem.effects.twisting_resistance import TwistingResistance

BUILT_IN = {
    effect.name: effect
    for effect in (
        NormalHertz,
        TangentialMindlin,
        RollingConstantTorque,
        RollingSpringDashpot,
        BodyGravity,
        CohesionArea,
        LiquidBridge,
        KineticFriction,
        TwistingResistance,
        BaseTilt,
        SizeSpread,
    )
}

__all__ = [
    "BUILT_IN",
    "BaseTilt",
    "BodyGravity",
    "CohesionArea",
    "KineticFriction",
    "LiquidBridge",
    "NormalHertz",
    "RollingConstantTorque",
    "RollingSpringDashpot",
    "SizeSpread",
    "TangentialMindlin",
    "TwistingResistance",
]
