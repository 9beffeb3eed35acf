"""Rate control: from body-rate setpoints to normalised torques.

PX4's rate controller (src/lib/rate_control) behind its gyro filters
(src/modules/sensors/vehicle_angular_velocity).
"""

from sitl_shim.autopilot.filters import SecondOrderLowPass, first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.laws import (
    GyroFilter,
    RateGains,
    RateState,
    axis_torque,
    rate_torques,
)
from sitl_shim.compiled import BOOLEAN, compiled
from sitl_shim.frames import Vector3

_REST: RateState = (0.0, 0.0, 0.0, 0.0, 0.0)


class RateControl:
    """PID of the three body rates (FLU)."""

    __slots__ = ("_gains", "_gyro", "_law", "_low_pass", "_settled", "_states")

    def __init__(self, parameters: ParameterStore) -> None:
        self._states = (_REST, _REST, _REST)
        self._law = compiled(
            rate_torques, *(5, 5, 5, 7, 5, 5, 5, 3, 3, BOOLEAN, 3), parts=(axis_torque,)
        )
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and filters anew; the integrators stay, the filters begin afresh."""
        self._gains = (
            _gains_of(parameters, "ROLL", "MC_RR_INT_LIM"),
            _gains_of(parameters, "PITCH", "MC_PR_INT_LIM"),
            _gains_of(parameters, "YAW", "MC_YR_INT_LIM"),
        )
        self._low_pass = SecondOrderLowPass(TICK_RATE_HZ, parameters["IMU_GYRO_CUTOFF"])
        d_gain = first_order_gain(TICK_RATE_HZ, parameters["IMU_DGYRO_CUTOFF"])
        self._gyro: GyroFilter = (*self._low_pass.coefficients, d_gain)
        self._settled = False

    def update(
        self,
        rate_flu_rad_s: Vector3,
        setpoint_flu_rad_s: Vector3,
        *,
        held: bool,
        saturated: tuple[int, int, int],
    ) -> Vector3:
        """Normalised torques about the body axes (FLU), each within -1 to 1."""
        if not self._settled:
            self._settle(rate_flu_rad_s)
        roll, pitch, yaw = self._gains
        roll_state, pitch_state, yaw_state = self._states
        torque, roll_state, pitch_state, yaw_state = self._law(
            roll,
            pitch,
            yaw,
            self._gyro,
            roll_state,
            pitch_state,
            yaw_state,
            rate_flu_rad_s,
            setpoint_flu_rad_s,
            held,
            saturated,
        )
        self._states = (roll_state, pitch_state, yaw_state)
        return torque

    def _settle(self, rate_flu_rad_s: Vector3) -> None:
        """Let the filters begin settled on the first sample."""
        self._settled = True
        roll, pitch, yaw = self._states
        memories = [self._low_pass.settled_on(rate) for rate in rate_flu_rad_s]
        self._states = (
            (*roll[:3], memories[0], memories[0]),
            (*pitch[:3], memories[1], memories[1]),
            (*yaw[:3], memories[2], memories[2]),
        )


def _gains_of(parameters: ParameterStore, name: str, limit_name: str) -> RateGains:
    gain = parameters[f"MC_{name}RATE_K"]
    return (
        gain * parameters[f"MC_{name}RATE_P"],
        gain * parameters[f"MC_{name}RATE_I"],
        gain * parameters[f"MC_{name}RATE_D"],
        parameters[f"MC_{name}RATE_FF"],
        parameters[limit_name],
    )
