"""Flight control: from mode and setpoints to the rotors, one period of 4 ms at a time."""

from collections.abc import Callable

from sitl_shim.autopilot.ardupilot.auto_flight import AutoFlight
from sitl_shim.autopilot.ardupilot.cascade import Cascade
from sitl_shim.autopilot.ardupilot.commander import Situation
from sitl_shim.autopilot.ardupilot.guided import Guided, Submode
from sitl_shim.autopilot.ardupilot.guided_flight import GuidedFlight
from sitl_shim.autopilot.ardupilot.landing import ReturnFlight, land
from sitl_shim.autopilot.ardupilot.modes import Mode
from sitl_shim.autopilot.ardupilot.motors import Spool
from sitl_shim.autopilot.ardupilot.takeoff import Takeoff
from sitl_shim.autopilot.interface import Motion, RotorCommands
from sitl_shim.autopilot.mission_plan import MissionPlan
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.thrust_axis import heading_of
from sitl_shim.frames import Vector3

_BRAKE_M_S2 = 7.5
_STICK_M_S2 = 2.5
_LANDING_PAUSE_US = 4_000_000
"""Of a landing that a failsafe began."""


class FlightControl:
    """What each mode does with the cascades.

    Args:
        parameters: gains, limits and speeds.
        guided: setpoints that came in.
        plan: the mission.
        say: takes informative texts.
        airborne: begin in the air.
    """

    def __init__(
        self,
        parameters: ParameterStore,
        guided: Guided,
        plan: MissionPlan,
        say: Callable[[str], None],
        *,
        airborne: bool,
    ) -> None:
        self._parameters = parameters
        self._guided = guided
        self.cascade = Cascade(parameters, airborne=airborne)
        self._takeoff = Takeoff(parameters, self.cascade)
        self._guided_flight = GuidedFlight(parameters, guided, self.cascade, self._takeoff)
        self.auto = AutoFlight(parameters, plan, self.cascade, self._takeoff, say)
        self.goal_at_entry: Vector3 | None = None
        """Where GUIDED, once it is entered, is to go at first."""
        self.sticks_centred = False
        """Whether there is a pilot, sticks in the middle; without one the throttle is down."""
        self.pauses_before_landing = False
        """Whether LAND, once it is entered, waits before it sinks."""
        self._sinks_from_us = 0
        self._return: ReturnFlight | None = None
        self._mode: Mode | None = None
        self._time_us = self._armed_us = 0
        self._home: Vector3 = (0.0, 0.0, 0.0)
        self._position_known = True
        self._behaviours: dict[Mode, Callable[[Motion], None]] = {
            Mode.STABILIZE: self._obey_sticks,
            Mode.ALT_HOLD: self._sink_level,
            Mode.AUTO: self._fly_mission,
            Mode.GUIDED: self._guide,
            Mode.LOITER: self._sink_in_place,
            Mode.RTL: self._go_home,
            Mode.LAND: self._land,
            Mode.BRAKE: self._hold,
            Mode.GUIDED_NOGPS: self._guide,
        }

    # --- state for others ---

    @property
    def landed(self) -> bool:
        """The land detector's verdict."""
        return self.cascade.detector.landed

    @property
    def taking_off(self) -> bool:
        """Whether it is on its way up from the ground."""
        return self._takeoff.climbing

    @property
    def landing(self) -> bool:
        """Whether it is on its way down to the ground by a mode's decision."""
        returning = self._return is not None and self._return.landing
        by_mission = self._mode is Mode.AUTO and self.auto.landing
        return self._mode is Mode.LAND or returning or by_mission

    def situation(self, mode: Mode, *, armed: bool) -> Situation:
        """What the commander needs to know."""
        angle = self._guided.submode is Submode.ANGLE
        guided_by_angle = mode is Mode.GUIDED_NOGPS or (mode is Mode.GUIDED and angle and armed)
        sticks = mode in (Mode.STABILIZE, Mode.ALT_HOLD)
        return Situation(
            landed=self.cascade.detector.landed,
            idle=self.cascade.motors.spool <= Spool.IDLE,
            position_controlled=not (guided_by_angle or sticks),
            altitude_controlled=mode is not Mode.STABILIZE
            and not (guided_by_angle and self._guided.use_throttle),
        )

    # --- the run of time ---

    def arm(self, time_us: int) -> None:
        """The motors may turn from now on."""
        self._armed_us = time_us
        self.cascade.begin()
        self._mode = None

    def disarm(self) -> None:
        """Stop."""
        self.cascade.release()
        self._takeoff.reset()
        self.auto.leave()
        self.auto.started = False
        self._return = None
        self._mode = None

    def stand_by(self, motion: Motion) -> None:
        """One period disarmed."""
        self.cascade.attitude.reset(motion.attitude_flu_to_enu)
        self.cascade.detector.step(motion, armed=False, at_bottom=True, rising=False)

    def fly(
        self,
        time_us: int,
        motion: Motion,
        mode: Mode,
        home_enu_m: Vector3,
        *,
        position_known: bool,
    ) -> RotorCommands:
        """One period armed: the rotors' signals, 0 to 1."""
        self._time_us = time_us
        self._home = home_enu_m
        self._position_known = position_known
        if mode is not self._mode:
            self._enter(mode, motion)
        self._behaviours[mode](motion)
        return self.cascade.drive(motion)

    def _enter(self, mode: Mode, motion: Motion) -> None:
        cascade, p = self.cascade, self._parameters
        self._sinks_from_us = 0
        if self._mode is Mode.AUTO:
            self.auto.leave()
        self._mode = mode
        cascade.heading = heading_of(cascade.attitude.target)
        self._takeoff.reset()
        self._return = None
        cascade.reset_limits()
        if mode is Mode.GUIDED:
            self._guided.hold()
            if self.goal_at_entry is not None:
                self._guided.stay_at(self.goal_at_entry)
                self.goal_at_entry = None
        elif mode is Mode.GUIDED_NOGPS:
            self._guided.level(cascade.level_target())
        elif mode is Mode.BRAKE:
            cascade.position.set_limits(p["WPNAV_SPEED"] * 0.01, _BRAKE_M_S2)
        elif mode in (Mode.LOITER, Mode.ALT_HOLD):
            up = p["PILOT_SPEED_UP"]
            cascade.altitude.speed_up = up * 0.01
            cascade.altitude.speed_down = (p["PILOT_SPEED_DN"] or up) * 0.01
            cascade.altitude.acceleration_max = _STICK_M_S2
        elif mode is Mode.AUTO:
            self.auto.enter()
        elif mode is Mode.LAND and self.pauses_before_landing:
            self._sinks_from_us = self._time_us + _LANDING_PAUSE_US
        elif mode is Mode.RTL:
            self._return = ReturnFlight(p, cascade, motion, self._home)
        self.pauses_before_landing = False

    # --- modes ---

    def _hold(self, motion: Motion) -> None:
        if self.cascade.detector.landed:
            self.cascade.stand(motion)
            return
        self.cascade.stop(motion)
        self.cascade.climb(motion, 0.0)

    def _obey_sticks(self, motion: Motion) -> None:
        """Throttle by hand: none at the bottom, hover in the middle."""
        cascade = self.cascade
        if not self.sticks_centred or cascade.detector.landed:
            cascade.stand(motion)
            return
        cascade.motors.wants_unlimited = True
        cascade.altitude.active = False
        cascade.level(motion)
        cutoff_hz = self._parameters["PILOT_THR_FILT"]
        cascade.give_throttle(motion, cascade.motors.hover, cutoff_hz)

    def _stick_rate_m_s(self) -> float:
        return 0.0 if self.sticks_centred else -self.cascade.altitude.speed_down

    def _sink_level(self, motion: Motion) -> None:
        """A mode for sticks: throttle at the bottom sinks, in the middle holds."""
        if self.cascade.detector.landed:
            self.cascade.stand(motion)
            return
        self.cascade.level(motion)
        self.cascade.climb(motion, self._stick_rate_m_s())

    def _sink_in_place(self, motion: Motion) -> None:
        """A mode for sticks, which stand in the middle but perhaps for the throttle's."""
        if self.cascade.detector.landed:
            self.cascade.stand(motion)
            return
        self.cascade.stop(motion)
        self.cascade.climb(motion, self._stick_rate_m_s())

    def _land(self, motion: Motion) -> None:
        known = self._position_known
        land(
            self._parameters,
            self.cascade,
            motion,
            self._home[2],
            position_known=known,
            waits=self._time_us < self._sinks_from_us,
        )

    def _go_home(self, motion: Motion) -> None:
        if self._return is not None:
            self._return.step(motion)

    def _fly_mission(self, motion: Motion) -> None:
        self.auto.step(motion, self._home, self._time_us - self._armed_us)

    def _guide(self, motion: Motion) -> None:
        self._guided_flight.step(self._time_us, motion, self._time_us - self._armed_us)
