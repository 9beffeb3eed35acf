"""One tick of the flight's control: state in, setpoint and record out.

Pure but for its memory: no clock is read, no byte is sent.  Who calls it carries the times in, and
records what it is given, so that a flight can be repeated from its log.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.control.flight_stack import FlightStack
from companion.control.frameworks import Command, StackRecord, Tick
from companion.control.mpc import MpcRecord, MpcStatus
from companion.control.reference_model import Array
from companion.flight.setpoints import footing
from companion.flight.setpoints.body_rates import BodyRates
from companion.flight.setpoints.footing import Footing
from companion.flight.setpoints.stack_runner import StackRunner, UnsoundCommandError, Watch
from companion.flight.setpoints.supervisor import (
    RESTARTING,
    Facts,
    Rung,
    SupervisorLimits,
    SupervisorMemory,
    judge,
)
from companion.flight.setpoints.timeline import Timeline
from companion.flight.stacks import Stacks, only
from companion.frames import Quaternion, Vector3, quaternion_from_euler, tilt_cosine, yaw_of
from companion.vehicle_state import VehicleState

_FALLBACKS: dict[MpcStatus, str] = {
    "shifted_plan": "shifted plan",
    "clipped_closed_form": "clipped closed form",
}
_LONGEST_DELAY_S = 0.5
"""No law carries the state further ahead; on a loop this slow nothing is tracked anyway."""
_TURNED_DEG = 3.0
"""A heading that is wrong by less makes nothing swing."""


# Made at every tick, and frozen it takes several times as long to make: change none.
@dataclass(slots=True)
class Output:
    """What a tick decided."""

    rung: Rung
    reason: str
    """Why not the top rung; empty on it."""
    attitude_flu_to_enu: Quaternion | None
    """None: nothing is sent."""
    thrust: float
    stack: StackRecord | None
    """The controller's record; None when it did not run."""
    fallback: str
    """Name of the fallback in use, empty for none."""
    rate_flu_rad_s: Vector3 | None = None
    """Body rates towards that attitude, to be sent in its place; None where attitudes are sent."""
    watch: Watch | None = None
    """Who flew the tick, and what the monitor made of it; None while holding."""
    remark: str = ""
    """For a person, about the state; empty if there is nothing to say."""


