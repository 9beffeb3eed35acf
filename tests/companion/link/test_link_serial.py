import asyncio
import contextlib
import os
import tty

import pytest

from companion.link import serial_port
from companion.link.link import LinkError
from companion.link.make import make_link
from companion.link.url import parse_link_url
from tests.companion.link.sockets import Heard, until


class Autopilot:
    """The other end of a serial line, with a device by a name of its own."""

    def __init__(self, folder):
        self.path = folder / "ttyVehicle"
        self.plug_in()

    def plug_in(self):
        self.fd, self.device = os.openpty()
        tty.setraw(self.device)
        os.set_blocking(self.fd, False)
        self.path.symlink_to(os.ttyname(self.device))

    def unplug(self):
        self.path.unlink()
        os.close(self.fd)
        os.close(self.device)

    def received(self):
        try:
            return os.read(self.fd, 65536)
        except BlockingIOError:
            return b""

    async def hears(self, wanted):
        data = b""

        def came():
            nonlocal data
            data += self.received()
            return wanted in data

        await until(came)


@pytest.fixture
def autopilot(tmp_path):
    made = Autopilot(tmp_path)
    yield made
    with contextlib.suppress(OSError):
        made.unplug()


@contextlib.asynccontextmanager
async def opened(autopilot, baud=921600):
    link = make_link(parse_link_url(f"serial://{autopilot.path}:{baud}"), lambda data: True)
    heard = Heard(link)
    try:
        await link.open()
        yield link, heard
    finally:
        link.close()


async def test_bytes_go_both_ways_untouched(autopilot):
    every_byte = bytes(range(256))
    async with opened(autopilot) as (link, heard):
        link.send(every_byte)
        os.write(autopilot.fd, every_byte)
        await autopilot.hears(every_byte)
        await until(lambda: heard.data == every_byte)

        assert heard.changes == [""]
        assert link.description == f"serial://{autopilot.path}:921600"
        assert not link.datagrams


async def test_an_unplugged_device_is_opened_again_when_it_is_back(autopilot):
    async with opened(autopilot) as (link, heard):
        autopilot.unplug()
        await until(lambda: "No such file" in link.down_because)
        link.send(b"lost")
        assert link.counters.unsent_packets == 1

        autopilot.plug_in()
        await until(lambda: not link.down_because)
        link.send(b"again")
        await autopilot.hears(b"again")

        assert heard.changes[0] == heard.changes[-1] == ""
        assert link.counters.connections == 2


async def test_a_line_that_takes_nothing_neither_blocks_nor_piles_up(autopilot, monkeypatch):
    monkeypatch.setattr(serial_port, "BLOCKED_AFTER_S", 1e9)
    async with opened(autopilot) as (link, _):
        for _ in range(3000):
            link.send(bytes(280))  # nobody reads at the other end
        assert link.counters.unsent_packets > 1000
        assert link._waiting() < 20_000

        await until(lambda: not autopilot.received() and not link._rest)
        link.send(b"fresh")
        await autopilot.hears(b"fresh")


async def test_what_waited_for_too_long_is_not_sent_any_more(autopilot, monkeypatch):
    monkeypatch.setattr(serial_port, "BLOCKED_AFTER_S", 0.1)
    async with opened(autopilot) as (link, _):
        while not link._rest:
            link.send(b"stale" * 50)

        def gone():
            link.send(b"stale" * 50)
            return not link._rest

        await until(gone)


async def test_a_slow_line_lets_less_wait():
    slow, fast = (
        make_link(parse_link_url(f"serial:///dev/ttyX:{baud}"), lambda data: True)
        for baud in (57_600, 921_600)
    )
    assert slow._congestion.limit_bytes == 576
    assert fast._congestion.limit_bytes == 9216


async def test_only_one_may_have_the_port(autopilot):
    async with opened(autopilot):
        with pytest.raises(LinkError, match=r"another program has .*ttyVehicle.*fuser"):
            async with opened(autopilot):
                pass
    async with opened(autopilot):
        pass  # it is free again


async def test_a_device_that_is_not_there_is_explained(tmp_path):
    link = make_link(parse_link_url(f"serial://{tmp_path}/none:57600"), lambda data: True)
    with pytest.raises(LinkError, match=r"there is no device .*/none.*by-id"):
        await link.open()


async def test_a_file_is_no_serial_port(tmp_path):
    (tmp_path / "file").write_text("")
    link = make_link(parse_link_url(f"serial://{tmp_path}/file:57600"), lambda data: True)
    with pytest.raises(LinkError, match="is no serial port"):
        await link.open()


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (PermissionError(13, "Permission denied"), "dialout"),
        (OSError(16, "Device or resource busy"), "another program has"),
        (ValueError("Failed to set custom baud rate"), "does not take 57600 bits per second"),
        (OSError(5, "Input/output error"), "Input/output error"),
    ],
)
async def test_what_the_system_refuses_is_explained(monkeypatch, error, said):
    def refuse(*_, **__):
        raise error

    monkeypatch.setattr(serial_port.serial, "Serial", refuse)
    link = make_link(parse_link_url("serial:///dev/ttyX:57600"), lambda data: True)
    with pytest.raises(LinkError, match=said):
        await link.open()


async def test_a_closed_link_stays_closed(autopilot):
    async with opened(autopilot) as (link, _):
        pass
    link.close()
    link.send(b"late")
    os.write(autopilot.fd, b"late")
    await asyncio.sleep(0)

    assert link.counters.unsent_packets == 1
    assert link.counters.bytes_in == 0
