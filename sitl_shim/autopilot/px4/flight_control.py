"""Flight control: from mode and stream to the rotors, one period of 4 ms at a time."""

from sitl_shim.autopilot.interface import EstimateStep, Motion, RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.attitude_control import AttitudeControl
from sitl_shim.autopilot.px4.commander import Commander
from sitl_shim.autopilot.px4.land_detector import LandDetector
from sitl_shim.autopilot.px4.mixer import ThrustCurve, allocate
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.offboard import OffboardStream
from sitl_shim.autopilot.px4.position_control import ControlOutput
from sitl_shim.autopilot.px4.position_flight import IDLE_THRUST, PositionFlight
from sitl_shim.autopilot.px4.rate_control import RateControl
from sitl_shim.autopilot.thrust_axis import attitude_from_thrust_axis, heading_of
from sitl_shim.frames import Quaternion, Vector3

STOPPED: RotorCommands = (0.0, 0.0, 0.0, 0.0)
_LEVEL: Vector3 = (0.0, 0.0, 1.0)
# Looked at in every tick: in Python 3.11 a member costs eight times as much by its class.
_OFFBOARD = Mode.OFFBOARD


class FlightControl:
    """The control cascade with what decides its setpoints.

    Args:
        parameters: gains, limits and speeds.
        commander: says which mode flies.
        stream: offboard setpoints.
        detector: of landings.
        position_flight: flies where positions count.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        commander: Commander,
        stream: OffboardStream,
        detector: LandDetector,
        position_flight: PositionFlight,
    ) -> None:
        self.parameters = parameters
        self._commander = commander
        self._stream = stream
        self._detector = detector
        self._position_flight = position_flight
        self._attitude_control = AttitudeControl(parameters)
        self._rate_control = RateControl(parameters)
        self._curve = ThrustCurve(parameters)
        self._airmode = parameters["MC_AIRMODE"] == 1.0
        self._saturated = (0, 0, 0)
        self._attitude_sp: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._rates_sp: Vector3 = (0.0, 0.0, 0.0)
        self._thrust_sp = 0.0
        self.output: ControlOutput | None = None
        """Of the position controller; None while it is idle."""

    @property
    def landed(self) -> bool:
        """The land detector's verdict."""
        return self._detector.landed

    @property
    def taking_off(self) -> bool:
        """Whether it is on its way up from the ground, under position control."""
        return self._position_flight.taking_off

    @property
    def landing(self) -> bool:
        """Whether it is on its way down to the ground, under position control."""
        return self._position_flight.landing

    @property
    def setpoint(self) -> tuple[Quaternion, Vector3, float]:
        """Attitude FLU to ENU, rates FLU (rad/s) and collective thrust now commanded."""
        return self._attitude_sp, self._rates_sp, self._thrust_sp

    def configure(self) -> None:
        """Read the parameters anew."""
        self._position_flight.configure()
        self._attitude_control.configure(self.parameters)
        self._rate_control.configure(self.parameters)
        self._curve.configure(self.parameters)
        self._airmode = self.parameters["MC_AIRMODE"] == 1.0

    def arm(self) -> None:
        """Begin afresh: the motors may turn from now on."""
        self._rate_control = RateControl(self.parameters)
        self._saturated = (0, 0, 0)

    def disarm(self) -> None:
        """Stop."""
        self._position_flight.disarm()
        self.output = None
        self._thrust_sp = IDLE_THRUST
        self._rates_sp = (0.0, 0.0, 0.0)

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew."""
        self._position_flight.note_reset(step)

    def stand_by(self, motion: Motion, *, tell: bool) -> None:
        """One period disarmed.

        Args:
            motion: the estimate.
            tell: bring the attitude setpoint, which nobody follows, to the heading.
        """
        if tell:
            heading_rad = heading_of(motion.attitude_flu_to_enu)
            self._attitude_sp = attitude_from_thrust_axis(_LEVEL, heading_rad)
        self._detect_landing(motion, climb_rate_controlled=True)

    def fly(self, motion: Motion, home_enu_m: Vector3) -> RotorCommands:
        """One period armed: the rotors' signals, 0 to 1."""
        flight, stream = self._position_flight, self._stream
        offboard = self._commander.mode is _OFFBOARD
        by_attitude = offboard and stream.position is None
        flight.advance_ramp(motion)
        if by_attitude:
            flight.stand_aside()
            self.output = None
            self._follow_stream(motion)
        else:
            self._follow_position(motion, home_enu_m)
        commands = self._control_rates(motion)
        self._detect_landing(motion, climb_rate_controlled=not by_attitude)
        return commands

    def _detect_landing(self, motion: Motion, *, climb_rate_controlled: bool) -> None:
        flight = self._position_flight
        self._detector.step(
            self.parameters,
            motion,
            armed=self._commander.armed,
            thrust=self._thrust_sp,
            climb_rate_controlled=climb_rate_controlled,
            descending=flight.descending,
            ramping=flight.ramping,
        )

    # --- setpoints ---

    def _follow_stream(self, motion: Motion) -> None:
        stream = self._stream
        self._thrust_sp = stream.thrust
        if stream.attitude_controlled:
            self._attitude_sp = stream.attitude
            if stream.passing_rates is not None:
                self._rates_sp, stream.passing_rates = stream.passing_rates, None
                return
            self._rates_sp = self._attitude_control.update(
                motion.attitude_flu_to_enu, stream.attitude, stream.yaw_rate_feedforward_rad_s
            )
        else:
            self._rates_sp = stream.rates

    def _follow_position(self, motion: Motion, home_enu_m: Vector3) -> None:
        output = self._position_flight.step(motion, home_enu_m)
        if isinstance(output, float):  # it stands
            self.output = None
            self._thrust_sp = output
            heading_rad = heading_of(motion.attitude_flu_to_enu)
            self._aim(motion, attitude_from_thrust_axis(_LEVEL, heading_rad), 0.0)
        else:
            self.output = output
            self._thrust_sp = output.thrust
            self._aim(motion, output.attitude_flu_to_enu, output.yaw_rate_rad_s)

    def _aim(self, motion: Motion, attitude: Quaternion, yaw_rate_rad_s: float) -> None:
        self._attitude_sp = attitude
        self._rates_sp = self._attitude_control.update(
            motion.attitude_flu_to_enu, attitude, yaw_rate_rad_s
        )

    # --- from rates to rotors ---

    def _control_rates(self, motion: Motion) -> RotorCommands:
        torque = self._rate_control.update(
            motion.rate_flu_rad_s,
            self._rates_sp,
            held=self._detector.landed,
            saturated=self._saturated,
        )
        thrust = self._thrust_sp
        # Beyond 0 to 1 there is nothing to give; NaN gives nothing.
        thrust = thrust if 0.0 <= thrust <= 1.0 else 1.0 if thrust > 1.0 else 0.0
        allocation = allocate(torque, thrust, airmode=self._airmode)
        self._saturated = allocation.saturated
        return self._curve.signals(allocation.thrusts)
