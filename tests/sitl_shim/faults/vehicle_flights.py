"""Vehicles in the air to whom something happens, and what is seen of it on the wire."""

import json
import math
from typing import Any

from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.autopilot.copter_client import CopterClient
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient

EAST = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""Level, nose to the east, FRD to NED: as a vehicle begins."""
HEIGHT_M = 5.0
COPTER_STREAMS = (
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION,
    dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT,
    dialect.MAVLINK_MSG_ID_SYS_STATUS,
)


def text_of(*faults: dict[str, Any], **parameters: dict[str, float]) -> str:
    """Faults of the vehicle, as the text of a file."""
    return json.dumps({"vehicle": faults, "parameters": parameters})


def options_of(autopilot: str, *faults: dict[str, Any], **more: Any) -> ShimOptions:
    settings: dict[str, Any] = {
        "vehicle": "x500" if autopilot == "px4" else "arducopter",
        "seed": 1,
        "airborne_at_enu_m": (0.0, 0.0, HEIGHT_M),
        "faults": text_of(*faults),
        **more,
    }
    return ShimOptions(autopilot=autopilot, **settings)


def px4(*faults: dict[str, Any], **more: Any) -> ShimClient:
    """Holding in the air, heard by a ground station."""
    client = ShimClient(options_of("px4", *faults, **more))
    client.run(0.5)
    client.every(1.0, lambda: client.heartbeat(6))
    return client


def px4_in_offboard(*faults: dict[str, Any], **more: Any) -> ShimClient:
    """Following level attitudes at hover thrust, since 1.0 s."""
    client = px4(*faults, **more)
    thrust = client.simulation.autopilot.parameters["MPC_THR_HOVER"]
    client.start_stream(EAST, thrust)
    client.run(0.4)
    client.set_mode(OFFBOARD)
    client.run_until(1.0)
    assert client.simulation.autopilot.heartbeat.custom_mode == OFFBOARD
    return client


def copter(*faults: dict[str, Any], **more: Any) -> CopterClient:
    """In GUIDED, following level attitudes without climbing, since 1.0 s."""
    client = CopterClient(options_of("ardupilot", *faults, **more))
    client.run(0.5)
    client.heartbeat()
    for message_id in COPTER_STREAMS:
        client.set_interval(message_id, 20_000)
    client.every(0.02, lambda: client.climb(0.0))
    client.run_until(1.0)
    return client


def told(client: ShimClient) -> list[tuple[float, str, float]]:
    """What the truth has told: time (to the ms), name, value; each once, in the order told."""
    messages = client.messages("NAMED_VALUE_FLOAT", component=TRUTH_COMPONENT_ID)
    found = [(m.time_boot_ms / 1e3, m.name, m.value) for m in messages]
    return list(dict.fromkeys(found))


def east_m(client: ShimClient) -> float:
    """True position."""
    return float(client.simulation.state.position_enu_m[0])
