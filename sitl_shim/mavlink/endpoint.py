"""The shim without I/O: bytes and times in, bytes and times out, one tick of 4 ms at a time."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sitl_shim.autopilot.interface import AttitudeTarget, Command
from sitl_shim.frames import attitude_from_wire, swap_flu_frd
from sitl_shim.mavlink.commands import (
    UNSUPPORTED,
    acknowledgement,
    command_of,
    handle_link_command,
    handle_truth_command,
)
from sitl_shim.mavlink.link import AUTOPILOT_COMPONENT_ID, Link
from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.mavlink.personality import personality_of
from sitl_shim.mavlink.services.context import Context
from sitl_shim.mavlink.services.dispatcher import Services
from sitl_shim.mavlink.setpoint_frame import Setpoint, read_setpoint
from sitl_shim.mavlink.signing import ACCEPTED_UNSIGNED, Signing
from sitl_shim.mavlink.statustext import status_messages
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Message
from sitl_shim.simulation import ShimOptions, Simulation

_GROUND_STATION = 6
"""MAV_TYPE_GCS."""
_BOOT_UNIX_S = 1_577_836_800.0
"""2020-01-01: when simulated time begins, where nobody says so."""
_SEED_STREAM = 5
"""Beside those of plant, wind, estimator and commander."""


class Datagram(NamedTuple):
    """Bytes on their way to a client."""

    due_s: float
    """Simulated time at which they arrive."""
    link: int
    data: bytes


class Shim:
    """A simulated vehicle that speaks MAVLink on several links.

    Transport delays apply to whole datagrams: what arrives is acted upon ``command_delay_s``
    later, at the next tick; what is sent arrives ``telemetry_delay_s`` later.

    Args:
        options: what is simulated.
        links: kind of each link.
        unix_s: gives the seconds since 1970 now, for signatures; by default simulated time does.

    Raises:
        ValueError: an unknown vehicle, scenario, sensor profile, flavour or parameter, or a
            signing key that is none.
    """

    def __init__(
        self,
        options: ShimOptions,
        links: Sequence[LinkKind],
        *,
        unix_s: Callable[[], float] | None = None,
    ) -> None:
        self.simulation = Simulation(options)
        self._boots = 0
        self.signing = Signing(
            options.signing_key,
            unix_s or (lambda: _BOOT_UNIX_S + self.time_s),
            ACCEPTED_UNSIGNED[options.autopilot],
        )
        self._system_id = options.system_id
        self.personality = personality_of(options.autopilot)
        self._options = options
        self._kinds = tuple(links)
        self._start()
        vehicle = self.simulation.vehicle
        self._command_delay_us = vehicle.command_delay_s * 1e6
        self._telemetry_delay_s = vehicle.telemetry_delay_s
        self._incoming: deque[tuple[float, int, bytes]] = deque()
        self._text_id = 0

    def _start(self) -> None:
        """What begins with each boot: links without a past, and services without memory."""
        options, sim = self._options, self.simulation
        self._links = [
            Link(
                kind,
                self.personality,
                system_id=options.system_id,
                truth=options.truth and kind is LinkKind.ONBOARD,
                estimate_interval_us=sim.autopilot.estimate_interval_us,
                random=np.random.default_rng(
                    np.random.SeedSequence(options.seed, spawn_key=(_SEED_STREAM, index))
                ),
                truth_begins_us=0 if sim.boots else self.personality.listens_from_us,
            )
            for index, kind in enumerate(self._kinds)
        ]
        self._services = Services(Context(sim, self._links, options.system_id, self.signing))
        for index, link in enumerate(self._links):
            link.sign(self.signing, index)
        self._commands: list[tuple[Link, Message, Command]] = []

    @property
    def time_s(self) -> float:
        """Simulated time."""
        return self.simulation.elapsed_us / 1e6

    def receive(self, link: int, data: bytes, time_s: float) -> None:
        """Take bytes that a client sent at a simulated time; times must not decrease."""
        self._incoming.append((time_s * 1e6 + self._command_delay_us, link, data))

    def step(self) -> list[Datagram]:
        """Advance by one tick and return what leaves at it."""
        sim = self.simulation
        sim.sense()
        if sim.boots != self._boots:
            self._boots = sim.boots
            self._start()
        # Half a microsecond, so that rounding in the driver's clock loses no tick.
        now_us = sim.elapsed_us + 0.5
        incoming = self._incoming
        while incoming and incoming[0][0] <= now_us:
            _, link, data = incoming.popleft()
            self._deliver(link, data)
        sim.control()
        if self._commands:
            self._carry_out_commands()
        return self._collect()

    def _collect(self) -> list[Datagram]:
        sim = self.simulation
        due_s = self.time_s + self._telemetry_delay_s
        if sim.time_us < self.personality.listens_from_us:
            sim.autopilot.take_texts()
            return self._collect_truth(due_s) if sim.boots else []
        self._send_announcements()
        self._send_texts()
        self._services.step(sim.time_us)
        datagrams: list[Datagram] = []
        for index, link in enumerate(self._links):
            link.stream(sim)
            frames = link.take(sim.time_us)
            if frames:
                datagrams += [Datagram(due_s, index, frame) for frame in frames]
        return datagrams

    def _collect_truth(self, due_s: float) -> list[Datagram]:
        """What the simulator tells while the autopilot that boots again is silent."""
        datagrams: list[Datagram] = []
        for index, link in enumerate(self._links):
            link.stream_truth(self.simulation)
            datagrams += [Datagram(due_s, index, frame) for frame in link.outgoing]
            link.outgoing = []
        return datagrams

    def _send_announcements(self) -> None:
        for announcement in self.simulation.autopilot.take_announcements():
            message = self.personality.announcements[announcement](self.simulation)
            for link in self._links:
                if message is not None:
                    link.send(message)

    def _send_texts(self) -> None:
        now_us = self.simulation.time_us
        for text in self.simulation.autopilot.take_texts():
            for message in status_messages(text, self._text_id):
                for link in self._links:
                    if link.carries_texts(now_us):
                        link.send(message)
            self._text_id = (self._text_id + 1) & 0xFFFF

    # --- what comes in ---

    def _deliver(self, index: int, data: bytes) -> None:
        link = self._links[index]
        booting = self.simulation.time_us < self.personality.listens_from_us
        if not booting and self.signing.key is None and link.parser.between_messages:
            setpoint = read_setpoint(data)
            if setpoint is not None:
                link.spoken_to = True
                self._follow(setpoint)
                return
        for message in link.parser.parse(data):
            if not booting and self.signing.admits(message):
                link.spoken_to = True
                self._handle(index, link, message)

    def _handle(self, index: int, link: Link, message: Message) -> None:
        name = message.get_type()
        if name == "SET_ATTITUDE_TARGET":
            self._follow(_setpoint(message))
        elif name == "REQUEST_DATA_STREAM":
            if self._is_for(message, AUTOPILOT_COMPONENT_ID):
                self._request_group(link, message)
        elif name == "HEARTBEAT":
            self.simulation.autopilot.receive_heartbeat(message.get_srcSystem())
            if message.type == _GROUND_STATION:
                link.note_ground_station(self.simulation.time_us)
            self._forward(index, message)
        elif name in ("COMMAND_LONG", "COMMAND_INT"):
            self._handle_command(link, message)
        else:
            self._services.handle(index, message)

    def _follow(self, setpoint: Setpoint) -> None:
        if self._is_for(setpoint, AUTOPILOT_COMPONENT_ID, any_system=True):
            self.simulation.autopilot.receive_attitude_target(setpoint.target)

    def _is_for(self, message: Message, component: int, *, any_system: bool = False) -> bool:
        """Whether a message is addressed to this system and component."""
        system_fits = message.target_system == self._system_id or (
            any_system and message.target_system == 0
        )
        return system_fits and message.target_component in (0, component)

    def _handle_command(self, link: Link, message: Message) -> None:
        sim = self.simulation
        if message.target_system not in (0, self._system_id):
            return
        command = command_of(message, sim.origin)
        if message.target_component == TRUTH_COMPONENT_ID:
            replies, result = handle_truth_command(command, link.truth_streams, sim)
            for reply in (*replies, acknowledgement(message, result)):
                link.send_truth(reply)
            return
        if message.target_component not in (0, AUTOPILOT_COMPONENT_ID):
            return
        answer = handle_link_command(command, link, sim)
        if answer is not None:
            replies, result = answer
            ack = acknowledgement(message, result)
            first = self.personality.message_before_acknowledgement
            for reply in (*replies, ack) if first else (ack, *replies):
                link.send(reply)
            return
        self._commands.append((link, message, command))

    def _carry_out_commands(self) -> None:
        """The autopilot looks at its commands after its control loop has run."""
        sim = self.simulation
        for link, message, command in self._commands:
            acknowledgements = sim.autopilot.receive_command(command)
            if acknowledgements is None:
                link.send(acknowledgement(message, UNSUPPORTED))
                continue
            for ack in acknowledgements:
                reply = acknowledgement(message, ack.result)
                if ack.delay_us == 0:  # it leaves before what the command brings about
                    link.send(reply)
                else:
                    link.send_later(reply, sim.time_us + ack.delay_us)
        self._commands = []

    def _request_group(self, link: Link, message: Message) -> None:
        """REQUEST_DATA_STREAM: the rate of a whole group of messages."""
        groups = self.personality.legacy_groups
        if groups is None:
            return
        wanted = groups if message.req_stream_id == 0 else (message.req_stream_id,)
        rate_hz = message.req_message_rate if message.start_stop else 0
        interval_us = 1_000_000 // rate_hz if rate_hz else -1
        for group in wanted:
            for message_id in groups.get(group, ()):
                link.streams.set_interval(message_id, interval_us, self.simulation.time_us)

    def _forward(self, index: int, message: Message) -> None:
        """Pass a heartbeat on to the other links, as PX4 does with what is for everybody."""
        for other_index, other in enumerate(self._links):
            if other_index != index:
                other.outgoing.append(bytes(message.get_msgbuf()))


def _setpoint(message: Message) -> Setpoint:
    w, x, y, z = message.q
    target = AttitudeTarget(
        message.type_mask,
        attitude_from_wire((w, x, y, z)),
        swap_flu_frd((message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)),
        message.thrust,
    )
    return Setpoint(message.target_system, message.target_component, target)
