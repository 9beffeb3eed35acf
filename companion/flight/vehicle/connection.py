"""The vehicle on the other end of the link: bytes to and from it, sorted and recorded.

Everything that comes in and is let in is sorted, then recorded; everything that goes out passes
`send` and is recorded after it went.
"""

import asyncio
import math
from collections.abc import Callable
from typing import Protocol

from companion.flight.errors import LinkLostError
from companion.flight.loop_time import loop_time
from companion.flight.vehicle.admission import Admission
from companion.flight.vehicle.exchanges import Exchanges
from companion.flight.vehicle.health import Health
from companion.flight.vehicle.intake import Gate
from companion.flight.vehicle.losses import Losses
from companion.flight.vehicle.pulse import UNHEARD_S, Pulse
from companion.flight.vehicle.reception import Reception
from companion.flight.vehicle.reports import LANDED_ON_GROUND, REPORT_IDS, Reports
from companion.flight.vehicle.samples import Samples
from companion.flight.vehicle.waiting import Waiting
from companion.link.link import Link
from companion.mavlink.boot_time import BootWatch, Fall
from companion.mavlink.codec import Packer, decode, signed_anew
from companion.mavlink.commands import ack_from_frame
from companion.mavlink.dialect import message_name
from companion.mavlink.dialects import dialect_for
from companion.mavlink.dialects.base import AutopilotDialect, Readiness, ReadinessFacts, Stream
from companion.mavlink.framing import Frame, Framer
from companion.mavlink.messages import (
    MessageId,
    Outgoing,
    Severity,
    Target,
    heartbeat,
    status_texts,
)
from companion.mavlink.peers import PeerTable, Vehicle
from companion.mavlink.signing import Signing
from companion.mavlink.state_source import STATE_MESSAGES
from companion.mavlink.telemetry import is_truth
from companion.mavlink.timesync import ClockEstimator, boot_time_s
from companion.vehicle_state import VehicleState

# Names of an enumeration are looked up slowly, and these are compared with at every frame.
_HEARTBEAT = int(MessageId.HEARTBEAT)
_TIMESYNC = int(MessageId.TIMESYNC)
_COMMAND_ACK = int(MessageId.COMMAND_ACK)

_HOUSEKEEPING_S = 0.05
_HEARTBEAT_S = 1.0
_SILENCE_TOLD_S = 1.0
_TEXT_IDS = 0xFFFF
_MOST_KINDS = 500
"""Of messages that are counted: more than any dialect's autopilot sends."""
_NOBODY = (0, 0)
"""Whom an acknowledgement names whose sender does not say."""


FrameListener = Callable[[Frame, float], None]
"""Takes a frame and the loop's time at which it came."""


class FrameLog(Protocol):
    """Where frames are recorded."""

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """A received frame."""

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """A sent frame."""


