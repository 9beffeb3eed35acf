"""The companion's process is killed in flight: what the autopilot does, and what is left."""

import math

import pytest

from tests.process_faults.harness import (
    ACTIVE,
    FAILSAFE,
    GUIDED,
    LAND,
    PX4_OFFBOARD,
    TILT_LIMIT_DEG,
    assert_logs_reach,
    mavlogdump,
)

pytestmark = [pytest.mark.realtime, pytest.mark.faults, pytest.mark.timeout(150)]


def test_px4_takes_over_within_its_second_after_kill_9(tracking):
    vehicle, companion = tracking("px4")
    vehicle.wait(1.0)
    assert vehicle.mode == PX4_OFFBOARD
    companion.kill()
    killed_s = vehicle.clock_s
    vehicle.wait_until(lambda: vehicle.said("Failsafe activated"))
    # PX4 stretches this second by the speed of a simulation.
    assert 0.9 < (vehicle.said("Failsafe activated")[0] - killed_s) / vehicle.speed < 1.3
    vehicle.wait_until(lambda: vehicle.modes[-1][2] == FAILSAFE)
    vehicle.wait_until(lambda: not vehicle.armed)
    assert (PX4_OFFBOARD, ACTIVE) not in vehicle.modes_after(killed_s)
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert vehicle.touched_down_at_m_s() < 1.5
    assert_logs_reach(companion, killed_s)
    assert any("SET_ATTITUDE_TARGET" in line for line in mavlogdump(companion.tlog)[-200:])
    assert not (companion.folder / "result.json").exists()


def test_ardupilot_lands_after_kill_9_as_fix_sets_it(tracking):
    vehicle, companion = tracking("ardupilot", "--fix", parameters={"FS_GCS_TIMEOUT": 3})
    vehicle.wait(1.0)
    companion.kill()
    killed_s = vehicle.clock_s
    landing_s = vehicle.wait_until(lambda: vehicle.mode == LAND)
    # Three seconds without a heartbeat, the last of which was up to one of ours old.
    assert 0.9 < landing_s - killed_s < 4.5
    vehicle.wait_until(lambda: not vehicle.armed)
    assert vehicle.worst_tilt_deg < TILT_LIMIT_DEG
    assert vehicle.touched_down_at_m_s() < 1.5
    assert_logs_reach(companion, killed_s)
    # What was set for the flight can still be set back.
    assert list(companion.folder.glob("*restore*"))


def test_ardupilot_drifts_after_kill_9_where_nothing_is_set(tracking):
    """Nothing covers this: `companion check` warns of it, `--fix` mends it."""
    vehicle, companion = tracking("ardupilot")
    vehicle.wait(0.8)
    companion.kill()
    killed_s, place_m = vehicle.clock_s, vehicle.position_m
    vehicle.wait(7.0)
    assert [mode for _, mode, _ in vehicle.modes][-1] == GUIDED
    assert vehicle.armed
    assert [text for time_s, text in vehicle.texts if time_s > killed_s] == []
    levelled = [v for t, _, v in vehicle.track if t > killed_s + 4.5]
    assert all(abs(v[2]) < 0.3 for v in levelled), "no climb"
    assert math.dist(vehicle.position_m, place_m) > 0.3, "nothing holds it in its place"
    assert "GUID_TIMEOUT" in companion.told()
    assert_logs_reach(companion, killed_s)
