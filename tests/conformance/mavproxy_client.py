"""The real MAVProxy, told what its users tell it, on its own command line."""

import asyncio
import os
import re
import sys
import tempfile
from pathlib import Path

from tests.conformance.shims import announced_parameters, shim_for_clients
from tests.conformance.steps import Session

_METRES_PER_DEGREE = 111_320.0
_PARAMETER = {"px4": "MIS_TAKEOFF_ALT", "ardupilot": "WPNAV_RADIUS"}
_MODULES = "log,param,arm,mode,wp,cmdlong,ftp,misc"


async def run(flavour: str) -> Session:
    """All steps, against a shim of a flavour."""
    session = Session("MAVProxy", flavour)
    with tempfile.TemporaryDirectory() as folder:
        async with shim_for_clients(flavour) as (onboard, ground):
            proxy = await MavProxy.start(f"udpin:127.0.0.1:{ground}", Path(folder))
            try:
                await _Client(proxy, session, Path(folder), other_port=onboard).run()
            finally:
                await proxy.end()
    return session


class MavProxy:
    """MAVProxy as a process: commands go in, text comes out."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self._text = ""
        self._news = asyncio.Event()
        self._reader = asyncio.create_task(self._read())

    @classmethod
    async def start(cls, master: str, folder: Path) -> "MavProxy":
        """Start it on a link, with its files in a folder."""
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            str(Path(sys.executable).parent / "mavproxy.py"),
            f"--master={master}",
            f"--state-basedir={folder}",
            f"--default-modules={_MODULES}",
            "--nowait",
            cwd=folder,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
        )
        return cls(process)

    def say(self, command: str) -> None:
        """Type a command; what it answers is looked for from here on."""
        assert self._process.stdin is not None
        self._text = ""
        self._process.stdin.write(f"{command}\n".encode())

    async def hears(self, pattern: str) -> "re.Match[str]":
        """Wait until it has printed something since the last command."""
        while True:
            found = re.search(pattern, self._text)
            if found:
                return found
            self._news.clear()
            await self._news.wait()

    @property
    def text(self) -> str:
        """What it has printed since the last command."""
        return self._text

    async def end(self) -> None:
        """End it."""
        if self._process.returncode is None:
            self._process.kill()
        await self._process.wait()
        self._reader.cancel()
        await asyncio.gather(self._reader, return_exceptions=True)

    async def _read(self) -> None:
        stream = self._process.stdout
        assert stream is not None
        while data := await stream.read(4096):
            self._text += data.decode(errors="replace")
            self._news.set()


class _Client:
    def __init__(self, proxy: MavProxy, session: Session, folder: Path, *, other_port: int) -> None:
        self.other_port = other_port
        self.proxy = proxy
        self.session = session
        self.folder = folder
        self.flavour = session.flavour

    async def run(self) -> None:
        step = self.session.step
        await step("connect", self.connect, 20.0)
        if not self.session.steps[-1].passed:
            return
        await step("all parameters", self.all_parameters, 30.0)
        await step("read a parameter", self.read_parameter, 10.0)
        await step("set a parameter", self.set_parameter, 10.0)
        await step("upload a mission", self.upload_mission, 20.0)
        await step("download the mission", self.download_mission, 20.0)
        await step("mode", self.mode, 40.0)
        await step("arm", self.arm, 40.0)
        await step("take off", self.take_off, 30.0)
        await step("land", self.land, 40.0)
        await step("fly the mission", self.fly_mission, 60.0)
        await step("list logs", self.list_logs, 20.0)
        await step("download a log", self.download_log, 60.0)

    async def connect(self) -> str:
        await self.proxy.hears(r"online system 1")
        return "online system 1"

    async def all_parameters(self) -> str:
        found = await self.proxy.hears(r"Received (\d+) parameters")
        assert int(found[1]) == await announced_parameters(self.other_port), found[0]
        return f"{found[1]} parameters, all that there are"

    async def read_parameter(self) -> str:
        name = _PARAMETER[self.flavour]
        self.proxy.say(f"param show {name}")
        found = await self.proxy.hears(rf"{name}\s+([-\d.]+)")
        return f"{name} is {float(found[1]):g}"

    async def set_parameter(self) -> str:
        name = _PARAMETER[self.flavour]
        value = {"px4": 3.0, "ardupilot": 250.0}[self.flavour]
        self.proxy.say(f"param set {name} {value:g}")
        await asyncio.sleep(0.5)
        self.proxy.say(f"param fetch {name}")
        found = await self.proxy.hears(rf"{name} = ([-\d.]+)")
        assert float(found[1]) == value, found[0]
        return f"{name} is now {value:g}"

    async def upload_mission(self) -> str:
        latitude, longitude = await self._place()
        north = latitude + 4.0 / _METRES_PER_DEGREE
        rows = [
            (0, 16, latitude, longitude, 0.0),
            (3, 22, latitude, longitude, 3.0),
            (3, 16, north, longitude, 3.0),
            (3, 21, north, longitude, 0.0),
        ]
        if self.flavour == "px4":  # only ArduPilot has home for its item 0
            rows = rows[1:]
        lines = ["QGC WPL 110"]
        for seq, (frame, command, latitude, longitude, height) in enumerate(rows):
            values = [
                seq,
                int(seq == 0),
                frame,
                command,
                0,
                0,
                0,
                0,
                latitude,
                longitude,
                height,
                1,
            ]
            lines.append("\t".join(str(value) for value in values))
        path = self.folder / "mission.txt"
        path.write_text("\n".join(lines) + "\n")
        self.rows = rows
        self.proxy.say(f"wp load {path}")
        await self.proxy.hears(r"Got MISSION_ACK: TYPE_MISSION: ACCEPTED")
        return f"{len(rows)} items"

    async def download_mission(self) -> str:
        path = self.folder / "saved.txt"
        self.proxy.say("wp list")
        await self.proxy.hears(r"Saved \d+ waypoints|Requesting \d+ waypoints")
        self.proxy.say(f"wp save {path}")
        await self.proxy.hears(r"Saved \d+ waypoints")
        commands = [int(line.split("\t")[3]) for line in path.read_text().splitlines()[1:]]
        assert commands == [row[1] for row in self.rows], commands
        return f"{len(commands)} items, the same"

    async def mode(self) -> str:
        if self.flavour == "px4":
            # MAVProxy 1.8.75 cannot pack PX4's modes for its `mode` command.
            self.proxy.say("long DO_SET_MODE 157 3 0")
            await self.proxy.hears(r"Mode POSCTL")
            self.proxy.say("long DO_SET_MODE 157 4 3")
            await self.proxy.hears(r"Mode LOITER")
            return "POSCTL, then LOITER, by DO_SET_MODE"
        while True:
            self.proxy.say("mode GUIDED")
            try:
                await asyncio.wait_for(self.proxy.hears(r"Mode GUIDED|GUIDED>"), 3.0)
            except TimeoutError:
                continue
            return "GUIDED"

    async def arm(self) -> str:
        while True:
            self.proxy.say("arm throttle")
            try:
                await asyncio.wait_for(self.proxy.hears(r"\bARMED\b"), 3.0)
            except TimeoutError:
                continue
            return "armed"

    async def take_off(self) -> str:
        if self.flavour == "px4":
            # Its `takeoff 3` means 3 m above the sea to PX4.
            self.proxy.say("long NAV_TAKEOFF 0 0 0 nan nan nan nan")
        else:
            self.proxy.say("takeoff 3")
        await self.proxy.hears(r"NAV_TAKEOFF: ACCEPTED")
        await self._wait_for_height(2.0)
        return "accepted, climbed"

    async def land(self) -> str:
        await self._change_to_land()
        await self.proxy.hears(r"DISARMED")
        return "landed and disarmed"

    async def fly_mission(self) -> str:
        start_deg, _ = await self._place()
        if self.flavour == "px4":
            await self.arm()
        else:
            await self.mode()
            await self.arm()
            self.proxy.say("mode AUTO")
            await self.proxy.hears(r"Mode AUTO|AUTO>")
        self.proxy.say("long MISSION_START 0 0")
        await self.proxy.hears(r"MISSION_START: ACCEPTED")
        await self.proxy.hears(r"DISARMED")
        end_deg, _ = await self._place()
        north_m = (end_deg - start_deg) * _METRES_PER_DEGREE
        assert 3.0 < north_m < 5.0, f"came down {north_m:.1f} m north of where it had stood, not 4"
        return f"landed {north_m:.0f} m north, disarmed"

    async def list_logs(self) -> str:
        self.proxy.say("log list")
        found = await self.proxy.hears(r"Log (\d+)\s+numLogs (\d+).*?size (\d+)")
        self.log_id = int(found[1])
        return f"{found[2]} logs"

    async def download_log(self) -> str:
        path = self.folder / "flight.log"
        self.proxy.say(f"log download {self.log_id} {path}")
        found = await self.proxy.hears(r"Finished downloading[^\n]*")
        return f"{path.stat().st_size} bytes: {found[0].split(str(self.folder))[0].strip()}"

    async def _place(self) -> tuple[float, float]:
        """Latitude and longitude of the vehicle, degrees."""
        while True:
            self.proxy.say("status GLOBAL_POSITION_INT")
            await asyncio.sleep(0.3)
            found = re.search(r"lat : (-?\d+), lon : (-?\d+)", self.proxy.text)
            if found is not None and int(found[1]) != 0:
                return int(found[1]) * 1e-7, int(found[2]) * 1e-7

    async def _wait_for_height(self, height_m: float) -> None:
        while True:
            self.proxy.say("status GLOBAL_POSITION_INT")
            await asyncio.sleep(0.3)
            found = re.search(r"relative_alt : (-?\d+)", self.proxy.text)
            if found is not None and int(found[1]) > height_m * 1000.0:
                return

    async def _change_to_land(self) -> None:
        if self.flavour == "px4":
            self.proxy.say("long NAV_LAND 0 0 0 0 0 0 0")
            await self.proxy.hears(r"NAV_LAND: ACCEPTED")
        else:
            self.proxy.say("mode LAND")
            await self.proxy.hears(r"Mode LAND|LAND>")
