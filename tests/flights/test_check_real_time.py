"""`companion check` as a user runs it: against a `sitl-shim` process of its own, over UDP."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(120)]

AUTOPILOT = 1
LOCAL_POSITION_NED = 32
ENVIRONMENT = {key: value for key, value in os.environ.items() if "COMPANION" not in key}


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


class Shim:
    """A running shim that sends to a port of its own choice."""

    def __init__(self, flavour, parameters, seed=1):
        self.port = free_port()
        command = [sys.executable, "-m", "sitl_shim", "run", f"--autopilot={flavour}"]
        command += ["--boot-scale=0.05", f"--seed={seed}", "--onboard-port=0", "--gcs-port=0"]
        command += [f"--onboard-remote={self.port}", f"--gcs-remote={free_port()}"]
        command += [f"--parameter={name}={value}" for name, value in parameters.items()]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline().startswith("ready:")

    def end(self):
        self.process.kill()
        self.process.communicate()


class ThinningRelay:
    """Passes datagrams on, but for four of five of some messages of the autopilot's."""

    def __init__(self, from_port, message_ids):
        self.to_port = free_port()
        self._ids = message_ids
        self._seen = 0
        self._ended = False
        self._shim_side = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._shim_side.bind(("127.0.0.1", from_port))
        self._shim_side.settimeout(0.1)
        self._client_side = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._client_side.bind(("127.0.0.1", 0))
        self._client_side.settimeout(0.1)
        self._shim = None
        self._threads = [threading.Thread(target=way) for way in (self._out, self._back)]
        for thread in self._threads:
            thread.start()

    def end(self):
        self._ended = True
        for thread in self._threads:
            thread.join()
        self._shim_side.close()
        self._client_side.close()

    def _out(self):
        while not self._ended:
            with contextlib.suppress(TimeoutError, ConnectionError):
                data, self._shim = self._shim_side.recvfrom(65535)
                if int.from_bytes(data[7:10], "little") in self._ids and data[6] == AUTOPILOT:
                    self._seen += 1
                    if self._seen % 5:
                        continue
                self._client_side.sendto(data, ("127.0.0.1", self.to_port))

    def _back(self):
        while not self._ended:
            with contextlib.suppress(TimeoutError, ConnectionError):
                data = self._client_side.recv(65535)
                if self._shim is not None:
                    self._shim_side.sendto(data, self._shim)


@pytest.fixture
def begin():
    running = []

    def begin_one(make, *arguments):
        running.append(make(*arguments))
        return running[-1]

    yield begin_one
    for one in reversed(running):
        one.end()


def check(port, *options, cwd=None):
    command = [sys.executable, "-m", "companion", "check", "--json", *options]
    command.append(f"--connect=udpin://127.0.0.1:{port}")
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, timeout=90, cwd=cwd, env=ENVIRONMENT
    )
    assert done.stdout, done.stderr
    result = json.loads(done.stdout)
    return done.returncode, {f["subject"]: f for f in result["findings"]}, result


def test_on_ardupilot_a_bad_timeout_a_wrong_thrust_meaning_and_a_slow_stream_are_named(begin):
    bad = {"GUID_TIMEOUT": 3.0, "GUID_OPTIONS": 8, "FS_GCS_ENABLE": 5, "MAV_GCS_SYSID": 1}
    shim = begin(Shim, "ardupilot", bad)
    relay = begin(ThinningRelay, shim.port, (LOCAL_POSITION_NED,))
    status, findings, result = check(relay.to_port, "--set=preflight.thrust_field=climb_rate")
    assert status == 3
    assert result["verdict"] == "refusal"
    assert findings["GUID_TIMEOUT"]["verdict"] == "warning"
    assert findings["GUID_TIMEOUT"]["change"]["old"] == 3.0
    assert findings["GUID_TIMEOUT"]["change"]["new"] == 0.5
    assert findings["GUID_OPTIONS"]["verdict"] == "refusal"
    assert findings["GUID_OPTIONS"]["change"]["new"] == 0.0
    assert findings["LOCAL_POSITION_NED"]["verdict"] == "refusal"
    rates = {stream["name"]: stream["measured_hz"] for stream in result["measured"]["streams"]}
    assert rates["LOCAL_POSITION_NED"] < 0.3 * rates["ATTITUDE_QUATERNION"]
    assert findings["FS_GCS_ENABLE"]["verdict"] == "ok"


