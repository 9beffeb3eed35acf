"""Who may look, and who may command: a page on loopback is within reach of every web site.

A site that the browser shows could ask for our pages by a name of its own (DNS rebinding), or open
our WebSocket (no same-origin rule holds there): so Host and Origin are looked at.  Commands take
the token besides, which only who started the flight has seen.
"""

import hmac
import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import urlsplit

_LOOPBACK_NAMES = ("localhost",)
POLICY = (
    "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Nothing from elsewhere; the charts place their parts by style attributes."""


@dataclass(frozen=True, slots=True)
class Access:
    """The rules of one page's server."""

    host: str
    """Address that it is bound to."""
    port: int
    token: str
    names: tuple[str, ...] = ()
    """By which others on the network may call this computer."""

    def host_allowed(self, headers: Mapping[str, str]) -> bool:
        """Whether a request names this server, and no other name that leads here."""
        found = _host_and_port(headers.get("host", ""))
        if found is None or found[1] != self.port:
            return False
        name = found[0]
        if name == self.host or name in self.names or is_loopback(name):
            return True
        # Beyond loopback this computer has addresses that only the network knows.  A number is
        # nobody's name: none can be made to lead here from elsewhere.
        return not is_loopback(self.host) and _is_address(name)

    def origin_allowed(self, headers: Mapping[str, str]) -> bool:
        """Whether a request comes from this server's own page, or from no page at all."""
        origin = headers.get("origin")
        return origin is None or origin == f"http://{headers.get('host', '')}"

    def may_command(self, headers: Mapping[str, str]) -> bool:
        """Whether a request carries the token."""
        given = headers.get("x-companion-token", "")
        return hmac.compare_digest(given.encode(), self.token.encode())


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches an address."""
    if host in _LOOPBACK_NAMES:
        return True
    return _is_address(host) and ipaddress.ip_address(host).is_loopback


def _host_and_port(netloc: str) -> tuple[str, int] | None:
    """Both of a Host header; None for what is none."""
    try:
        parts = urlsplit(f"//{netloc}")
        return parts.hostname or "", parts.port or 80
    except ValueError:
        return None


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
