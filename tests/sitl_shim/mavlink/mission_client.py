"""The client's side of the mission protocol, for tests."""

from typing import Any

from sitl_shim.mavlink.geodesy import global_position
from sitl_shim.mavlink.wire import dialect
from tests.sitl_shim.mavlink.shim_client import NAN, ShimClient

WAYPOINT, RETURN, LAND, TAKEOFF = 16, 20, 21, 22
RELATIVE, NO_PLACE = 3, 2


def item(
    client: ShimClient,
    seq: int,
    command: int,
    east_m: float = 0.0,
    north_m: float = 0.0,
    up_m: float = 0.0,
    *,
    parameters: tuple[float, float, float, float] = (0.0, 0.0, 0.0, NAN),
    frame: int = RELATIVE,
    mission_type: int = 0,
) -> Any:
    """MISSION_ITEM_INT of a point in the local frame."""
    latitude, longitude, _ = global_position(client.simulation.origin, (east_m, north_m, 0.0))
    x, y = (latitude, longitude) if frame != NO_PLACE else (0, 0)
    return dialect.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, int(seq == 0), 1, *parameters, x, y, up_m, mission_type
    )


def do(seq: int, command: int, *parameters: float) -> Any:
    """MISSION_ITEM_INT of a command without a place."""
    filled = [*parameters, *([0.0] * (4 - len(parameters)))]
    return dialect.MAVLink_mission_item_int_message(
        1, 1, seq, NO_PLACE, command, int(seq == 0), 1, *filled, 0, 0, 0.0, 0
    )


def asked(client: ShimClient, link: int = 0) -> list[int]:
    """Items that were asked for, with MISSION_REQUEST_INT."""
    return [m.seq for m in client.messages("MISSION_REQUEST_INT", link=link)]


def results(client: ShimClient, link: int = 0) -> list[int]:
    return [m.type for m in client.messages("MISSION_ACK", link=link)]


def announce(client: ShimClient, count: int, mission_type: int = 0) -> None:
    client.send(dialect.MAVLink_mission_count_message(1, 1, count, mission_type))
    client.run(0.1)


def upload(client: ShimClient, items: list[Any], mission_type: int = 0) -> int:
    """Upload; returns the MAV_MISSION_RESULT."""
    client.forget()
    announce(client, len(items), mission_type)
    for each in items:
        assert asked(client)[-1] == each.seq
        client.send(each)
        client.run(0.1)
    (result,) = results(client)
    return result


def download(client: ShimClient, mission_type: int = 0) -> list[Any]:
    """Download, and acknowledge."""
    client.forget()
    client.send(dialect.MAVLink_mission_request_list_message(1, 1, mission_type))
    client.run(0.1)
    count = client.last("MISSION_COUNT").count
    for seq in range(count):
        client.send(dialect.MAVLink_mission_request_int_message(1, 1, seq, mission_type))
        client.run(0.1)
    client.send(dialect.MAVLink_mission_ack_message(1, 1, 0, mission_type))
    client.run(0.1)
    return client.messages("MISSION_ITEM_INT")
