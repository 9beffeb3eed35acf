"""The process between vehicle and client: passes datagrams on, and notes when.

    python -m benchmarks.real_time.relay times|tags CLIENT_PORT

It says the port to which the vehicle speaks, and ends when its standard input closes; then it says
what it has seen, as JSON.  A state's time is taken just before it is handed to the system on
its way to the client; a setpoint's is the system's own stamp of its arrival (SO_TIMESTAMPNS,
socket(7)), so how late this process itself wakes up does not count.
"""

import json
import select
import socket
import sys
import time
from collections.abc import Callable, Iterator

from benchmarks.real_time.frames import TAGS, sample_times_ms, setpoint_tags, setpoint_times_ms
from benchmarks.real_time.stamps import Address, receive_stamped, stamped


class Seen:
    """Which states went by, and when the first setpoint for each came back."""

    def __init__(self, key_of: Callable[[int], int]) -> None:
        self._key_of = key_of
        self._open: dict[int, int] = {}
        self.pairs: list[tuple[int, int]] = []
        """Moment of a state, and how much later its setpoint came, ns."""
        self.samples: list[int] = []
        self.repeated = 0
        """Setpoints for a state that has been answered, or that never was."""

    def sample(self, time_ms: int, now_ns: int) -> None:
        """A state leaves for the client."""
        self._open[self._key_of(time_ms)] = now_ns
        self.samples.append(now_ns)

    def setpoint(self, key: int, now_ns: int) -> None:
        """A setpoint has come back."""
        sent_ns = self._open.pop(key, None)
        if sent_ns is None:
            self.repeated += 1
        else:
            self.pairs.append((sent_ns, now_ns - sent_ns))


def main() -> None:
    """Relay until standard input closes."""
    tagged = sys.argv[1] == "tags"
    seen = Seen((lambda ms: ms % TAGS) if tagged else (lambda ms: ms))
    keys = setpoint_tags if tagged else setpoint_times_ms
    vehicle, client = _bound(), _bound()
    stamped(client)
    sys.stdout.write(f"{vehicle.getsockname()[1]}\n")
    sys.stdout.flush()
    _relay(vehicle, client, ("127.0.0.1", int(sys.argv[2])), seen, keys)
    told = {"pairs_ns": seen.pairs, "samples_ns": seen.samples, "repeated": seen.repeated}
    sys.stdout.write(json.dumps(told) + "\n")


def _bound() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.setblocking(False)
    return made


def _relay(
    vehicle: socket.socket,
    client: socket.socket,
    client_is: Address,
    seen: Seen,
    keys: Callable[[bytes], Iterator[int]],
) -> None:
    vehicle_is: Address | None = None
    poll = select.epoll()
    for stream in (vehicle, client, sys.stdin):
        poll.register(stream.fileno(), select.EPOLLIN)
    while True:
        ready = {descriptor for descriptor, _ in poll.poll()}
        if vehicle.fileno() in ready:
            for data, sender, _ in _waiting(vehicle):
                vehicle_is = sender
                times = list(sample_times_ms(data))
                now_ns = time.time_ns()
                client.sendto(data, client_is)
                for time_ms in times:
                    seen.sample(time_ms, now_ns)
        if client.fileno() in ready:
            for data, _, stamp_ns in _waiting(client):
                for key in keys(data):
                    seen.setpoint(key, stamp_ns)
                if vehicle_is is not None:
                    vehicle.sendto(data, vehicle_is)
        if sys.stdin.fileno() in ready:
            return


def _waiting(source: socket.socket) -> Iterator[tuple[bytes, Address, int]]:
    """All that waits, with the system's stamps where it gives them."""
    while True:
        try:
            stamped_one = receive_stamped(source)
        except BlockingIOError:
            return
        except ConnectionRefusedError:
            continue  # the other side is not there yet, or no longer
        yield stamped_one


if __name__ == "__main__":
    main()