def test_on_px4_a_bad_failsafe_a_wrong_thrust_meaning_and_a_slow_stream_are_named(begin):
    bad = {"COM_OBL_RC_ACT": 7, "COM_OF_LOSS_T": 10.0, "EKF2_PREDICT_US": 20000}
    shim = begin(Shim, "px4", bad)
    status, findings, result = check(shim.port, "--set=preflight.thrust_field=climb_rate")
    assert status == 3
    assert "the motors stop in the air" in findings["COM_OBL_RC_ACT"]["found"]
    assert findings["COM_OF_LOSS_T"]["verdict"] == "warning"
    assert findings["thrust"]["verdict"] == "refusal"
    assert findings["ODOMETRY"]["verdict"] == "warning"
    rates = {stream["name"]: stream["measured_hz"] for stream in result["measured"]["streams"]}
    assert rates["ODOMETRY"] < 60.0


def test_a_port_on_which_nothing_comes_ends_with_that():
    begun = time.monotonic()
    status, findings, _ = check(free_port(), "--set=timeouts.connect_s=1.5")
    assert status == 3
    assert "no HEARTBEAT of one came" in findings["autopilot"]["found"]
    assert time.monotonic() - begun < 60.0


def test_fix_and_restore_from_one_process_to_the_next(begin, tmp_path):
    shim = begin(Shim, "ardupilot", {})
    status, findings, _ = check(shim.port, "--fix", "--out=mended.json", cwd=tmp_path)
    assert status in (0, 1), "a busy machine's streams may come late, which is a warning"
    assert not [f for f in findings.values() if f["verdict"] == "refusal"]
    listed = json.loads((tmp_path / "mended.json").read_text())
    assert [p["name"] for p in listed["parameters"]] == [
        "GUID_TIMEOUT",
        "MAV_GCS_SYSID",
        "FS_GCS_ENABLE",
    ]
    status, findings, _ = check(shim.port, "--restore=mended.json", cwd=tmp_path)
    assert status in (0, 1)
    assert findings["--restore"]["found"] == "done: GUID_TIMEOUT, MAV_GCS_SYSID, FS_GCS_ENABLE"
    assert not (tmp_path / "mended.json").exists()


def test_what_a_killed_flight_has_left_is_restored_by_its_list(begin, tmp_path):
    shim = begin(Shim, "px4", {"COM_OF_LOSS_T": 8.0})
    command = [sys.executable, "-m", "companion", "fly", "--fix", "--out=flight"]
    command.append(f"--connect=udpin://127.0.0.1:{shim.port}")
    flight = subprocess.Popen(
        command, cwd=tmp_path, env=ENVIRONMENT, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    )
    path = tmp_path / "flight" / "restore.json"
    end = time.monotonic() + 60.0
    while not path.exists() or b"set COM_OF_LOSS_T" not in tlog_of(path.parent):
        assert time.monotonic() < end
        assert flight.poll() is None
        time.sleep(0.05)
    os.kill(flight.pid, signal.SIGKILL)
    flight.communicate()
    status, _, _ = check(shim.port, f"--restore={path}")
    assert status == 0
    assert not path.exists()
    _, findings, _ = check(shim.port)
    assert findings["COM_OF_LOSS_T"]["change"]["old"] == 8.0


def tlog_of(folder):
    """What was sent and received; what is told goes out as STATUSTEXT."""
    return (folder / "flight.tlog").read_bytes()
