"""The relay between vehicle and client knows which setpoint answers which state."""

from pymavlink.dialects.v20 import all as dialect

from benchmarks.real_time.frames import (
    TAGS,
    sample_times_ms,
    setpoint_tags,
    setpoint_times_ms,
    tagged_thrust,
)
from benchmarks.real_time.relay import Seen


def odometry(time_usec: int, component: int = 1) -> bytes:
    zeros = [0.0] * 21
    packer = dialect.MAVLink(None, 1, component)
    message = dialect.MAVLink_odometry_message(
        time_usec, 1, 12, 1.0, 2.0, 3.0, [1.0, 0.0, 0.0, 0.0], *([0.5] * 6), zeros, zeros
    )
    return bytes(message.pack(packer))


def setpoint(time_ms: int, thrust: float, *, key: bytes | None = None) -> bytes:
    packer = dialect.MAVLink(None, 1, 191)
    if key is not None:
        packer.signing.secret_key = key
        packer.signing.sign_outgoing = True
    message = dialect.MAVLink_set_attitude_target_message(
        time_ms, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, thrust
    )
    return bytes(message.pack(packer))


def heartbeat() -> bytes:
    packer = dialect.MAVLink(None, 1, 1)
    return bytes(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3).pack(packer))


def test_a_state_is_known_by_its_time_among_other_messages() -> None:
    datagram = heartbeat() + odometry(12_344_000) + odometry(12_352_000)
    assert list(sample_times_ms(datagram)) == [12_344, 12_352]


def test_the_truth_of_a_simulator_is_no_state() -> None:
    assert list(sample_times_ms(odometry(12_344_000, component=240))) == []


def test_a_setpoint_says_which_state_it_answers_signed_or_not() -> None:
    datagram = setpoint(12_344, 0.4, key=bytes(32)) + setpoint(12_352, 0.4)
    assert list(setpoint_times_ms(datagram)) == [12_344, 12_352]


def test_a_thrust_tells_the_time_where_the_setpoint_does_not() -> None:
    times_ms = (0, 1, 12_344, 12_345, TAGS - 1, TAGS)
    datagram = b"".join(setpoint(0, tagged_thrust(1000 * time_ms)) for time_ms in times_ms)
    assert list(setpoint_tags(datagram)) == [time_ms % TAGS for time_ms in times_ms]


def test_a_cut_datagram_tells_nothing_wrong() -> None:
    whole = odometry(12_344_000)
    assert list(sample_times_ms(whole + whole[:9])) == [12_344]


def test_only_the_first_setpoint_for_a_state_counts() -> None:
    seen = Seen(lambda ms: ms)
    seen.sample(4, 1_000)
    seen.sample(12, 2_000)
    seen.setpoint(12, 2_700)
    seen.setpoint(12, 2_900)
    seen.setpoint(99, 3_000)
    assert seen.pairs == [(2_000, 700)]
    assert seen.samples == [1_000, 2_000]
    assert seen.repeated == 2
