"""A vehicle and a companion as processes of their own, and what is seen of them from outside."""

import contextlib
import json
import math
import os
import re
import select
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

from mcap.exceptions import EndOfFile
from mcap.reader import NonSeekingReader, make_reader
from pymavlink import mavutil
from pymavlink.dialects.v20 import all as mavlink

from companion.commands.recover import RecoverRequest, run_recover
from companion.recording.tlog import read_tlog

TRUTH = 240
"""Component by which the simulation tells what truly is."""
PX4_OFFBOARD = 0x00060000
GUIDED, BRAKE, LAND = 4, 17, 9
"""Of ArduPilot."""
ACTIVE, FAILSAFE = 4, 5
"""MAV_STATE: armed, and as PX4 says it while a failsafe acts."""
HEIGHT_M = 1.0
TILT_LIMIT_DEG = 35.0
_LOOK_S = 0.01
_HEARTBEAT_S = 0.4


def short_trajectory(duration_s=4.0):
    """CSV of a trajectory near the place of take-off, at its height."""
    rows = ["t,x,y,z"]
    for step in range(round(duration_s) + 1):
        angle = math.pi / 2.0 * step
        rows.append(f"{step},{0.3 * math.sin(angle):.3f},{0.2 * (step % 2)},{HEIGHT_M}")
    return "\n".join(rows) + "\n"


class Vehicle:
    """`sitl-shim run`, which outlives the companion, and a ground station that only listens."""

    def __init__(self, autopilot="px4", parameters=None, speed=2.0):
        self.speed = speed
        """Its seconds in a second of ours."""
        self.clock_s = 0.0
        """The autopilot's, by the newest truth."""
        self.position_m = (0.0, 0.0, 0.0)
        """East, north, up, truly."""
        self.velocity_m_s = (0.0, 0.0, 0.0)
        self.worst_tilt_deg = 0.0
        self.mode = None
        self.armed = False
        self.modes = []
        """(autopilot's time, mode, state) at each change."""
        self.texts = []
        """(autopilot's time, text)."""
        self.track = []
        """(autopilot's time, position, velocity)."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True
        self.port = _free_port()
        command = [sys.executable, "-m", "sitl_shim", "run", f"--autopilot={autopilot}", "--seed=1"]
        command += ["--boot-scale=0.05", "--onboard-port=0", f"--onboard-remote={self.port}"]
        command += ["--gcs-port=0", f"--gcs-remote={self._socket.getsockname()[1]}"]
        command += [f"--speed={speed}"]
        command += [f"--parameter={name}={value}" for name, value in (parameters or {}).items()]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self._send = self._ask = None
        self._alive_s = -math.inf

    def booted(self):
        """Wait until it runs; a companion may be started before."""
        ready = self.process.stdout.readline()
        assert ready.startswith("ready:")
        port = int(re.search(r"ground station 127\.0\.0\.1:(\d+)", ready)[1])
        own = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
        self._send = lambda message: self._socket.sendto(message.pack(own), ("127.0.0.1", port))
        # Only who asks is told the truth on the link of ground stations.
        self._ask = mavlink.MAVLink_command_long_message(
            1, TRUTH, mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 0, 331, 20_000, 0, 0, 0, 0, 0
        )

    def look(self):
        """Take what has come."""
        if time.monotonic() > self._alive_s + _HEARTBEAT_S:
            self._alive_s = time.monotonic()
            self._send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            if not self.clock_s:
                self._send(self._ask)
        with contextlib.suppress(BlockingIOError):
            while True:
                for message in self._parser.parse_buffer(self._socket.recv(65535)) or ():
                    self._take(message)

    def _await_packet(self, at_most_s):
        """Until there is something to look at, or some time has passed."""
        select.select([self._socket], [], [], at_most_s)

    def wait_until(self, condition, timeout_s=30.0):
        """Look on until something is the case; the autopilot's time at which it was."""
        end = time.monotonic() + timeout_s
        while True:
            self.look()
            if condition():
                return self.clock_s
            assert time.monotonic() < end, self.story()
            self._await_packet(_LOOK_S)

    def wait(self, duration_s):
        """Look on for a while of the autopilot's time."""
        until_s = self.clock_s + duration_s
        self.wait_until(lambda: self.clock_s >= until_s, 10.0 + 5.0 * duration_s)

    def pause(self, duration_s):
        """Look on for a while of real time."""
        end = time.monotonic() + duration_s
        while time.monotonic() < end:
            self.look()
            self._await_packet(min(_LOOK_S, max(0.0, end - time.monotonic())))

    def said(self, text):
        """The autopilot's times at which it said something like this."""
        return [time_s for time_s, said in self.texts if text in said]

    def modes_after(self, time_s):
        """(mode, state) that it has been in since."""
        return [(mode, state) for changed_s, mode, state in self.modes if changed_s > time_s]

    def touched_down_at_m_s(self):
        """How fast it truly sank before it stood."""
        flying = [velocity for _, position, velocity in self.track if position[2] > 0.1]
        return -flying[-1][2]

    def story(self):
        """What happened, for a person who wonders."""
        return f"{self.clock_s} {self.position_m} {self.armed} {self.modes} {self.texts}"

    def end(self):
        self.process.kill()
        self.process.communicate()
        self._socket.close()

    def _take(self, message):
        name = message.get_type()
        truth = message.get_srcComponent() == TRUTH
        if name == "ODOMETRY" and truth:
            self.clock_s = message.time_usec * 1e-6
            self.position_m = (message.y, message.x, -message.z)
            self.velocity_m_s = (message.vy, message.vx, -message.vz)
            self.track.append((self.clock_s, self.position_m, self.velocity_m_s))
            self.worst_tilt_deg = max(self.worst_tilt_deg, _tilt_deg(message.q))
        elif name == "HEARTBEAT" and message.get_srcComponent() == 1:
            self.mode, self.armed = message.custom_mode, bool(message.base_mode & 0x80)
            seen = (self.mode, message.system_status)
            if not self.modes or self.modes[-1][1:] != seen:
                self.modes.append((self.clock_s, *seen))
        elif name == "STATUSTEXT" and message.get_srcComponent() == 1:
            self.texts.append((self.clock_s, message.text))


