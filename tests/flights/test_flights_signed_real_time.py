"""Signed packets over sockets, between processes."""

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.flights.process_flight import Flight
from tests.sitl_shim.server.shim_process import free_port

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(60)]

KEY = bytes(range(32))


@pytest.fixture
def key_file(tmp_path):
    path = tmp_path / "signing.key"
    path.touch(mode=0o600)
    path.write_bytes(KEY)
    return path


def test_the_embedded_shim_gets_the_key_and_not_on_its_command_line(tmp_path, key_file):
    flight = Flight(tmp_path, f"--signing-key-file={key_file}")
    try:
        flight.wait_for("phase ready")  # streams were asked for, granted, and came
        shown = [Path(f"/proc/{child}/cmdline").read_bytes() for child in flight.children()]
        flight.press_ctrl_c()
        output, _ = flight.process.communicate(timeout=30)
    finally:
        flight.process.kill()

    result = json.loads(output)
    assert result["note"].startswith("Stopped by command")
    assert result["rejected_packets"] == {}
    assert any(b"sitl_shim" in line for line in shown)
    assert not any(KEY in line or KEY.hex().encode() in line for line in shown)


@contextlib.contextmanager
def shim_on_its_own(port, *options, environment=None):
    """A shim that sends to a port."""
    shim = subprocess.Popen(
        [
            *(sys.executable, "-m", "sitl_shim", "run", *options),
            *("--onboard-port=0", "--gcs-port=0", f"--onboard-remote={port}"),
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=os.environ | {"PYTHONUNBUFFERED": "1"} | (environment or {}),
        text=True,
    )
    try:
        assert "ready" in shim.stdout.readline()
        yield shim
    finally:
        shim.kill()
        shim.communicate()


@pytest.mark.parametrize(
    ("theirs", "says"),
    [({}, "they are not signed"), ({"SITL_SHIM_SIGNING_KEY": "ab" * 32}, "are not by our key")],
)
def test_a_vehicle_without_our_key_is_refused_and_the_reason_is_the_signatures(
    tmp_path, key_file, theirs, says
):
    port = free_port()
    with shim_on_its_own(port, environment=theirs):
        flight = Flight(
            tmp_path,
            f"--connect=udpin://127.0.0.1:{port}",
            f"--signing-key-file={key_file}",
            "--set=timeouts.connect_s=3",
        )
        output, _ = flight.process.communicate(timeout=40)

    result = json.loads(output)
    assert flight.process.returncode == 3
    assert "packets were not read because" in result["note"]
    assert says in result["note"]
    assert sum(result["rejected_packets"].values()) >= 1


def test_a_vehicle_with_a_key_is_not_flown_without(tmp_path, key_file):
    port = free_port()
    with shim_on_its_own(port, f"--signing-key-file={key_file}") as shim:
        flight = Flight(tmp_path, f"--connect=udpin://127.0.0.1:{port}")
        output, _ = flight.process.communicate(timeout=40)
        shim.terminate()
        _, said = shim.communicate(timeout=10)

    result = json.loads(output)
    assert flight.process.returncode == 3
    assert "no key was given here" in result["note"]
    assert "packets that were not read" in said
    assert "unsigned" in said
