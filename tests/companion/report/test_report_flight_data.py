import math
import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest

from companion.flight.records import CHANNELS
from companion.mavlink.codec import Packer, encode
from companion.mavlink.messages import COMPONENT_TRUTH
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, FlightLog
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import Bench

NAN3 = (math.nan, math.nan, math.nan)


def control(time_s, **changes):
    record = {field.name: 0.0 for field in CHANNELS[0].fields if field.kind == "number"}
    record |= {field.name: "" for field in CHANNELS[0].fields if field.kind == "string"}
    record |= {field.name: (0.0, 0.0, 0.0) for field in CHANNELS[0].fields if field.kind == "array"}
    return record | {"projecting": False, "autopilot_time_s": time_s} | changes


def plan(time_s, status, *, r_max_active=False):
    return {
        "autopilot_time_s": time_s,
        "status": status,
        "constrained_axes": [0, 0, 0],
        "r_max_active": r_max_active,
        "solver_status": "",
        "solver_iterations": 0,
        "predicted_end_enu_m": NAN3,
    }


def odometry(time_s, ned_m, component=COMPONENT_TRUTH, ned_m_s=(0.0, 0.0, 0.0)):
    packer = Packer(1, component)
    x, y, z = ned_m
    vx, vy, vz = ned_m_s
    return packer.pack(
        encode(
            "ODOMETRY",
            time_usec=round(time_s * 1e6),
            frame_id=1,
            child_frame_id=1,
            x=x,
            y=y,
            z=z,
            q=[1.0, 0.0, 0.0, 0.0],
            vx=vx,
            vy=vy,
            vz=vz,
            rollspeed=0.0,
            pitchspeed=0.0,
            yawspeed=0.0,
            pose_covariance=[0.0] * 21,
            velocity_covariance=[0.0] * 21,
        )
    )


def wind(time_s, ned_m_s2, name=b"wind_acc"):
    x, y, z = ned_m_s2
    return Packer(1, COMPONENT_TRUTH).pack(
        encode("DEBUG_VECT", name=name, time_usec=round(time_s * 1e6), x=x, y=y, z=z)
    )


def record_flight(folder, *, end_s=3.0):
    """A tick each 10 ms, a plan each 30 ms, truth each 20 ms."""
    log = FlightLog(folder, CHANNELS)
    for step in range(round(end_s * 100)):
        time_s = 0.01 * step
        log.record("control", time_s, control(time_s, thrust=0.5 + 0.001 * step))
        if step % 3 == 0:
            log.record("plan", time_s, plan(time_s, "solved" if step % 2 else "closed_form"))
        if step % 2 == 0:
            log.frame_in(time_s, odometry(time_s, (step, 2.0, -3.0), ned_m_s=(0.5, 0, -1)))
            log.frame_in(time_s, odometry(time_s, (7.0, 7.0, -7.0), component=1))
            log.frame_in(time_s, wind(time_s, (0.3, 0.0, -0.4)))
    log.close()


def test_ticks_plans_truth_and_wind_are_read_back(tmp_path):
    record_flight(tmp_path)

    data = read_flight(tmp_path)

    assert data.ticks.time_s == pytest.approx(np.arange(300) * 0.01)
    assert data.ticks.thrust[7] == pytest.approx(0.507)
    assert data.ticks.plan[:7].tolist() == ["closed_form", "", "", "solved", "", "", "closed_form"]
    assert data.truth.time_s == pytest.approx(np.arange(150) * 0.02)
    # NED on the wire, ENU inside.
    assert data.truth.position_enu_m[5] == pytest.approx((2.0, 10.0, 3.0))
    assert data.truth.velocity_enu_m_s[5] == pytest.approx((0.0, 0.5, 1.0))
    assert data.truth.wind_acceleration_m_s2 == pytest.approx(np.full(150, 0.5))


def test_what_is_missing_is_nan_and_what_was_a_fallback_is_marked(tmp_path):
    log = FlightLog(tmp_path, CHANNELS)
    log.record("control", 0.0, control(0.0))
    log.record(
        "control",
        0.1,
        control(0.1, desired_enu_m=NAN3, roll_rad=math.nan, fallback="level", phase="silence"),
    )
    log.close()

    ticks = read_flight(tmp_path).ticks

    assert np.isnan(ticks.desired_enu_m[1]).all()
    assert math.isnan(ticks.roll_rad[1])
    assert ticks.on_fallback.tolist() == [False, True]
    assert ticks.phase.tolist() == ["", "silence"]


def test_every_vector_and_flag_of_a_tick_is_read_into_its_own_array(tmp_path):
    vectors = ("position_enu_m", "velocity_enu_m_s", "desired_enu_m", "r2_enu_m", "r1_enu_m_s")
    vectors += ("u", "applied_u", "y_tilde_m_s", "sigma_hat")
    values = {name: (1.0 + k, 2.0 + k, 3.0 + k) for k, name in enumerate(vectors)}
    log = FlightLog(tmp_path, CHANNELS)
    log.record("control", 0.0, control(0.0, projecting=True, **values))
    log.record("plan", 0.0, plan(0.0, "solved", r_max_active=True))
    log.record("control", 0.01, control(0.01))
    log.close()

    ticks = read_flight(tmp_path).ticks

    for name, vector in values.items():
        assert getattr(ticks, name).tolist() == [list(vector), [0.0, 0.0, 0.0]], name
    assert ticks.projecting.tolist() == [True, False]
    assert ticks.r_max_active.tolist() == [True, False]


