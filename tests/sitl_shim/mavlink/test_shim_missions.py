"""The mission protocol, as PX4 speaks it: up, down, out of turn, given up."""

from itertools import pairwise
from typing import Any

import pytest

from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import Packer, dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.mission_client import (
    LAND,
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
from tests.sitl_shim.mavlink.shim_client import ShimClient

_BOTH = (LinkKind.ONBOARD, LinkKind.GROUND_STATION)
_ERROR, _UNSUPPORTED_FRAME, _UNSUPPORTED, _NO_SPACE = 1, 2, 3, 4


@pytest.fixture
def client() -> ShimClient:
    shim_client = ShimClient(ShimOptions(seed=1), _BOTH)
    shim_client.every(1.0, lambda: shim_client.heartbeat(6))
    shim_client.run_until(2.1)
    shim_client.forget()
    return shim_client


def _mission(client: ShimClient) -> list[Any]:
    return [
        item(client, 0, TAKEOFF, up_m=5.0, parameters=(0.0, 0.0, 0.0, 0.0)),
        item(client, 1, WAYPOINT, 3.0, 0.0, 5.0),
        do(2, 178, 1.0, 2.0, -1.0),
        item(client, 3, LAND, 3.0, 4.0),
    ]


def test_what_goes_up_comes_down(client: ShimClient) -> None:
    sent = _mission(client)
    assert upload(client, sent) == 0
    got = download(client)
    assert [(m.seq, m.command, m.x, m.y, m.z) for m in got] == [
        (m.seq, m.command, m.x, m.y, m.z) for m in sent
    ]
    assert [m.frame for m in got] == [6, 6, 2, 6]
    assert [m.current for m in got] == [1, 0, 0, 0]
    assert (got[2].param1, got[2].param2) == (1.0, 2.0)


def test_the_older_messages_carry_the_same(client: ShimClient) -> None:
    upload(client, _mission(client))
    client.send(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    client.send(dialect.MAVLink_mission_request_message(1, 1, 0, 0))
    client.send(dialect.MAVLink_mission_request_message(1, 1, 1, 0))
    client.run(0.1)
    first, second = client.messages("MISSION_ITEM")
    assert (first.command, first.frame, second.z) == (TAKEOFF, 3, 5.0)
    assert second.x == pytest.approx(47.3977418, abs=1e-5)
    assert second.y == pytest.approx(8.5456336, abs=1e-5)


def test_whoever_speaks_the_older_messages_is_asked_in_them(client: ShimClient) -> None:
    client.send(dialect.MAVLink_mission_request_message(1, 1, 0, 0))
    announce(client, 2)
    for seq in range(2):
        assert client.messages("MISSION_REQUEST")[-1].seq == seq
        client.send(
            dialect.MAVLink_mission_item_message(
                1, 1, seq, 3, WAYPOINT, 0, 1, 0, 0, 0, 0, 47.3977 + seq * 1e-4, 8.5456, 7.0, 0
            )
        )
        client.run(0.1)
    assert results(client) == [0]
    assert [m.x for m in download(client)] == pytest.approx([473977000, 473978000], abs=60)


def test_fence_and_rally_points_are_kept_apart_from_the_mission(client: ShimClient) -> None:
    upload(client, _mission(client))
    fence = [
        item(client, n, 5001, 9.0 * n, 5.0, parameters=(3.0, 0.0, 0.0, 0.0), mission_type=1)
        for n in range(3)
    ]
    assert upload(client, fence, 1) == 0
    assert upload(client, [item(client, 0, 5100, 4.0, mission_type=2)], 2) == 0
    assert [len(download(client, kind)) for kind in (0, 1, 2)] == [4, 3, 1]
    assert download(client, 1)[0].param1 == 3.0
    client.send(dialect.MAVLink_mission_clear_all_message(1, 1, 1))
    client.run(0.1)
    assert [len(download(client, kind)) for kind in (0, 1, 2)] == [4, 0, 1]


def test_everything_is_cleared_at_once(client: ShimClient) -> None:
    upload(client, _mission(client))
    upload(client, [item(client, 0, 5100, 4.0, mission_type=2)], 2)
    client.forget()
    client.send(dialect.MAVLink_mission_clear_all_message(1, 1, 255))
    client.run(0.1)
    assert results(client) == [0]
    assert [len(download(client, kind)) for kind in (0, 1, 2)] == [0, 0, 0]


def test_an_item_that_does_not_come_is_asked_for_every_quarter_second_for_five(
    client: ShimClient,
) -> None:
    announce(client, 3)
    client.run(7.0)
    times = [time_s for time_s, _ in client.received("MISSION_REQUEST_INT")]
    gaps = [b - a for a, b in pairwise(times)]
    assert 0.25 <= min(gaps) <= max(gaps) <= 0.27
    assert 4.7 <= times[-1] - times[0] <= 5.0
    assert client.texts() == ["Operation timeout\t"]
    assert results(client) == []
    assert upload(client, _mission(client)) == 0


def test_a_download_that_is_not_acknowledged_keeps_the_next_upload_off(
    client: ShimClient,
) -> None:
    client.send(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    client.run(0.1)
    assert client.last("MISSION_COUNT").count == 0
    announce(client, 1)
    assert results(client) == [_ERROR]
    client.send(dialect.MAVLink_mission_ack_message(1, 1, 0, 0))
    client.run(0.1)
    assert upload(client, _mission(client)) == 0


def test_a_request_out_of_turn_ends_the_download(client: ShimClient) -> None:
    upload(client, _mission(client))
    client.forget()
    client.send(dialect.MAVLink_mission_request_list_message(1, 1, 0))
    for seq in (0, 1, 1, 3):
        client.send(dialect.MAVLink_mission_request_int_message(1, 1, seq, 0))
    client.run(0.1)
    assert [m.seq for m in client.messages("MISSION_ITEM_INT")] == [0, 1, 1]
    assert results(client) == [_ERROR]
    assert client.texts() == ["WPM: REJ. CMD: Req. WP was unexpected\t"]


def test_items_out_of_turn_are_ignored_and_repeated_ones_forgiven(client: ShimClient) -> None:
    sent = _mission(client)
    announce(client, 4)
    for each in (sent[1], sent[0], sent[0], sent[3], sent[1], sent[2], sent[3]):
        client.send(each)
        client.run(0.05)
    assert results(client) == [0]
    client.send(sent[3])
    client.run(0.1)
    assert results(client) == [0, 0]
    assert len(download(client)) == 4


@pytest.mark.parametrize(
    ("change", "result"),
    [
        ({"command": 31999}, _UNSUPPORTED),
        ({"command": 5001}, _UNSUPPORTED),
        ({"frame": 1}, _UNSUPPORTED_FRAME),
        ({"x": 950_000_000}, 10),
        ({"y": -1_900_000_000}, 11),
        ({"z": float("inf")}, 12),
    ],
)
def test_an_item_that_makes_no_sense_ends_the_upload(
    client: ShimClient, change: dict[str, Any], result: int
) -> None:
    upload(client, _mission(client))
    bad = item(client, 0, WAYPOINT, 3.0, 0.0, 5.0)
    for name, value in change.items():
        setattr(bad, name, value)
    assert upload(client, [bad]) == result
    assert len(download(client)) == 4, "the old mission stays"


def test_a_mission_that_is_too_long_is_refused(client: ShimClient) -> None:
    announce(client, 2001)
    announce(client, 65, 1)
    announce(client, 1, 7)
    assert results(client) == [_NO_SPACE] * 3
    assert asked(client) == []


def test_an_item_that_nobody_asked_for_is_an_error(client: ShimClient) -> None:
    client.send(item(client, 2, WAYPOINT, 3.0, 0.0, 5.0))
    client.run(0.1)
    assert results(client) == [_ERROR]


def test_two_links_do_not_upload_at_once(client: ShimClient) -> None:
    announce(client, 2)
    client.send(dialect.MAVLink_mission_count_message(1, 1, 2, 0), link=1)
    client.run(0.1)
    assert results(client, link=1) == [_ERROR]
    assert asked(client)[-1] == 0


def test_somebody_else_cannot_take_part(client: ShimClient) -> None:
    announce(client, 1)
    stranger = Packer(1, 77)
    client.send_bytes(stranger.pack(item(client, 0, WAYPOINT, 9.0, 0.0, 9.0)))
    client.run(0.05)
    assert [(m.target_component, m.type) for m in client.messages("MISSION_ACK")] == [(77, 14)]
    client.send(item(client, 0, WAYPOINT, 3.0, 0.0, 5.0))
    client.run(0.05)
    assert client.messages("MISSION_ACK")[-1].type == 0


def test_an_upload_can_be_cancelled(client: ShimClient) -> None:
    announce(client, 3)
    client.send(dialect.MAVLink_mission_ack_message(1, 1, 15, 0))
    client.run(0.1)
    client.forget()
    client.run(1.0)
    assert asked(client) == []


def test_the_current_item_is_told_every_second(client: ShimClient) -> None:
    client.run(3.0)
    told = client.messages("MISSION_CURRENT")
    assert [(m.seq, m.total, m.mission_state, m.mission_mode) for m in told] == [
        (0, 65535, 1, 2)
    ] * 3
    upload(client, _mission(client))
    client.send(dialect.MAVLink_mission_set_current_message(1, 1, 2))
    client.send(dialect.MAVLink_mission_set_current_message(1, 1, 9))
    client.run(1.1)
    now = client.last("MISSION_CURRENT")
    assert (now.seq, now.total, now.mission_state, now.mission_mode) == (2, 4, 2, 2)
    assert client.texts()[-1] == "WPM: WP CURR CMD: Not in list\t"
