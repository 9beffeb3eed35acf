"""What an estimator is told to lean on, and the poses that come to it from outside."""

from dataclasses import dataclass, replace
from math import nan

from sitl_shim.frames import Quaternion, Vector3


@dataclass(frozen=True, slots=True)
class Aiding:
    """Which measurements the estimator fuses, and how far it trusts a pose."""

    gnss: bool = True
    """Position by satellites; while it is on, poses are not used for the horizontal position."""
    pose_horizontal: bool = False
    pose_height: bool = False
    pose_yaw: bool = False
    pose_delay_s: float = 0.0
    """How much older a pose is than its time stamp says."""
    least_position_noise_m: float = 0.1
    """Standard deviation below which no pose is believed to be."""
    least_yaw_noise_rad: float = 0.1
    noise_of_message: bool = True
    """Whether a pose's own covariance counts where it is larger."""
    least_quality: int = 0
    """Poses of a lower quality are dropped; 0 takes all."""
    lost_after_s: float = 5.0
    """Position is valid for this long without a measurement of it."""


@dataclass(frozen=True, slots=True)
class ExternalPose:
    """A pose measured from outside.  World ENU (or what its sender takes for it), body FLU."""

    time_s: float
    """Of the measurement, by the autopilot's clock."""
    position_enu_m: Vector3
    attitude_flu_to_enu: Quaternion
    """(w, x, y, z), unit norm."""
    heading_is_arbitrary: bool = True
    """The world's axes are level but need not point north (MAV_FRAME_LOCAL_FRD)."""
    position_variance_m2: float = nan
    """The largest of the three; NaN where the sender does not say."""
    yaw_variance_rad2: float = nan
    reset_counter: int = 0
    """Another value than before says: what jumped is the measurement, not the vehicle."""
    quality: int = 0
    """Percent; 0 where the sender does not say, negative for a failure."""


def nothing_of(aiding: Aiding) -> Aiding:
    """The same with nothing to lean on: whatever measures the position is gone."""
    return replace(aiding, gnss=False, pose_horizontal=False, pose_height=False, pose_yaw=False)
