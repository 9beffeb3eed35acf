"""From an address to the link, or the endpoint, that it asks for."""

from collections.abc import Callable

from companion.link.clients import Clients
from companion.link.clients_tcp import TcpClients
from companion.link.clients_udp import UdpClients
from companion.link.link import Link, LinkError
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


def make_clients(url: LinkUrl, makes_sense: Callable[[bytes], bool]) -> Clients:
    """The endpoint of an address; nothing is opened yet.

    Raises:
        LinkError: clients can't be had there.
    """
    if url.scheme in ("udpin", "udpout"):
        return UdpClients(url, makes_sense)
    if url.scheme == "tcpin":
        return TcpClients(url)
    raise LinkError(
        f"The endpoint {url} cannot be forwarded to: write udpout:// for a client that listens, "
        "udpin:// or tcpin:// for clients that call."
    )
