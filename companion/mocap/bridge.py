"""The bridge: datagrams of the motion capture in, ODOMETRY at a steady rate out.

Nothing queues: what leaves at a beat is the newest pose, if it is newer than what left before.
Whether the stream lives is told from the same poses, so what is lost here is lost there.
"""

import asyncio
import math
from collections.abc import Callable

from companion.config.mocap_models import MocapConfig
from companion.mavlink.messages import Outgoing
from companion.mocap.intake import Intake
from companion.mocap.json_input import DroppedError, read_pose
from companion.mocap.odometry import OdometryMessages
from companion.mocap.plausible import Plausible
from companion.mocap.pose import Pose, RoomAxes

_MOST_TOLD = 3


class MocapBridge:
    """One stream of poses, from whatever source to the autopilot.

    Args:
        config: what the mission says of it.
    """

    def __init__(self, config: MocapConfig) -> None:
        self.config = config
        self.sent = 0
        self.on_lost: Callable[[], None] | None = None
        """Called when the stream is found lost, and not again before it has come back."""
        self.armed: Callable[[], bool] = lambda: False
        """Whether the vehicle is armed: from then on no jump is believed, and no repetition."""
        self.in_air: Callable[[], bool] = lambda: False
        """Whether it is surely off the ground, where even a pose without noise changes."""
        self._intake = Intake(
            RoomAxes(
                y_up=config.axes == "y_up",
                room_yaw_rad=math.radians(config.room_yaw_deg),
                body_yaw_rad=math.radians(config.body_yaw_deg),
            ),
            Plausible(config.max_speed_m_s, math.radians(config.max_rate_deg_s)),
            latency_s=config.latency_s,
            timeout_s=config.timeout_s,
        )
        self._messages = OdometryMessages(
            config.position_sigma_m, math.radians(config.attitude_sigma_deg)
        )
        self._sent_pose: Pose | None = None

    @property
    def pose(self) -> Pose | None:
        """The newest pose that is believed."""
        return self._intake.newest

    @property
    def jumps(self) -> int:
        """How often the poses jumped for good, on the ground: the reset counter."""
        return self._intake.jumps

    def receive(self, data: bytes, now_s: float) -> None:
        """Take a datagram; one that is no pose is dropped and counted."""
        try:
            seen = read_pose(data, self.config.body)
        except DroppedError as error:
            self._intake.dropped[str(error)] += 1
            return
        self._intake.take(seen, now_s, armed=self.armed(), in_air=self.in_air())

    @property
    def trouble(self) -> str:
        """What is the matter with the poses that come now; empty while they are believed."""
        return self._intake.trouble

    def silent_s(self, now_s: float) -> float:
        """How long no usable pose has come; infinite before the first."""
        return now_s - self._intake.received_s

    def alive(self, now_s: float) -> bool:
        """Whether usable poses come."""
        return self.silent_s(now_s) <= self.config.timeout_s

    def beat(self) -> Outgoing | None:
        """The message that is due at a beat; None if there is no newer pose than before."""
        pose = self._intake.newest
        if pose is None or pose is self._sent_pose:
            return None
        self._sent_pose = pose
        self.sent += 1
        return self._messages.message(pose, self._intake.jumps)

    def describe(self) -> str:
        """What has come so far, for a person."""
        counts = [f"{self._intake.taken} usable"]
        counts += [f"{n} {reason}" for reason, n in self._intake.dropped.most_common(_MOST_TOLD)]
        return ", ".join(counts)

    async def run(self, send: Callable[[Outgoing], None], tell: Callable[[str, str], None]) -> None:
        """Send at the steady rate and watch over the stream, until cancelled.

        Args:
            send: takes a message for the autopilot.
            tell: takes severity and text for a person.
        """
        loop = asyncio.get_running_loop()
        period_s = 1.0 / self.config.rate_hz
        due_s = loop.time()
        was_alive, jumps = False, 0
        while True:
            now_s = loop.time()
            alive = self.alive(now_s)
            if alive:
                message = self.beat()
                if message is not None:
                    send(message)
            if alive != was_alive:
                was_alive = alive
                if alive:
                    tell("info", f"motion capture: poses of '{self.config.body}' come in")
                else:
                    tell(
                        "error",
                        f"motion capture lost: no usable pose of '{self.config.body}' for "
                        f"{self.config.timeout_s:g} s ({self.describe()})"
                        + (f". {self.trouble}." if self.trouble else ""),
                    )
                    if self.on_lost is not None:
                        self.on_lost()
            if self.jumps != jumps:
                jumps = self.jumps
                tell("warning", "motion capture: the poses jumped; the autopilot is told so")
            # After a stall no beat is made up for: only the newest pose counts.
            due_s = max(due_s + period_s, now_s)
            await asyncio.sleep(due_s - now_s)
