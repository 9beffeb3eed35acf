"""The one type of state that the companion's stages pass on."""

from dataclasses import dataclass

from companion.frames import Quaternion, Vector3


# Made at every tick, and frozen it takes several times as long to make: change none.
@dataclass(slots=True)
class VehicleState:
    """One sample of the vehicle's motion, as the autopilot reports it."""

    time_s: float
    """Autopilot's time since its boot at which the sample is true."""
    position_enu_m: Vector3
    """Position in the autopilot's local frame, turned to ENU."""
    velocity_enu_m_s: Vector3
    """m/s."""
    attitude_flu_to_enu: Quaternion
    """(w, x, y, z), body FLU to world ENU."""
    rate_flu_rad_s: Vector3
    """Body rates about forward, left and up, rad/s."""
    reset_counter: int = 0
    """Goes up, and around after 255, when the estimator steps and says so; 0 where none does."""
