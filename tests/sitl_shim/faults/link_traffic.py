"""Sends datagrams through the faults of a link, on bare numbers for a clock."""

from collections.abc import Iterable, Sequence
from typing import Any, Literal

from sitl_shim.faults.link import LinkWay, link_faults
from sitl_shim.faults.schema import Faults
from sitl_shim.wind.events import Moments

Sent = tuple[float, bytes]
"""When, s, and what."""
FOR_EVER_S = 1e9


def way_of(
    *faults: dict[str, Any],
    seed: int = 1,
    links: int = 1,
    way: Literal["telemetry", "setpoints"] = "telemetry",
    moments: Moments | None = None,
    babble: Sequence[bytes] = (b"babble",),
) -> LinkWay:
    """One direction of links with faults as a file has them."""
    model = Faults.model_validate({"link": faults})
    both = link_faults(model, moments or Moments(), seed=seed, links=links, babble=lambda _: babble)
    found = both.telemetry if way == "telemetry" else both.setpoints
    assert found is not None
    return found


def carried(
    way: LinkWay, sent: Iterable[Sent], *, link: int = 0, looks_s: Iterable[float] = ()
) -> list[Sent]:
    """All that arrives of a link's datagrams, with its time.

    Args:
        way: with the faults.
        sent: in order of time.
        link: by which they go.
        looks_s: times of further looks at what has arrived.
    """
    events: list[tuple[float, bytes | None]] = [*sent, *((time_s, None) for time_s in looks_s)]
    arrived: list[Sent] = []
    for time_s, data in sorted(events, key=lambda event: event[0]):
        if data is None:
            arrived += [(due_s, got) for due_s, at, got in way.arrived(time_s) if at == link]
        else:
            way.send(link, data, time_s)
    arrived += [(due_s, got) for due_s, at, got in way.arrived(FOR_EVER_S) if at == link]
    return arrived


def numbered(count: int, *, every_s: float = 0.01, size: int = 12) -> list[Sent]:
    """Datagrams that differ, at even times from 0 on."""
    return [(i * every_s, i.to_bytes(4, "little") * (size // 4)) for i in range(count)]


def number_of(data: bytes) -> int:
    """Of one of `numbered`."""
    return int.from_bytes(data[:4], "little")
