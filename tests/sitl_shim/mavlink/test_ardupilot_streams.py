"""What the ArduPilot flavour streams and answers, as ArduCopter 4.7-dev was recorded."""

import math
from collections import Counter

import numpy as np
import pytest

from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.mavlink.wire import dialect
from sitl_shim.simulation import ShimOptions
from tests.sitl_shim.mavlink.shim_client import ShimClient

_SET_INTERVAL, _GET_INTERVAL, _REQUEST = 511, 510, 512
_POSITION, _QUATERNION, _ODOMETRY, _ESTIMATOR = 32, 31, 331, 230


def _client(**options: object) -> ShimClient:
    settings = {"vehicle": "arducopter", "seed": 1, "boot_scale": 0.1, **options}
    return ShimClient(ShimOptions(autopilot="ardupilot", **settings))  # type: ignore[arg-type]


@pytest.fixture
def ready() -> ShimClient:
    client = _client()
    client.run_until(5.0)
    client.forget()
    return client


def test_a_fresh_link_carries_heartbeats_texts_and_timesync_alone() -> None:
    client = _client(truth=False)
    client.run_until(0.5)
    client.heartbeat()  # texts go to whoever has spoken
    client.run_until(25.0)
    seen = Counter(message.get_type() for _, message in client.inbox())
    announced = {"GPS_GLOBAL_ORIGIN", "HOME_POSITION"}
    assert set(seen) - announced == {"HEARTBEAT", "STATUSTEXT", "TIMESYNC"}
    assert seen["HEARTBEAT"] in (24, 25)
    assert seen["TIMESYNC"] == 2


def test_the_truth_is_streamed_all_the_same(ready: ShimClient) -> None:
    ready.run(1.0)
    assert len(ready.messages("ODOMETRY", component=240)) == pytest.approx(100, abs=2)


def test_texts_go_to_every_link_on_which_somebody_has_spoken() -> None:
    options = ShimOptions(autopilot="ardupilot", vehicle="arducopter", boot_scale=0.1)
    client = ShimClient(options, (LinkKind.ONBOARD, LinkKind.GROUND_STATION, LinkKind.ONBOARD))
    client.run_until(0.5)
    client.heartbeat(link=0)
    client.heartbeat(link=1)
    client.run_until(5.0)
    assert client.texts(0) == client.texts(1) != []
    assert client.texts(2) == []


@pytest.mark.parametrize("interval_us", [10_000, 20_000, 5_000])
def test_intervals_are_kept_exactly(ready: ShimClient, interval_us: int) -> None:
    ready.set_interval(_POSITION, interval_us)
    ready.run(10.0)
    assert ready.acks(_SET_INTERVAL) == [0]
    times = [m.time_boot_ms for m in ready.messages("LOCAL_POSITION_NED")]
    assert len(times) == pytest.approx(10e6 / interval_us, abs=6)
    assert max(np.diff(times)) <= interval_us / 1000 + 4


def test_arrivals_come_in_small_bursts(ready: ShimClient) -> None:
    ready.set_interval(_POSITION, 10_000)
    ready.run(20.0)
    late = [t - m.time_boot_ms / 1e3 for t, m in ready.received("LOCAL_POSITION_NED")]
    assert np.std(late) == pytest.approx(0.0027, abs=0.0005)
    assert max(late) <= 0.0161
    assert min(late) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("message", "interval_us", "result"),
    [(_POSITION, 3_000, 0), (_POSITION, 2_500, 2), (_ODOMETRY, 20_000, 2), (_ESTIMATOR, 1e6, 2)],
)
def test_what_is_too_fast_or_not_there_is_denied(
    ready: ShimClient, message: int, interval_us: float, result: int
) -> None:
    ready.set_interval(message, interval_us)
    ready.run(0.1)
    assert ready.acks(_SET_INTERVAL) == [result]
    unknown = message in (_ODOMETRY, _ESTIMATOR)
    assert ready.texts() == ([f"No ap_message for mavlink id ({message})"] if unknown else [])


