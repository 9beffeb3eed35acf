"""What a flight tells whoever watches it."""

from typing import NamedTuple, Protocol


class TickView(NamedTuple):
    """A glance at a tick."""

    phase: str
    progress: float
    """Share of the timeline that is over, 0..1."""
    tracking_error_m: float
    """Distance to the reference, as reported by the autopilot."""
    tilt_deg: float
    thrust: float
    fallback: str


class Observer(Protocol):
    """Watches a flight; must return quickly.

    One that has `looks_at_ticks` and says False there is spared them.
    """

    def phase(self, name: str, detail: str) -> None:
        """A phase begins."""

    def tick(self, view: TickView) -> None:
        """A setpoint was sent."""

    def message(self, severity: str, text: str) -> None:
        """Something to tell a person: "info", "warning" or "error"."""


class SilentObserver:
    """Watches and says nothing."""

    looks_at_ticks = False

    def phase(self, name: str, detail: str) -> None:
        """Ignore it."""

    def tick(self, view: TickView) -> None:
        """Ignore it."""

    def message(self, severity: str, text: str) -> None:
        """Ignore it."""
