"""Real clients over real sockets on the link of a flight: MAVSDK, and pymavlink as MAVProxy has it.

The flights run as processes of their own, at twice the speed of the wall clock, and each shows as
much as fits together: such a flight takes a quarter of a minute.
"""

import asyncio
import contextlib
import os
import select
import socket
import subprocess
import sys
import threading
import time
import tty
from concurrent.futures import ThreadPoolExecutor

import pytest
from pymavlink import mavutil

from companion.mavlink.dialects.px4 import encode_mode

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(150)]

LOOPBACK = "127.0.0.1"
SPEED = 2
PATIENT = ("--set=supervisor.state_age_limit_s=0.5", "--set=supervisor.hand_over_after_s=3")
"""Flights that go on, at this speed, while a busy machine lets the companion wait."""
DENIED, ACCEPTED = 2, 0


def free_port(kind=socket.SOCK_DGRAM):
    with socket.socket(socket.AF_INET, kind) as taken:
        taken.bind((LOOPBACK, 0))
        return taken.getsockname()[1]


class Station:
    """A ground station by pymavlink, which is what MAVProxy is made of."""

    def __init__(self, url):
        deadline = time.monotonic() + 30
        while True:
            with contextlib.suppress(OSError):
                self.link = mavutil.mavlink_connection(url, source_system=254, retries=1)
                break
            assert time.monotonic() < deadline
            time.sleep(0.2)

    def heartbeat(self):
        self.link.mav.heartbeat_send(6, 8, 0, 0, 4)

    def wait(self, condition, timeout_s=20.0):
        """The first message that fulfils a condition."""
        end = time.monotonic() + timeout_s
        beat = 0.0
        while time.monotonic() < end:
            if time.monotonic() > beat:
                beat = time.monotonic() + 1.0
                self.heartbeat()
            message = self.link.recv_match(blocking=True, timeout=0.2)
            if message is not None and message.get_srcSystem() == 1 and condition(message):
                return message
        raise AssertionError("it did not come in time")

    def command(self, command, *params):
        """Result of a command."""
        params = [*params, *[0.0] * (7 - len(params))]
        self.link.mav.command_long_send(1, 1, command, 0, *params)
        ack = self.wait(
            lambda m: (
                m.get_type() == "COMMAND_ACK"
                and (m.command, m.target_system, m.target_component)
                == (command, 254, self.link.mav.srcComponent)
            )
        )
        return ack.result

    def change_mode(self, main, sub):
        return self.command(176, 1, main, sub)

    def close(self):
        self.link.close()


async def mavsdk_sees_the_flight(port):
    """What MAVSDK can do beside a flight: see it, read parameters, and arm nothing."""
    from mavsdk.asyncio import Configuration, Mavsdk
    from mavsdk.asyncio.plugins.action import ActionAsync
    from mavsdk.asyncio.plugins.param import ParamAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

    configuration = Configuration.create_manual(245, 190, True)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(f"udpout://{LOOPBACK}:{port}")
        system = await mavsdk.first_autopilot(30.0)
        assert system is not None
        position = await anext(aiter(TelemetryAsync(system).subscribe_position()))
        timeout = await ParamAsync(system).get_param_float("COM_OF_LOSS_T")
        denied = None
        try:
            await ActionAsync(system).arm()
        except Exception as error:
            denied = error.result.name
        return position.latitude_deg, timeout, denied


class Bridge:
    """Between a shim's UDP and another kind of link; runs in a thread of the test's own."""

    def __init__(self):
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.bind((LOOPBACK, 0))
        self.shim = None
        self.ended = False

    @property
    def port(self):
        return self.udp.getsockname()[1]

    def run(self):
        while not self.ended:
            readable, _, _ = select.select([self.udp, *self.waiting()], [], [], 0.05)
            for each in readable:
                if each is self.udp:
                    data, self.shim = self.udp.recvfrom(4096)
                    self.to_companion(data)
                elif data := self.from_companion(each):
                    self.udp.sendto(data, self.shim)


class TcpBridge(Bridge):
    def __init__(self):
        super().__init__()
        self.server = socket.create_server((LOOPBACK, 0))
        self.companion = None
        self.calls = 0
        self.url = f"tcpout://{LOOPBACK}:{self.server.getsockname()[1]}"

    def waiting(self):
        return [self.server] if self.companion is None else [self.server, self.companion]

    def from_companion(self, source):
        if source is self.server:
            self.companion = self.server.accept()[0]
            self.calls += 1
            return b""
        with contextlib.suppress(OSError):
            if data := source.recv(4096):
                return data
        self.companion = None
        return b""

    def to_companion(self, data):
        with contextlib.suppress(OSError, AttributeError):
            self.companion.sendall(data)

    def cut(self):
        companion, self.companion = self.companion, None
        companion.shutdown(socket.SHUT_RDWR)
        companion.close()


class SerialBridge(Bridge):
    def __init__(self):
        super().__init__()
        self.fd, self.device = os.openpty()
        tty.setraw(self.device)
        os.set_blocking(self.fd, False)
        self.url = f"serial://{os.ttyname(self.device)}:921600"

    def waiting(self):
        return [self.fd]

    def from_companion(self, source):
        return os.read(source, 4096)

    def to_companion(self, data):
        with contextlib.suppress(BlockingIOError):
            os.write(self.fd, data)