def test_positions_are_acknowledged_and_silent_until_there_are_any() -> None:
    client = _client(boot_scale=0.5)
    client.run_until(5.0)
    for message in (_POSITION, _QUATERNION):
        client.set_interval(message, 20_000)
    client.run_until(15.0)
    assert client.acks(_SET_INTERVAL) == [0, 0]
    assert client.messages("LOCAL_POSITION_NED") == []
    assert len(client.messages("ATTITUDE_QUATERNION")) > 400
    client.run_until(22.0)
    assert client.simulation.autopilot.estimator.position_known
    assert client.messages("LOCAL_POSITION_NED") != []


def test_legacy_stream_requests_start_and_stop_groups(ready: ShimClient) -> None:
    def request(stream: int, rate_hz: int, start: int) -> list[str]:
        ready.send(dialect.MAVLink_request_data_stream_message(1, 1, stream, rate_hz, start))
        ready.run(0.3)
        ready.forget()
        ready.run(2.0)
        seen = Counter(message.get_type() for _, message in ready.inbox())
        return sorted(name for name, count in seen.items() if count >= 7)

    truth = ["DEBUG_VECT", "ODOMETRY"]
    assert request(6, 4, 1) == sorted([*truth, "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"])
    assert request(6, 4, 0) == truth
    everything = request(0, 4, 1)
    assert {"ATTITUDE", "VFR_HUD", "SYS_STATUS", "EKF_STATUS_REPORT", "RAW_IMU"} <= set(everything)
    assert "ATTITUDE_QUATERNION" not in everything  # never in the legacy streams
    assert request(0, 4, 0) == truth


def test_the_version_comes_after_its_acknowledgement(ready: ShimClient) -> None:
    ready.command(_REQUEST, 148)
    ready.run(0.1)
    names = [m.get_type() for _, m in ready.inbox() if m.get_srcComponent() == 1]
    first = [name for name in names if name in ("COMMAND_ACK", "AUTOPILOT_VERSION")]
    assert first == ["COMMAND_ACK", "AUTOPILOT_VERSION"]
    version = ready.last("AUTOPILOT_VERSION")
    assert (version.capabilities, version.flight_sw_version) == (64495, 0x04070000 | 0)


def test_a_message_that_is_not_there_cannot_be_requested(ready: ShimClient) -> None:
    ready.command(_REQUEST, 331)
    ready.command(31999)
    ready.run(0.1)
    assert (ready.acks(_REQUEST), ready.acks(31999)) == ([4], [3])


def test_intervals_are_told(ready: ShimClient) -> None:
    ready.set_interval(_QUATERNION, 20_900)
    ready.command(_GET_INTERVAL, _QUATERNION)
    ready.run(0.1)
    assert ready.last("MESSAGE_INTERVAL").interval_us == 20_000  # whole milliseconds


def test_messages_are_filled_as_ardupilot_does(ready: ShimClient) -> None:
    for message in (105, 242, 245, 24, 36, 164, 193):
        ready.set_interval(message, 100_000)
    ready.run(0.5)
    assert abs(ready.last("HIGHRES_IMU").xmag) > 1e3  # in wrong units
    assert all(math.isnan(part) for part in ready.last("HOME_POSITION").q)
    assert ready.last("EXTENDED_SYS_STATE").vtol_state == 3
    assert ready.last("GPS_RAW_INT").fix_type == 6
    assert ready.last("GPS_RAW_INT").lat == pytest.approx(-353632610, abs=100)
    servos = ready.last("SERVO_OUTPUT_RAW")
    assert (servos.servo1_raw, servos.servo5_raw) == (1000, 0)
    assert ready.last("SIMSTATE").lat == pytest.approx(-353632610, abs=100)
    assert ready.last("EKF_STATUS_REPORT").flags == 0x33F
