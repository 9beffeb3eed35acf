"""The shim on a running event loop, without sockets: for flights on a virtual clock."""

from collections.abc import Callable

from sitl_shim.driver import LoopDriver, faults_on_links
from sitl_shim.mavlink.endpoint import Shim
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.sensors.camera import CameraOptions, MocapCamera
from sitl_shim.simulation import ShimOptions

__all__ = ["LockstepShim", "ShimOptions"]


class LockstepShim:
    """One vehicle with an onboard link, driven by the clock of the loop that runs it.

    Every wait is a timer of the loop, so the loop's clock decides how fast time goes.

    Args:
        options: what is simulated.
        send: takes what the client receives, one MAVLink message per call.
        on_frame: takes what the room's motion capture says of the vehicle; None: there is none.

    Raises:
        ValueError: an unknown vehicle, scenario, sensor profile, flavour or parameter, or faults
            that are none.
    """

    def __init__(
        self,
        options: ShimOptions,
        send: Callable[[bytes], None],
        *,
        on_frame: Callable[[bytes], None] | None = None,
    ) -> None:
        camera = MocapCamera(CameraOptions(), seed=options.seed)
        shim = Shim(options, (LinkKind.ONBOARD,))
        self._driver = LoopDriver(
            shim,
            speed=options.speed,
            deliver=lambda _, data: send(data),
            room=None if on_frame is None else (camera, on_frame),
            faults=faults_on_links(shim, options, 1),
        )

    def receive(self, data: bytes) -> None:
        """Take what the client sends, now; what comes before `run` is lost."""
        self._driver.receive(0, data)

    async def run(self) -> None:
        """Fly until cancelled; the vehicle boots at the moment at which this starts."""
        await self._driver.run()
