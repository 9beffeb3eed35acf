"""Flight under position control: autonomous modes, missions, offboard positions."""

import math

from sitl_shim.autopilot.interface import EstimateStep, Motion
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4 import offboard_position
from sitl_shim.autopilot.px4.commander import Commander
from sitl_shim.autopilot.px4.flight_tasks import FlightTask
from sitl_shim.autopilot.px4.land_detector import LandDetector
from sitl_shim.autopilot.px4.mission_flight import MissionFlight
from sitl_shim.autopilot.px4.modes import Mode
from sitl_shim.autopilot.px4.offboard import OffboardStream
from sitl_shim.autopilot.px4.position_control import (
    ControlOutput,
    PositionControl,
    TrajectorySetpoint,
)
from sitl_shim.autopilot.px4.takeoff import TakeoffRamp, TakeoffStage
from sitl_shim.frames import Vector3

IDLE_THRUST = 0.001
"""What PX4 commands while it stands armed."""
# Looked at in every tick: in Python 3.11 a member costs eight times as much by its class.
_RAMP, _FLIGHT = TakeoffStage.RAMP, TakeoffStage.FLIGHT
_TAKEOFF = Mode.AUTO_TAKEOFF
_LEAST_CLIMB_M = 0.2
"""A take-off to less above where it stands does not leave the ground."""
_SINKING_SHARE = 1.1
"""A vertical velocity setpoint beyond this share of LNDMC_Z_VEL_MAX is meant to go down."""


