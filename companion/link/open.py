"""From an address to a link."""

from collections.abc import Callable

from companion.link.link import OnBytes
from companion.link.udp import UdpLink, looks_like_mavlink
from companion.link.url import parse_link_url


async def open_link(
    url: str, on_bytes: OnBytes, accept_peer: Callable[[bytes], bool] = looks_like_mavlink
) -> UdpLink:
    """Open the link that an address names.

    Args:
        url: ``udpin://HOST:PORT`` or ``udpout://HOST:PORT``.
        on_bytes: takes what is received.
        accept_peer: for `udpin`, decides by a datagram whether its sender is the vehicle.

    Raises:
        LinkError: the address is wrong or cannot be opened.
    """
    link = UdpLink(parse_link_url(url), accept_peer)
    link.on_bytes = on_bytes
    await link.open()
    return link
