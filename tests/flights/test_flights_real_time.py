"""The same flight on the wall clock, over UDP, and processes that are killed in it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from companion.commands.recover import RecoverRequest, run_recover
from companion.recording.mcap_log import read_records
from companion.recording.tlog import read_tlog
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import Bench

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(150)]

IN_FLIGHT = "phase track"


def is_running(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except OSError:
        return False


def test_in_real_time_it_flies_as_in_lockstep(start, tmp_path, capsys):
    flight = start()
    folder = tmp_path / "lockstep"
    folder.mkdir()
    flown = Bench(folder).fly()
    result, err = flight.end(timeout_s=120.0)
    assert flight.process.returncode == 0, err
    assert result["outcome"] == "landed"
    assert result["completed"]
    lockstep = tracking_figures(read_flight(flown.folder), flown.outcome.scored_s).against_truth
    assert result["mean_tracking_error_m"] == pytest.approx(lockstep.mean_m, rel=0.3)
    with capsys.disabled():
        sys.stdout.write(
            f"\nreal time: latency {result['latency_ms']} ms, timers {result['timer_noise_ms']} ms,"
            f" {result['missed_deadlines']} deadlines missed of {result['ticks']}, error "
            f"{result['mean_tracking_error_m'] * 1e3:.1f} mm (lockstep {lockstep.mean_m * 1e3:.1f})"
            "\n"
        )


@pytest.mark.faults
def test_a_shim_that_is_killed_is_said_at_once_and_the_log_is_whole(start, capsys):
    flight = start()
    flight.wait_for(IN_FLIGHT)
    (shim,) = flight.children()
    killed_s = time.time()
    os.kill(shim, signal.SIGKILL)
    result, err = flight.end(timeout_s=20.0)
    assert flight.process.returncode == 4
    assert result["outcome"] == "aborted"
    assert "The embedded shim ended by itself (exit status -9)" in result["note"]
    assert "The embedded shim ended by itself" in err
    said = [e for e in flight.events() if "The embedded shim ended" in e.values["text"]]
    assert said
    packets = list(read_tlog(flight.folder / "flight.tlog"))
    received = [p.time_us * 1e-6 for p in packets if not p.sent]
    assert killed_s - received[-1] < 0.5
    assert abs(packets[-1].time_us * 1e-6 - killed_s) < 2.0
    controls = [r for r in read_records(flight.folder / "flight.mcap") if r.topic == "control"]
    assert said[0].time_s - controls[-1].time_s < 2.0
    assert (flight.folder / "result.json").is_file()
    assert run_recover(RecoverRequest(flight.folder)) == 0
    assert capsys.readouterr().out.count("it is whole") == 2


def test_a_companion_that_is_killed_leaves_a_readable_log_and_no_process(start):
    flight = start()
    flight.wait_for(IN_FLIGHT)
    time.sleep(1.0)
    (shim,) = flight.children()
    killed_s = time.time()
    flight.process.kill()
    flight.process.communicate()
    packets = list(read_tlog(flight.folder / "flight.tlog"))
    assert killed_s - packets[-1].time_us * 1e-6 < 1.0
    records = list(read_records(flight.folder / "flight.mcap"))
    controls = [r for r in records if r.topic == "control"]
    tracked = [r for r in controls if r.values["phase"] == "track"]
    assert len(tracked) > 30
    assert packets[-1].time_us * 1e-6 - killed_s > -1.0
    end = time.monotonic() + 5.0
    while is_running(shim) and time.monotonic() < end:
        time.sleep(0.05)
    assert not is_running(shim)


def test_ctrl_c_lands_and_a_command_from_outside_reaches_the_flight(start, tmp_path):
    flight = start()
    flight.wait_for(IN_FLIGHT)
    environment = os.environ | {"XDG_RUNTIME_DIR": str(tmp_path)}
    answer = subprocess.run(
        [sys.executable, "-m", "companion", "resume"],
        check=False,
        env=environment,
        capture_output=True,
        text=True,
        timeout=20.0,
    )
    assert answer.returncode == 0
    assert "taken" in answer.stdout
    flight.press_ctrl_c()
    result, _ = flight.end()
    assert flight.process.returncode == 0
    assert result["outcome"] == "landed"
    assert result["note"] == "landed early by command"
    texts = [e.values["text"] for e in flight.events()]
    assert "nothing to resume: the companion flies" in texts
    assert list((tmp_path / "companion").iterdir()) == []  # the socket is gone