@contextlib.contextmanager
def simulated_at(port):
    """A shim that sends to a port."""
    shim = subprocess.Popen(
        [
            sys.executable, "-m", "sitl_shim", "run", "--vehicle=bebop2", "--seed=1",
            f"--speed={SPEED}", "--parameter=MPC_LAND_SPEED=1.2", "--parameter=COM_DISARM_LAND=0.5",
            "--onboard-port=0", f"--onboard-remote={port}", "--gcs-port=0",
        ],
        stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert shim.stdout.readline()
        yield
    finally:
        shim.terminate()
        shim.communicate()


@contextlib.contextmanager
def simulated_behind(bridge):
    thread = threading.Thread(target=bridge.run, daemon=True)
    thread.start()
    try:
        with simulated_at(bridge.port):
            yield
    finally:
        bridge.ended = True
        thread.join()


def test_clients_share_the_link_of_a_flight_over_a_serial_line_and_do_not_steer_it(start):
    udp, tcp = free_port(), free_port(socket.SOCK_STREAM)
    bridge = SerialBridge()
    with simulated_behind(bridge), ThreadPoolExecutor() as threads:
        flight = start(
            *PATIENT,
            f"--connect={bridge.url}",
            f"--set=link.forward=[{{url: 'udpin://{LOOPBACK}:{udp}'}}, "
            f"{{url: 'tcpin://{LOOPBACK}:{tcp}'}}]",
        )
        station = Station(f"tcp:{LOOPBACK}:{tcp}")
        mavsdk = threads.submit(lambda: asyncio.run(mavsdk_sees_the_flight(udp)))
        try:
            station.wait(lambda m: m.get_type() == "HEARTBEAT" and m.autopilot == 12, 40.0)
            assert station.command(400, 1.0) == DENIED
            assert station.change_mode(6, 0) == DENIED
            station.link.mav.param_request_read_send(1, 1, b"MIS_TAKEOFF_ALT", -1)
            value = station.wait(
                lambda m: m.get_type() == "PARAM_VALUE" and m.param_id == "MIS_TAKEOFF_ALT"
            )
            assert value.param_value == 2.5
            # Read on meanwhile: a client that takes nothing for long is cut off.
            station.wait(
                lambda m: m.get_type() == "HEARTBEAT" and m.custom_mode == encode_mode(6, 0), 60.0
            )
            for _ in range(20):
                station.link.mav.set_attitude_target_send(0, 1, 1, 7, [1, 0, 0, 0], 0, 0, 0, 0.0)
            station.wait(lambda m: m.get_type() == "ODOMETRY")
            result, err = flight.end(timeout_s=120.0)
        finally:
            station.close()
        latitude_deg, timeout_s, armed = mavsdk.result()

    assert latitude_deg == pytest.approx(47.4, abs=0.1)
    assert timeout_s == 1.0 * SPEED, "the shim stretches it, as PX4 does"
    assert armed == "COMMAND_DENIED"
    assert result["outcome"] == "landed", err
    assert result["mean_tracking_error_m"] < 0.03
    said = " ".join(event.values["text"] for event in flight.events())
    assert "SET_ATTITUDE_TARGET of 254" in said
    assert "20 SET_ATTITUDE_TARGET" in said, "each of them is counted"
    assert "COMPONENT_ARM_DISARM of 245" in said


def test_over_a_link_that_was_cut_and_made_anew_a_pilot_takes_over_and_keeps_the_vehicle(start):
    udp = free_port()
    bridge = TcpBridge()
    with simulated_behind(bridge):
        flight = start(
            *PATIENT,
            f"--connect={bridge.url}",
            f"--set=link.forward=[{{url: 'udpin://{LOOPBACK}:{udp}'}}]",
            "--set=timeouts.handed_over_s=1",
        )
        flight.wait_for("phase connect")
        station = Station(f"udpout:{LOOPBACK}:{udp}")
        try:
            station.wait(lambda m: m.get_type() == "HEARTBEAT")
            flight.wait_for("phase track")
            bridge.cut()
            flight.wait_for("the link is there again")
            flight.wait_for("phase return")
            assert station.change_mode(4, 3) == ACCEPTED
            flight.wait_for("handed over: somebody else changed the mode to loiter")
            flight.wait_for("the link stays shared")
            assert flight.process.poll() is None
            # The flight is the pilot's: what was kept back before, passes.
            assert station.change_mode(3, 0) == ACCEPTED
            assert station.change_mode(4, 6) == ACCEPTED
            station.wait(
                lambda m: m.get_type() == "HEARTBEAT" and m.custom_mode == encode_mode(4, 6)
            )
            station.wait(
                lambda m: (
                    m.get_type() == "HEARTBEAT" and m.autopilot == 12 and not m.base_mode & 0x80
                ),
                timeout_s=40.0,
            )
            result, err = flight.end(timeout_s=20.0)
        finally:
            station.close()

    assert result["completed"], err
    assert result["outcome"] == "aborted"
    assert bridge.calls == 2
    assert any("the link is down" in event.values["text"] for event in flight.events())


def test_mavsdk_arms_takes_off_and_lands_for_the_companion(start):
    port = free_port()
    with simulated_at(port):
        flight = start(
            *PATIENT, f"--connect=udpin://{LOOPBACK}:{port}", "--set=link.mission_backend=mavsdk"
        )
        result, err = flight.end(timeout_s=120.0)

    assert result["outcome"] == "landed", err
    assert result["completed"]
    said = [event.values["text"] for event in flight.events()]
    assert any("kept back: none" in text for text in said)
