"""What the page is told of a moment, from the records and packets up to then."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from companion.flight.setpoints.timeline import Timeline
from companion.flight.setpoints.timing import Punctuality
from companion.frames import Vector3
from companion.mavlink.codec import decode
from companion.mavlink.dialects import dialect_for
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import MessageId
from companion.mavlink.peers import PeerTable
from companion.mavlink.state_source import STATE_MESSAGES, StateReader, StateSource
from companion.mavlink.telemetry import Rejected, is_truth, state_from_odometry, wind_acceleration
from companion.vehicle_state import VehicleState

_ARMED = 0x80
"""MAV_MODE_FLAG_SAFETY_ARMED."""
_PREVIEW_POINTS = 15
_OLD_S = 0.5
"""A sample, a truth or a push of before is not shown any more."""
_PHASE = "phase "
"""How the text of an event begins that says what the flight does now."""
_SILENCE = "silence"


class FrameMaker:
    """Follows a flight's records and packets, and makes the page's Frame (docs/live.md)."""

    def __init__(
        self, system_id: int | None = None, horizon_s: float = 0.0, state_rate_hz: float = 100.0
    ) -> None:
        """Prepare.

        Args:
            system_id: the vehicle's, if the mission says which.
            horizon_s: how far ahead the reference is shown.
            state_rate_hz: how often the state was asked for.
        """
        self.timeline: Timeline | None = None
        """The reference, once the controller has been engaged."""
        self.autopilot: str | None = None
        self._horizon_s = horizon_s
        self._punctuality = Punctuality(period_s=1.0 / state_rate_hz)
        self._peers = PeerTable(wanted_system_id=system_id)
        self._framer = Framer()
        self._readers = (StateReader(), StateReader())
        self._readers[1].source = StateSource.PARTS
        self._phase = ""
        self._mode: str | None = None
        self._armed: bool | None = None
        self._battery_percent: float | None = None
        self._sample: tuple[float, VehicleState] | None = None
        self._truth: tuple[float, Vector3] | None = None
        self._push: tuple[float, Vector3] | None = None
        self._tick: tuple[float, Mapping[str, Any]] | None = None
        self._plan_end: tuple[float, Sequence[float | None]] | None = None
        self._received_s = math.nan
        self._begin_interval()

    def _begin_interval(self) -> None:
        self._computed_us = self._latency_s = self._age_s = math.nan

    def on_pause(self) -> None:
        """The stream of setpoints begins anew: what lies between is no delay."""
        self._punctuality.pause()

    def on_event(self, text: str) -> None:
        """Something that a person was told: a phase may have begun."""
        if text.startswith(_PHASE):
            self._phase = text.removeprefix(_PHASE).split(":")[0]

    def on_plan(self, time_s: float, values: Mapping[str, Any]) -> None:
        """A record of the channel `plan`."""
        end = values.get("predicted_end_enu_m")
        if end is not None:
            self._plan_end = (time_s, end)

    def on_control(self, time_s: float, values: Mapping[str, Any]) -> None:
        """A record of the channel `control`."""
        self._tick = (time_s, values)
        if values.get("phase") == _SILENCE:
            self._age_s = _largest(self._age_s, values.get("state_age_s"))
            return
        received_s = values.get("received_s")
        if received_s is not None:
            if received_s - self._received_s < _OLD_S:
                self._age_s = _largest(self._age_s, received_s - self._received_s)
            self._received_s = received_s
        self._computed_us = _largest(self._computed_us, values.get("computed_us"))
        latency_s = values.get("latency_s")
        self._latency_s = _largest(self._latency_s, latency_s)
        if values.get("sent") and received_s is not None and latency_s is not None:
            self._punctuality.tick(received_s, received_s + latency_s)

    def on_packet(self, time_s: float, raw: bytes) -> None:
        """A packet that came in, whole."""
        for frame in self._framer.feed(raw):
            if is_truth(frame):
                self._take_truth(time_s, frame)
            elif frame.message_id == MessageId.HEARTBEAT:
                self._take_heartbeat(frame)
            elif self._peers.is_vehicle(frame):
                self._take_state(time_s, frame)

    def _take_truth(self, time_s: float, frame: Frame) -> None:
        if frame.message_id == MessageId.ODOMETRY:
            state = state_from_odometry(frame)
            if not isinstance(state, Rejected):
                self._truth = (time_s, state.position_enu_m)
        elif frame.message_id == MessageId.DEBUG_VECT:
            wind = wind_acceleration(frame)
            if wind is not None and not isinstance(wind, Rejected):
                self._push = (time_s, wind.acceleration_enu_m_s2)

    def _take_heartbeat(self, frame: Frame) -> None:
        message = decode(frame)
        if self._peers.on_heartbeat(frame, message) is None or not self._peers.is_vehicle(frame):
            return
        dialect = dialect_for(int(message.autopilot))
        self._armed = bool(int(message.base_mode) & _ARMED)
        if dialect is not None:
            self.autopilot = dialect.name
            self._mode = dialect.mode_name(int(message.custom_mode))

    def _take_state(self, time_s: float, frame: Frame) -> None:
        if frame.message_id in STATE_MESSAGES:
            for reader in self._readers:
                state = reader.take(frame, time_s)
                if isinstance(state, VehicleState):
                    self._sample = (time_s, state)
        elif frame.message_id == MessageId.SYS_STATUS:
            remaining = float(decode(frame).battery_remaining)
            self._battery_percent = remaining if remaining >= 0.0 else None

    def frame(self, time_s: float, begun_s: float) -> dict[str, Any]:
        """The Frame of a moment; what is the largest of an interval begins anew with it.

        Args:
            time_s: of the log.
            begun_s: when the log began.
        """
        tick = _recent(self._tick, time_s) or {}
        sample = _recent(self._sample, time_s)
        position = _known(tick.get("position_enu_m"))
        attitude = _known(tick.get("attitude_flu_to_enu"))
        velocity = _known(tick.get("velocity_enu_m_s"))
        if position is None and sample is not None:
            position = list(sample.position_enu_m)
            velocity = list(sample.velocity_enu_m_s)
            attitude = list(sample.attitude_flu_to_enu)
        desired = _known(tick.get("desired_enu_m"))
        phase = str(tick.get("phase") or "")
        made = {
            "t": round(time_s - begun_s, 4),
            "phase": phase if phase and phase != _SILENCE else self._phase,
            "mode": self._mode,
            "armed": self._armed,
            "position": position,
            "velocity": velocity,
            "attitude": attitude,
            "desired": desired,
            "preview": self._preview(tick.get("autopilot_time_s")),
            "plan_end": _known(_recent(self._plan_end, time_s)),
            "truth": _recent(self._truth, time_s),
            "push": _recent(self._push, time_s),
            "error_mm": None
            if desired is None or position is None
            else math.dist(desired, position) * 1e3,
            "tilt_deg": None if attitude is None else _tilt_deg(attitude),
            "thrust": _number(tick.get("thrust")),
            "y_tilde": _known(tick.get("y_tilde_m_s")),
            "y_tilde_bound": _known(tick.get("y_tilde_bound_m_s")),
            "sigma": _known(tick.get("sigma_hat")),
            "sigma_bound": _known(tick.get("sigma_bound")),
            "computed_us": _number(self._computed_us),
            "state_age_ms": _scaled(self._age_s, 1e3),
            "latency_ms": _scaled(self._latency_s, 1e3),
            "rung": tick.get("rung") or "",
            "fallback": tick.get("fallback") or "",
            "monitor": tick.get("monitor") or "",
            "controller": tick.get("controller") or "",
            "battery_percent": self._battery_percent,
            "missed_deadlines": self._punctuality.missed_deadlines,
        }
        self._begin_interval()
        return made

    def _preview(self, autopilot_time_s: float | None) -> list[list[float]] | None:
        """The reference over the horizon from now."""
        if self.timeline is None or autopilot_time_s is None or not self._horizon_s:
            return None
        ahead = np.linspace(0.0, self._horizon_s, _PREVIEW_POINTS)
        points = self.timeline.position(autopilot_time_s + ahead)
        found: list[list[float]] = np.round(points, 4).tolist()
        return found


def _recent(timed: tuple[float, Any] | None, time_s: float) -> Any:  # noqa: ANN401 - what it holds
    return None if timed is None or time_s - timed[0] > _OLD_S else timed[1]


def _known(vector: Sequence[float | None] | None) -> list[float] | None:
    """A vector of which every part is a finite number; records have null, or NaN, for others."""
    if vector is None or any(c is None or not math.isfinite(c) for c in vector):
        return None
    return [float(c) for c in vector if c is not None]


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _scaled(value: float, factor: float) -> float | None:
    return value * factor if math.isfinite(value) else None


def _largest(before: float, value: float | None) -> float:
    if value is None or not math.isfinite(value):
        return before
    return value if math.isnan(before) else max(before, value)


def _tilt_deg(attitude: Sequence[float]) -> float:
    _, x, y, _ = attitude
    return math.degrees(math.acos(max(-1.0, min(1.0, 1.0 - 2.0 * (x * x + y * y)))))
