"""Commands of a person to a running flight, over a local socket.

``companion land|abort|resume`` finds the socket by the flight's process id in a folder that only
its owner can enter, writes one word, and reads one line back.
"""

import asyncio
import contextlib
import os
import stat
import tempfile
from pathlib import Path

from companion.flight.inbox import Inbox, PilotCommand

_LONGEST_WORD = 64
_LONGEST_ANSWER = 200


class CommandSocketError(Exception):
    """A running flight can't be reached; the text names the remedy."""


def socket_folder() -> Path:
    """The folder of this user's sockets: below XDG_RUNTIME_DIR, or the temporary folder."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and Path(runtime).is_dir():
        return Path(runtime) / "companion"
    return Path(tempfile.gettempdir()) / f"companion-{os.getuid()}"


class CommandServer:
    """Puts commands that come by the socket into the flight's inbox."""

    def __init__(self, inbox: Inbox) -> None:
        self._inbox = inbox
        self._path = socket_folder() / f"{os.getpid()}.sock"
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        """Listen.

        Raises:
            OSError: the socket can't be made, or its folder belongs to somebody else.
        """
        folder = self._path.parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_ours(folder):
            raise PermissionError(f"{folder} belongs to somebody else, or is a link")
        folder.chmod(0o700)
        self._path.unlink(missing_ok=True)
        for path in folder.glob("*.sock"):
            if _running_pid(path) is None:  # its flight was killed
                path.unlink(missing_ok=True)
        self._server = await asyncio.start_unix_server(self._serve, self._path)

    async def close(self) -> None:
        """Stop listening and remove the socket."""
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()
            self._path.unlink(missing_ok=True)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(ConnectionError):
            try:
                word = (await asyncio.wait_for(reader.read(_LONGEST_WORD), 1.0)).decode().strip()
                self._inbox.put(PilotCommand(word))
                answer = f"{word}: taken\n"
            except (ValueError, TimeoutError):
                known = ", ".join(command.value for command in PilotCommand)
                answer = f"not a command; there are {known}\n"
            writer.write(answer.encode())
            await writer.drain()
        writer.close()


async def send_command(command: PilotCommand, pid: int | None) -> str:
    """Give a command to a running flight; its answer.

    Args:
        command: what to ask for.
        pid: of the flight's process; None if only one is running.

    Raises:
        CommandSocketError: no flight, several, or one that does not answer.
    """
    folder = socket_folder()
    found = sorted(folder.glob("*.sock")) if folder.is_dir() and _is_ours(folder) else []
    alive = [path for path in found if _running_pid(path) is not None]
    if pid is not None:
        alive = [path for path in alive if path.stem == str(pid)]
    if not alive:
        which = f" with process id {pid}" if pid is not None else ""
        raise CommandSocketError(f"No flight{which} is running under this user.")
    if len(alive) > 1:
        pids = ", ".join(path.stem for path in alive)
        raise CommandSocketError(f"Several flights are running: choose one by --pid ({pids}).")
    try:
        reader, writer = await asyncio.open_unix_connection(alive[0])
        writer.write(command.value.encode())
        writer.write_eof()
        answer = await asyncio.wait_for(reader.read(_LONGEST_ANSWER), 2.0)
        writer.close()
    except (OSError, TimeoutError) as error:
        raise CommandSocketError(
            f"The flight does not answer ({error or 'no word within 2 s'}). If its process hangs, "
            "end it: the autopilot's failsafe then takes over."
        ) from error
    return answer.decode().strip()


def _is_ours(folder: Path) -> bool:
    """True for a real folder that belongs to this user."""
    status = folder.lstat()
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid()


def _running_pid(path: Path) -> int | None:
    """The process whose socket this is; None if there is none any more."""
    if not path.stem.isdecimal():
        return None
    pid = int(path.stem)
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return None
    except PermissionError:
        pass
    return pid