class Companion:
    """`companion fly`, connected to a vehicle."""

    def __init__(self, folder, vehicle, *options, trajectory_s=4.0):
        self.folder = folder / "flight"
        self.vehicle = vehicle
        path = folder / "short.csv"
        path.write_text(short_trajectory(trajectory_s))
        command = [sys.executable, "-m", "companion", "fly", "--json", f"--out={self.folder}"]
        command += [f"--connect=udpin://127.0.0.1:{vehicle.port}", f"--traj={path}"]
        command += ["--set=hover_s=0.2", f"--set=takeoff_height_m={HEIGHT_M}", *options]
        self._out = (folder / "stdout").open("w+")
        self._err = (folder / "stderr").open("w+")
        self.process = subprocess.Popen(
            command,
            cwd=folder,
            env=os.environ | {"XDG_RUNTIME_DIR": str(folder)},
            stdin=subprocess.DEVNULL,
            stdout=self._out,
            stderr=self._err,
            start_new_session=True,
        )

    @property
    def mcap(self):
        return self.folder / "flight.mcap"

    @property
    def tlog(self):
        return self.folder / "flight.tlog"

    def told(self):
        """All that it has told a person."""
        return (self.folder.parent / "stderr").read_text()

    def tells(self, text, timeout_s=60.0):
        """True once it has told something, False if it ends before."""
        self.vehicle.wait_until(
            lambda: text in self.told() or self.process.poll() is not None, timeout_s
        )
        return text in self.told()

    def stop(self, duration_s):
        """SIGSTOP, and SIGCONT after a while of the process's own time; when that was, for us."""
        self.process.send_signal(signal.SIGSTOP)
        self.vehicle.pause(duration_s)
        self.process.send_signal(signal.SIGCONT)
        return time.time()

    def kill(self):
        """SIGKILL; the wall clock's time at which it was."""
        killed_s = time.time()
        self.process.kill()
        self.process.wait()
        return killed_s

    def end(self, timeout_s=60.0):
        """Wait for its end: the exit status, and its result if it gave one."""
        self.vehicle.wait_until(lambda: self.process.poll() is not None, timeout_s)
        self._out.seek(0)
        said = self._out.read()
        return self.process.returncode, json.loads(said) if said else None

    def clean_up(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
        self.process.wait()
        self._out.close()
        self._err.close()


def _free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def mavlogdump(path: Path):
    """Run mavlogdump on a log; the lines that it prints."""
    tool = Path(sys.executable).with_name("mavlogdump.py")
    done = subprocess.run(
        [sys.executable, str(tool), str(path)],
        check=True, capture_output=True, text=True, timeout=60.0,
    )  # fmt: skip
    return done.stdout.splitlines()


def logged(companion):
    """What is left of a flight's records, by the library's reader that does not seek.

    (topic, values) each, in the order of writing.
    """
    found = []
    with companion.mcap.open("rb") as file:
        messages = NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False)
        # A file that was not finished ends where the next record would begin.
        with contextlib.suppress(EndOfFile):
            for _, channel, message in messages:
                found.append((channel.topic, json.loads(message.data)))
    return found


