"""What tests of links share: the other side, and waiting for things without sleeping."""

import asyncio

from companion.mavlink.codec import Packer, encode
from companion.mavlink.messages import VehicleStateOfHealth, heartbeat

LOOPBACK = "127.0.0.1"
HEARTBEAT = encode(
    "HEARTBEAT",
    type=2, autopilot=12, base_mode=0, custom_mode=0, system_status=3, mavlink_version=3,
)  # fmt: skip
PACKET = Packer(1, 1).pack(HEARTBEAT)
OF_GROUND_STATION = Packer(255, 190).pack(heartbeat(VehicleStateOfHealth.ACTIVE))
PATIENCE_S = 10.0


async def until(condition):
    """Wait until something holds, looking after every round of the loop."""
    async with asyncio.timeout(PATIENCE_S):
        while not condition():  # noqa: ASYNC110 - it is a condition of many things
            await asyncio.sleep(0.001)


class Heard:
    """Takes what a link gives: bytes, and changes."""

    def __init__(self, link):
        self.data = b""
        self.changes = []
        link.on_bytes = self._on_bytes
        link.on_change = self.changes.append

    def _on_bytes(self, data, received_s):
        assert received_s <= asyncio.get_running_loop().time()
        self.data += data


class TcpPeer:
    """A listening socket on the other side, that keeps what it is told."""

    def __init__(self, reads=True):
        self.calls = []
        self.data = b""
        self.reads = reads
        self.server = None

    async def listen(self, port=0):
        self.server = await asyncio.start_server(self._serve, LOOPBACK, port, limit=4096)
        return self.server.sockets[0].getsockname()[1]

    async def _serve(self, reader, writer):
        self.calls.append(writer)
        if not self.reads:
            writer.transport.pause_reading()
            return
        try:
            while data := await reader.read(4096):
                self.data += data
        except ConnectionError:
            pass

    def hang_up(self):
        for writer in self.calls:
            writer.transport.abort()

    def close(self):
        self.hang_up()
        if self.server is not None:
            self.server.close()
