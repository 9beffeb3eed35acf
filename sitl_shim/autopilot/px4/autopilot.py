"""PX4 whole: commander, flight tasks and the control cascade, stepped every 4 ms."""

import math
from collections.abc import Mapping, Sequence

from sitl_shim.autopilot.interface import (
    Acknowledgement,
    AttitudeTarget,
    Command,
    Heartbeat,
    ModeInfo,
    Motion,
    PositionTarget,
    RotorCommands,
    SensorHealth,
    StatusText,
)
from sitl_shim.autopilot.px4 import arming, modes
from sitl_shim.autopilot.px4.attitude_control import AttitudeControl
from sitl_shim.autopilot.px4.commander import Commander
from sitl_shim.autopilot.px4.flight_tasks import FlightTask
from sitl_shim.autopilot.px4.land_detector import LandDetector
from sitl_shim.autopilot.px4.mixer import ThrustCurve, allocate
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.offboard import OffboardStream
from sitl_shim.autopilot.px4.parameters import make_parameters
from sitl_shim.autopilot.px4.position_control import (
    ControlOutput,
    PositionControl,
    attitude_from_thrust_axis,
    heading_of,
)
from sitl_shim.autopilot.px4.rate_control import RateControl
from sitl_shim.autopilot.px4.takeoff import TakeoffRamp, TakeoffStage
from sitl_shim.frames import Quaternion, Vector3

_QUADROTOR, _PX4 = 2, 12
_ON_GROUND, _IN_AIR, _TAKEOFF, _LANDING = 1, 2, 3, 4
_IDLE_THRUST = 0.001
"""What PX4 commands while it stands armed."""
_IDLE_PERIOD_US = 100_000
"""How often the attitude setpoint, which nobody follows, is brought to the heading."""
_STOPPED: RotorCommands = (0.0, 0.0, 0.0, 0.0)
_LEVEL: Vector3 = (0.0, 0.0, 1.0)


