"""Keeps the flight's log going beside the flight, and tells when it is not kept any more."""

from collections.abc import Callable

from companion.recording.flight_log import FlightLog


def log_keeper(log: FlightLog, tell: Callable[[str], None]) -> Callable[[float], None]:
    """A chore of the connection's housekeeping.

    Args:
        log: hands to the system what is due though nothing comes in.
        tell: told once for each file that cannot be written any more.

    Returns:
        To be called with the loop's time, between datagrams and never within one.
    """
    told: str | None = None

    def keep(now_s: float) -> None:
        nonlocal told
        log.flush_if_due(now_s)
        if log.trouble != told:
            told = log.trouble
            tell(f"the flight goes on unrecorded: {told}")

    return keep
