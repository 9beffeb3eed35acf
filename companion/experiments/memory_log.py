"""A flight's log that stays in memory: what the figures need, and nothing is encoded."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from companion.report.flight_data import (
    FlightData,
    is_truth_packet,
    ticks_from_records,
    truth_from_packets,
)

_KEPT = ("control", "plan")


class MemoryLog:
    """Takes what a `FlightLog` takes; keeps the controller's records and the truth's packets."""

    def __init__(self) -> None:
        self._records: dict[str, list[Mapping[str, Any]]] = {topic: [] for topic in _KEPT}
        self._truth: list[bytes] = []
        self.folder = Path()
        """Where a flight that changes parameters keeps what they were; a study changes none."""
        self.trouble: str | None = None
        """Memory has none."""

    def frame_in(self, time_s: float, raw: bytes) -> None:
        """Keep a received packet if it is the truth."""
        if is_truth_packet(raw):
            self._truth.append(raw)

    def frame_out(self, time_s: float, raw: bytes) -> None:
        """Pass over a sent packet."""

    def record(self, topic: str, time_s: float, values: Mapping[str, Any]) -> None:
        """Keep a record of the controller."""
        kept = self._records.get(topic)
        if kept is not None:
            kept.append(values)

    def flush_if_due(self, time_s: float) -> None:
        """Nothing is to be written."""

    def data(self) -> FlightData:
        """All that was kept, as arrays."""
        ticks = ticks_from_records(self._records["control"], self._records["plan"])
        return FlightData(ticks, truth_from_packets(self._truth))
