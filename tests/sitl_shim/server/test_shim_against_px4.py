"""The shim, driven by what clients sent to a real PX4, answers as that PX4 did."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import AUTO_LOITER, ShimClient

_DATA = Path(__file__).parents[2] / "data" / "px4"
_FLIGHTS = {
    "stream_loss_hold": {"COM_OBL_RC_ACT": 5.0},
    "refusals_and_descent": {"COM_OBL_RC_ACT": 0.0},
    "mavsdk": {},
}

# A heartbeat may show a change a whole period late, here and there.
_HEARTBEAT_S = 1.1
# CURRENT_MODE comes every 2 s, until it is asked for at 10 Hz.
_CURRENT_MODE_S = 2.2
_ACK_S = 0.15
# Climb and descent take as long as vehicle and estimator let them.
_MOTION_S = 2.5


def _nan(value: float | None) -> float:
    return math.nan if value is None else value


def _replay(name: str) -> tuple[dict[str, Any], ShimClient]:
    flight = json.loads((_DATA / f"{name}.json").read_text())
    client = ShimClient(
        ShimOptions(vehicle="sih_quadx", seed=3, parameters=_FLIGHTS[name]), component=190
    )
    setpoint: list[Any] = []
    for time_s, kind, *fields in flight["client"]:
        client.run_until(math.floor(time_s * 250.0 - 1e-6) / 250.0)
        if kind == "COMMAND_LONG":
            command, parameters = fields
            client.command(command, *map(_nan, parameters))
        elif kind == "HEARTBEAT":
            client.heartbeat(fields[0])
        elif kind == "PARAM_SET":
            name_, value, type_ = fields
            client.send(dialect.MAVLink_param_set_message(1, 1, name_.encode(), value, type_))
        else:
            setpoint = fields or setpoint
            mask, q, rates, thrust = setpoint
            client.setpoint(q, thrust, mask=mask, rates=tuple(rates))
    client.run_until(flight["autopilot"][-1][0] + _MOTION_S)
    return flight, client


def _changes(received: list[tuple[float, Any]], *fields: str) -> list[tuple[float, list[Any]]]:
    changes: list[tuple[float, list[Any]]] = []
    for time_s, message in received:
        values = [getattr(message, field) for field in fields]
        if not changes or changes[-1][1] != values:
            changes.append((time_s, values))
    return changes


def _recorded(flight: dict[str, Any], kind: str) -> list[tuple[float, list[Any]]]:
    return [(row[0], row[2:]) for row in flight["autopilot"] if row[1] == kind]


@pytest.fixture(scope="module", params=list(_FLIGHTS))
def replayed(request: pytest.FixtureRequest) -> tuple[dict[str, Any], ShimClient]:
    return _replay(request.param)


def _assert_agree(
    ours: list[tuple[float, list[Any]]],
    theirs: list[tuple[float, list[Any]]],
    tolerance_s: float,
) -> None:
    assert [values for _, values in ours] == [values for _, values in theirs]
    for (our_s, values), (their_s, _) in zip(ours, theirs, strict=True):
        assert abs(our_s - their_s) <= tolerance_s, values


def test_heartbeats_show_the_same_modes_and_states(
    replayed: tuple[dict[str, Any], ShimClient],
) -> None:
    flight, client = replayed
    theirs = _recorded(flight, "HEARTBEAT")
    ours = _changes(client.received("HEARTBEAT"), "base_mode", "custom_mode", "system_status")
    _assert_agree(_from(ours, theirs), theirs, _HEARTBEAT_S + _MOTION_S)
    for (our_s, _), (their_s, values) in zip(_from(ours, theirs), theirs, strict=True):
        if values[0] not in (0x1D, 0x9D):  # not waiting for a climb or a descent
            assert abs(our_s - their_s) <= _HEARTBEAT_S


def _from(
    ours: list[tuple[float, list[Any]]], theirs: list[tuple[float, list[Any]]]
) -> list[tuple[float, list[Any]]]:
    """Ours from where the recording begins (one of them was cut)."""
    begin_s = theirs[0][0] - _HEARTBEAT_S
    return [row for row in ours if row[0] >= begin_s]


def test_commands_get_the_same_acknowledgements(
    replayed: tuple[dict[str, Any], ShimClient],
) -> None:
    flight, client = replayed
    ours = [(t, [m.command, m.result]) for t, m in client.received("COMMAND_ACK")]
    _assert_agree(ours, _recorded(flight, "COMMAND_ACK"), _ACK_S)


def test_current_mode_tells_what_flies_and_what_was_intended(
    replayed: tuple[dict[str, Any], ShimClient],
) -> None:
    flight, client = replayed
    theirs = _recorded(flight, "CURRENT_MODE")
    ours = _changes(client.received("CURRENT_MODE"), "custom_mode", "intended_custom_mode")
    remaining = iter(_from(ours, theirs))
    for time_s, values in theirs:
        # What PX4 told at its time, the shim tells within a period of the message, in order.
        ours_s = next(our_s for our_s, our_values in remaining if our_values == values)
        entered_by_climbing = values[0] == AUTO_LOITER
        limit_s = _CURRENT_MODE_S + (_MOTION_S if entered_by_climbing else 0.0)
        assert abs(ours_s - time_s) <= limit_s, values
    intended = {values[1] for _, values in theirs}
    assert {values[1] for _, values in ours} == intended


def test_landed_states_follow_each_other_alike(
    replayed: tuple[dict[str, Any], ShimClient],
) -> None:
    flight, client = replayed
    ours = _changes(client.received("EXTENDED_SYS_STATE"), "landed_state")
    theirs = _recorded(flight, "EXTENDED_SYS_STATE")
    assert [values for _, values in ours] == [values for _, values in theirs]
    for (our_s, _), (their_s, values) in zip(ours[1:], theirs[1:], strict=True):
        assert abs(our_s - their_s) <= _MOTION_S, values  # the first tells when one listened


def test_texts_are_the_same_word_for_word(
    replayed: tuple[dict[str, Any], ShimClient],
) -> None:
    flight, client = replayed
    assert client.texts() == [values[0] for _, values in _recorded(flight, "STATUSTEXT")]