class PositionFlight:
    """What decides the position controller's setpoints, and the controller.

    Args:
        parameters: gains, limits and speeds.
        commander: says which mode flies, and is told when something is done.
        stream: offboard setpoints.
        plan: the mission.
        detector: of landings.
        airborne: begin in the air.
        origin_altitude_amsl_m: altitude of the local frame's origin.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        commander: Commander,
        stream: OffboardStream,
        plan: MissionPlan,
        detector: LandDetector,
        *,
        airborne: bool,
        origin_altitude_amsl_m: float,
    ) -> None:
        self._parameters = parameters
        self._commander = commander
        self._stream = stream
        self._plan = plan
        self._detector = detector
        self._origin_altitude_m = origin_altitude_amsl_m
        self._ramp = TakeoffRamp()
        if airborne:
            self._ramp.start_in_flight()
        self._control = PositionControl(parameters)
        self._in_control = False
        self._sinking = False
        self._task: FlightTask | None = None
        self._mission: MissionFlight | None = None
        self._home: Vector3 = (0.0, 0.0, 0.0)
        self._too_low = False

    @property
    def taking_off(self) -> bool:
        """Whether it is on its way up from the ground."""
        return self._task is not None and self._task.taking_off

    @property
    def landing(self) -> bool:
        """Whether it is on its way down to the ground, on purpose."""
        return self._task is not None and self._task.landing

    @property
    def descending(self) -> bool:
        """Whether a sink rate is being asked for, for the land detector."""
        return self._sinking or (self._task is not None and self._task.descending)

    @property
    def ramping(self) -> bool:
        """Whether the take-off ramp is on its way."""
        return self._ramp.stage is _RAMP

    def configure(self) -> None:
        """Read the parameters anew."""
        self._control.configure(self._parameters)

    def disarm(self) -> None:
        """Stop."""
        self.stand_aside()
        self._ramp = TakeoffRamp()

    def stand_aside(self) -> None:
        """Others fly."""
        if self._task is not None or self._mission is not None:
            self._drop_task()
        self._in_control = False
        self._sinking = False

    def note_reset(self, step: EstimateStep) -> None:
        """The estimate was set anew: what is flown goes with it."""
        self._control.note_reset(step.velocity_enu_m_s)
        if self._task is not None:
            self._task.note_reset(step)

    def advance_ramp(self, motion: Motion) -> None:
        """One period of the take-off ramp, whoever flies."""
        self._judge_takeoff(motion)
        if self._ramp.stage is _FLIGHT and not self._detector.landed:
            return  # it is over
        in_the_air = self._ramp.stage >= TakeoffStage.RAMP
        self._ramp.step(
            self._parameters,
            armed=True,
            landed=self._detector.landed,
            wanted=not in_the_air and self._wants_takeoff(motion),
        )

    def step(self, motion: Motion, home_enu_m: Vector3) -> ControlOutput | float:
        """One period of 4 ms in charge.

        Returns:
            What is asked of the attitude controller; or, while it stands on the ground, the
            thrust at which it does so.
        """
        self._home = home_enu_m
        stage = self._ramp.stage
        if self._mission is not None and self._detector.landed:
            self._mission.landed()
        if stage < TakeoffStage.RAMP:
            self.stand_aside()
            return IDLE_THRUST
        offboard = self._commander.mode is Mode.OFFBOARD
        task = None if offboard else self._choose_task(motion)
        if self._detector.maybe_landed and stage is TakeoffStage.FLIGHT:
            return self._parameters["MPC_THR_MIN"]
        setpoint = self._follow_stream(motion) if task is None else task.step(motion)
        if not self._in_control:
            self._control.reset()
            self._in_control = True
        ramping = stage is TakeoffStage.RAMP
        tilt_deg = self._parameters["MPC_TILTMAX_LND" if ramping else "MPC_TILTMAX_AIR"]
        return self._control.update(
            motion,
            setpoint,
            climb_limit_m_s=self._ramp.climb_limit_m_s(self._parameters),
            tilt_limit_rad=0.0 if self._detector.ground_contact else math.radians(tilt_deg),
            integrate=not self._detector.landed,
        )

    def _wants_takeoff(self, motion: Motion) -> bool:
        mode, position = self._commander.mode, self._stream.position
        if mode is Mode.AUTO_MISSION:
            return bool(self._plan.items) and not self._plan.complete
        if mode is Mode.OFFBOARD and position is not None:
            return offboard_position.wants_takeoff(position, motion)
        return mode is Mode.AUTO_TAKEOFF and self._climb_m(motion) > _LEAST_CLIMB_M

    def _climb_m(self, motion: Motion) -> float:
        return self._takeoff_goal_m() - motion.position_enu_m[2]

    def _judge_takeoff(self, motion: Motion) -> None:
        """Say once that the altitude asked for is below the present one, which is kept then."""
        too_low = self._commander.mode is _TAKEOFF and self._climb_m(motion) < 0.0
        if too_low and not self._too_low:
            self._commander.say_already_higher()
        self._too_low = too_low

    # --- offboard ---

    def _follow_stream(self, motion: Motion) -> TrajectorySetpoint:
        self._drop_task()
        position = self._stream.position
        setpoint = (
            None if position is None else offboard_position.trajectory_setpoint(position, motion)
        )
        if setpoint is None:  # invalid: sink
            rate = -self._parameters["MPC_LAND_SPEED"]
            setpoint = TrajectorySetpoint(None, (0.0, 0.0), None, rate, 0.0)
        down = setpoint.velocity_z_m_s or 0.0
        self._sinking = down < -_SINKING_SHARE * self._parameters["LNDMC_Z_VEL_MAX"]
        return setpoint

    # --- autonomous modes ---

    def _choose_task(self, motion: Motion) -> FlightTask:
        self._sinking = False
        mode = self._commander.mode
        task = self._task
        if task is None or task.mode is not mode:
            task = self._enter(mode, motion)
        if mode is Mode.AUTO_TAKEOFF and self._takeoff_done(task, motion):
            self._commander.takeoff_done()
            if self._commander.mode is not mode:  # else it holds where the take-off has ended
                task = self._enter(self._commander.mode, motion, previous=task)
        elif self._mission is not None:
            low = self._ramp.stage is TakeoffStage.RAMP
            if not self._mission.step(task, motion, self._home, low=low):
                self._commander.mission_done()
                # Without a mission any more there is no goal to be kept.
                kept = task if self._plan.items else None
                task = self._enter(self._commander.mode, motion, previous=kept)
        elif mode is Mode.AUTO_LOITER:
            self._reposition(task)
        return task

    def _enter(
        self, mode: Mode, motion: Motion, *, previous: FlightTask | None = None
    ) -> FlightTask:
        self._drop_task()
        if mode is Mode.AUTO_MISSION:
            self._mission = MissionFlight(self._plan, self._parameters)
        self._task = FlightTask(
            mode,
            motion,
            self._parameters,
            goal_z_m=self._takeoff_goal_m(),
            home_enu_m=self._home,
            sticks=self._commander.sticks_centred,
            previous=previous,
        )
        return self._task

    def _drop_task(self) -> None:
        self._task = None
        if self._mission is not None:
            self._mission = None
            self._plan.suspend()

    def _reposition(self, task: FlightTask) -> None:
        wanted = self._commander.take_reposition()
        if wanted is None:
            return
        if wanted.speed_m_s is not None:
            task.cruise_m_s = wanted.speed_m_s
        if wanted.goes:
            if wanted.position_xy_m is None:
                task.stop()
            z = wanted.altitude_m + (self._home[2] if wanted.above_home else 0.0)
            task.fly_to(wanted.position_xy_m, z, wanted.yaw_enu_rad)

    def _takeoff_goal_m(self) -> float:
        altitude = self._commander.takeoff_altitude_amsl_m
        if math.isfinite(altitude):
            return altitude - self._origin_altitude_m
        return self._home[2] + self._parameters["MIS_TAKEOFF_ALT"]

    def _takeoff_done(self, task: FlightTask, motion: Motion) -> bool:
        return (
            self._ramp.stage is TakeoffStage.FLIGHT
            and task.altitude_error_m(motion) < self._parameters["NAV_MC_ALT_RAD"]
        )
