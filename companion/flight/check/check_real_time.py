"""A check on the wall clock: of a real autopilot, or of the embedded shim."""

import asyncio
import time
from functools import partial

from companion.flight.check.checking import Checked, CheckOrder, Tell, check_vehicle
from companion.flight.shim_process import ShimOptions, ShimProcess, start_shim, with_state_rate
from companion.link.make import make_link
from companion.link.udp import UdpLink
from companion.link.url import LinkUrl, parse_link_url
from companion.mavlink.peers import vehicle_heartbeat_in
from companion.mavlink.signing import Signing

_EMBEDDED = LinkUrl("udpin", "127.0.0.1", 0)


def check_in_real_time(
    order: CheckOrder, tell: Tell, shim: ShimOptions | None, *, signing_key: bytes | None = None
) -> Checked:
    """Check; Ctrl-C ends it.

    Args:
        order: what to check.
        tell: told severity and text of what is set and restored.
        shim: start this shim and check it; None to check what `mission.connect` names.
        signing_key: 32 bytes, to sign packets with and to check them by; None: neither is done.

    Raises:
        LinkError: the link can't be opened.
        ShimRefusedError: the embedded shim can't simulate what it was asked for.
        KeyboardInterrupt: a person ended it.
    """
    with asyncio.Runner() as runner:
        return runner.run(_check(order, tell, shim, signing_key))


async def _check(
    order: CheckOrder, tell: Tell, options: ShimOptions | None, key: bytes | None
) -> Checked:
    mission = order.config.mission
    signing = None
    if key is not None:
        loop = asyncio.get_running_loop()
        epoch_unix_s = time.time() - loop.time()
        link_id = 0 if mission.link.signing is None else mission.link.signing.link_id
        signing = Signing(key, lambda: epoch_unix_s + loop.time(), link_id)
    accept = partial(vehicle_heartbeat_in, verifier=None if signing is None else signing.verifier)
    url = _EMBEDDED if mission.connect is None else parse_link_url(mission.connect)
    link = make_link(url, accept)
    shim: ShimProcess | None = None
    await link.open()
    try:
        if options is not None:
            assert isinstance(link, UdpLink)
            assert link.local is not None
            shim = await start_shim(with_state_rate(options, mission.state_rate_hz), link.local[1])
        lost = shim.lost if shim is not None else None
        return await check_vehicle(order, link, tell, signing=signing, lost=lost)
    finally:
        link.close()
        if shim is not None:
            await shim.end()
