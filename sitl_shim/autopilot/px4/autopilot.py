"""PX4 whole: commander, flight tasks and the control cascade, stepped every 4 ms."""

from collections.abc import Mapping, Sequence

from sitl_shim.autopilot.interface import (
    FULL,
    TICK_US,
    Acknowledgement,
    Announcement,
    AttitudeTarget,
    Command,
    EstimateStep,
    EstimatorState,
    Event,
    Heartbeat,
    ModeInfo,
    Motion,
    PositionSetpoint,
    PositionTarget,
    RotorCommands,
    SensorHealth,
    StatusText,
)
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.px4 import arming, modes
from sitl_shim.autopilot.px4.announcements import Announcer
from sitl_shim.autopilot.px4.causes import Watch
from sitl_shim.autopilot.px4.command_desk import CommandDesk
from sitl_shim.autopilot.px4.commander import CHECK_PERIOD_US, Commander
from sitl_shim.autopilot.px4.flight_control import STOPPED, FlightControl
from sitl_shim.autopilot.px4.land_detector import LandDetector
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.offboard import OffboardStream
from sitl_shim.autopilot.px4.parameters import make_parameters
from sitl_shim.autopilot.px4.position_flight import PositionFlight
from sitl_shim.autopilot.thrust_axis import heading_of
from sitl_shim.frames import Quaternion, Vector3

_QUADROTOR, _PX4 = 2, 12
_ON_GROUND, _IN_AIR, _TAKEOFF, _LANDING = 1, 2, 3, 4
_ORIGIN_FOUND_US = 1_200_000
"""With the first heartbeat."""
_CAUSES_PERIOD_US = 200_000
_IDLE_PERIOD_US = 100_000
"""How often the attitude setpoint, which nobody follows, is brought to the heading."""


