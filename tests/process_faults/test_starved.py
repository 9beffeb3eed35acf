"""The companion gets too little: of the disk, of the processor, of memory."""

import os
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.process_faults.harness import (
    FAILSAFE,
    PX4_OFFBOARD,
    TILT_LIMIT_DEG,
    assert_logs_reach,
    short_trajectory,
)

pytestmark = [pytest.mark.realtime, pytest.mark.faults, pytest.mark.timeout(150)]

LANDED, BAD_INPUT, ABORTED = 0, 2, 4
HOG = """
import os, sys
os.sched_setaffinity(0, {int(sys.argv[1])})
while True:
    pass
"""
WITHOUT_OVERRIDE = """
import ctypes, os, sys
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1
ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)  # root obeys, too
os.execv(sys.executable, [sys.executable, "-m", "companion", *sys.argv[1:]])
"""


def test_a_disk_that_fills_up_in_flight_ends_the_log_and_not_the_flight(tracking):
    """Nor does standing still for 0.3 s before that, by both clocks: it is flown through."""
    vehicle, companion = tracking("px4", speed=1.0, trajectory_s=2.0)
    began_s = vehicle.clock_s
    companion.stop(0.3)
    assert vehicle.clock_s - began_s > 0.25
    vehicle.wait(0.4)
    full_s = vehicle.clock_s
    room = companion.tlog.stat().st_size + 10_000
    resource.prlimit(companion.process.pid, resource.RLIMIT_FSIZE, (room, room))
    status, result = companion.end()
    assert status == LANDED, companion.told()
    assert result["outcome"] == "landed"
    assert result["completed"]
    assert result["timer_noise_ms"]["max"] > 250.0, "standing still is seen in the result"
    assert "the flight goes on unrecorded: flight.tlog" in companion.told()
    assert "File too large" in companion.told()
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert_logs_reach(companion, full_s)


def test_a_folder_that_cannot_be_written_is_refused_before_anything_begins(tmp_path):
    (tmp_path / "short.csv").write_text(short_trajectory())
    folder = tmp_path / "read-only"
    folder.mkdir(mode=0o555)
    command = [sys.executable, "-c", WITHOUT_OVERRIDE, "fly", f"--traj={tmp_path / 'short.csv'}"]
    done = subprocess.run(
        [*command, f"--out={folder / 'flight'}"],
        check=False, capture_output=True, text=True, cwd=tmp_path, timeout=60.0,
    )  # fmt: skip
    assert done.returncode == BAD_INPUT
    assert done.stderr.startswith("error: The flight cannot be recorded in ")
    assert "Permission denied" in done.stderr
    assert "--out" in done.stderr
    assert "arm" not in done.stderr.split()
    assert list(folder.iterdir()) == []


def test_a_loop_that_gets_little_of_the_processor_flies_or_hands_over(tracking):
    """Two hogs on its processor, and then only 40 ms of each 100."""
    # Long enough that it is the lost terminal that ends the flight, not the trajectory.
    vehicle, companion = tracking("px4", speed=1.0, trajectory_s=20.0)
    began_s = vehicle.clock_s
    processor = {max(os.sched_getaffinity(companion.process.pid))}
    os.sched_setaffinity(companion.process.pid, processor)
    hogs = [subprocess.Popen([sys.executable, "-c", HOG, str(*processor)]) for _ in range(2)]
    try:
        vehicle.wait(2.0)
    finally:
        for hog in hogs:
            hog.kill()
            hog.wait()
    end = time.monotonic() + 5.0
    while time.monotonic() < end and companion.process.poll() is None:
        companion.process.send_signal(signal.SIGSTOP)
        vehicle.pause(0.06)
        companion.process.send_signal(signal.SIGCONT)
        vehicle.pause(0.04)
    starved_s = vehicle.clock_s
    companion.process.send_signal(signal.SIGHUP)  # and its terminal is lost
    status, result = companion.end(90.0)
    assert (status, result["outcome"]) in [(LANDED, "landed"), (ABORTED, "aborted")]
    if status == ABORTED:
        assert "handing over: " in companion.told() or "handed over: " in companion.told()
    assert result["missed_deadlines"] > 0
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert (PX4_OFFBOARD, FAILSAFE) not in vehicle.modes_after(began_s)
    if status == LANDED:
        assert result["note"] == "landed early by command"
        assert_logs_reach(companion, starved_s)


def test_allocations_that_fail_in_flight_end_in_something_defined(tracking):
    vehicle, companion = tracking("px4")
    vehicle.wait(0.5)
    scarce_s = vehicle.clock_s
    pages = int((Path("/proc") / str(companion.process.pid) / "statm").read_text().split()[0])
    room = pages * resource.getpagesize()
    resource.prlimit(companion.process.pid, resource.RLIMIT_AS, (room, room))
    status, result = companion.end(90.0)
    assert (status, result["outcome"]) in [(LANDED, "landed"), (ABORTED, "aborted")]
    assert "Traceback" not in companion.told()
    # What could not be had is told: memory to draw with, at least.
    assert "is not complete: " in companion.told()
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert_logs_reach(companion, scarce_s)
