"""The stream of setpoints, with its deadman.

A setpoint leaves when a fresh sample comes, and only then; a timer covers samples that do not
come.  Once the stream has stopped, or somebody else has changed the mode, it stays stopped: PX4
would take a resumed stream for consent.
"""

import asyncio
import math
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from companion.flight.connection import Connection
from companion.flight.control_loop import ControlLoop, Output
from companion.flight.observer import Observer, TickView
from companion.flight.records import control_record, plan_record
from companion.flight.supervisor import Rung
from companion.flight.timing import Punctuality
from companion.frames import euler_from_quaternion, tilt_cosine
from companion.mavlink.messages import Severity
from companion.mavlink.setpoints import AttitudeSetpoint, InvalidSetpointError, setpoint_message
from companion.vehicle_state import VehicleState

_WATCH_S = 0.02
_LONGEST_DELAY_S = 0.2


class RecordLog(Protocol):
    """Where records are kept."""

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Keep a record."""


class SetpointStream:
    """Runs the control loop at each sample and sends what it decides."""

    def __init__(
        self,
        connection: Connection,
        control: ControlLoop,
        log: RecordLog,
        observer: Observer,
        punctuality: Punctuality,
    ) -> None:
        self.control = control
        self.punctuality = punctuality
        self.running = False
        self.stopped_because = ""
        """Why the stream stopped by itself; empty if it did not."""
        self.fallbacks = 0
        """Ticks at which something less than the controller's optimum was sent."""
        self.plans = 0
        self.plans_at_r_max = 0
        """Plans at which the bound on the second difference of r was active."""
        self.on_stop: Callable[[], None] | None = None
        """Called when the stream stops by itself."""
        self._connection = connection
        self._log = log
        self._observer = observer
        self._rung = Rung.TRACK
        self._fallback = ""
        connection.on_state = self._on_state

    def start(self) -> None:
        """Begin to stream, holding; a clean ladder."""
        self.control.release()
        self._rung = Rung.TRACK
        self._fallback = ""
        self.stopped_because = ""
        self.running = True

    def stop(self, reason: str = "") -> None:
        """Stop streaming; a reason means that it was not planned."""
        if not self.running:
            return
        self.running = False
        self.punctuality.pause()
        self.stopped_because = reason
        if reason and self.on_stop is not None:
            self.on_stop()

    async def watch(self) -> None:
        """Cover samples that do not come, until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(_WATCH_S)
            if not self.running or self._connection.state is None:
                continue
            now = loop.time()
            rate = self._connection.clock.rate if self._connection.clock.valid else 1.0
            age = (now - self._connection.state_received_s) * rate
            autopilot_s = self._connection.state.time_s + age
            self._act(self.control.on_silence(autopilot_s, age), autopilot_s)

    def loop_delay_s(self, state: VehicleState, now_s: float) -> float:
        """From a sample's time until a setpoint sent now acts, by the autopilot's clock.

        The sample's age by the synchronised clock, and half the round trip for the way back.
        """
        clock = self._connection.clock
        if not clock.valid:
            return 0.0
        age = clock.autopilot_time(now_s) - state.time_s
        delay = age + 0.5 * clock.round_trip_s * clock.rate
        return max(0.0, min(_LONGEST_DELAY_S, delay))

    def _on_state(self, state: VehicleState, received_s: float) -> None:
        if not self.running:
            return
        delay = self.loop_delay_s(state, received_s)
        started = time.perf_counter()
        output = self.control.on_sample(state, delay)
        computed_us = (time.perf_counter() - started) * 1e6
        sent = self._act(output, state.time_s)
        sent_s = asyncio.get_running_loop().time()
        if sent:
            self.punctuality.tick(received_s, sent_s)
        self._record(state, output, delay, received_s, sent_s, computed_us)

    def _act(self, output: Output, autopilot_s: float) -> bool:
        """Send an output and tell of a change of rung; True if a setpoint went out."""
        sent = False
        if output.attitude_flu_to_enu is not None:
            try:
                setpoint = AttitudeSetpoint(output.attitude_flu_to_enu, output.thrust)
                message = setpoint_message(setpoint, autopilot_s, self._connection.target)
            except InvalidSetpointError as error:
                self._tell("error", f"setpoint withheld: {error}")
            else:
                self._connection.send(message)
                sent = True
        if output.fallback:
            self.fallbacks += 1
        if output.rung is not self._rung or output.fallback != self._fallback:
            self._announce(output)
        if output.rung is Rung.HAND_OVER:
            self.stop(output.reason or "the ladder's end")
        return sent

    def _announce(self, output: Output) -> None:
        self._rung, self._fallback = output.rung, output.fallback
        if output.rung is Rung.HAND_OVER:
            explanation = self._connection.dialect.hand_over.explanation
            self._tell("error", f"handing over: {output.reason}; {explanation}")
        elif output.rung is Rung.LEVEL:
            self._tell("warning", f"level and holding: {output.reason}")
        elif output.fallback:
            self._tell("warning", f"fallback: {output.fallback}")
        else:
            self._tell("info", "tracking")

    def _tell(self, severity: str, text: str) -> None:
        self._observer.message(severity, text)
        level = {"info": Severity.INFO, "warning": Severity.WARNING}.get(severity, Severity.ERROR)
        self._connection.say(level, f"companion: {text}"[:200])
        now = asyncio.get_running_loop().time()
        self._log.record("event", now, {"severity": severity, "text": text})

    def _record(
        self,
        state: VehicleState,
        output: Output,
        delay_s: float,
        received_s: float,
        sent_s: float,
        computed_us: float,
    ) -> None:
        timeline = self.control.timeline
        desired = self.control.desired_position(state.time_s)
        phase = timeline.phase(state.time_s) if timeline is not None else "hold"
        timing_s = (received_s, delay_s, sent_s - received_s)
        record = control_record(state, output, desired, phase, timing_s, computed_us)
        self._log.record("control", received_s, record)
        if output.stack is not None and output.stack.outer is not None:
            self.plans += 1
            self.plans_at_r_max += output.stack.outer.r_max_active
            self._log.record("plan", received_s, plan_record(state.time_s, output.stack.outer))
        if timeline is None or desired is None or output.attitude_flu_to_enu is None:
            return
        error = float(np.linalg.norm(desired - np.array(state.position_enu_m)))
        progress = (state.time_s - timeline.start_s) / timeline.end_s
        tilt = math.degrees(math.acos(min(1.0, tilt_cosine(output.attitude_flu_to_enu))))
        self._observer.tick(
            TickView(phase, min(1.0, progress), error, tilt, output.thrust, output.fallback)
        )


def heading_of(state: VehicleState) -> float:
    """Yaw (rad, ENU) of a state."""
    return euler_from_quaternion(state.attitude_flu_to_enu)[2]
