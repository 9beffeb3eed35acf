"""The shim on a virtual clock: exact times, and the same bytes from the same seed."""

import asyncio
import contextlib
from pathlib import Path

import pytest

from sitl_shim.lockstep import LockstepShim, ShimOptions
from sitl_shim.mavlink.wire import Packer, Parser, dialect
from tests.sitl_shim.server.virtual_loop import run_virtually

_OPTIONS = {"vehicle": "bebop2", "scenario": "gusts"}
_LOAD = "name: load\nwinds: []\npayload: [{at_s: 8.0, mass_kg: 0.1}]\n"
Received = list[tuple[float, bytes]]


async def _fly(options: ShimOptions, duration_s: float) -> Received:
    """Arm, take off, and give every datagram with its time of arrival since boot."""
    loop = asyncio.get_running_loop()
    begin_s = loop.time()
    received: Received = []
    shim = LockstepShim(options, lambda data: received.append((loop.time() - begin_s, data)))
    packer = Packer(1, 191)
    running = asyncio.ensure_future(shim.run())
    await asyncio.sleep(5.0)
    for command in (400, 22):
        message = dialect.MAVLink_command_long_message(
            1, 1, command, 0, 1, 0, 0, 0, 0, 0, float("nan")
        )
        shim.receive(packer.pack(message))
    await asyncio.sleep(duration_s - 5.0)
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running
    count = len(received)
    await asyncio.sleep(0.5)
    assert len(received) == count  # silent once cancelled
    return received


def _flown(seed: int = 1, begin_s: float = 0.0, **options: object) -> Received:
    merged = ShimOptions(seed=seed, **{**_OPTIONS, **options})  # type: ignore[arg-type]
    return run_virtually(_fly(merged, 9.0), begin_s)


def test_the_same_seed_gives_the_same_bytes_at_the_same_times() -> None:
    first, second = _flown(seed=1), _flown(seed=1)
    assert first == second
    assert len(first) > 3000


def test_a_payload_changes_nothing_before_its_time_and_is_the_same_each_time(
    tmp_path: Path,
) -> None:
    path = tmp_path / "load.yaml"
    path.write_text(_LOAD)
    bare, loaded, again = _flown(scenario="calm"), _flown(scenario=path), _flown(scenario=path)
    assert loaded == again
    assert loaded != bare
    # What leaves at the very tick of 8 s arrives after the delay of 15 ms.
    before = [entry for entry in bare if entry[0] < 8.012]
    assert loaded[: len(before)] == before


def test_another_seed_gives_other_bytes() -> None:
    assert [data for _, data in _flown(seed=1)] != [data for _, data in _flown(seed=2)]


@pytest.mark.parametrize("begin_s", [0.1, 12345.678, 1e6])
def test_it_does_not_matter_when_the_clock_begins(begin_s: float) -> None:
    here, there = _flown(), _flown(begin_s=begin_s)
    assert [data for _, data in here] == [data for _, data in there]
    for (time_s, _), (other_s, _) in zip(here, there, strict=True):
        assert other_s == pytest.approx(time_s, abs=1e-5)


def test_each_datagram_holds_one_message_and_arrives_after_the_links_delay() -> None:
    for time_s, data in _flown()[::7]:
        assert len(data) == 12 + data[1], "one frame, and nothing else"
        for message in Parser().parse(data):  # which does not know all that PX4 sends
            if message.get_type() != "ATTITUDE":
                continue
            assert time_s - message.time_boot_ms / 1e3 == pytest.approx(0.015, abs=1e-6)


def test_speed_stretches_the_time_of_the_loop() -> None:
    slow = run_virtually(_fly(ShimOptions(speed=0.5), 6.0))
    (message,) = Parser().parse(
        [data for _, data in slow if data[7:10] == (30).to_bytes(3, "little")][-1]
    )
    assert message.time_boot_ms / 1e3 == pytest.approx(3.0, abs=0.03)


def test_an_unknown_vehicle_is_refused_before_anything_runs() -> None:
    with pytest.raises(ValueError, match="bebop9"):
        LockstepShim(ShimOptions(vehicle="bebop9"), lambda _: None)