class ControlLoop:
    """The controller under its supervisor.

    Before `engage` it holds: level, with the thrust of hover.  That is what flows while the
    autopilot waits for a stream before it changes the mode.
    """

    def __init__(self, stacks: Stacks | FlightStack, limits: SupervisorLimits) -> None:
        self.adopt(stacks, limits)
        self._supervisor = SupervisorMemory()
        self._timeline: Timeline | None = None
        self._desired_yaw_rad = 0.0
        self._newest: VehicleState | None = None
        self._footing = Footing()
        self._breach = ""
        """What ends tracking also when it is over: the geofence was left, or the vehicle swings
        because its heading is wrong."""
        self._plan_status: MpcStatus = "closed_form"
        self.idle = False
        """While holding: no thrust.  For collective thrust, before take-off."""

    def adopt(self, stacks: Stacks | FlightStack, limits: SupervisorLimits) -> None:
        """Fly with other stacks and other limits from now on; only while holding.

        What a stack must be made of is known for certain only once the autopilot has been asked.
        """
        stacks = stacks if isinstance(stacks, Stacks) else only(stacks)
        self._made_limits = self._limits = limits
        self._runner = StackRunner(stacks)
        gains = stacks.ladder[0].stack.attitude_loop
        self._body_rates = None if gains is None else BodyRates(gains)

    @property
    def state_age_limit_s(self) -> float:
        """A state older than this is not flown on."""
        return self._limits.state_age_limit_s

    @property
    def timeline(self) -> Timeline | None:
        """The reference in use; None while holding."""
        return self._timeline

    @property
    def rung(self) -> Rung:
        """Where on the ladder the last tick was."""
        return self._supervisor.rung

    def engage(
        self,
        timeline: Timeline,
        desired_yaw_rad: float,
        anchor_enu_m: Vector3 = (0.0, 0.0, 0.0),
    ) -> None:
        """Let the controller take over at the next sample, without a bump.

        Args:
            timeline: the reference.
            desired_yaw_rad: ENU.
            anchor_enu_m: what the geofence lies about.
        """
        self._runner.engage(anchor_enu_m)
        self._limits = self._made_limits.about(anchor_enu_m)
        self._timeline = timeline
        self._desired_yaw_rad = desired_yaw_rad
        self._footing = Footing()
        self._breach = ""

    def release(self) -> None:
        """Back to holding, with a clean ladder."""
        self._timeline = None
        self._runner.forget()
        self._newest = None
        self._supervisor = SupervisorMemory()
        self._plan_status = "closed_form"

    def on_sample(self, state: VehicleState, loop_delay_s: float) -> Output | None:
        """A new sample of the state arrived.

        Args:
            state: the sample, not older than `state_age_limit_s`.
            loop_delay_s: from the sample's time until a setpoint sent now acts, s.

        Returns:
            What to send; None if the sample is not later than the newest: it is not flown on.
        """
        if self._newest is not None and state.time_s <= self._newest.time_s:
            return None
        self._newest = state
        output = self._decide(state, loop_delay_s)
        desired = output.attitude_flu_to_enu
        if self._body_rates is None or desired is None:
            return output
        rate = self._body_rates.at_sample(state, loop_delay_s, desired)
        return replace(output, rate_flu_rad_s=rate)

    def on_silence(self, now_s: float, state_age_s: float, why: str) -> Output | None:
        """Time has passed without a sample that could be flown on.

        Args:
            now_s: the autopilot's clock, estimated.
            state_age_s: since the newest usable sample arrived.
            why: what was wrong with what came instead; empty if nothing came.

        Returns:
            What to send in place of a controller's command; None while that is not needed.
        """
        if self._newest is None or state_age_s <= self._limits.state_age_limit_s:
            return None
        self._judge(now_s, state_age_s, why)
        self._runner.forget()
        if self.rung is Rung.HAND_OVER:
            return Output(self.rung, self._supervisor.reason, None, 0.0, None, "hand over")
        attitude, field = self._hold(self._newest, 0.0)
        rates = self._body_rates
        rate = None if rates is None else rates.in_silence(now_s, attitude)
        return Output(self.rung, self._supervisor.reason, attitude, field, None, "level", rate)

    def level(self) -> tuple[Quaternion, float] | None:
        """Level at the last known heading, and the thrust field of hover; None without a state."""
        return None if self._newest is None else self._hold(self._newest, 0.0)

    def desired_position(self, autopilot_time_s: float) -> Array | None:
        """The reference at a time, (3,) ENU m; None while holding."""
        if self._timeline is None:
            return None
        return np.array(self._timeline.position_at(autopilot_time_s))

    def _decide(self, state: VehicleState, loop_delay_s: float) -> Output:
        """Attitude and thrust for a sample, or that nothing is sent."""
        command: Command | None = None
        record: StackRecord | None = None
        watch: Watch | None = None
        problem = remark = ""
        if self._timeline is not None and self.rung is not Rung.HAND_OVER:
            self._footing, found = footing.step(self._footing, state, self._limits.jump_limit_m)
            problem, remark = found.problem, found.remark
            if problem or found.restart:
                self._runner.forget()
            if problem:
                watch = self._runner.watch()
            else:
                command, record, watch, problem = self._control(self._timeline, state, loop_delay_s)
                if found.restart and problem in ("", RESTARTING):
                    # Nothing flies such a tick: it counts, or steps without end hold for ever.
                    problem, remark = found.remark, ""
        self._judge(state.time_s, 0.0, problem, loop_delay_s)
        reason = self._supervisor.reason
        if self.rung is Rung.HAND_OVER:
            return Output(self.rung, reason, None, 0.0, record, "hand over", watch=watch)
        if command is not None and self.rung is Rung.LEVEL:
            self._runner.forget()  # what it commands is not sent
            command = None
        if command is None:
            fallback = "level" if self.rung is Rung.LEVEL else ""
            attitude, field = self._hold(state, state.velocity_enu_m_s[2])
            return Output(
                self.rung, reason, attitude, field, record, fallback, watch=watch, remark=remark
            )
        fallback = _FALLBACKS.get(self._plan_status, "")
        attitude = command.attitude_flu_to_enu
        return Output(
            self.rung, "", attitude, command.thrust, record, fallback, watch=watch, remark=remark
        )

    def _control(
        self, timeline: Timeline, state: VehicleState, loop_delay_s: float
    ) -> tuple[Command | None, StackRecord | None, Watch, str]:
        """Run the controller; the text says what is wrong with its command, empty if nothing.

        Whatever goes wrong in there must end on the ladder, not in a dead stream.
        """
        runner = self._runner
        flown_s = runner.flown_s()
        if flown_s is not None and state.time_s - flown_s > self._limits.state_age_limit_s:
            runner.forget()  # what the laws remember is of another time
        self._breach = self._breach or self._limits.breach(state.position_enu_m)
        if self._breach:
            runner.forget()
            return None, None, runner.watch(), self._breach
        flies = runner.present
        try:
            track_s = state.time_s - timeline.scored_s[0]
            shifted = footing.seen(self._footing, state)
            delay_s = min(loop_delay_s, _LONGEST_DELAY_S)
            tick = Tick(shifted, delay_s, self._desired_yaw_rad, track_s)
            reference = footing.slid(self._footing, timeline.position)
            command, record, watch = runner.step(tick, reference)
        except UnsoundCommandError as error:
            return None, error.record, runner.watch(), str(error)
        except Exception as error:
            text = f"the controller failed ({type(error).__name__}: {error})"
            return None, None, runner.watch(), text
        if runner.present is not flies:
            self._plan_status = "closed_form"  # of a plan that nobody flies any more
        if command is None or record is None:
            return None, None, watch, RESTARTING if self.rung is Rung.LEVEL else ""
        if isinstance(record.outer, MpcRecord):
            self._plan_status = record.outer.status
        self._breach = self._swinging(watch)
        if self._breach:
            runner.forget()
            return None, _unshifted(record, self._footing), watch, self._breach
        return command, _unshifted(record, self._footing), watch, ""

    def _swinging(self, watch: Watch) -> str:
        """What is wrong if a vehicle swings whose heading has jumped; empty if nothing is.

        The monitor says so, and that no controller is below the one that flies.
        """
        if not watch.changes:
            return ""
        alarmed = any(c.cause == "monitor" and not c.handed_over for c in watch.changes)
        turned_deg = math.degrees(abs(self._footing.turned_rad))
        if not alarmed or turned_deg < _TURNED_DEG or not watch.gauges.slew > 1.0:
            return ""
        return f"the vehicle swings since the heading jumped ({turned_deg:.0f} degrees in all)"

    def _judge(
        self, now_s: float, state_age_s: float, problem: str, loop_delay_s: float = math.nan
    ) -> None:
        solved = self._plan_status not in _FALLBACKS
        facts = Facts(now_s, state_age_s, problem, solved, loop_delay_s)
        self._supervisor = judge(self._limits, self._supervisor, facts)

    def _hold(self, state: VehicleState, climb_rate_m_s: float) -> tuple[Quaternion, float]:
        """Level at the present heading, with the thrust that ends a known climb rate.

        A climb rate that is not known any more is given as 0: hover thrust.
        """
        cosine = tilt_cosine(state.attitude_flu_to_enu)
        field = self._runner.hold(climb_rate_m_s, cosine)
        field = 0.0 if self.idle else field
        return quaternion_from_euler(0.0, 0.0, yaw_of(state.attitude_flu_to_enu)), field


def _unshifted(record: StackRecord, footing: Footing) -> StackRecord:
    """What the controller says of places, in the local frame."""
    if not footing.slides:
        return record
    shift = np.array(footing.shift_m)
    outer = record.outer
    if isinstance(outer, MpcRecord):
        outer = replace(outer, predicted_position_m=outer.predicted_position_m + shift)
    return replace(record, r2_m=record.r2_m + shift, outer=outer)
