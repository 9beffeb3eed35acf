"""Take-off, landing, holding and returning of ArduCopter."""

import math
from itertools import pairwise

import pytest

from tests.sitl_shim.autopilot.copter_client import (
    AIR,
    ALT_HOLD,
    BRAKE,
    GROUND,
    GUIDED,
    LAND,
    LANDING,
    LOITER,
    RTL,
    STABILIZE,
    TAKING_OFF,
    CopterClient,
    grounded,
    hovering,
    tilted,
)
from tests.sitl_shim.mavlink.shim_client import LAND as LAND_COMMAND
from tests.sitl_shim.mavlink.shim_client import RETURN, TAKEOFF


def _taken_off(height_m: float = 3.0, vehicle: str = "arducopter") -> CopterClient:
    client = grounded(vehicle)
    client.ready()
    client.arm()
    client.command(TAKEOFF, 0, 0, 0, 0, 0, 0, height_m)
    return client


def _height(client: CopterClient) -> float:
    return client.simulation.state.position_enu_m[2]


def test_a_takeoff_to_three_metres_goes_as_measured() -> None:
    client = _taken_off()
    begin_s = client.time_s
    off_s = client.wait_for(lambda: _height(client) > 0.02, 6.0) - begin_s
    assert off_s == pytest.approx(3.55, abs=0.3)  # 3.7 s were measured
    assert client.copter.landed_state == TAKING_OFF
    near_s = client.wait_for(lambda: _height(client) > 2.85, 6.0) - begin_s
    assert near_s == pytest.approx(6.5, abs=0.5)
    client.wait_for(lambda: client.copter.landed_state == AIR, 2.0)
    highest = 0.0
    for _ in range(200):
        client.run(0.02)
        highest = max(highest, _height(client))
    assert highest < 3.12
    assert _height(client) == pytest.approx(3.0, abs=0.06)
    assert client.copter.heartbeat.base_mode == 217
    assert client.copter.heartbeat.system_status == 4


def test_the_heading_jumps_once_in_flight_and_the_vehicle_does_not() -> None:
    client = _taken_off()
    client.set_interval(31, 10_000)
    client.run(12.0)
    yaws = [
        math.degrees(math.atan2(2 * (m.q1 * m.q4 + m.q2 * m.q3), 1 - 2 * (m.q3**2 + m.q4**2)))
        for m in client.messages("ATTITUDE_QUATERNION")
    ]
    steps = [b - a for a, b in pairwise(yaws)]
    jumps = [step for step in steps if abs(step) > 1.0]
    assert len(jumps) == 1
    assert jumps[0] == pytest.approx(-2.44, abs=0.1)
    aligned = [t for t, m in client.received("STATUSTEXT") if "in-flight yaw" in m.text]
    assert len(aligned) == 2
    assert abs(client.heading_deg - 90.0) < 1.0


def test_landing_sinks_at_half_a_metre_per_second_and_disarms() -> None:
    client = _taken_off()
    client.run(10.0)
    client.command(LAND_COMMAND)
    client.run(2.0)
    assert client.mode == LAND
    assert client.copter.landed_state == LANDING
    assert client.simulation.state.velocity_enu_m_s[2] == pytest.approx(-0.5, abs=0.08)
    touched_s = client.wait_for(lambda: client.simulation.state.on_ground, 8.0)
    client.wait_for(lambda: client.copter.landed_state == GROUND, 3.0)
    disarmed_s = client.wait_for(lambda: not client.copter.armed, 3.0)
    assert 1.3 <= disarmed_s - touched_s <= 2.4
    assert client.copter.heartbeat.base_mode == 89
    assert client.copter.heartbeat.system_status == 3


def test_the_hover_throttle_is_learned_and_a_change_of_something_else_does_not_undo_it() -> None:
    client = hovering()
    client.choose(BRAKE)
    client.run(30.0)
    learned = client.copter.parameters["MOT_THST_HOVER"]
    assert learned == pytest.approx(0.366, abs=0.004)  # 0.39 at first
    client.copter.parameters.set("GUID_TIMEOUT", 1.0)
    client.run(1.0)
    assert client.copter.parameters["MOT_THST_HOVER"] == pytest.approx(learned, abs=0.001)
    client.copter.parameters.set("MOT_THST_HOVER", 0.30)
    client.run(1.0)
    assert client.copter.parameters["MOT_THST_HOVER"] == pytest.approx(0.306, abs=0.004)


