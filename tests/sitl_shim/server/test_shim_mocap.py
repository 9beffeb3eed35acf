import asyncio
import json

import pytest

from tests.sitl_shim.server.shim_process import free_port, running_shim

pytestmark = pytest.mark.realtime


class Listener(asyncio.DatagramProtocol):
    def __init__(self):
        self.frames = []
        self.enough = asyncio.Event()

    def datagram_received(self, data, addr):
        self.frames.append(json.loads(data))
        if len(self.frames) >= 50:
            self.enough.set()


async def test_the_rooms_cameras_stream_the_true_pose_to_a_port():
    loop = asyncio.get_running_loop()
    port = free_port()
    transport, listener = await loop.create_datagram_endpoint(
        Listener, local_addr=("127.0.0.1", port)
    )
    try:
        arguments = ("--onboard-port=0", "--gcs-port=0", f"--mocap-port={port}", "--speed=10")
        async with running_shim(*arguments):
            await asyncio.wait_for(listener.enough.wait(), 20.0)
    finally:
        transport.close()
    times = [frame["t"] for frame in listener.frames]
    assert times == sorted(times)
    assert times[40] - times[0] == pytest.approx(0.4, abs=0.005)
    assert listener.frames[0]["body"] == "drone"
    assert listener.frames[-1]["position"] == pytest.approx([0.0, 0.0, 0.0], abs=0.01)