def test_messages_that_only_look_like_the_wind_or_are_not_finite_are_left_out(tmp_path):
    log = FlightLog(tmp_path, CHANNELS)
    log.frame_in(0.0, wind(0.0, (9.0, 9.0, 9.0), name=b"other"))
    log.frame_in(0.0, wind(0.0, (math.nan, 0.0, 0.0)))
    log.frame_in(0.0, odometry(0.0, (math.nan, 0.0, 0.0)))
    log.close()

    truth = read_flight(tmp_path).truth

    assert (len(truth.time_s), len(truth.wind_time_s)) == (0, 0)


def test_a_log_with_nothing_in_it_gives_empty_arrays(tmp_path):
    FlightLog(tmp_path, CHANNELS).close()

    data = read_flight(tmp_path)

    assert data.ticks.desired_enu_m.shape == (0, 3)
    assert data.truth.position_enu_m.shape == (0, 3)


KILLED = """
import os, signal, sys
from pathlib import Path
from tests.companion.report.test_report_flight_data import control, odometry
from companion.flight.records import CHANNELS
from companion.recording.flight_log import FlightLog

log = FlightLog(Path(sys.argv[1]), CHANNELS)
for step in range(200):
    log.record("control", 0.01 * step, control(0.01 * step))
    log.frame_in(0.01 * step, odometry(0.01 * step, (1.0, 2.0, -3.0)))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_flight_whose_process_was_killed_is_read_up_to_its_last_quarter_of_a_second(tmp_path):
    ended = subprocess.run(
        [sys.executable, "-c", KILLED, str(tmp_path)], cwd=os.getcwd(), check=False
    )
    assert ended.returncode == -signal.SIGKILL

    data = read_flight(tmp_path)

    assert 1.74 < data.ticks.time_s[-1] < 1.995
    assert 1.74 < data.truth.time_s[-1] < 1.995
    assert np.diff(data.ticks.time_s) == pytest.approx(np.full(len(data.ticks.time_s) - 1, 0.01))


@pytest.mark.parametrize("share", [0.15, 0.4, 0.61, 0.83, 0.999])
def test_logs_cut_off_anywhere_are_read_up_to_there(tmp_path, share):
    record_flight(tmp_path / "whole")
    whole = read_flight(tmp_path / "whole")
    cut = tmp_path / "cut"
    shutil.copytree(tmp_path / "whole", cut)
    for name in (MCAP_NAME, TLOG_NAME):
        size = (cut / name).stat().st_size
        os.truncate(cut / name, int(size * share))

    data = read_flight(cut)

    for read, recorded in (
        (data.ticks.time_s, whole.ticks.time_s),
        (data.truth.time_s, whole.truth.time_s),
    ):
        # The index at the end of the MCAP file is not needed; two thirds are records.
        assert len(read) < len(recorded) or share > 0.67
        assert (read == recorded[: len(read)]).all()
    assert len(data.truth.time_s) >= int(len(whole.truth.time_s) * share) - 1


@pytest.mark.parametrize("size", range(12))
def test_files_of_a_few_bytes_hold_nothing(tmp_path, size):
    record_flight(tmp_path, end_s=0.1)
    for name in (MCAP_NAME, TLOG_NAME):
        os.truncate(tmp_path / name, size)

    data = read_flight(tmp_path)

    assert (len(data.ticks.time_s), len(data.truth.time_s)) == (0, 0)


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A short flight from arming to landing, through the simulator."""
    return Bench(tmp_path_factory.mktemp("flown")).fly()


def test_a_real_flight_is_read_scored_and_cut_off_anywhere(flown, tmp_path):
    whole = read_flight(flown.folder)
    begin_s, end_s = flown.outcome.scored_s
    assert whole.ticks.time_s[0] < begin_s < end_s < whole.ticks.time_s[-1]
    assert list(dict.fromkeys(whole.ticks.phase.tolist()))[1:4] == ["approach", "hover", "track"]
    assert tracking_figures(whole, (begin_s, end_s)).against_truth.max_m < 0.1

    random = np.random.default_rng(1)
    for share in random.uniform(0.0, 1.0, 12):
        for name in (MCAP_NAME, TLOG_NAME):
            content = (flown.folder / name).read_bytes()
            (tmp_path / name).write_bytes(content[: int(len(content) * share)])
        data = read_flight(tmp_path)
        assert (data.ticks.time_s == whole.ticks.time_s[: len(data.ticks.time_s)]).all()
        assert (data.truth.time_s == whole.truth.time_s[: len(data.truth.time_s)]).all()