class Px4Autopilot:
    """One PX4.

    Args:
        overrides: parameters that the airframe or the user sets, by name.
        seed: of what is random in its answers.
        origin_altitude_amsl_m: altitude of the local frame's origin.
        airborne: begin booted, armed and holding in the air.

    Raises:
        ParameterError: an override that does not exist or is out of range.
    """

    def __init__(
        self,
        overrides: Mapping[str, float],
        *,
        seed: int,
        origin_altitude_amsl_m: float,
        airborne: bool,
    ) -> None:
        self.parameters = make_parameters(overrides)
        self._revision = self.parameters.revision
        self._origin_altitude_m = origin_altitude_amsl_m
        self._commander = Commander(self.parameters, seed=seed, airborne=airborne)
        self._stream = OffboardStream()
        self._detector = LandDetector(landed=not airborne)
        self._ramp = TakeoffRamp()
        if airborne:
            self._ramp.start_in_flight()
        self._position_control = PositionControl(self.parameters)
        self._attitude_control = AttitudeControl(self.parameters)
        self._rate_control = RateControl(self.parameters)
        self._curve = ThrustCurve(self.parameters)
        self._airmode = self.parameters["MC_AIRMODE"] == 1.0
        self._loss_s = self.parameters["COM_OF_LOSS_T"]
        self._time_us = 0
        self._task: FlightTask | None = None
        self._was_armed = airborne
        self._home: Vector3 | None = None
        self._home_attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._saturated = (0, 0, 0)
        self._attitude_sp: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._rates_sp: Vector3 = (0.0, 0.0, 0.0)
        self._thrust_sp = 0.0
        self._output: ControlOutput | None = None
        self._commands = _STOPPED

    # --- what comes in ---

    def receive_command(self, command: Command) -> Sequence[Acknowledgement] | None:
        """Carry out a command; None if PX4 does not know it here."""
        return self._commander.receive(command)

    def receive_attitude_target(self, target: AttitudeTarget) -> None:
        """Take an offboard setpoint, whatever the mode."""
        self._stream.receive(target, self._time_us)

    # --- the run of time ---

    def step(self, time_us: int, motion: Motion) -> RotorCommands:
        """Run one period of 4 ms and return the rotors' signals, 0 to 1."""
        self._time_us = time_us
        if self.parameters.revision != self._revision:
            self._configure()
        commander = self._commander
        commander.step(
            time_us,
            landed=self._detector.landed,
            stream_alive=self._stream.alive(time_us, self._loss_s),
        )
        self._keep_home(motion)
        if not commander.armed:
            if self._was_armed:
                self._stop()
            if time_us % _IDLE_PERIOD_US == 0:
                heading_rad = heading_of(motion.attitude_flu_to_enu)
                self._attitude_sp = attitude_from_thrust_axis(_LEVEL, heading_rad)
            self._detect_landing(motion, offboard=False)
            self._was_armed = False
            return _STOPPED
        if not self._was_armed:
            self._start()
        offboard = commander.mode is Mode.OFFBOARD
        self._advance_ramp()
        if offboard:
            self._task = None
            self._output = None
            self._follow_stream(motion)
        else:
            self._fly_task(motion)
        self._commands = self._control_rates(motion)
        self._detect_landing(motion, offboard=offboard)
        return self._commands

    def _configure(self) -> None:
        parameters = self.parameters
        self._revision = parameters.revision
        self._position_control.configure(parameters)
        self._attitude_control.configure(parameters)
        self._rate_control.configure(parameters)
        self._curve.configure(parameters)
        self._airmode = parameters["MC_AIRMODE"] == 1.0
        self._loss_s = parameters["COM_OF_LOSS_T"]

    def _start(self) -> None:
        self._was_armed = True
        self._rate_control = RateControl(self.parameters)
        self._saturated = (0, 0, 0)
        self._home = None  # home is where the vehicle was armed

    def _stop(self) -> None:
        self._task = None
        self._output = None
        self._ramp = TakeoffRamp()
        self._thrust_sp = _IDLE_THRUST
        self._rates_sp = (0.0, 0.0, 0.0)
        self._commands = _STOPPED

    def _keep_home(self, motion: Motion) -> None:
        if self._home is None and (self._commander.ready or self._time_us >= arming.HOME_US):
            x, y, z = motion.position_enu_m
            self._home = (x, y, z if self._detector.landed else 0.0)
            self._home_attitude = motion.attitude_flu_to_enu

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
            task = self._enter(self._commander.mode, motion, keep_control=True, previous=task)
        if detector.maybe_landed and stage is TakeoffStage.FLIGHT:
            self._stand(motion, self.parameters["MPC_THR_MIN"])
            return
        setpoint = task.step(motion)
        ramping = stage is TakeoffStage.RAMP
        tilt_deg = self.parameters["MPC_TILTMAX_LND" if ramping else "MPC_TILTMAX_AIR"]
        self._output = output = self._position_control.update(
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
        home = self._home or (0.0, 0.0, 0.0)
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
        self._output = None
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

    # --- what others see ---

    def take_texts(self) -> Sequence[StatusText]:
        """Texts since the last call."""
        return self._commander.take_texts()

    @property
    def heartbeat(self) -> Heartbeat:
        """Contents of HEARTBEAT."""
        commander = self._commander
        return Heartbeat(
            vehicle_type=_QUADROTOR,
            autopilot=_PX4,
            base_mode=modes.base_mode(
                commander.mode,
                armed=commander.armed,
                attitude_controlled=self._stream.attitude_controlled,
            ),
            custom_mode=commander.mode.value,
            system_status=commander.system_status,
        )

    @property
    def intended_custom_mode(self) -> int:
        """What the user asked for; in a failsafe it differs from what flies."""
        return self._commander.intended.value

    @property
    def standard_mode(self) -> int:
        """MAV_STANDARD_MODE of what flies."""
        return modes.standard_mode(self._commander.mode)

    @property
    def available_modes(self) -> Sequence[ModeInfo]:
        """Rows of AVAILABLE_MODES."""
        return modes.AVAILABLE_MODES

    @property
    def sensor_health(self) -> SensorHealth:
        """The bit sets of SYS_STATUS."""
        commander = self._commander
        return arming.sensor_health(
            self._time_us, ready=commander.ready, checks_pass=commander.can_arm
        )

    @property
    def landed_state(self) -> int:
        """MAV_LANDED_STATE."""
        if self._detector.landed:
            return _ON_GROUND
        mode = self._commander.mode
        if mode is Mode.AUTO_TAKEOFF:
            return _TAKEOFF
        return _LANDING if mode is Mode.AUTO_LAND else _IN_AIR

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._commander.armed

    @property
    def home_enu_m(self) -> Vector3 | None:
        """Home in the local frame, once it is known."""
        return self._home

    @property
    def home_attitude_flu_to_enu(self) -> Quaternion:
        """Attitude when home was set."""
        return self._home_attitude

    @property
    def attitude_setpoint(self) -> tuple[Quaternion, Vector3, float]:
        """Attitude FLU to ENU, rates FLU (rad/s) and collective thrust now commanded."""
        return self._attitude_sp, self._rates_sp, self._thrust_sp

    @property
    def position_target(self) -> PositionTarget | None:
        """What the position controller is after; None while it is idle."""
        output = self._output
        if output is None:
            return None
        return PositionTarget(
            None,
            output.velocity_enu_m_s,
            output.acceleration_enu_m_s2,
            heading_of(output.attitude_flu_to_enu),
        )

    @property
    def rotor_commands(self) -> RotorCommands:
        """Signals of the rotors, 0 to 1."""
        return self._commands
