"""Rate control: from body-rate setpoints to normalised torques (ArduPilot's AC_PID)."""

from sitl_shim.autopilot.ardupilot.laws import RateGains, RateState, axis_torque, rate_torques
from sitl_shim.autopilot.filters import SecondOrderLowPass, first_order_gain
from sitl_shim.autopilot.interface import TICK_RATE_HZ
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.compiled import BOOLEAN, compiled
from sitl_shim.frames import Vector3

_REST: RateState = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class RateControl:
    """PID of the three body rates (FLU)."""

    __slots__ = ("_gains", "_gyro", "_law", "_low_pass", "_settled", "_states")

    def __init__(self, parameters: ParameterStore) -> None:
        self._states = (_REST, _REST, _REST)
        self._law = compiled(
            rate_torques,
            *(8, 8, 8, 6, 7, 7, 7, 3, 3, BOOLEAN, BOOLEAN),
            parts=(axis_torque,),
        )
        self.configure(parameters)

    def configure(self, parameters: ParameterStore) -> None:
        """Read gains and filters anew; the integrators stay, the filters begin afresh."""
        self._gains = (
            _gains_of(parameters, "RLL"),
            _gains_of(parameters, "PIT"),
            _gains_of(parameters, "YAW"),
        )
        self._low_pass = SecondOrderLowPass(TICK_RATE_HZ, parameters["INS_GYRO_FILTER"])
        self._gyro = self._low_pass.coefficients
        self._settled = False

    def reset(self) -> None:
        """Forget the past: the motors did not obey."""
        roll, pitch, yaw = self._states
        self._states = (_forgotten(roll), _forgotten(pitch), _forgotten(yaw))

    def update(
        self, rate_flu_rad_s: Vector3, setpoint_flu_rad_s: Vector3, limits: tuple[bool, bool]
    ) -> Vector3:
        """Normalised torques about the body axes (FLU), each within -1 to 1.

        Args:
            rate_flu_rad_s: measured.
            setpoint_flu_rad_s: wanted.
            limits: whether roll and pitch, and yaw, were cut by the motors.
        """
        if not self._settled:
            self._settle(rate_flu_rad_s)
        roll, pitch, yaw = self._gains
        roll_state, pitch_state, yaw_state = self._states
        tilt, turn = limits
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
            tilt,
            turn,
        )
        self._states = (roll_state, pitch_state, yaw_state)
        return torque

    def _settle(self, rate_flu_rad_s: Vector3) -> None:
        """Let the filters begin settled on the first sample."""
        self._settled = True
        roll, pitch, yaw = self._states
        x, y, z = (self._low_pass.settled_on(rate) for rate in rate_flu_rad_s)
        self._states = ((*roll[:5], x, x), (*pitch[:5], y, y), (*yaw[:5], z, z))


def _gains_of(parameters: ParameterStore, name: str) -> RateGains:
    prefix, p = f"ATC_RAT_{name}_", parameters
    return (
        p[prefix + "P"],
        p[prefix + "I"],
        p[prefix + "D"],
        p[prefix + "FF"],
        p[prefix + "IMAX"],
        first_order_gain(TICK_RATE_HZ, p[prefix + "FLTT"]),
        first_order_gain(TICK_RATE_HZ, p[prefix + "FLTE"]),
        first_order_gain(TICK_RATE_HZ, p[prefix + "FLTD"]),
    )


def _forgotten(state: RateState) -> RateState:
    """A state without integral and target; the gyro's filter goes on."""
    _, target, error, derivative, _, w1, w2 = state
    return (0.0, target, error, derivative, 0.0, w1, w2)
