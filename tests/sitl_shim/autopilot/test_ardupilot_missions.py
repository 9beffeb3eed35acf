"""Missions on the ArduPilot flavour: home is item 0, MISSION_START lets it leave the ground."""

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
    announce,
    asked,
    do,
    download,
    item,
    results,
    upload,
)
from tests.sitl_shim.mavlink.shim_client import ARM, SET_MODE, ShimClient

_START, _CHANGE_SPEED, _REPOSITION, _SET_CURRENT = 300, 178, 192, 224
_AUTO, _GUIDED = 3, 4


def _booted() -> ShimClient:
    client = ShimClient(ShimOptions(autopilot="ardupilot", boot_scale=0.05, seed=1))
    client.run_until(6.0)
    return client


def _armed(client: ShimClient) -> None:
    client.command(SET_MODE, 1, _GUIDED)
    client.run(0.5)
    client.command(ARM, 1)
    client.run(0.2)
    assert client.simulation.autopilot.armed


def _flying(height_m: float = 8.0) -> ShimClient:
    client = _booted()
    _armed(client)
    client.command(22, 0, 0, 0, 0, 0, 0, height_m)
    client.wait_for(lambda: client.simulation.state.position_enu_m[2] > height_m - 0.3, 20.0)
    return client


def _mode(client: ShimClient) -> int:
    return int(client.simulation.autopilot.heartbeat.custom_mode)


def _near(client: ShimClient, *point: float, within_m: float = 2.3) -> bool:
    return math.dist(client.simulation.state.position_enu_m[: len(point)], point) < within_m


def _reached(client: ShimClient) -> list[int]:
    return [m.seq for m in client.messages("MISSION_ITEM_REACHED")]


def _square(client: ShimClient) -> list[Any]:
    return [
        item(client, 0, WAYPOINT, frame=0),
        item(client, 1, TAKEOFF, up_m=5.0),
        item(client, 2, WAYPOINT, 9.0, 0.0, 5.0),
        item(client, 3, WAYPOINT, 9.0, 6.0, 6.0),
        item(client, 4, LAND, 0.0, 6.0, 0.0),
    ]


def test_a_mission_takes_off_flies_its_waypoints_lands_and_disarms() -> None:
    client = _booted()
    assert upload(client, _square(client)) == 0
    _armed(client)
    client.command(_START, 0, 0)
    client.run(0.2)
    assert client.acks(_START) == [0]
    assert _mode(client) == _AUTO
    client.wait_for(lambda: _near(client, 9.0, 0.0, 5.0), 30.0)
    client.wait_for(lambda: _near(client, 9.0, 6.0, 6.0), 20.0)
    client.wait_for(lambda: not client.simulation.autopilot.armed, 60.0)
    assert _near(client, 0.0, 6.0, within_m=1.0)
    client.run(0.2)
    assert _reached(client) == [1, 2, 3, 4]
    assert [m.seq for m in client.messages("MISSION_CURRENT")][-1] == 4
    said = client.texts()
    assert [text for text in said if text.startswith("Mission:")] == [
        "Mission: 1 Takeoff",
        "Mission: 2 WP",
        "Mission: 3 WP",
        "Mission: 4 Land",
    ]
    assert "Reached command #2" in said


def test_without_mission_start_it_stays_on_the_ground() -> None:
    client = _booted()
    upload(client, _square(client))
    _armed(client)
    client.command(SET_MODE, 1, _AUTO)
    client.run(6.0)
    assert _mode(client) == _AUTO
    assert client.simulation.autopilot.landed_state == 1


def test_auto_needs_a_mission() -> None:
    client = _booted()
    client.command(SET_MODE, 1, _AUTO)
    client.command(_START, 0, 0)
    client.run(0.2)
    assert client.acks(SET_MODE) == [4]
    assert client.acks(_START) == [4]
    assert "Mode change to AUTO failed: init failed" in client.texts()


