"""The parameter protocol over PX4's names; and that what is set acts."""

import inspect
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import sitl_shim
from sitl_shim.autopilot.ardupilot import parameters as copter_parameters
from sitl_shim.autopilot.px4 import parameters as px4_parameters
from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.services.parameter_messages import decode_value, encode_value
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.mission_client import WAYPOINT, item, upload
from tests.sitl_shim.mavlink.shim_client import ARM, ShimClient

_INT32, _REAL32, _UINT32 = 6, 9, 5


@pytest.fixture
def client() -> ShimClient:
    shim_client = ShimClient(ShimOptions(seed=1, airborne_at_enu_m=(0.0, 0.0, 30.0)))
    shim_client.run_until(0.6)
    shim_client.forget()  # what is told unasked
    return shim_client


def _read(client: ShimClient, name: str, index: int = -1) -> None:
    client.send(dialect.MAVLink_param_request_read_message(1, 1, name.encode(), index))
    client.run(0.1)


def _set(client: ShimClient, name: str, value: float, kind: int) -> None:
    client.send(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
    client.run(0.1)


def test_the_list_begins_with_the_hash_and_holds_each_parameter_once(client: ShimClient) -> None:
    client.send(dialect.MAVLink_param_request_list_message(1, 1))
    client.run(1.0)
    values = client.messages("PARAM_VALUE")
    assert (values[0].param_id, values[0].param_index, values[0].param_type) == (
        "_HASH_CHECK",
        65535,
        _UINT32,
    )
    rest = values[1:]
    assert [m.param_index for m in rest] == list(range(rest[0].param_count))
    names = [m.param_id for m in rest]
    assert names == sorted(set(names))
    assert {"MC_ROLL_P", "MPC_XY_P", "COM_OF_LOSS_T", "MIS_TAKEOFF_ALT"} <= set(names)


def test_a_parameter_is_read_by_name_or_by_index(client: ShimClient) -> None:
    _read(client, "MPC_XY_P")
    by_name = client.last("PARAM_VALUE")
    assert by_name.param_value == pytest.approx(0.95)
    assert by_name.param_type == _REAL32
    _read(client, "", by_name.param_index)
    assert client.last("PARAM_VALUE").param_id == "MPC_XY_P"


def test_integers_travel_bytewise(client: ShimClient) -> None:
    five = struct.unpack("<f", struct.pack("<i", 5))[0]
    _set(client, "COM_OBL_RC_ACT", five, _INT32)
    assert client.last("PARAM_VALUE").param_value == five
    assert client.simulation.autopilot.parameters["COM_OBL_RC_ACT"] == 5.0


@pytest.mark.parametrize(
    ("name", "value", "kind", "error"),
    [
        ("NO_SUCH", 1.0, _REAL32, 1),
        ("COM_OBL_RC_ACT", 5.0, _REAL32, 7),
        ("COM_OF_LOSS_T", -3.0, _REAL32, 2),
        ("MC_ROLL_P", float("nan"), _REAL32, 2),
    ],
)
def test_what_does_not_fit_is_a_param_error_and_changes_nothing(
    client: ShimClient, name: str, value: float, kind: int, error: int
) -> None:
    before = client.simulation.autopilot.parameters.hash()
    client.forget()
    _set(client, name, value, kind)
    refusal = client.last("PARAM_ERROR")
    assert (refusal.param_id, refusal.error) == (name, error)
    assert (refusal.target_system, refusal.target_component) == (1, 191)
    assert client.messages("PARAM_VALUE") == []
    assert client.simulation.autopilot.parameters.hash() == before


def test_an_unknown_name_or_index_is_a_param_error(client: ShimClient) -> None:
    _read(client, "NO_SUCH")
    _read(client, "", 5000)
    assert [m.error for m in client.messages("PARAM_ERROR")] == [1, 1]
    assert client.messages("PARAM_VALUE") == []


def test_a_change_is_told_on_every_link_and_changes_the_hash() -> None:
    client = ShimClient(ShimOptions(), (LinkKind.ONBOARD, LinkKind.GROUND_STATION))
    client.run_until(0.5)
    _read(client, "_HASH_CHECK")
    before = client.last("PARAM_VALUE").param_value
    _set(client, "MPC_XY_P", 1.0, _REAL32)
    assert client.last("PARAM_VALUE", link=1).param_value == 1.0
    _read(client, "_HASH_CHECK")
    assert client.last("PARAM_VALUE").param_value != before


def test_parameters_of_other_systems_are_none_of_its_business(client: ShimClient) -> None:
    client.send(dialect.MAVLink_param_set_message(2, 1, b"MPC_XY_P", 1.5, _REAL32))
    client.send(dialect.MAVLink_param_request_list_message(2, 1))
    client.run(0.2)
    assert client.messages("PARAM_VALUE") == []


@settings(deadline=None, derandomize=True)
@given(value=st.integers(-(2**20), 2**20))
def test_encoding_an_integer_loses_nothing(value: int) -> None:
    assert decode_value(encode_value(value, _INT32), _INT32) == value


def test_the_take_off_altitude_that_was_set_is_flown() -> None:
    client = ShimClient(ShimOptions(seed=1))
    client.boot()
    _set(client, "MIS_TAKEOFF_ALT", 4.0, _REAL32)
    client.command(ARM, 1)
    client.take_off()
    client.run(14.0)
    assert client.simulation.state.position_enu_m[2] == pytest.approx(4.0, abs=0.2)


def test_a_gain_that_was_set_acts_at_once() -> None:
    def tilt_after(gain: float) -> float:
        client = ShimClient(ShimOptions(seed=1, airborne_at_enu_m=(0.0, 0.0, 30.0)))
        client.run(0.5)
        _set(client, "MC_ROLL_P", gain, _REAL32)
        client.start_stream((0.7071, 0.0, 0.0, 0.7071), 0.49)
        client.run(0.5)
        client.set_mode(0x00060000)
        client.run(1.0)
        client.every(0.01, lambda: client.setpoint((0.7044, 0.0616, 0.0616, 0.7044), 0.49))
        client.run(0.25)
        return float(client.last("ATTITUDE").roll)

    assert tilt_after(8.0) > 1.3 * tilt_after(3.0)


def test_what_the_airframe_sets_is_told_unasked_while_booting() -> None:
    client = ShimClient(ShimOptions(vehicle="x500"))
    client.run_until(1.0)
    told = {m.param_id: m.param_value for m in client.messages("PARAM_VALUE")}
    assert told["THR_MDL_FAC"] == 1.0
    assert told["MPC_THR_HOVER"] == pytest.approx(0.57)
    assert len(told) < 30


@pytest.mark.parametrize(("speed", "time_out_s"), [(0.5, 1.0), (5.0, 5.0), (100.0, 60.0)])
def test_the_streams_time_out_stretches_with_the_speed(speed: float, time_out_s: float) -> None:
    client = ShimClient(ShimOptions(speed=speed))
    assert client.simulation.autopilot.parameters["COM_OF_LOSS_T"] == time_out_s


def test_a_change_is_told_on_its_own_link_again_and_only_if_it_is_one(client: ShimClient) -> None:
    _set(client, "MPC_XY_P", 1.0, _REAL32)
    assert [m.param_value for m in client.messages("PARAM_VALUE")] == [1.0, 1.0]
    client.forget()
    _set(client, "MPC_XY_P", 1.0, _REAL32)
    assert len(client.messages("PARAM_VALUE")) == 1


def test_the_list_is_as_long_as_px4s_and_as_quick(client: ShimClient) -> None:
    client.send(dialect.MAVLink_param_request_list_message(1, 1))
    client.run(1.2)
    received = client.received("PARAM_VALUE")
    assert len(received) >= 888
    assert 0.8 < received[-1][0] - received[0][0] < 1.0
    values = {m.param_id: m for _, m in received}
    assert values["SYS_AUTOSTART"].param_type == _INT32
    assert values["BAT1_V_CHARGED"].param_value == pytest.approx(4.05)


def test_what_clients_look_for_is_kept_though_it_does_nothing(client: ShimClient) -> None:
    _set(client, "COM_RC_IN_MODE", encode_value(4.0, _INT32), _INT32)
    _read(client, "COM_RC_IN_MODE")
    assert decode_value(client.last("PARAM_VALUE").param_value, _INT32) == 4.0


# --- ArduPilot ---


@pytest.fixture
def copter() -> ShimClient:
    client = ShimClient(ShimOptions(autopilot="ardupilot", boot_scale=0.05))
    client.run_until(3.0)
    client.forget()
    return client


def test_ardupilot_puts_the_value_of_an_integer_into_the_float_field(copter: ShimClient) -> None:
    _set(copter, "GUID_OPTIONS", 8.0, _REAL32)
    told = copter.messages("PARAM_VALUE")
    assert {(m.param_value, m.param_type, m.param_index) for m in told} == {(8.0, _INT32, 65535)}
    assert copter.simulation.autopilot.parameters["GUID_OPTIONS"] == 8.0


def test_ardupilot_says_nothing_of_what_it_does_not_know(copter: ShimClient) -> None:
    _read(copter, "NO_SUCH")
    _set(copter, "NO_SUCH", 1.0, _REAL32)
    _read(copter, "_HASH_CHECK")
    assert copter.messages("PARAM_ERROR") == copter.messages("PARAM_VALUE") == []


def test_ardupilots_list_has_no_hash_and_tells_places(copter: ShimClient) -> None:
    copter.send(dialect.MAVLink_param_request_list_message(1, 1))
    copter.run(1.0)
    values = copter.messages("PARAM_VALUE")
    assert [m.param_index for m in values] == list(range(values[0].param_count))
    assert "_HASH_CHECK" not in {m.param_id for m in values}


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_parameter_that_claims_an_effect_is_read_somewhere(flavour: str) -> None:
    package = Path(sitl_shim.__file__).parent
    source = "".join(
        path.read_text()
        for path in sorted(package.rglob("*.py"))
        if path.name != "parameters.py" or "autopilot" not in path.parts
    )
    source += inspect.getsource(px4_parameters.aiding_of)
    source += inspect.getsource(px4_parameters.scale_timeouts)
    definitions = {"px4": px4_parameters, "ardupilot": copter_parameters}[flavour].DEFINITIONS
    acting = [d.name for d in definitions if "without effect here" not in d.meaning]
    axes = ("_RAT_", "_ACCEL_", "_RATE_", "ROLL", "PITCH", "YAW")
    unread = [n for n in acting if n not in source and not any(axis in n for axis in axes)]

    assert len(acting) > 60
    assert unread == []


@pytest.mark.parametrize(("autopilot", "name"), [("px4", "MAV_SYS_ID"), ("ardupilot", "MAV_SYSID")])
def test_a_parameter_tells_the_system_id(autopilot: str, name: str) -> None:
    options = ShimOptions(autopilot=autopilot, boot_scale=0.02, system_id=7)
    assert Shim(options, (LinkKind.ONBOARD,)).simulation.autopilot.parameters[name] == 7.0


@pytest.mark.parametrize(
    ("autopilot", "name", "option"),
    [
        ("px4", "MAV_SYS_ID", "--system-id"),
        ("ardupilot", "MAV_SYSID", "--system-id"),
        ("ardupilot", "SIM_SPEEDUP", "--speed"),
    ],
)
def test_what_an_option_says_is_refused_as_a_parameter(
    autopilot: str, name: str, option: str
) -> None:
    with pytest.raises(ValueError, match=f"{name} .*{option}"):
        Shim(ShimOptions(autopilot=autopilot, parameters={name: 2.0}), (LinkKind.ONBOARD,))


def test_mis_total_follows_the_mission(copter: ShimClient) -> None:
    parameters = copter.simulation.autopilot.parameters
    assert parameters["MIS_TOTAL"] == 1.0
    assert upload(copter, [item(copter, seq, WAYPOINT, 5.0, 5.0, 5.0) for seq in range(4)]) == 0
    assert parameters["MIS_TOTAL"] == 4.0
    copter.send(dialect.MAVLink_mission_clear_all_message(1, 1, 0))
    copter.run(0.1)
    assert parameters["MIS_TOTAL"] == 1.0
