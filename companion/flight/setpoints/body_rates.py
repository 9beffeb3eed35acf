"""Body rates for the attitudes that the control loop decides on, at samples and in silence."""

from companion.control.attitude import AttitudeGains, body_rates, carried
from companion.frames import Quaternion, Vector3
from companion.vehicle_state import VehicleState

_LONGEST_RECKONING_S = 1.0


class BodyRates:
    """The companion's attitude loop, and where it reckons the attitude to be without samples.

    The autopilot goes on turning at the last rates that it was given: in silence the attitude is
    reckoned from those, so that the vehicle is levelled and not left turning.
    """

    def __init__(self, gains: AttitudeGains) -> None:
        self._gains = gains
        self._reckoned: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._reckoned_s = 0.0
        """Autopilot's time at which `_reckoned` holds."""
        self._sent: Vector3 = (0.0, 0.0, 0.0)

    def at_sample(self, state: VehicleState, loop_delay_s: float, desired: Quaternion) -> Vector3:
        """Rates (FLU, rad/s) towards a desired attitude.

        Args:
            state: the sample.
            loop_delay_s: from its time until the rates act.
            desired: FLU to ENU.
        """
        self._reckoned, self._reckoned_s = state.attitude_flu_to_enu, state.time_s
        acts_on = carried(state.attitude_flu_to_enu, state.rate_flu_rad_s, loop_delay_s)
        self._sent = body_rates(self._gains, acts_on, desired)
        return self._sent

    def in_silence(self, now_s: float, desired: Quaternion) -> Vector3:
        """Rates (FLU, rad/s) towards a desired attitude, by reckoning.

        Args:
            now_s: the autopilot's clock, estimated.
            desired: FLU to ENU.
        """
        passed = min(_LONGEST_RECKONING_S, max(0.0, now_s - self._reckoned_s))
        self._reckoned = carried(self._reckoned, self._sent, passed)
        self._reckoned_s = now_s
        self._sent = body_rates(self._gains, self._reckoned, desired)
        return self._sent