def test_from_the_ground_it_needs_a_take_off() -> None:
    client = _booted()
    home, _, *rest = _square(client)
    for seq, each in enumerate(rest, 1):
        each.seq = seq
    upload(client, [home, *rest])
    _armed(client)
    client.command(_START, 0, 0)
    client.run(0.2)
    assert client.acks(_START) == [4]
    assert "Mode change to AUTO failed: Missing Takeoff Cmd" in client.texts()


def test_a_mission_joined_in_the_air_is_flown_to_its_end_and_held_there() -> None:
    client = _flying()
    upload(client, [item(client, 0, WAYPOINT, frame=0), item(client, 1, WAYPOINT, 9.0, 5.0, 8.0)])
    client.command(SET_MODE, 1, _AUTO)
    client.run(12.0)
    assert _mode(client) == _AUTO
    assert _near(client, 9.0, 5.0, 8.0, within_m=0.5)


def test_a_mission_that_returns_lands_at_home() -> None:
    client = _booted()
    home, takeoff, waypoint, *_ = _square(client)
    upload(client, [home, takeoff, waypoint, do(3, RETURN)])
    client.simulation.autopilot.parameters.set("RTL_ALT", 600.0)
    _armed(client)
    client.command(_START, 0, 0)
    client.wait_for(lambda: 2 in _reached(client), 40.0)
    client.wait_for(lambda: not client.simulation.autopilot.armed, 90.0)
    assert _near(client, 0.0, 0.0, within_m=1.0)


def test_speed_and_current_item_can_be_commanded() -> None:
    client = _flying()
    far = [item(client, n, WAYPOINT, 0.0, 40.0 * n, 8.0) for n in range(3)]
    upload(client, far)
    client.command(_SET_CURRENT, 2)
    client.command(SET_MODE, 1, _AUTO)
    client.run(0.3)
    client.command(_CHANGE_SPEED, 1, 2.0)
    client.run(12.0)
    assert client.acks(_SET_CURRENT) == [0]
    assert client.acks(_CHANGE_SPEED) == [0]
    assert client.last("MISSION_CURRENT").seq == 2
    assert client.simulation.state.velocity_enu_m_s[1] == pytest.approx(2.0, abs=0.15)


def test_a_reposition_flies_there_in_guided() -> None:
    client = _flying()
    goal = item(client, 0, WAYPOINT, 6.0, 4.0)
    client.send(
        dialect.MAVLink_command_int_message(
            1, 1, 6, _REPOSITION, 0, 0, -1, 1, 0, 0, goal.x, goal.y, 10.0
        )
    )
    client.run(12.0)
    assert client.acks(_REPOSITION) == [0]
    assert _near(client, 6.0, 4.0, 10.0, within_m=0.4)


# --- the protocol, where it differs ---


def test_item_0_is_home_whatever_is_written_to_it() -> None:
    client = _booted()
    sent = _square(client)
    sent[0].x += 5_000_000
    assert upload(client, sent) == 0
    got = download(client)
    home = client.simulation.origin
    assert len(got) == 5
    assert got[0].x * 1e-7 == pytest.approx(home.latitude_deg, abs=1e-5)
    assert [m.command for m in got[1:]] == [m.command for m in sent[1:]]


def test_items_can_be_asked_for_in_any_order() -> None:
    client = _booted()
    upload(client, _square(client))
    client.forget()
    for seq in (3, 1, 9):
        client.send(dialect.MAVLink_mission_request_int_message(1, 1, seq, 0))
    client.run(0.1)
    assert [m.seq for m in client.messages("MISSION_ITEM_INT")] == [3, 1]
    assert results(client) == [13]


def test_an_item_out_of_turn_is_an_error() -> None:
    client = _booted()
    announce(client, 3)
    client.send(item(client, 2, WAYPOINT))
    client.run(0.1)
    assert results(client) == [13]
    assert asked(client) == [0]


def test_an_upload_that_stops_is_cancelled_after_eight_seconds() -> None:
    client = _booted()
    announce(client, 3)
    client.run(9.0)
    assert len(asked(client)) == 8
    assert results(client) == [15]
    assert "Mission upload timeout" in client.texts()
