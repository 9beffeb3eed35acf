"""The companion gets too little: of the disk, of the processor, of memory."""

import resource
import subprocess
import sys

import pytest

from tests.process_faults.harness import (
    TILT_LIMIT_DEG,
    assert_logs_reach,
    short_trajectory,
)

pytestmark = [pytest.mark.realtime, pytest.mark.faults, pytest.mark.timeout(150)]

LANDED, BAD_INPUT, ABORTED = 0, 2, 4
WITHOUT_OVERRIDE = """
import ctypes, os, sys
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1
ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)  # root obeys, too
os.execv(sys.executable, [sys.executable, "-m", "companion", *sys.argv[1:]])
"""


def test_a_disk_that_fills_up_in_flight_ends_the_log_and_not_the_flight(begin):
    vehicle, companion = begin("px4")
    companion.wait_for("s  track")
    vehicle.wait(1.0)
    full_s = vehicle.clock_s
    room = companion.tlog.stat().st_size + 10_000
    resource.prlimit(companion.process.pid, resource.RLIMIT_FSIZE, (room, room))
    status, result = companion.end()
    assert status == LANDED, companion.told()
    assert result["outcome"] == "landed"
    assert result["completed"]
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
