"""Addresses of links: what a person writes, checked before anything is opened."""

import ipaddress
from dataclasses import dataclass
from urllib.parse import urlsplit

from companion.link.link import LinkError

NETWORK_SCHEMES = ("udpin", "udpout", "tcpin", "tcpout")
SERIAL_SCHEME = "serial"
_SERVERS = ("udpin", "tcpin")
_SLOWEST_BAUD = 1200
_FASTEST_BAUD = 12_000_000
_HELP = (
    "write udpin://HOST:PORT to wait for the vehicle (udpin://127.0.0.1:14540 for PX4 on this "
    "computer), udpout://HOST:PORT to speak first, tcpout://HOST:PORT or tcpin://HOST:PORT for "
    "TCP, or serial:///dev/DEVICE:BAUD"
)


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """A checked address."""

    scheme: str
    host: str
    """Or the path of the device, of a serial port."""
    port: int
    """Or the bits per second, of a serial port."""

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host and self.scheme != SERIAL_SCHEME else self.host
        return f"{self.scheme}://{host}:{self.port}"

    @property
    def is_server(self) -> bool:
        """True if others come to us: it binds to an address of this computer."""
        return self.scheme in _SERVERS

    @property
    def is_local(self) -> bool:
        """True if nobody outside of this computer can be at the other end of it."""
        if self.scheme == SERIAL_SCHEME or self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False


def parse_link_url(text: str) -> LinkUrl:
    """Read ``udpin|udpout|tcpin|tcpout://HOST:PORT`` or ``serial:///dev/DEVICE:BAUD``.

    Raises:
        LinkError: it is something else.
    """
    try:
        parts = urlsplit(text.strip())
    except ValueError as error:
        raise LinkError(f"The link address {text!r} is wrong: {error}; {_HELP}.") from error
    if parts.scheme == SERIAL_SCHEME:
        return _serial(text)
    if parts.scheme not in NETWORK_SCHEMES:
        named = f"has the scheme {parts.scheme!r}" if parts.scheme else "has no scheme"
        raise LinkError(f"The link address {text!r} {named}, which is none of ours; {_HELP}.")
    if parts.path not in ("", "/") or parts.query or parts.fragment or "@" in parts.netloc:
        raise LinkError(
            f"The link address {text!r} has more to it than a host and a port; {_HELP}."
        )
    try:
        port = parts.port
    except ValueError:
        raise LinkError(
            f"The link address {text!r} has a port that is no number of 0..65535; {_HELP}."
        ) from None
    if not parts.hostname:
        raise LinkError(f"The link address {text!r} names no host; {_HELP}.")
    if port is None:
        raise LinkError(f"The link address {text!r} names no port; {_HELP}.")
    if port == 0 and parts.scheme not in _SERVERS:
        raise LinkError(f"The link address {text!r} leads to port 0, which nobody has; {_HELP}.")
    return LinkUrl(parts.scheme, parts.hostname, port)


def _serial(text: str) -> LinkUrl:
    """Read ``serial://PATH:BAUD``; a path by-path has colons of its own, and case matters."""
    rest = text.strip()[len(SERIAL_SCHEME) + len("://") :]
    device, colon, baud = rest.rpartition(":")
    if not colon or not baud.isdecimal():
        raise LinkError(
            f"The link address {text!r} names no baud rate: write it behind the device, "
            f"serial:///dev/ttyACM0:115200; {_HELP}."
        )
    if not device.startswith("/"):
        raise LinkError(
            f"The link address {text!r} names no device by its whole path, with three slashes "
            f"(serial:///dev/ttyACM0:{baud}); {_HELP}."
        )
    if not _SLOWEST_BAUD <= int(baud) <= _FASTEST_BAUD:
        raise LinkError(
            f"The link address {text!r} has a baud rate that is none of {_SLOWEST_BAUD}.."
            f"{_FASTEST_BAUD}: 57600, 115200 and 921600 are common; {_HELP}."
        )
    return LinkUrl(SERIAL_SCHEME, device, int(baud))
