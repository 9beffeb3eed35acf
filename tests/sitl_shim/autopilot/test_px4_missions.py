"""Missions that were uploaded are flown, in simulated time."""

import math
from typing import Any

import pytest

from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.mission_client import (
    LAND,
    RETURN,
    TAKEOFF,
    WAYPOINT,
    do,
    item,
    upload,
)
from tests.sitl_shim.mavlink.shim_client import (
    ARM,
    AUTO_LOITER,
    SET_MODE,
    ShimClient,
    airborne,
)

AUTO_MISSION = 0x04040000
_START = 300
_CHANGE_SPEED, _JUMP = 178, 177


def _booted() -> ShimClient:
    client = ShimClient(ShimOptions(seed=1))
    client.every(1.0, lambda: client.heartbeat(6))
    client.boot()
    return client


def _mode(client: ShimClient) -> int:
    return int(client.simulation.autopilot.heartbeat.custom_mode)


def _position(client: ShimClient) -> tuple[float, float, float]:
    position: tuple[float, float, float] = client.simulation.state.position_enu_m
    return position


def _near(client: ShimClient, *point: float, within_m: float = 2.3) -> bool:
    return math.dist(_position(client)[: len(point)], point) < within_m


def _reached(client: ShimClient) -> list[int]:
    return [m.seq for m in client.messages("MISSION_ITEM_REACHED")]


def _square(client: ShimClient) -> list[Any]:
    return [
        item(client, 0, TAKEOFF, up_m=5.0),
        item(client, 1, WAYPOINT, 8.0, 0.0, 5.0),
        item(client, 2, WAYPOINT, 8.0, 6.0, 6.0),
        item(client, 3, LAND, 0.0, 6.0, 0.0),
    ]


def test_a_mission_takes_off_flies_its_waypoints_lands_and_disarms() -> None:
    client = _booted()
    assert upload(client, _square(client)) == 0
    client.command(_START, 0, 0)
    client.run(0.1)
    assert client.acks(_START) == [0]
    assert client.simulation.autopilot.armed
    assert _mode(client) == AUTO_MISSION
    client.wait_for(lambda: _near(client, 8.0, 0.0, 5.0), 30.0)
    client.wait_for(lambda: _near(client, 8.0, 6.0, 6.0), 15.0)
    client.wait_for(lambda: not client.simulation.autopilot.armed, 40.0)
    assert _near(client, 0.0, 6.0, within_m=0.7)
    client.run(1.1)
    assert sorted(set(_reached(client))) == [0, 1, 2, 3]
    assert client.last("MISSION_CURRENT").mission_state == 5
    assert "Landing detected\t" in client.texts()


def test_the_states_of_landing_follow_the_items() -> None:
    client = _booted()
    upload(client, _square(client))
    client.set_interval(245, 20_000)
    client.command(_START, 0, 0)
    client.wait_for(lambda: client.simulation.autopilot.armed, 1.0)
    client.wait_for(lambda: not client.simulation.autopilot.armed, 80.0)
    states = [m.landed_state for m in client.messages("EXTENDED_SYS_STATE")]
    changes = [s for s, before in zip(states, [None, *states], strict=False) if s != before]
    assert changes == [1, 3, 2, 4, 1]


def test_without_a_mission_there_is_no_mission_mode() -> None:
    client = airborne()
    client.set_mode(AUTO_MISSION)
    client.command(_START, 0, 0)
    client.run(0.3)
    assert client.acks(SET_MODE) == [0, 1]
    assert client.acks(_START) == [2]
    assert _mode(client) == AUTO_LOITER


def test_at_the_end_in_the_air_it_holds() -> None:
    client = airborne()
    upload(client, [item(client, 0, WAYPOINT, 5.0, 5.0, 30.0)])
    client.set_mode(AUTO_MISSION)
    client.run(1.0)
    client.wait_for(lambda: _mode(client) == AUTO_LOITER, 20.0)
    client.run(5.0)
    assert _near(client, 5.0, 5.0, within_m=0.5)
    assert client.simulation.autopilot.armed


def test_a_mission_without_a_take_off_climbs_first() -> None:
    client = _booted()
    upload(client, [item(client, 0, WAYPOINT, 6.0, 0.0, 4.0)])
    client.set_mode(AUTO_MISSION)
    client.command(ARM, 1)
    client.wait_for(lambda: _position(client)[2] > 2.0, 20.0)
    assert math.hypot(*_position(client)[:2]) < 0.5
    client.wait_for(lambda: _mode(client) == AUTO_LOITER, 20.0)
    assert _near(client, 6.0, 0.0)


