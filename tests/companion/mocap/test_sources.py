import asyncio
import sys
import textwrap

import pytest

from companion.config.mocap_models import MocapConfig
from companion.mocap.json_input import read_pose, write_pose
from companion.mocap.pose import RoomPose
from companion.mocap.sources import MocapError, open_source
from companion.mocap.worker import pose_of

POSE = RoomPose(1.0, (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0))

STAND_IN = textwrap.dedent(
    """
    import time

    class Rotation:
        w, x, y, z = 1.0, 0.0, 0.0, 0.0

    class Body:
        position, rotation = (1.0, 2.0, 3.0), Rotation()

    class System:
        rigidBodies = {"drone": Body()}

        def waitForNextFrame(self):
            time.sleep(0.01)

    def connect(kind, options):
        if options["hostname"] != "room":
            raise RuntimeError(f"no {kind} at {options['hostname']}")
        return System()
    """
)


async def collect(config, send=None):
    """The first datagram that a source gives, or None; and the source's trouble."""
    first = asyncio.get_running_loop().create_future()

    def receive(data, _):
        if not first.done():
            first.set_result(data)

    source = await open_source(config, receive)
    try:
        if send is not None:
            send(source)
        waiting = asyncio.ensure_future(first)
        while not waiting.done() and not source.trouble:
            await asyncio.wait([waiting], timeout=0.05)
        return (waiting.result() if waiting.done() else None), source.trouble
    finally:
        await source.close()


@pytest.mark.realtime
async def test_a_datagram_comes_in_by_udp():
    async def send_to(source):
        loop = asyncio.get_running_loop()
        transport, _ = await loop.create_datagram_endpoint(
            asyncio.DatagramProtocol, remote_addr=("127.0.0.1", source.port)
        )
        transport.sendto(write_pose("drone", POSE))
        transport.close()

    tasks = []
    data, trouble = await collect(
        MocapConfig(port=0), lambda source: tasks.append(asyncio.ensure_future(send_to(source)))
    )
    assert read_pose(data, "drone") == POSE
    assert trouble == ""


@pytest.mark.realtime
async def test_a_port_that_is_taken_is_told_with_the_remedy():
    source = await open_source(MocapConfig(port=0), lambda data, now: None)
    try:
        with pytest.raises(MocapError, match=r"set mocap\.port"):
            await open_source(MocapConfig(port=source.port), lambda data, now: None)
    finally:
        await source.close()


@pytest.mark.realtime
async def test_a_system_of_the_package_is_waited_for_in_a_process(tmp_path, monkeypatch):
    (tmp_path / "motioncapture.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    data, _ = await collect(MocapConfig(system="vicon", host="room"))
    assert read_pose(data, "drone").position_m == (1.0, 2.0, 3.0)


@pytest.mark.realtime
async def test_a_system_that_cannot_be_reached_says_why(tmp_path, monkeypatch):
    (tmp_path / "motioncapture.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    data, trouble = await collect(MocapConfig(system="vicon", host="nowhere"))
    assert data is None
    assert "no vicon at nowhere" in trouble


async def test_a_missing_package_is_told_with_the_extra_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "motioncapture", None)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MocapError, match=r"pip install .*companion\[mocap\]"):
        await open_source(MocapConfig(system="vicon"), lambda data, now: None)


def test_the_installed_package_has_what_is_used_of_it():
    motioncapture = pytest.importorskip("motioncapture")
    system = motioncapture.connect("mock", {"hostname": "nowhere"})
    system.waitForNextFrame()
    assert pose_of(system, "drone", 1.0) is None