_ESTIMATOR = EstimatorState(
    flags=0x33F, gps_fix=3, origin_known=True, position_known=True, yaw_error_rad=0.0
)


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
        self.mission = MissionPlan()
        self.battery = FULL
        self._revision = self.parameters.revision
        self._announcer = Announcer()
        self._commander = Commander(
            self.parameters, self.mission, self._announcer, airborne=airborne
        )
        self._desk = CommandDesk(
            self._commander, self.parameters, self.mission, self._announcer, seed=seed
        )
        self._stream = OffboardStream()
        detector = LandDetector(landed=not airborne)
        position_flight = PositionFlight(
            self.parameters,
            self._commander,
            self._stream,
            self.mission,
            detector,
            airborne=airborne,
            origin_altitude_amsl_m=origin_altitude_amsl_m,
        )
        self._control = FlightControl(
            self.parameters, self._commander, self._stream, detector, position_flight
        )
        self._loss_s = self.parameters["COM_OF_LOSS_T"]
        predict_us = self.parameters["EKF2_PREDICT_US"]
        self.estimate_interval_us = max(1, int(predict_us) // TICK_US) * TICK_US
        """How often its estimator publishes, µs: as many samples of 4 ms as fit in."""
        self._time_us = 0
        self._stream_alive = False
        self._position_known = arming.PositionKnown()
        self._watch = Watch(self.parameters)
        self._was_armed = airborne
        self._home: Vector3 | None = None
        self._home_attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._commands = STOPPED
        self._shown: tuple[Mode, bool, bool, int] | None = None
        self._heartbeat = Heartbeat(_QUADROTOR, _PX4, 0, 0, 0)

    # --- what comes in ---

    def receive_command(self, command: Command) -> Sequence[Acknowledgement] | None:
        """Carry out a command; None if PX4 does not know it here."""
        return self._desk.receive(command)

    def receive_attitude_target(self, target: AttitudeTarget) -> None:
        """Take an offboard setpoint, whatever the mode."""
        self._stream.receive(target, self._time_us)

    def receive_position_setpoint(self, setpoint: PositionSetpoint) -> None:
        """Take an offboard setpoint, whatever the mode."""
        self._stream.receive_position(setpoint, self._time_us)

    def receive_heartbeat(self, system_id: int) -> None:
        """No ground station is needed by default."""

    def receive_sticks(self, custom_mode: int) -> None:
        """A pilot's radio control is there, its switch on a mode, its sticks in the middle."""
        self._commander.take_sticks(Mode(custom_mode))

    def note_reset(self, step: EstimateStep) -> None:
        """Setpoints of its own step along, so that nothing is felt; a client's do not."""
        self._control.note_reset(step)

    # --- the run of time ---

    def step(self, time_us: int, motion: Motion) -> RotorCommands:
        """Run one period of 4 ms and return the rotors' signals, 0 to 1."""
        self._time_us = time_us
        control = self._control
        if self.parameters.revision != self._revision:
            self._revision = self.parameters.revision
            self._loss_s = self.parameters["COM_OF_LOSS_T"]
            control.configure()
        commander = self._commander
        if time_us % _CAUSES_PERIOD_US == 0:
            self._look_for_causes(motion)
        if time_us % CHECK_PERIOD_US == 0:  # else nobody looks at them
            self._stream_alive = self._stream.alive(time_us, self._loss_s)
            self._position_known = arming.PositionKnown(
                motion.local_position_valid, motion.global_position_valid
            )
        commander.step(
            time_us,
            landed=control.landed,
            stream_alive=self._stream_alive,
            position=self._position_known,
        )
        armed = commander.armed
        if armed and not self._was_armed:
            control.arm()
            self._home = None  # home is where the vehicle was armed
        elif self._was_armed and not armed:
            control.disarm()
        self._was_armed = armed
        home = self._keep_home(motion)
        if armed:
            self._commands = control.fly(motion, home)
        else:
            self._commands = STOPPED
            control.stand_by(motion, tell=time_us % _IDLE_PERIOD_US == 0)
        return self._commands

    def _look_for_causes(self, motion: Motion) -> None:
        """Battery and geofence: what they ask for now."""
        flies = motion.global_position_valid and not self._control.landed
        position = motion.position_enu_m if flies else None
        armed, remaining = self._commander.armed, self.battery.remaining
        self._commander.beware(self._watch.look(remaining, position, self._home, armed=armed))

    def _keep_home(self, motion: Motion) -> Vector3:
        """Home; set it as soon as the position is good, and anew when armed."""
        if self._home is None:
            if not self._commander.ready and self._time_us < arming.HOME_US:
                return (0.0, 0.0, 0.0)
            x, y, z = motion.position_enu_m
            self._home = (x, y, z if self._control.landed else 0.0)
            self._home_attitude = motion.attitude_flu_to_enu
        return self._home

    # --- what others see ---

    def take_texts(self) -> Sequence[StatusText]:
        """Texts since the last call."""
        return self._announcer.take_texts()

    def take_events(self) -> Sequence[Event]:
        """Events since the last call."""
        return self._announcer.take_events()

    def take_announcements(self) -> Sequence[Announcement]:
        """The origin, when it is found; whatever else changes is streamed."""
        return (Announcement.ORIGIN,) if self._time_us == _ORIGIN_FOUND_US else ()

    @property
    def estimator(self) -> EstimatorState:
        """It streams an estimate as soon as it streams at all."""
        return _ESTIMATOR

    @property
    def heartbeat(self) -> Heartbeat:
        """Contents of HEARTBEAT."""
        commander = self._commander
        shows = (
            commander.mode,
            commander.armed,
            self._stream.attitude_controlled,
            commander.system_status,
        )
        if shows != self._shown:
            self._shown = shows
            mode, armed, attitude_controlled, system_status = shows
            self._heartbeat = Heartbeat(
                vehicle_type=_QUADROTOR,
                autopilot=_PX4,
                base_mode=modes.base_mode(
                    mode, armed=armed, attitude_controlled=attitude_controlled
                ),
                custom_mode=mode.value,
                system_status=system_status,
            )
        return self._heartbeat

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
            self._time_us, ready=commander.ready, checks_pass=commander.checks_pass
        )

    @property
    def landed_state(self) -> int:
        """MAV_LANDED_STATE."""
        if self._control.landed:
            return _ON_GROUND
        mode = self._commander.mode
        if mode is Mode.AUTO_TAKEOFF or self._control.taking_off:
            return _TAKEOFF
        return _LANDING if mode is Mode.AUTO_LAND or self._control.landing else _IN_AIR

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._commander.armed

    @property
    def follows_setpoints(self) -> bool:
        """Whether it flies as a client's setpoints say."""
        return self._commander.armed and self._commander.mode is Mode.OFFBOARD

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
        return self._control.setpoint

    @property
    def position_target(self) -> PositionTarget | None:
        """What the position controller is after; None while it is idle."""
        output = self._control.output
        if output is None:
            return None
        return PositionTarget(
            output.position_enu_m,
            output.velocity_enu_m_s,
            output.acceleration_enu_m_s2,
            heading_of(output.attitude_flu_to_enu),
        )

    @property
    def rotor_commands(self) -> RotorCommands:
        """Signals of the rotors, 0 to 1."""
        return self._commands