def test_a_waypoint_is_held_for_its_time() -> None:
    client = airborne()
    held = (4.0, 0.0, 0.0, math.nan)
    upload(
        client,
        [
            item(client, 0, WAYPOINT, 3.0, 0.0, 30.0, parameters=held),
            item(client, 1, WAYPOINT, 9.0, 0.0, 30.0),
        ],
    )
    client.set_mode(AUTO_MISSION)
    arrived = client.wait_for(lambda: _near(client, 3.0, 0.0, within_m=2.0), 10.0)
    left = client.wait_for(lambda: 0 in _reached(client), 10.0)
    assert left - arrived == pytest.approx(4.0, abs=0.3)


def test_the_heading_of_a_waypoint_is_flown() -> None:
    client = airborne()
    south = (3.0, 0.0, 0.0, 180.0)
    upload(client, [item(client, 0, WAYPOINT, 3.0, 0.0, 30.0, parameters=south)])
    client.set_mode(AUTO_MISSION)
    client.run(6.0)
    assert abs(client.last("ATTITUDE").yaw) == pytest.approx(math.pi, abs=0.1)


def test_the_speed_is_that_of_the_mission_or_of_a_later_command() -> None:
    client = airborne()
    speed = do(0, _CHANGE_SPEED, 1, 1.5, -1)
    upload(client, [speed, item(client, 1, WAYPOINT, 90.0, 0.0, 30.0)])
    client.set_mode(AUTO_MISSION)
    client.run(10.0)
    assert client.simulation.state.velocity_enu_m_s[0] == pytest.approx(1.5, abs=0.1)
    client.command(_CHANGE_SPEED, 1, 3.0, -1)
    client.run(10.0)
    assert client.acks(_CHANGE_SPEED) == [0]
    assert client.simulation.state.velocity_enu_m_s[0] == pytest.approx(3.0, abs=0.15)


def test_jumps_are_carried_out_as_often_as_they_say() -> None:
    client = airborne()
    upload(
        client,
        [
            item(client, 0, WAYPOINT, 2.0, 0.0, 30.0),
            item(client, 1, WAYPOINT, 10.0, 0.0, 30.0),
            item(client, 2, WAYPOINT, 5.0, 0.0, 30.0),
            do(3, _JUMP, 1, 2),
        ],
    )
    client.set_mode(AUTO_MISSION)
    client.run(1.0)
    client.wait_for(lambda: _mode(client) == AUTO_LOITER, 40.0)
    client.run(0.1)
    flown = [
        s
        for s, before in zip(_reached(client), [None, *_reached(client)], strict=False)
        if s != before
    ]
    assert [s for s in flown if s in (1, 2)] == [1, 2, 1, 2, 1, 2]


def test_set_current_leaves_items_out() -> None:
    client = _booted()
    upload(client, _square(client))
    client.send(dialect.MAVLink_mission_set_current_message(1, 1, 2))
    client.run(1.1)
    assert client.last("MISSION_CURRENT").seq == 2
    client.command(_START, -1, 0)
    client.wait_for(lambda: 2 in _reached(client), 40.0)
    assert 1 not in _reached(client)


def test_a_mission_that_returns_lands_at_home() -> None:
    client = _booted()
    upload(
        client,
        [
            item(client, 0, TAKEOFF, up_m=4.0),
            item(client, 1, WAYPOINT, 6.0, 0.0, 4.0),
            do(2, RETURN),
        ],
    )
    client.command(_START, 0, 0)
    client.wait_for(lambda: client.simulation.autopilot.armed, 1.0)
    client.wait_for(lambda: not client.simulation.autopilot.armed, 90.0)
    assert _near(client, 0.0, 0.0, within_m=1.0)


def test_a_mission_that_is_interrupted_goes_on_where_it_was() -> None:
    client = airborne()
    upload(client, [item(client, n, WAYPOINT, 8.0 * (n + 1), 0.0, 30.0) for n in range(3)])
    client.set_mode(AUTO_MISSION)
    client.wait_for(lambda: 0 in _reached(client), 15.0)
    client.set_mode(AUTO_LOITER)
    client.run(2.5)
    assert client.last("MISSION_CURRENT").mission_state == 4
    client.set_mode(AUTO_MISSION)
    client.wait_for(lambda: _mode(client) == AUTO_LOITER and 2 in _reached(client), 30.0)
    assert _near(client, 24.0, 0.0)


def test_clearing_the_mission_that_is_flown_holds() -> None:
    client = airborne()
    upload(client, [item(client, 0, WAYPOINT, 80.0, 0.0, 30.0)])
    client.set_mode(AUTO_MISSION)
    client.run(2.0)
    client.send(dialect.MAVLink_mission_clear_all_message(1, 1, 0))
    client.run(8.0)
    assert _mode(client) == AUTO_LOITER
    assert math.hypot(*client.simulation.state.velocity_enu_m_s[:2]) < 0.3
