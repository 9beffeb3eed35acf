"""ArduCopter whole: boot, commander, GUIDED and the control cascades, stepped every 4 ms."""

import math
from collections.abc import Mapping, Sequence

from sitl_shim.autopilot.ardupilot import modes
from sitl_shim.autopilot.ardupilot.boot import HOME_S, YAW_ERROR_RAD, Boot
from sitl_shim.autopilot.ardupilot.commander import Commander
from sitl_shim.autopilot.ardupilot.flight_control import FlightControl
from sitl_shim.autopilot.ardupilot.guards import PERIOD_US as GUARD_PERIOD_US
from sitl_shim.autopilot.ardupilot.guards import Guards
from sitl_shim.autopilot.ardupilot.guided import Guided
from sitl_shim.autopilot.ardupilot.mission_commands import MissionCommands
from sitl_shim.autopilot.ardupilot.modes import Mode
from sitl_shim.autopilot.ardupilot.motors import STOPPED
from sitl_shim.autopilot.ardupilot.parameters import make_parameters
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
from sitl_shim.frames import Quaternion, Vector3

_QUADROTOR, _ARDUPILOT = 2, 3
_ON_GROUND, _IN_AIR, _TAKEOFF, _LANDING = 1, 2, 3, 4
_ALIGNS_AFTER_US = 2_750_000
"""In the air: then the estimator is sure of its heading."""

_TELLS_HOVER_US = 100_000


