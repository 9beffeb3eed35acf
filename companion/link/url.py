"""Addresses of links: what a person writes, checked before anything is opened."""

from dataclasses import dataclass
from urllib.parse import urlsplit

from companion.link.link import LinkError

SCHEMES = ("udpin", "udpout")
_HELP = (
    "write udpin://HOST:PORT to wait for the vehicle (udpin://127.0.0.1:14540 for PX4 on this "
    "computer), or udpout://HOST:PORT to speak first"
)


@dataclass(frozen=True, slots=True)
class LinkUrl:
    """A checked address."""

    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


def parse_link_url(text: str) -> LinkUrl:
    """Read ``udpin://HOST:PORT`` or ``udpout://HOST:PORT``.

    Raises:
        LinkError: it is something else.
    """
    try:
        parts = urlsplit(text.strip())
    except ValueError as error:
        raise LinkError(f"The link address {text!r} is wrong: {error}; {_HELP}.") from error
    if parts.scheme not in SCHEMES:
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
    if port == 0 and parts.scheme == "udpout":
        raise LinkError(f"The link address {text!r} leads to port 0, which nobody has; {_HELP}.")
    return LinkUrl(parts.scheme, parts.hostname, port)
