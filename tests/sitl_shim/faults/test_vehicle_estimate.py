"""The estimate steps, loses its position, or is told no more."""

import math
from itertools import pairwise

import pytest

from tests.sitl_shim.faults.vehicle_flights import copter, east_m, px4, px4_in_offboard, told
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, POSCTL

_STEP = {"fault": "estimator_reset", "at_s": 1.5, "position_enu_m": [0.8, 0.0, 0.0]}
_GUIDED, _LAND, _ALT_HOLD, _LOITER = 4, 9, 2, 5
_DESCENDS = 0x06040000
_HORIZONTAL = 2 | 8 | 16 | 256 | 512
"""Of ESTIMATOR_STATUS: velocity and positions."""


def _yaw_deg(message):
    """Clockwise from north."""
    w, x, y, z = message.q if hasattr(message, "q") else (
        message.q1, message.q2, message.q3, message.q4,
    )  # fmt: skip
    return math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))


def test_an_announced_reset_steps_the_estimate_once_and_px4_does_not_fly_after_it():
    client = px4({**_STEP, "yaw_deg": 10.0})
    client.run_until(4.0)
    odometry = client.messages("ODOMETRY")
    jumps = [(b.y - a.y, b.time_usec) for a, b in pairwise(odometry)]
    (jump,) = [(by, at) for by, at in jumps if abs(by) > 0.3]
    assert jump[0] == pytest.approx(0.8, abs=0.02)
    assert 1.5e6 <= jump[1] < 1.54e6
    before, after = (next(m for m in odometry if m.time_usec >= at_s * 1e6) for at_s in (1.4, 3.9))
    assert (before.reset_counter, after.reset_counter) == (0, 2), "position, heading"
    assert _yaw_deg(after) - _yaw_deg(before) == pytest.approx(-10.0, abs=0.6), "to the left"
    assert abs(east_m(client)) < 0.1
    assert told(client) == [(1.5, "reset", pytest.approx(0.8)), (1.5, "heading", 10.0)]


def test_a_jump_that_nobody_is_told_of_is_flown_off_by():
    client = px4({**_STEP, "announced": False})
    client.run_until(7.0)
    assert {m.reset_counter for m in client.messages("ODOMETRY")} == {0}
    assert east_m(client) == pytest.approx(-0.8, abs=0.1)
    assert told(client) == [(1.5, "jump", pytest.approx(0.8))]


@pytest.mark.parametrize(("announced", "goes_m"), [(True, 0.0), (False, -0.8)])
def test_ardupilot_that_holds_follows_an_unannounced_step_alone(announced, goes_m):
    client = copter({**_STEP, "at_s": 3.0, "announced": announced})
    client._repeats.clear()
    client.choose(17)  # BRAKE
    client.run_until(8.0)
    assert east_m(client) == pytest.approx(goes_m, abs=0.12)
    assert client.last("LOCAL_POSITION_NED").y - east_m(client) == pytest.approx(0.8, abs=0.08)
    texts = ["EKF3 lane switch 1", "EKF primary changed:1"]
    assert [text for text in client.texts() if text in texts] == (texts if announced else [])


def test_a_step_of_the_velocity_is_told_and_reported():
    client = px4({**_STEP, "position_enu_m": [0.0, 0.0, 0.0], "velocity_enu_m_s": [0.0, 0.5, 0.0]})
    client.run_until(1.6)
    assert client.last("ODOMETRY").vx == pytest.approx(0.5, abs=0.1)
    client.run_until(2.5)
    assert told(client) == [(1.5, "reset", 0.0), (1.5, "velocity", 0.5)]


def test_offboard_goes_on_without_a_position_and_odometry_drifts_on():
    client = px4_in_offboard({"fault": "position_loss", "at_s": 1.5, "lasts_s": 3.0})
    client.set_interval(230, 100_000)
    client.run_until(4.4)
    assert client.simulation.autopilot.heartbeat.custom_mode == OFFBOARD
    last = max(m.time_boot_ms for m in client.messages("LOCAL_POSITION_NED"))
    assert 1450 < last < 1500
    odometry = client.messages("ODOMETRY")
    assert odometry[-1].time_usec > 4.3e6
    assert all(math.isfinite(v) for m in odometry for v in (m.x, m.y, m.z, m.vx, m.vy, m.vz))
    x, y, _ = client.simulation.state.position_enu_m
    error_m = math.hypot(odometry[-1].y - x, odometry[-1].x - y)
    assert 0.1 < error_m < 5.0, "reckoned from accelerations"
    assert client.last("ESTIMATOR_STATUS").flags & _HORIZONTAL == 0
    client.run_until(5.0)
    x, y, _ = client.simulation.state.position_enu_m
    back = client.last("ODOMETRY")
    assert math.hypot(back.y - x, back.x - y) < 0.1
    assert back.reset_counter == 2, "position and velocity, level"
    assert client.last("ESTIMATOR_STATUS").flags & _HORIZONTAL == _HORIZONTAL
    assert client.last("LOCAL_POSITION_NED").time_boot_ms > 4900
    assert told(client) == [(1.5, "pos lost", 1.0), (4.5, "pos lost", 0.0)]