class Connection:
    """A link with a vehicle behind it."""

    def __init__(
        self,
        link: Link,
        log: FrameLog,
        signing: Signing | None = None,
        *,
        system_id: int | None = None,
    ) -> None:
        """Take a link.

        Args:
            link: the way to the vehicle; its `on_bytes` is set here.
            log: where every frame is recorded.
            signing: signs and checks packets; None for a link without a key.
            system_id: take only this system for the vehicle; None takes the first.
        """
        self.signing = signing
        """With it, everything that leaves is signed, and only what is signed right is read."""
        self.admission = Admission(None if signing is None else signing.verifier)
        self.waiting = Waiting()
        self.losses = Losses()
        """Of the vehicle's packets, of late."""
        self.exchanges = Exchanges(
            self.waiting, self.send, lambda: self.dialect, self.losses.patience
        )
        self.reports = Reports(on_mode=self._on_mode)
        self.clock = ClockEstimator()
        self.peers = PeerTable(wanted_system_id=system_id)
        self.framer = Framer()
        self.reception = Reception(
            link,
            self.framer,
            Gate(self.admission.admit, self._note, self._may_be_vehicle),
            lambda: self.clock.rate if self.clock.valid else None,
            self._deal_with,
        )
        self.health = Health()
        """What our own heartbeat says of us."""
        self.streams: tuple[Stream, ...] = ()
        """What the autopilot granted, at the intervals that were asked for."""
        self.counts: dict[int, int] = {}
        """How many of each message came from the vehicle."""
        self.state_rate_hz = 0.0
        """How often the state was asked for; 0 before that."""
        self.restarts = 0
        """How often the autopilot has been seen to restart."""
        self.clocks_set_back = 0
        """How often its clock has been seen to be set back."""
        self.lost_after_s = math.inf
        """The link counts as lost after this long in silence."""
        self.heard_s = -math.inf
        """When anything came from the vehicle last."""
        self.pulse = Pulse(self.loop_seconds, self.losses)
        self.samples = Samples()
        """The vehicle's state, as it arrives."""
        self.samples.lost = lambda: self.reports.position_lost
        self.samples.in_air = lambda: self.reports.landed_state > LANDED_ON_GROUND
        self.on_trouble: Callable[[str], None] | None = None
        """Told, once for each kind of message, what could not be dealt with."""
        self.listeners: dict[int, list[FrameListener]] = {}
        """Who else is given the vehicle's frames, by message id, after the flight has read them."""
        self.chores: list[Callable[[float], None]] = []
        """Called at each round of housekeeping with the loop's time."""
        self.on_frames: Callable[[list[Frame]], None] | None = None
        """Given all that came and was let in, after the flight has dealt with it."""
        self.on_sent: Callable[[int, bytes], None] | None = None
        """Given the id and the bytes of each message of ours, after it went."""
        self.on_link_change: Callable[[str], None] | None = None
        """Told when the link is lost or there again: why it is down, empty if it is up."""
        self.on_other_vehicle: Callable[[Vehicle], None] | None = None
        """Told of each vehicle on the link that is not the chosen one, once."""
        self._dialect: AutopilotDialect | None = None
        self._boot = BootWatch()
        self._link = link
        self._log = log
        self._packer = Packer(system_id or 1, signer=None if signing is None else signing.signer)
        self._heartbeat_due_s = -math.inf
        self._text_id = 0
        self._time = loop_time
        """The loop's clock; while housekeeping runs without a look for the loop."""
        self._named_mode: tuple[int, str] | None = None
        """The mode that was named last: it is asked for at every frame."""
        self._troubles: dict[str, int] = {}
        link.on_bytes = self.reception.take
        link.on_change = self._on_link_change

    @property
    def target(self) -> Target:
        """Whom to address; only once the vehicle is known."""
        assert self.peers.vehicle is not None
        return self.peers.vehicle.target

    @property
    def our_system_id(self) -> int:
        """By which we send; the vehicle's own, once it is known, unless another was asked for."""
        return self._packer.system_id

    @property
    def dialect(self) -> AutopilotDialect:
        """How the vehicle's autopilot speaks; only once it is known."""
        assert self._dialect is not None
        return self._dialect

    @property
    def dialect_known(self) -> bool:
        """True once the vehicle's heartbeat has told what it is, and we know that kind."""
        return self._dialect is not None

    @property
    def hand_over_explanation(self) -> str:
        """What the vehicle does after a hand-over, for a person."""
        if self._dialect is None:
            return "the companion had commanded nothing"
        return self._dialect.hand_over.explanation

    @property
    def state(self) -> VehicleState | None:
        """The newest sample of the state."""
        return self.samples.newest

    @property
    def _our_address(self) -> tuple[int, int]:
        return (self._packer.system_id, self._packer.component_id)

    @property
    def link_description(self) -> str:
        """Where the link leads, for a person, and what is wrong with it."""
        down = self._link.down_because
        return f"{self._link.description} ({down})" if down else self._link.description

    @property
    def mode(self) -> str:
        """Name of the vehicle's mode."""
        mode, named = self.reports.custom_mode, self._named_mode
        if named is not None and named[0] == mode:
            return named[1]
        if mode is None or self._dialect is None:
            return "unknown"
        name = self._dialect.mode_name(mode)
        self._named_mode = (mode, name)
        return name

    @property
    def readiness(self) -> Readiness:
        """Whether the autopilot would arm."""
        now = self._time()
        reports = self.reports
        return self.dialect.readiness(
            ReadinessFacts(
                reports.custom_mode,
                reports.sensors,
                reports.sensors_of_mode,
                reports.estimator_flags,
                self.samples.arriving(now),
            )
        )

    @property
    def blind_because(self) -> str:
        """Why what the vehicle does is not known, though it is heard; empty if it is."""
        if not self.pulse.missing(self._time()):
            return ""
        return (
            f"no HEARTBEAT of the autopilot came for {self.pulse.missing_after_s:g} s, though "
            "other messages do: whether it is armed is not known"
        )

    @property
    def unheard_because(self) -> str:
        """Why the vehicle seems not to hear us, though it is heard; empty if it answers."""
        unheard_s = self.pulse.unheard_for_s(self._time(), self.clock)
        # How long is too long takes a look at the losses, which is seldom needed.
        if unheard_s <= UNHEARD_S or unheard_s <= self.pulse.unheard_after_s:
            return ""
        return (
            f"for {unheard_s:.1f} s the autopilot has answered nothing (TIMESYNC), though it is "
            "heard: what the companion sends does not arrive"
        )

    async def request_streams(self, state_rate_hz: float) -> None:
        """Ask for what the flight needs, the state at the given rate.

        Raises:
            FlightAbortedError: a stream that is needed was refused.
        """
        self.state_rate_hz = state_rate_hz
        source, self.streams = await self.exchanges.request_streams(self.target, state_rate_hz)
        self.samples.make_of(source)

    @property
    def loop_rate(self) -> float:
        """Seconds of the autopilot's clock per second of ours; 1 while that is not known."""
        clock = self.clock
        return clock.rate if clock.valid else 1.0

    def loop_seconds(self, autopilot_seconds: float) -> float:
        """How long a time of the autopilot's clock is by ours."""
        rate = self.loop_rate
        return autopilot_seconds / (rate if rate > 0.1 else 0.1)

    def send(self, outgoing: Outgoing) -> None:
        """Send a message, then record it."""
        raw = self._packer.pack(outgoing)
        self.send_raw(raw)
        if self.on_sent is not None:
            self.on_sent(outgoing.message_id, raw)

    def send_raw(self, raw: bytes) -> None:
        """Send a packet as it is, then record it."""
        self._link.send(raw)
        self._log.frame_out(self._time(), raw)

    def send_frame(self, frame: Frame) -> None:
        """Send somebody else's frame, under our signature where the link has a key.

        One of MAVLink 1 can't be signed, and goes as it is.
        """
        signed = None if self.signing is None else signed_anew(frame, self.signing.signer)
        self.send_raw(frame.raw if signed is None else signed)

    def say(self, severity: Severity, text: str) -> None:
        """Tell the ground station, by STATUSTEXT; nobody listens before the vehicle is known."""
        if self.peers.vehicle is None:
            return
        self._text_id = self._text_id % _TEXT_IDS + 1
        for chunk in status_texts(severity, text, self._text_id):
            self.send(chunk)

    async def housekeeping(self, tell: Callable[[str], None]) -> None:
        """Keep heartbeat, clock and exchanges going, until cancelled or the link is lost.

        Args:
            tell: told when the vehicle falls silent.
        """
        loop = asyncio.get_running_loop()
        self._time = loop.time
        told = False
        while True:
            now = loop.time()
            if self.peers.vehicle is not None:
                silence = now - self.heard_s
                if silence > _SILENCE_TOLD_S and not told:
                    tell(f"nothing was heard from the autopilot for {_SILENCE_TOLD_S:g} s")
                told = silence > _SILENCE_TOLD_S
                if silence > self.lost_after_s:
                    self.waiting.fail(
                        LinkLostError(
                            "Nothing was heard from the autopilot for "
                            f"{self.lost_after_s:g} s over {self.link_description}: the link is "
                            "lost. What the vehicle does now is its autopilot's failsafe."
                        )
                    )
                    return
                self._keep_up(now)
            elif self._link.speaks_first and now >= self._heartbeat_due_s:
                self._heartbeat_due_s = now + _HEARTBEAT_S
                self.send(heartbeat(self.health.say()))
            await asyncio.sleep(_HOUSEKEEPING_S)

    def _keep_up(self, now_s: float) -> None:
        """One round of housekeeping; it must go on whatever happens in it."""
        try:
            if now_s >= self._heartbeat_due_s:
                self._heartbeat_due_s = now_s + _HEARTBEAT_S
                self.send(heartbeat(self.health.say()))
            for outgoing in self.clock.outgoing(now_s):
                self.send(outgoing)
            self.exchanges.pump(now_s)
            for chore in self.chores:
                chore(now_s)
        except Exception as error:
            self._trouble("housekeeping", error)
        finally:
            self.waiting.wake()

    def _deal_with(self, frames: list[Frame], received_s: float) -> None:
        news = False
        for frame in frames:
            try:
                if self._on_frame(frame, received_s):
                    news = True
            except Exception as error:
                # asyncio would swallow it, and what came behind it in this datagram.
                news = True
                self._trouble(message_name(frame.message_id), error)
        # Recorded after the setpoint went out: a slow disk must not delay the control.
        frame_in = self._log.frame_in
        for frame in frames:
            frame_in(received_s, frame.raw)
        if news:  # what only time brings about, housekeeping and the state's samples look at
            self.waiting.wake()
        if self.on_frames is not None and frames:
            try:
                self.on_frames(frames)
            except Exception as error:
                self._trouble("forwarding", error)

    def _note(self, frame: Frame, received_s: float) -> None:
        """Count a frame, whether there is time for it or not."""
        peers = self.peers
        peers.on_frame(frame, received_s)
        if peers.is_vehicle(frame):
            self.losses.on_packet(frame.sequence)

    def _may_be_vehicle(self, frame: Frame) -> bool:
        return self.peers.vehicle is None or self.peers.is_vehicle(frame)

    def _on_link_change(self, down_because: str) -> None:
        self.reception.break_off()
        if self.on_link_change is not None:
            self.on_link_change(down_because)

    def _on_frame(self, frame: Frame, received_s: float) -> bool:
        """Sort a frame; True if anybody read it, so that what is waited for may have come."""
        message_id = frame.message_id
        if message_id == _HEARTBEAT:
            self._on_heartbeat(frame, received_s)
            return True
        if not self.peers.is_vehicle(frame) or is_truth(frame):
            return False
        self.heard_s = received_s
        self.pulse.on_message(received_s)
        counts = self.counts
        if message_id in counts:
            counts[message_id] += 1
        elif len(counts) < _MOST_KINDS:
            counts[message_id] = 1
        read = True
        if message_id in STATE_MESSAGES:
            self.samples.take(frame, received_s, self.clock)
        elif message_id == _TIMESYNC:
            fall = self._boot.fall(boot_time_s(frame), received_s, self.loop_rate)
            if fall is Fall.RESTART:
                self._on_restart()
            elif fall is Fall.SET_BACK:
                self._on_clock_set_back()
            for outgoing in self.clock.on_timesync(received_s, frame):
                self.send(outgoing)
        elif message_id == _COMMAND_ACK:
            ack = ack_from_frame(frame)
            # Another client's commands are acknowledged on our link, too.
            if (ack.target_system, ack.target_component) in (_NOBODY, self._our_address):
                self.exchanges.on_ack(received_s, ack)
        elif message_id in REPORT_IDS:
            self.reports.take(frame)
        else:
            read = False
        listeners = self.listeners.get(message_id)
        if listeners:
            for listener in listeners:
                listener(frame, received_s)
            return True
        return read

    def _on_restart(self) -> None:
        """Whatever the autopilot said or promised before is not true any more."""
        self.restarts += 1
        self.exchanges.on_restart()
        self.samples.forget()
        self.clock = ClockEstimator()
        self.streams = ()
        self.counts = {}
        self.reports.forget()
        self.pulse.forget()
        self.losses.forget()
        self.waiting.wake()

    def _on_clock_set_back(self) -> None:
        """Times of before and after do not go together."""
        self.clocks_set_back += 1
        self.clock = ClockEstimator()
        self.waiting.wake()

    def _on_heartbeat(self, frame: Frame, received_s: float) -> None:
        message = decode(frame)
        vehicle_known = self.peers.vehicle is not None
        others = len(self.peers.other_vehicles)
        heard = self.peers.on_heartbeat(frame, message)
        if len(self.peers.other_vehicles) > others and heard and self.on_other_vehicle:
            self.on_other_vehicle(heard)
        # A ground station's that is forwarded, under whatever ids, says nothing of the vehicle.
        if heard is None or not self.peers.is_vehicle(frame):
            return
        self.heard_s = received_s
        self.pulse.on_heartbeat(received_s)
        self.admission.on_vehicle(frame)
        if not vehicle_known:
            self._packer.system_id = frame.system_id
        if self._dialect is None:
            self._dialect = dialect_for(int(message.autopilot))
        self.reports.take_heartbeat(message)
        self.exchanges.on_heartbeat(received_s, self.reports.armed)

    def _on_mode(self, custom_mode: int) -> None:
        self.exchanges.on_mode(custom_mode)
        # At once, not at the end of the datagram: a setpoint must not follow a takeover.
        self.waiting.wake()

    def _trouble(self, where: str, error: Exception) -> None:
        if where not in self._troubles and len(self._troubles) >= _MOST_KINDS:
            return
        count = self._troubles.get(where, 0)
        self._troubles[where] = count + 1
        if count == 0 and self.on_trouble is not None:
            self.on_trouble(f"{where} could not be dealt with ({type(error).__name__}: {error})")