def assert_logs_reach(companion, streamed_s, heard_s=None):
    """Both logs, and what is recovered of them, lack at most the last second.

    Args:
        companion: that flew.
        streamed_s: the autopilot's time until which it sent setpoints.
        heard_s: until which it heard the vehicle; None: as long.
    """
    heard_s = streamed_s if heard_s is None else heard_s
    records = logged(companion)
    controls = [values["autopilot_time_s"] for topic, values in records if topic == "control"]
    assert controls[-1] >= streamed_s - 1.0
    assert _last_truth_s(companion.tlog) >= heard_s - 1.0

    assert run_recover(RecoverRequest(companion.folder)) == 0

    recovered = companion.folder / "flight.recovered.mcap"
    with (recovered if recovered.exists() else companion.mcap).open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_summary().statistics.message_count == len(records)
        assert sum(1 for _ in reader.iter_messages(topics=["control"])) == len(controls)
    trimmed = companion.folder / "flight.recovered.tlog"
    if trimmed.exists():
        assert _last_truth_s(trimmed) >= heard_s - 1.0


def sent_tilts_deg(companion, after_unix_s=0.0):
    """Tilts of the setpoints that were sent after a time (s since 1970), by the packet log."""
    raws = [r.raw for r in read_tlog(companion.tlog) if r.sent and r.time_us * 1e-6 > after_unix_s]
    setpoints = [raw for raw in raws if _is(raw, mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET)]
    parser = mavlink.MAVLink(None)
    parsed = [message for raw in setpoints for message in parser.parse_buffer(raw)]
    return [_tilt_deg(message.q) for message in parsed]


def _tilt_deg(quaternion):
    _, x, y, _ = quaternion
    return math.degrees(math.acos(max(-1.0, 1.0 - 2.0 * (x * x + y * y))))


def _last_truth_s(path):
    """The autopilot's time in the last truth of a packet log, by pymavlink's own reader."""
    log = mavutil.mavlogfile(str(path))
    newest = 0.0
    while (message := log.recv_match(type="ODOMETRY")) is not None:
        if message.get_srcComponent() == TRUTH:
            newest = message.time_usec * 1e-6
    log.close()
    return newest


def _is(raw, message_id):
    return raw[0] == 0xFD and int.from_bytes(raw[7:10], "little") == message_id
