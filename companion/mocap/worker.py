"""The process that waits for a motion-capture system: `python -m companion.mocap.worker`.

The package's `waitForNextFrame` blocks, for ever if the cameras stop; so it has a process of its
own, which sends each frame's pose on as UDP/JSON.  It ends with its parent, however that ends.
"""

import argparse
import ctypes
import importlib
import json
import math
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from companion.mocap.json_input import write_pose
from companion.mocap.pose import RoomPose

_SET_PARENT_DEATH_SIGNAL = 1
"""PR_SET_PDEATHSIG of Linux's prctl."""


class MotionCapture(Protocol):
    """What is used of the package's object."""

    @property
    def rigidBodies(self) -> Mapping[str, Any]:  # noqa: N802 - the package's name
        """The bodies that the newest frame has, by name."""

    def waitForNextFrame(self) -> None:  # noqa: N802 - the package's name
        """Block until there is a newer frame."""


def pose_of(system: MotionCapture, body: str, time_s: float) -> RoomPose | None:
    """The body's pose in the newest frame; None if the cameras do not see it."""
    seen = system.rigidBodies.get(body)
    if seen is None:
        return None
    x, y, z = (float(value) for value in seen.position)
    q = seen.rotation
    attitude = (float(q.w), float(q.x), float(q.y), float(q.z))
    if not all(map(math.isfinite, (x, y, z, *attitude))):
        return None
    return RoomPose(time_s, (x, y, z), attitude)


def forward(
    system: MotionCapture, body: str, send: Callable[[bytes], object], alive: Callable[[], bool]
) -> None:
    """Send each new pose on until the parent is gone."""
    while alive():
        system.waitForNextFrame()
        pose = pose_of(system, body, time.monotonic())
        if pose is not None:
            send(write_pose(body, pose))


def main() -> None:
    """Connect as the arguments say, and forward."""
    parser = argparse.ArgumentParser()
    parser.add_argument("system")
    parser.add_argument("options", help="a JSON object of texts")
    parser.add_argument("body")
    parser.add_argument("port", type=int)
    arguments = parser.parse_args()
    parent = os.getppid()
    _die_with_parent()
    try:
        package = importlib.import_module("motioncapture")
        system = package.connect(arguments.system, json.loads(arguments.options))
    except Exception as error:
        sys.exit(f"{arguments.system} cannot be connected to: {error}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        address = ("127.0.0.1", arguments.port)
        forward(
            system,
            arguments.body,
            lambda data: sender.sendto(data, address),
            lambda: os.getppid() == parent,
        )


def _die_with_parent() -> None:
    """Let the system end this process with its parent, even while a frame is waited for."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)


if __name__ == "__main__":
    main()