def test_the_heading_is_turned_on_command() -> None:
    client = hovering()
    client.command(115, 0.0, 0, 0, 0)
    client.run(3.0)
    assert client.acks(115) == [0]
    assert client.heading_deg == pytest.approx(0.0, abs=2.0)
    client.command(115, 30.0, 0, -1, 1)
    client.run(3.0)
    assert client.heading_deg == pytest.approx(-30.0, abs=2.0)


def test_a_landing_from_high_up_hurries_down_to_ten_metres() -> None:
    client = hovering()
    client.choose(LAND)
    client.run(5.0)
    assert client.simulation.state.velocity_enu_m_s[2] == pytest.approx(-1.5, abs=0.1)
    client.wait_for(lambda: _height(client) < 8.0, 20.0)
    assert client.simulation.state.velocity_enu_m_s[2] == pytest.approx(-0.5, abs=0.1)


def test_brake_stops_and_stays() -> None:
    client = hovering()
    stop = client.every(0.02, lambda: client.climb(0.0, tilted(pitch_deg=-10.0)))
    client.run(2.0)
    stop()
    assert math.hypot(*client.simulation.state.velocity_enu_m_s[:2]) > 2.0
    client.choose(BRAKE)
    client.run(6.0)
    assert math.hypot(*client.simulation.state.velocity_enu_m_s) < 0.1
    x, y, z = client.simulation.state.position_enu_m
    client.run(5.0)
    assert math.dist((x, y, z), client.simulation.state.position_enu_m) < 0.2
    assert client.copter.heartbeat.base_mode == 217


def test_loiter_keeps_its_place_and_sinks_with_the_throttle_stick_down() -> None:
    client = hovering()
    client.choose(LOITER)
    client.run(3.0)
    assert math.hypot(*client.simulation.state.position_enu_m[:2]) < 0.3
    assert client.simulation.state.velocity_enu_m_s[2] == pytest.approx(-2.5, abs=0.2)


def test_altitude_hold_sinks_and_drifts() -> None:
    client = hovering()
    client.choose(ALT_HOLD)
    client.run(3.0)
    assert client.simulation.state.velocity_enu_m_s[2] == pytest.approx(-2.5, abs=0.2)
    assert client.tilt_deg < 1.0


def test_stabilize_with_the_throttle_stick_down_falls() -> None:
    client = hovering()
    client.choose(STABILIZE)
    client.run(1.5)
    assert client.simulation.state.velocity_enu_m_s[2] < -7.0


def test_return_climbs_goes_home_waits_and_lands() -> None:
    client = _taken_off()
    client.run(9.0)
    stop = client.every(0.02, lambda: client.climb(0.0, tilted(pitch_deg=-8.0)))
    client.run(4.0)
    stop()
    away_m = math.hypot(*client.simulation.state.position_enu_m[:2])
    assert away_m > 6.0
    client.command(RETURN)
    client.run(0.1)
    assert client.mode == RTL
    client.wait_for(lambda: _height(client) > 14.0, 12.0)
    client.wait_for(lambda: not client.copter.armed, 60.0)
    assert math.hypot(*client.simulation.state.position_enu_m[:2]) < 0.5


def test_guided_entered_again_stops() -> None:
    client = hovering()
    stop = client.every(0.02, lambda: client.climb(0.0, tilted(roll_deg=10.0)))
    client.run(2.0)
    stop()
    client.choose(BRAKE)
    client.choose(GUIDED)
    client.run(5.0)
    assert math.hypot(*client.simulation.state.velocity_enu_m_s) < 0.1


def test_losing_the_ground_station_does_nothing_unless_asked() -> None:
    client = hovering()
    stop = client.every(1.0, lambda: _beat(client))
    client.run(3.0)
    stop()
    client.run(10.0)
    assert client.mode == GUIDED


@pytest.mark.parametrize(("action", "mode"), [(1, RTL), (5, LAND), (7, BRAKE)])
def test_losing_the_ground_station_does_what_fs_gcs_enable_says(action: int, mode: int) -> None:
    client = hovering(parameters={"FS_GCS_ENABLE": action, "FS_GCS_TIMEOUT": 2.0})
    client.run(5.0)
    assert client.mode == GUIDED  # a station that was never heard is not lost
    stop = client.every(1.0, lambda: _beat(client))
    client.run(3.0)
    stop()
    lost_s = client.wait_for(lambda: client.mode == mode, 4.0)
    client.run(0.1)
    assert "GCS Failsafe" in client.texts()
    assert client.copter.heartbeat.system_status == 5
    _beat(client)
    client.run(0.1)
    assert "GCS Failsafe Cleared" in client.texts()
    assert lost_s > 0.0


def _beat(client: CopterClient) -> None:
    """A heartbeat of system 255, which is the ground station by default."""
    client.send_bytes(client.station.pack(client.station_heartbeat))
