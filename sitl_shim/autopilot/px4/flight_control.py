"""Flight control: from mode and stream to the rotors, one period of 4 ms at a time."""

import math

from sitl_shim.autopilot.interface import Motion, RotorCommands
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.attitude_control import AttitudeControl
from sitl_shim.autopilot.px4.commander import Commander
from sitl_shim.autopilot.px4.flight_tasks import FlightTask
from sitl_shim.autopilot.px4.land_detector import LandDetector
from sitl_shim.autopilot.px4.mixer import ThrustCurve, allocate
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.offboard import OffboardStream
from sitl_shim.autopilot.px4.position_control import (
    ControlOutput,
    PositionControl,
    attitude_from_thrust_axis,
    heading_of,
)
from sitl_shim.autopilot.px4.rate_control import RateControl
from sitl_shim.autopilot.px4.takeoff import TakeoffRamp, TakeoffStage
from sitl_shim.frames import Quaternion, Vector3

STOPPED: RotorCommands = (0.0, 0.0, 0.0, 0.0)
_IDLE_THRUST = 0.001
"""What PX4 commands while it stands armed."""
_LEVEL: Vector3 = (0.0, 0.0, 1.0)


class FlightControl:
    """The control cascade with what decides its setpoints.

    Args:
        parameters: gains, limits and speeds.
        commander: says which mode flies, and is told when a take-off is done.
        stream: offboard setpoints.
        airborne: begin in the air.
        origin_altitude_amsl_m: altitude of the local frame's origin.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        commander: Commander,
        stream: OffboardStream,
        *,
        airborne: bool,
        origin_altitude_amsl_m: float,
    ) -> None:
        self.parameters = parameters
        self._commander = commander
        self._stream = stream
        self._origin_altitude_m = origin_altitude_amsl_m
        self._detector = LandDetector(landed=not airborne)
        self._ramp = TakeoffRamp()
        if airborne:
            self._ramp.start_in_flight()
        self._position_control = PositionControl(parameters)
        self._attitude_control = AttitudeControl(parameters)
        self._rate_control = RateControl(parameters)
        self._curve = ThrustCurve(parameters)
        self._airmode = parameters["MC_AIRMODE"] == 1.0
        self._task: FlightTask | None = None
        self._home: Vector3 = (0.0, 0.0, 0.0)
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
    def setpoint(self) -> tuple[Quaternion, Vector3, float]:
        """Attitude FLU to ENU, rates FLU (rad/s) and collective thrust now commanded."""
        return self._attitude_sp, self._rates_sp, self._thrust_sp

    def configure(self) -> None:
        """Read the parameters anew."""
        self._position_control.configure(self.parameters)
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
        self._task = None
        self.output = None
        self._ramp = TakeoffRamp()
        self._thrust_sp = _IDLE_THRUST
        self._rates_sp = (0.0, 0.0, 0.0)

    def stand_by(self, motion: Motion, *, tell: bool) -> None:
        """One period disarmed.

        Args:
            motion: the estimate.
            tell: bring the attitude setpoint, which nobody follows, to the heading.
        """
        if tell:
            heading_rad = heading_of(motion.attitude_flu_to_enu)
            self._attitude_sp = attitude_from_thrust_axis(_LEVEL, heading_rad)
        self._detect_landing(motion, offboard=False)

    def fly(self, motion: Motion, home_enu_m: Vector3) -> RotorCommands:
        """One period armed: the rotors' signals, 0 to 1."""
        self._home = home_enu_m
        offboard = self._commander.mode is Mode.OFFBOARD
        self._advance_ramp()
        if offboard:
            self._task = None
            self.output = None
            self._follow_stream(motion)
        else:
            self._fly_task(motion)
        commands = self._control_rates(motion)
        self._detect_landing(motion, offboard=offboard)
        return commands

    def _advance_ramp(self) -> None:
        self._ramp.step(
            self.parameters,
            armed=True,
            landed=self._detector.landed,
            wanted=self._commander.mode is Mode.AUTO_TAKEOFF,
        )

    def _detect_landing(self, motion: Motion, *, offboard: bool) -> None:
        task = self._task
        self._detector.step(
            self.parameters,
            motion,
            armed=self._commander.armed,
            thrust=self._thrust_sp,
            climb_rate_controlled=not offboard,
            descending=task is not None and task.descending,
            ramping=self._ramp.stage is TakeoffStage.RAMP,
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

    def _fly_task(self, motion: Motion) -> None:
        detector, stage = self._detector, self._ramp.stage
        if stage < TakeoffStage.RAMP:
            self._task = None
            self._stand(motion, _IDLE_THRUST)
            return
        mode = self._commander.mode
        task = self._task
        if task is None or task.mode is not mode:
            task = self._enter(mode, motion, keep_control=task is not None)
        if mode is Mode.AUTO_TAKEOFF and self._takeoff_done(task, motion):
            self._commander.takeoff_done()
            if self._commander.mode is not mode:  # else it holds where the take-off has ended
                task = self._enter(self._commander.mode, motion, keep_control=True, previous=task)
        if detector.maybe_landed and stage is TakeoffStage.FLIGHT:
            self._stand(motion, self.parameters["MPC_THR_MIN"])
            return
        setpoint = task.step(motion)
        ramping = stage is TakeoffStage.RAMP
        tilt_deg = self.parameters["MPC_TILTMAX_LND" if ramping else "MPC_TILTMAX_AIR"]
        self.output = output = self._position_control.update(
            motion,
            setpoint,
            climb_limit_m_s=self._ramp.climb_limit_m_s(self.parameters),
            tilt_limit_rad=0.0 if detector.ground_contact else math.radians(tilt_deg),
            integrate=not detector.landed,
        )
        self._thrust_sp = output.thrust
        self._aim(motion, output.attitude_flu_to_enu)

    def _enter(
        self, mode: Mode, motion: Motion, *, keep_control: bool, previous: FlightTask | None = None
    ) -> FlightTask:
        if not keep_control:
            self._position_control.reset()
        home = self._home
        self._task = FlightTask(
            mode,
            motion,
            self.parameters,
            goal_z_m=self._takeoff_goal_m(home),
            home_enu_m=home,
            previous=previous,
        )
        return self._task

    def _takeoff_goal_m(self, home: Vector3) -> float:
        altitude = self._commander.takeoff_altitude_amsl_m
        if math.isfinite(altitude):
            return altitude - self._origin_altitude_m
        return home[2] + self.parameters["MIS_TAKEOFF_ALT"]

    def _takeoff_done(self, task: FlightTask, motion: Motion) -> bool:
        return (
            self._ramp.stage is TakeoffStage.FLIGHT
            and task.altitude_error_m(motion) < self.parameters["NAV_MC_ALT_RAD"]
        )

    def _stand(self, motion: Motion, thrust: float) -> None:
        self.output = None
        self._thrust_sp = thrust
        self._aim(motion, attitude_from_thrust_axis(_LEVEL, heading_of(motion.attitude_flu_to_enu)))

    def _aim(self, motion: Motion, attitude: Quaternion) -> None:
        self._attitude_sp = attitude
        self._rates_sp = self._attitude_control.update(motion.attitude_flu_to_enu, attitude, 0.0)

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
