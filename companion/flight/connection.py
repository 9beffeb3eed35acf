"""The vehicle on the other end of the link: its newest reports, and exchanges with it.

Everything that comes in is recorded, then sorted; everything that goes out passes `send` and is
recorded after it went.  Waiting always has a time-out that names what is missing.
"""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from companion.flight.errors import FlightAbortedError, LinkLostError
from companion.link.link import Link
from companion.mavlink.codec import Packer, decode
from companion.mavlink.command_exchange import CommandExchange, CommandQueue
from companion.mavlink.commands import Command, ack_from_frame, message_interval
from companion.mavlink.dialects.base import AutopilotDialect, Readiness
from companion.mavlink.exchange import Verdict
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import (
    BASE_MODE_ARMED,
    MessageId,
    Outgoing,
    Severity,
    Target,
    VehicleStateOfHealth,
    heartbeat,
    status_texts,
)
from companion.mavlink.mode_change import ModeChange
from companion.mavlink.peers import PeerTable
from companion.mavlink.telemetry import Rejected, is_truth, state_from_odometry
from companion.mavlink.timesync import ClockEstimator
from companion.vehicle_state import VehicleState

_HOUSEKEEPING_S = 0.05
_HEARTBEAT_S = 1.0
_SILENCE_TOLD_S = 1.0


class FrameLog(Protocol):
    """Where frames are recorded."""

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """A received frame."""

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """A sent frame."""


@dataclass(slots=True)
class Reports:
    """The newest of what the vehicle says about itself."""

    armed: bool = False
    custom_mode: int | None = None
    system_status: int = 0
    landed_state: int = 0
    sensors: tuple[int, int, int] | None = None
    """Masks present, enabled, health of SYS_STATUS."""
    battery_remaining: float = math.nan
    texts: list[str] = field(default_factory=list)
    """STATUSTEXTs, oldest first."""


