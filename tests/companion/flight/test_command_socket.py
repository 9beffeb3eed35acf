"""Commands over the real local socket."""

import asyncio
import os
import stat
import subprocess
import sys

import pytest

from companion.flight.command_socket import (
    CommandServer,
    CommandSocketError,
    send_command,
    socket_folder,
)
from companion.flight.inbox import Inbox, PilotCommand


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "companion"


@pytest.fixture
async def server(folder):
    server = CommandServer(Inbox())
    await server.open()
    yield server
    await server.close()


def dead_pid():
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


async def test_every_command_reaches_the_inbox(folder):
    inbox = Inbox()
    server = CommandServer(inbox)
    await server.open()
    for command in PilotCommand:
        assert await send_command(command, None) == f"{command.value}: taken"
        assert await send_command(command, os.getpid()) == f"{command.value}: taken"
        assert [inbox.take(), inbox.take()] == [command, command]
    await server.close()
    assert list(folder.iterdir()) == []


async def test_only_the_owner_can_enter(folder):
    folder.mkdir(mode=0o777)
    folder.chmod(0o777)
    server = CommandServer(Inbox())
    await server.open()
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    await server.close()


async def test_a_folder_that_is_a_link_is_not_used(folder, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    folder.symlink_to(elsewhere)
    with pytest.raises(PermissionError, match="somebody else, or is a link"):
        await CommandServer(Inbox()).open()
    with pytest.raises(CommandSocketError, match="No flight is running"):
        await send_command(PilotCommand.LAND, None)


async def test_no_flight_is_an_error_that_says_so(folder):
    with pytest.raises(CommandSocketError, match="No flight is running under this user"):
        await send_command(PilotCommand.LAND, None)
    with pytest.raises(CommandSocketError, match="No flight with process id 17 is running"):
        await send_command(PilotCommand.LAND, 17)


async def test_sockets_of_dead_flights_are_passed_over_and_cleared_away(folder):
    folder.mkdir()
    stale = folder / f"{dead_pid()}.sock"
    foreign = folder / "not-a-number.sock"
    stale.touch()
    foreign.touch()
    with pytest.raises(CommandSocketError, match="No flight"):
        await send_command(PilotCommand.LAND, None)
    inbox = Inbox()
    server = CommandServer(inbox)
    await server.open()
    assert not stale.exists()
    await send_command(PilotCommand.LAND, None)
    assert inbox.take() is PilotCommand.LAND
    await server.close()


async def test_several_flights_must_be_told_apart(server, folder):
    other = os.getppid()
    (folder / f"{other}.sock").touch()
    with pytest.raises(CommandSocketError, match=r"choose one by --pid") as error:
        await send_command(PilotCommand.LAND, None)
    assert str(other) in str(error.value)
    assert str(os.getpid()) in str(error.value)


async def test_a_flight_that_does_not_answer_is_an_error(folder):
    folder.mkdir()
    (folder / f"{os.getpid()}.sock").touch()
    with pytest.raises(CommandSocketError, match="does not answer"):
        await send_command(PilotCommand.LAND, None)


@pytest.mark.parametrize("data", [b"fly to the moon", b"\xff\xfe", b"", b"x" * 5000])
async def test_what_is_no_command_is_answered_and_ignored(server, folder, data):
    reader, writer = await asyncio.open_unix_connection(socket_folder() / f"{os.getpid()}.sock")
    writer.write(data)
    writer.write_eof()
    assert (await reader.read(200)).startswith(b"not a command")
    writer.close()
    assert await send_command(PilotCommand.LAND, None) == "land: taken"
