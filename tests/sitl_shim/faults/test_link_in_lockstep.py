"""Faults of the link around a whole shim on a virtual clock."""

import asyncio
import contextlib
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import pytest

from sitl_shim.lockstep import LockstepShim, ShimOptions
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from tests.sitl_shim.server.virtual_loop import run_virtually

_TRUTH = 240
_ODOMETRY = 331
_BAD = (
    "{link: [{loss: 0.3, delay_s: 0.02, jitter_s: 0.015, duplicate: 0.05, reorder: 0.05,"
    " corrupt: 0.05}]}"
)
_FIRST_PING_S = 0.502
"""Between two ticks."""
Received = list[tuple[float, bytes]]


def _is_truth(data: bytes) -> bool:
    return data[6] == _TRUTH


def _messages(received: Received, name: str) -> list[tuple[float, Any]]:
    """Those that are whole, each datagram for itself."""
    return [
        (time_s, message)
        for time_s, data in received
        for message in Parser().parse(data)
        if message.get_type() == name
    ]


async def _listen(options: ShimOptions, duration_s: float, pings_hz: float) -> Received:
    """Send numbered PINGs, and give every datagram with the simulated time of its arrival."""
    loop = asyncio.get_running_loop()
    begin_s = loop.time()
    received: Received = []

    def receive(data: bytes) -> None:
        received.append(((loop.time() - begin_s) * options.speed, data))

    shim = LockstepShim(options, receive)
    packer = Packer(1, 191)
    running = asyncio.ensure_future(shim.run())
    await asyncio.sleep(_FIRST_PING_S / options.speed)
    for number in range(int((duration_s - 1.0) * pings_hz)):
        shim.receive(packer.pack(dialect.MAVLink_ping_message(0, number, 0, 0)))
        await asyncio.sleep(1.0 / pings_hz / options.speed)
    await asyncio.sleep(0.5 / options.speed)
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running
    return received


def _heard(
    faults: str | None,
    *,
    seed: int = 1,
    speed: float = 1.0,
    duration_s: float = 4.0,
    vehicle: str = "bebop2",
) -> Received:
    options = ShimOptions(seed=seed, faults=faults, speed=speed, vehicle=vehicle)
    return run_virtually(_listen(options, duration_s, 50.0))


def _answers(received: Received) -> Sequence[tuple[float, int]]:
    return [
        (time_s, message.seq)
        for time_s, message in _messages(received, "PING")
        if message.target_system
    ]


def test_faults_that_do_nothing_yet_leave_every_byte_and_time_as_it_was() -> None:
    bare = _heard(None)
    waiting = _heard("{link: [{from_s: 3.0, loss: 0.5}, {since: setpoints, pause: true}]}")
    before = [entry for entry in bare if entry[0] < 3.0]
    assert waiting[: len(before)] == before
    assert len(waiting) < len(bare)


@pytest.mark.parametrize("vehicle", ["bebop2", "sih_quadx"])  # which has no delay of its own
def test_a_fault_of_nothing_changes_nothing(vehicle: str) -> None:
    assert _heard("{link: [{}, {}]}", vehicle=vehicle) == _heard(None, vehicle=vehicle)


def test_the_truth_passes_untouched_whatever_the_link_does() -> None:
    bare, hurt = _heard(None), _heard(_BAD)
    truth = [entry for entry in bare if _is_truth(entry[1])]
    assert len(truth) > 100
    assert [entry for entry in hurt if _is_truth(entry[1])] == truth
    assert len(hurt) < 0.9 * len(bare)


def test_the_same_seed_gives_the_same_faults_and_another_one_others() -> None:
    first = _heard(_BAD)
    assert _heard(_BAD) == first
    assert _heard(_BAD, seed=2) != first


def test_all_times_are_simulated_ones_at_any_speed() -> None:
    faults = "{link: [{delay_s: 0.05, jitter_s: 0.01}, {from_s: 2.0, until_s: 3.0, pause: true}]}"
    heard = _messages(_heard(faults, speed=4.0), "ATTITUDE")
    late_s = [time_s - message.time_boot_ms / 1e3 for time_s, message in heard]
    # 15 ms are the vehicle's own.
    assert 0.055 - 1e-6 <= min(late_s) < 0.057
    assert 0.073 < max(late_s) <= 0.075 + 1e-6
    assert not [time_s for time_s, _ in heard if 2.0 <= time_s < 3.0]
    assert [time_s for time_s, _ in heard if 3.0 <= time_s < 3.1]


