"""What a mission, a vehicle and a controller file may say: the models of all of them."""

from companion.config.controller_models import (
    FRAMEWORK_SECTIONS,
    ControllerConfig,
    Framework,
    LqrConfig,
    MpcConfig,
    MpcModelConfig,
    NonNegativePerAxis,
    OuterPidConfig,
    PidConfig,
    ThrustConfig,
    YawConfig,
)
from companion.config.l1_models import (
    ClimbRateGains,
    L1Config,
    TransferFunctionConfig,
    TransferFunctions,
)
from companion.config.mission_models import (
    GeofenceConfig,
    MissionConfig,
    OriginConfig,
    SupervisorConfig,
    TimeoutsConfig,
)
from companion.config.vehicle_models import (
    AttitudeLoopConfig,
    DynamicsConfig,
    NoiseConfig,
    ResponseConfig,
    VehicleConfig,
)

__all__ = [
    "FRAMEWORK_SECTIONS",
    "AttitudeLoopConfig",
    "ClimbRateGains",
    "ControllerConfig",
    "DynamicsConfig",
    "Framework",
    "GeofenceConfig",
    "L1Config",
    "LqrConfig",
    "MissionConfig",
    "MpcConfig",
    "MpcModelConfig",
    "NoiseConfig",
    "NonNegativePerAxis",
    "OriginConfig",
    "OuterPidConfig",
    "PidConfig",
    "ResponseConfig",
    "SupervisorConfig",
    "ThrustConfig",
    "TimeoutsConfig",
    "TransferFunctionConfig",
    "TransferFunctions",
    "VehicleConfig",
    "YawConfig",
]