def test_a_mode_that_needs_a_position_descends_without_one_and_lands():
    client = px4({"fault": "position_loss", "at_s": 1.5})
    client.run_until(2.5)
    beat = client.simulation.autopilot.heartbeat
    assert (beat.custom_mode, beat.system_status) == (_DESCENDS, 5)
    assert "Failsafe activated\t" in client.texts()
    client.wait_for(lambda: not client.simulation.autopilot.armed, 16.0)
    assert client.simulation.state.on_ground


def test_position_mode_becomes_altitude_mode_without_a_position():
    pilot = {"fault": "mode", "at_s": 1.0, "mode": {"px4": "Position"}, "by": "rc"}
    client = px4(pilot, {"fault": "position_loss", "at_s": 1.5})
    client.run_until(1.4)
    assert client.simulation.autopilot.heartbeat.custom_mode == POSCTL
    client.run_until(4.0)
    beat = client.simulation.autopilot.heartbeat
    assert (beat.custom_mode, beat.system_status) == (0x00020000, 5)
    assert client.simulation.autopilot.intended_custom_mode == POSCTL
    assert client.simulation.state.position_enu_m[2] == pytest.approx(5.0, abs=0.2)


def test_guided_without_a_position_lands_after_a_second():
    client = copter({"fault": "position_loss", "at_s": 1.5})
    client.run_until(2.39)
    assert client.mode == _GUIDED
    assert client.last("EKF_STATUS_REPORT").flags == 167
    last = max(m.time_boot_ms for m in client.messages("LOCAL_POSITION_NED"))
    assert 1460 < last < 1520
    client.run_until(2.7)
    assert (client.mode, client.copter.heartbeat.system_status) == (_LAND, 5)
    assert {"EKF variance", "EKF Failsafe: changed to LAND Mode"} <= set(client.texts())
    client.run_until(6.4)
    assert client.simulation.state.position_enu_m[2] > 4.8, "it waits for four seconds"
    client.run_until(9.0)
    assert client.simulation.state.position_enu_m[2] < 4.2


@pytest.mark.parametrize(("action", "mode"), [(0, _GUIDED), (2, _ALT_HOLD)])
def test_what_an_estimator_without_position_brings_is_a_parameter(action, mode):
    client = copter({"fault": "position_loss", "at_s": 1.2}, parameters={"FS_EKF_ACTION": action})
    client.run_until(2.6)
    assert client.mode == mode


def test_a_loss_of_half_a_second_changes_no_mode_of_ardupilot():
    client = copter({"fault": "position_loss", "at_s": 1.5, "lasts_s": 0.5})
    client.run_until(3.5)
    assert (client.mode, client.copter.heartbeat.system_status) == (_GUIDED, 4)
    assert "EKF3 IMU0 is using GPS" in client.texts()
    assert not any("lane" in text for text in client.texts())
    assert client.last("EKF_STATUS_REPORT").flags == 831


@pytest.mark.parametrize("stamps", ["running", "frozen"])
@pytest.mark.parametrize("fly", [px4, copter], ids=["px4", "ardupilot"])
def test_frozen_telemetry_repeats_itself_and_all_else_goes_on(fly, stamps):
    fault = {"fault": "frozen_telemetry", "at_s": 1.5, "lasts_s": 0.5, "stamps": stamps}
    client = fly(fault)
    client.run_until(1.99)
    frozen = [
        (m.x, m.y, m.z, m.vx, m.vy, m.vz, m.time_boot_ms)
        for arrived_s, m in client.received("LOCAL_POSITION_NED")
        if arrived_s > 1.545
    ]
    assert len(frozen) > 10
    assert len({state[:6] for state in frozen}) == 1, "though noise never repeats itself"
    assert len({stamp for *_, stamp in frozen}) == (1 if stamps == "frozen" else len(frozen))
    attitudes = {
        m.q1 for arrived_s, m in client.received("ATTITUDE_QUATERNION") if arrived_s > 1.545
    }
    assert len(attitudes) == 1
    beats = [arrived_s for arrived_s, _ in client.received("HEARTBEAT")]
    client.run_until(3.2)
    assert client.received("HEARTBEAT")[-1][0] > beats[-1]
    again = {m.x for arrived_s, m in client.received("LOCAL_POSITION_NED") if arrived_s > 2.1}
    assert len(again) > 10
    assert told(client) == [(1.5, "frozen", 1.0), (2.0, "frozen", 0.0)]


def test_a_vehicle_flies_by_what_it_knows_not_by_what_it_tells():
    client = px4({"fault": "frozen_telemetry", "at_s": 1.2, "lasts_s": 5.0})
    client.run_until(1.5)
    client.command(192, -1.0, 1.0, 0.0, math.nan, math.nan, math.nan, 489.4 + 7.0)  # climb
    client.run_until(6.0)
    assert client.simulation.state.position_enu_m[2] > 6.0
    assert client.last("LOCAL_POSITION_NED").z == pytest.approx(-5.0, abs=0.1)