class Connection:
    """A link with a vehicle behind it."""

    def __init__(self, link: Link, dialect: AutopilotDialect, log: FrameLog) -> None:
        self.dialect = dialect
        self.reports = Reports()
        self.clock = ClockEstimator()
        self.peers = PeerTable()
        self.framer = Framer()
        self.health = VehicleStateOfHealth.ACTIVE
        """What our own heartbeat says of us."""
        self.state: VehicleState | None = None
        self.state_received_s = -math.inf
        self.heard_s = -math.inf
        """When anything came from the vehicle last."""
        self.samples = 0
        """Usable samples of the state so far."""
        self.rejected_samples = 0
        self.on_state: Callable[[VehicleState, float], None] | None = None
        """Called with each usable sample and the loop's time at which it came."""
        self.on_mode: Callable[[int], None] | None = None
        """Called when the vehicle reports another mode."""
        self.interrupted: Callable[[], Exception | None] = lambda: None
        """An error that ends whatever is waited for; None to wait on."""
        self._link = link
        self._log = log
        self._packer = Packer(1)
        self._commands = CommandQueue()
        self._mode_change: ModeChange | None = None
        self._heartbeat_due_s = -math.inf
        self._waiters: list[tuple[Callable[[], bool], asyncio.Future[None]]] = []
        self._failure: BaseException | None = None
        link.on_bytes = self._on_bytes

    @property
    def target(self) -> Target:
        """Whom to address; only once the vehicle is known."""
        assert self.peers.vehicle is not None
        return self.peers.vehicle.target

    @property
    def link_description(self) -> str:
        """Where the link leads, for a person."""
        return self._link.description

    @property
    def mode(self) -> str:
        """Name of the vehicle's mode."""
        mode = self.reports.custom_mode
        return "unknown" if mode is None else self.dialect.mode_name(mode)

    @property
    def readiness(self) -> Readiness:
        """Whether the autopilot would arm."""
        if self.reports.sensors is None:
            return Readiness(False, ("no SYS_STATUS came yet",))
        return self.dialect.readiness(*self.reports.sensors)

    def send(self, outgoing: Outgoing) -> None:
        """Send a message, then record it."""
        raw = self._packer.pack(outgoing)
        self._link.send(raw)
        self._log.frame_out(asyncio.get_running_loop().time(), raw)

    def say(self, severity: Severity, text: str) -> None:
        """Tell the ground station, by STATUSTEXT."""
        for chunk in status_texts(severity, text, text_id=len(text) or 1):
            self.send(chunk)

    def fail(self, error: BaseException) -> None:
        """End every wait, present and coming, with an error: the vehicle is gone."""
        self._failure = error
        self.wake()

    async def housekeeping(self, lost_after_s: float, tell: Callable[[str], None]) -> None:
        """Keep heartbeat, clock and exchanges going, until cancelled.

        Args:
            lost_after_s: the link counts as lost after this long in silence.
            tell: told once when the vehicle falls silent.
        """
        loop = asyncio.get_running_loop()
        told = False
        while True:
            now = loop.time()
            if self.peers.vehicle is not None:
                silence = now - self.heard_s
                if silence > _SILENCE_TOLD_S and not told:
                    tell(f"nothing was heard from the autopilot for {_SILENCE_TOLD_S:g} s")
                told = silence > _SILENCE_TOLD_S
                if silence > lost_after_s:
                    self.fail(
                        LinkLostError(
                            f"Nothing was heard from the autopilot for {lost_after_s:g} s over "
                            f"{self.link_description}: the link is lost. What the vehicle does "
                            "now is its autopilot's failsafe."
                        )
                    )
                    return
                if now >= self._heartbeat_due_s:
                    self._heartbeat_due_s = now + _HEARTBEAT_S
                    self.send(heartbeat(self.health))
                self._pump(now)
            await asyncio.sleep(_HOUSEKEEPING_S)

    async def wait_until(
        self, condition: Callable[[], bool], timeout_s: float | None, missing: Callable[[], str]
    ) -> None:
        """Wait until a condition on the reports holds.

        Raises:
            FlightAbortedError: it did not within the time; the text is what `missing` says.
        """
        error = self._failure or self.interrupted()
        if error is not None:
            raise error
        if condition():
            return
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        entry = (condition, future)
        self._waiters.append(entry)
        try:
            await asyncio.wait_for(future, timeout_s)
        except TimeoutError:
            raise FlightAbortedError(missing()) from None
        finally:
            self._waiters.remove(entry)

    async def command(self, command: Command) -> CommandExchange:
        """Send a command and wait for its verdict, whatever that is."""
        exchange = self._commands.submit(command)
        self._pump(asyncio.get_running_loop().time())
        await self.wait_until(
            lambda: exchange.verdict is not Verdict.PENDING,
            60.0,
            lambda: f"no verdict on {command.label} within 60 s",
        )
        return exchange

    async def change_mode(self, name: str) -> ModeChange:
        """Ask for a mode and wait until the vehicle reports it, or refuses."""
        change = ModeChange(
            self.dialect.set_mode(self.target, name), self.dialect.custom_mode(name), name
        )
        self._mode_change = change
        self._pump(asyncio.get_running_loop().time())
        try:
            await self.wait_until(
                lambda: change.verdict is not Verdict.PENDING,
                60.0,
                lambda: f"no verdict on the change to mode {name} within 60 s",
            )
        finally:
            self._mode_change = None
        return change

    async def request_streams(self, state_rate_hz: float) -> None:
        """Ask for the dialect's streams, the state at the given rate; refusals are told."""
        for stream in self.dialect.streams:
            interval = stream.interval_s
            if stream.message_id is MessageId.ODOMETRY:
                interval = 1.0 / state_rate_hz
            exchange = await self.command(
                message_interval(self.target, int(stream.message_id), interval)
            )
            if exchange.verdict is not Verdict.ACCEPTED and stream.required:
                raise FlightAbortedError(
                    f"The autopilot does not stream {stream.message_id.name}, without which there "
                    f"is no flight: {exchange.explanation}."
                )

    def _pump(self, now_s: float) -> None:
        """Send what is due of all exchanges."""
        for outgoing in self.clock.outgoing(now_s):
            self.send(outgoing)
        for outgoing in self._commands.outgoing(now_s):
            self.send(outgoing)
        if self._mode_change is not None:
            for outgoing in self._mode_change.outgoing(now_s):
                self.send(outgoing)
        self.wake()

    def wake(self) -> None:
        """Look at all conditions that are waited for."""
        for condition, future in list(self._waiters):
            if future.done():
                continue
            error = self._failure or self.interrupted()
            if error is not None:
                future.set_exception(error)
            elif condition():
                future.set_result(None)

    def _on_bytes(self, data: bytes, received_s: float) -> None:
        frames = self.framer.feed(data)
        for frame in frames:
            self._on_frame(frame, received_s)
        # Recorded after the setpoint went out: a slow disk must not delay the control.
        for frame in frames:
            self._log.frame_in(received_s, frame.raw)
        self.wake()

    def _on_frame(self, frame: Frame, received_s: float) -> None:
        self.peers.on_frame(frame, received_s)
        message_id = frame.message_id
        if message_id == MessageId.HEARTBEAT:
            self._on_heartbeat(frame, received_s)
            return
        if not self.peers.is_vehicle(frame) or is_truth(frame):
            return
        self.heard_s = received_s
        if message_id == MessageId.ODOMETRY:
            sample = state_from_odometry(frame)
            if isinstance(sample, Rejected):
                self.rejected_samples += 1
                return
            self.samples += 1
            self.state = sample
            self.state_received_s = received_s
            if self.on_state is not None:
                self.on_state(sample, received_s)
        elif message_id == MessageId.TIMESYNC:
            for outgoing in self.clock.on_timesync(received_s, frame):
                self.send(outgoing)
        elif message_id == MessageId.COMMAND_ACK:
            ack = ack_from_frame(frame)
            self._commands.on_ack(received_s, ack)
            if self._mode_change is not None:
                self._mode_change.on_ack(received_s, ack)
            self._pump(received_s)
        elif message_id in _DECODED:
            self._on_report(frame)

    def _on_heartbeat(self, frame: Frame, received_s: float) -> None:
        message = decode(frame)
        vehicle_known = self.peers.vehicle is not None
        self.peers.on_heartbeat(frame, message)
        if not self.peers.is_vehicle(frame):
            return
        self.heard_s = received_s
        if not vehicle_known:
            self._packer.system_id = frame.system_id
        self.reports.armed = bool(message.base_mode & BASE_MODE_ARMED)
        self.reports.system_status = int(message.system_status)
        self._take_mode(int(message.custom_mode))

    def _on_report(self, frame: Frame) -> None:
        message = decode(frame)
        reports = self.reports
        if frame.message_id == MessageId.CURRENT_MODE:
            self._take_mode(int(message.custom_mode))
        elif frame.message_id == MessageId.SYS_STATUS:
            reports.sensors = (
                int(message.onboard_control_sensors_present),
                int(message.onboard_control_sensors_enabled),
                int(message.onboard_control_sensors_health),
            )
            if message.battery_remaining >= 0:
                reports.battery_remaining = message.battery_remaining / 100.0
        elif frame.message_id == MessageId.EXTENDED_SYS_STATE:
            reports.landed_state = int(message.landed_state)
        elif frame.message_id == MessageId.STATUSTEXT:
            reports.texts.append(str(message.text).rstrip("\0\t "))
            del reports.texts[:-50]

    def _take_mode(self, custom_mode: int) -> None:
        changed = custom_mode != self.reports.custom_mode
        self.reports.custom_mode = custom_mode
        if self._mode_change is not None:
            self._mode_change.on_mode(custom_mode)
        if changed and self.on_mode is not None:
            self.on_mode(custom_mode)


_DECODED = frozenset(
    (
        MessageId.CURRENT_MODE,
        MessageId.SYS_STATUS,
        MessageId.EXTENDED_SYS_STATE,
        MessageId.STATUSTEXT,
    )
)
