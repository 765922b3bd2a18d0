"""Physical effects, one per file: import it here and it is a force, a factor and a hypothesis."""

from taichidem.effects.air_drag import AirDrag
from taichidem.effects.base_tilt import BaseTilt
from taichidem.effects.body_gravity import BodyGravity
from taichidem.effects.cohesion_area import CohesionArea
from taichidem.effects.normal_elastoplastic import NormalElastoplastic
from taichidem.effects.normal_hertz import NormalHertz
from taichidem.effects.normal_viscoelastic import NormalViscoelastic
from taichidem.effects.rolling_constant_torque import RollingConstantTorque
from taichidem.effects.rolling_spring_dashpot import RollingSpringDashpot
from taichidem.effects.size_spread import SizeSpread
from taichidem.effects.tangential_mindlin import TangentialMindlin

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
        CohesionArea,
        BaseTilt,
        SizeSpread,
    )
}

__all__ = [
    "BUILT_IN",
    "AirDrag",
    "BaseTilt",
    "BodyGravity",
    "CohesionArea",
    "NormalElastoplastic",
    "NormalHertz",
    "NormalViscoelastic",
    "RollingConstantTorque",
    "RollingSpringDashpot",
    "SizeSpread",
    "TangentialMindlin",
]
