"""From an address to the link that it asks for."""

from collections.abc import Callable

from companion.link.link import Link
from companion.link.tcp import TcpInLink, TcpOutLink
from companion.link.udp import UdpLink
from companion.link.url import SERIAL_SCHEME, LinkUrl


def make_link(url: LinkUrl, accept_peer: Callable[[bytes], bool]) -> Link:
    """Make the link of an address; nothing is opened yet.

    Args:
        url: where it leads.
        accept_peer: for a link at which others call, decides by what one has said whether it is
            the peer.
    """
    if url.scheme == SERIAL_SCHEME:
        from companion.link.serial_port import SerialLink  # pyserial is Unix's or Windows's own

        return SerialLink(url)
    if url.scheme == "tcpout":
        return TcpOutLink(url)
    if url.scheme == "tcpin":
        return TcpInLink(url, accept_peer)
    return UdpLink(url, accept_peer)