def test_delays_of_both_ways_add_up() -> None:
    def round_trip_s(faults: str | None) -> float:
        return (
            min(time_s for time_s, number in _answers(_heard(faults)) if number == 0)
            - _FIRST_PING_S
        )

    bare_s = round_trip_s(None)
    assert round_trip_s("{link: [{way: telemetry, delay_s: 0.05}]}") == pytest.approx(bare_s + 0.05)
    assert round_trip_s("{link: [{way: setpoints, delay_s: 0.05}]}") == pytest.approx(
        bare_s + 0.05, abs=0.004
    )
    assert round_trip_s("{link: [{delay_s: 0.02}]}") == pytest.approx(bare_s + 0.04)


def test_a_pause_of_the_way_there_keeps_the_vehicle_talking_but_deaf() -> None:
    bare = _heard(None)
    deaf = _heard("{link: [{way: setpoints, from_s: 1.0, until_s: 2.0, pause: true}]}")
    assert [number for _, number in _answers(bare)] == list(range(150))
    assert [number for _, number in _answers(deaf)] == [*range(25), *range(75, 150)]
    assert len(_messages(deaf, "ATTITUDE")) == len(_messages(bare, "ATTITUDE"))


def test_a_pause_of_the_way_back_leaves_the_truth_alone() -> None:
    mute = _heard("{link: [{way: telemetry, from_s: 1.0, until_s: 2.0, pause: true}]}")
    meanwhile = [data for time_s, data in mute if 1.0 <= time_s < 2.0]
    assert len(meanwhile) > 50
    assert all(map(_is_truth, meanwhile))
    assert _messages([entry for entry in mute if entry[0] > 2.0], "ATTITUDE")


def test_losses_of_both_ways_multiply() -> None:
    answered = {number for _, number in _answers(_heard("{link: [{loss: 0.3}]}", duration_s=9.0))}
    assert len(answered) / 400 == pytest.approx(0.49, abs=0.12)


def test_what_is_damaged_on_the_way_there_is_no_message() -> None:
    hurt = _answers(_heard("{link: [{way: setpoints, corrupt: 1.0}]}"))
    assert len(hurt) < 5  # of 150; a change of the sender leaves a message


def test_babble_is_heard_at_the_client_and_hurts_no_answer_of_the_vehicle() -> None:
    faults = "{link: [{from_s: 1.0, until_s: 2.0, babble_packets_s: 5000}]}"
    heard = _heard(faults)
    babble = [time_s for time_s, _ in _messages(heard, "DEBUG")]
    assert len(babble) == pytest.approx(5000, abs=5)
    assert 1.0 <= min(babble) <= max(babble) < 2.0
    # But for the babble, and for the truth, which says when it began.
    rest = [(time_s, data) for time_s, data in heard if data[6] not in (25, _TRUTH)]
    assert rest == [entry for entry in _heard(None) if not _is_truth(entry[1])]


# --- since setpoints, in the air ---


async def _fly_by_setpoints(faults: str) -> tuple[Received, float]:
    """Fly level by setpoints from the air, and give when OFFBOARD was asked for."""
    loop = asyncio.get_running_loop()
    received: Received = []
    options = ShimOptions(seed=1, faults=faults, airborne_at_enu_m=(0.0, 0.0, 5.0))
    shim = LockstepShim(options, lambda data: received.append((loop.time(), data)))
    packer = Packer(1, 191)
    running = asyncio.ensure_future(shim.run())
    asked_s = 0.0
    for step in range(200):
        if step == 50:
            asked_s = loop.time()
            mode = dialect.MAVLink_command_long_message(1, 1, 176, 0, 1, 6, 0, 0, 0, 0, 0)
            shim.receive(packer.pack(mode))
        level = dialect.MAVLink_set_attitude_target_message(
            0, 1, 1, 7, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0, 0.5
        )
        shim.receive(packer.pack(level))
        await asyncio.sleep(0.02)
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running
    return received, asked_s


def test_a_fault_since_setpoints_begins_so_long_after_they_are_first_followed() -> None:
    faults = "{link: [{way: telemetry, since: setpoints, from_s: 1.0, until_s: 1.5, pause: true}]}"
    received, asked_s = run_virtually(_fly_by_setpoints(faults))
    times_s = [time_s for time_s, data in received if not _is_truth(data)]
    gaps = [(earlier, later) for earlier, later in pairwise(times_s) if later - earlier > 0.2]
    ((begin_s, end_s),) = gaps
    assert begin_s - asked_s == pytest.approx(1.0, abs=0.1)
    assert end_s - begin_s == pytest.approx(0.5, abs=0.03)