class ArduCopter:
    """One ArduCopter.

    Args:
        overrides: parameters that the vehicle or the user sets, by name.
        seed: of what differs from boot to boot.
        origin_altitude_amsl_m: altitude of the local frame's origin.
        airborne: begin booted, armed and holding in the air.
        boot_scale: times of the boot are multiplied by it.

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
        boot_scale: float,
    ) -> None:
        self.parameters = make_parameters(overrides)
        self.mission = MissionPlan()
        self.battery = FULL
        self._told_items = 0
        self._revision = self.parameters.revision
        self._boot = Boot(
            scale=boot_scale,
            seed=seed,
            airborne=airborne,
            elevation_m=origin_altitude_amsl_m,
        )
        self._commander = Commander(self.parameters, self._boot, self.mission, airborne=airborne)
        self._guided = Guided()
        self._control = FlightControl(
            self.parameters,
            self._guided,
            self.mission,
            self._commander.inform,
            airborne=airborne,
        )
        self._mission_commands = MissionCommands(
            self.parameters, self.mission, self._commander, self._guided, self._control
        )
        self._guards = Guards(self.parameters, self._commander, self._control)
        self.estimate_interval_us = TICK_US
        """How often its estimator publishes, µs."""
        self._time_us = 0
        self._was_armed = airborne
        self._home: Vector3 | None = None
        self._home_attitude: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._commands = STOPPED
        self._left_ground_us: int | None = None
        self._height_m = 0.0

    # --- what comes in ---

    def receive_command(self, command: Command) -> Sequence[Acknowledgement] | None:
        """Carry out a command; None if ArduCopter does not know it here."""
        home_z_m = math.nan if self._home is None else self._home[2]
        answer = self._mission_commands.receive(command, home_z_m, self._height_m)
        return self._commander.receive(command) if answer is None else answer

    def receive_attitude_target(self, target: AttitudeTarget) -> None:
        """Take a setpoint; outside of GUIDED it is ignored in silence."""
        if self._commander.mode.is_guided:
            self._guided.receive_attitude(target, self._time_us, self.parameters)

    def receive_position_setpoint(self, setpoint: PositionSetpoint) -> None:
        """Take a setpoint for the position controller, in GUIDED."""
        if self._commander.mode is Mode.GUIDED:
            self._guided.receive_position(setpoint, self._time_us)

    def receive_heartbeat(self, system_id: int) -> None:
        """The ground station is the one of MAV_GCS_SYSID."""
        if system_id == self.parameters["MAV_GCS_SYSID"]:
            self._commander.heard_ground_station()

    def receive_sticks(self, custom_mode: int) -> None:
        """A pilot's radio control is there, its switch on a mode, its sticks in the middle."""
        self._control.sticks_centred = True
        self._commander.set_mode(Mode(custom_mode))

    def note_reset(self, step: EstimateStep) -> None:
        """Another of the estimator's lanes leads, unless it only finds its position again.

        Targets go along, so that nothing is felt.
        """
        if not self._boot.position_lost:
            self._commander.change_lane()
        self._control.cascade.note_reset(step)

    # --- the run of time ---

    def step(self, time_us: int, motion: Motion) -> RotorCommands:
        """Run one period of 4 ms and return the rotors' signals, 0 to 1."""
        self._time_us = time_us
        control, commander = self._control, self._commander
        if self.parameters.revision != self._revision:
            self._revision = self.parameters.revision
            control.cascade.configure()
        if motion.local_position_valid is self._boot.position_lost:
            commander.lose_position(not motion.local_position_valid)
        commander.step(time_us, control.situation(commander.mode, armed=commander.armed))
        self._height_m = motion.position_enu_m[2]
        if time_us % GUARD_PERIOD_US == 0:
            known = self._boot.estimator.position_known
            self._guards.step(time_us, motion, self.battery, self._home, position_known=known)
        armed = commander.armed
        if armed and not self._was_armed:
            control.arm(time_us)
            self._set_home(motion)
        elif self._was_armed and not armed:
            control.disarm()
        self._was_armed = armed
        if self._home is None and self._boot.passed(time_us, HOME_S):
            self._set_home(motion)
        if armed:
            home = self._home or (0.0, 0.0, 0.0)
            known = self._boot.estimator.position_known
            self._commands = control.fly(
                time_us, motion, commander.mode, home, position_known=known
            )
        else:
            self._commands = STOPPED
            control.stand_by(motion)
        if len(self.mission) != self._told_items:
            self._told_items = len(self.mission)
            self.parameters.learn("MIS_TOTAL", max(1, self._told_items))
        if time_us % _TELLS_HOVER_US == 0:
            control.cascade.motors.tell_hover(self.parameters)
        self._align_yaw_in_flight(time_us)
        return self._commands

    def _set_home(self, motion: Motion) -> None:
        x, y, z = motion.position_enu_m
        self._home = (x, y, z if self._control.landed else 0.0)
        self._home_attitude = motion.attitude_flu_to_enu

    def _align_yaw_in_flight(self, time_us: int) -> None:
        if self._control.landed or self._boot.estimator.yaw_error_rad == 0.0:
            self._left_ground_us = None
            return
        if self._left_ground_us is None:
            self._left_ground_us = time_us
        if time_us - self._left_ground_us >= _ALIGNS_AFTER_US:
            self._commander.align_yaw()
            self._control.cascade.turn(-YAW_ERROR_RAD)

    # --- what others see ---

    def take_texts(self) -> Sequence[StatusText]:
        """Texts since the last call."""
        return self._commander.take_texts()

    def take_events(self) -> Sequence[Event]:
        """ArduPilot has no events interface."""
        return ()

    def take_announcements(self) -> Sequence[Announcement]:
        """Messages to be sent on all links, since the last call."""
        return self._commander.take_announcements()

    @property
    def estimator(self) -> EstimatorState:
        """How far the estimator has got."""
        return self._boot.estimator

    @property
    def heartbeat(self) -> Heartbeat:
        """Contents of HEARTBEAT."""
        commander = self._commander
        return Heartbeat(
            vehicle_type=_QUADROTOR,
            autopilot=_ARDUPILOT,
            base_mode=modes.base_mode(
                armed=commander.armed, position_controlled=commander.base_shows_position
            ),
            custom_mode=commander.mode.value,
            system_status=commander.system_status,
        )

    @property
    def intended_custom_mode(self) -> int:
        """ArduPilot does not tell what was intended: what flies."""
        return self._commander.mode.value

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
        return self._commander.sensor_health

    @property
    def landed_state(self) -> int:
        """MAV_LANDED_STATE."""
        if self._control.landed:
            return _ON_GROUND
        if self._control.taking_off:
            return _TAKEOFF
        return _LANDING if self._control.landing else _IN_AIR

    @property
    def armed(self) -> bool:
        """Whether the motors may turn."""
        return self._commander.armed

    @property
    def follows_setpoints(self) -> bool:
        """Whether it flies as a client's setpoints say."""
        commander = self._commander
        guided = commander.armed and commander.mode.is_guided
        return guided and self._guided.has_setpoint(self._time_us)

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
        """Attitude FLU to ENU, rates FLU (rad/s) and throttle now commanded."""
        cascade = self._control.cascade
        return cascade.attitude.target, cascade.attitude.rates, cascade.throttle_asked

    @property
    def position_target(self) -> PositionTarget | None:
        """What the position controller is after; None while it is idle."""
        cascade = self._control.cascade
        if not cascade.position.active:
            return None
        horizontal, vertical = cascade.position, cascade.altitude
        return PositionTarget(
            (*horizontal.position, vertical.position),
            (*horizontal.velocity, vertical.velocity),
            (*horizontal.acceleration, vertical.acceleration),
            cascade.heading,
        )

    @property
    def rotor_commands(self) -> RotorCommands:
        """Signals of the rotors, 0 to 1."""
        return self._commands
