"""`faults.json`: the table and what came of each row, for machines."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from companion.experiments.faults.study import Result, Unflown
from companion.experiments.faults.table import Row

NAME = "faults.json"


@dataclass(frozen=True, slots=True)
class Made:
    """Where the figures come from."""

    version: str
    commit: str
    seed: int
    wall_s: float
    command: str


@dataclass(frozen=True, slots=True)
class RowResult:
    """A row and its flights."""

    row: Row
    flights: tuple[Result, ...]

    @property
    def verdict(self) -> str:
        """passed, failed, or not flown (a row of a process)."""
        if self.row.kind != "flight":
            return "not flown"
        return "passed" if all(passed(flight) for flight in self.flights) else "failed"


def passed(result: Result) -> bool:
    """Whether a flight kept what was promised."""
    return not isinstance(result, Unflown) and result.passed


def by_row(rows: Sequence[Row], results: Sequence[Result]) -> list[RowResult]:
    """Each row with its flights."""
    return [RowResult(row, tuple(r for r in results if r.row == row.name)) for row in rows]


def counts(results: Sequence[RowResult]) -> dict[str, int]:
    """Rows by verdict."""
    return {
        verdict: sum(result.verdict == verdict for result in results)
        for verdict in ("passed", "failed", "not flown")
    }


def faults_object(results: Sequence[RowResult], made: Made) -> dict[str, Any]:
    """All of it; what is not known is null."""
    return {"made": asdict(made), "counts": counts(results), "rows": [_row(r) for r in results]}


def _row(result: RowResult) -> dict[str, Any]:
    row = result.row
    return {
        "name": row.name,
        "group": row.group,
        "kind": row.kind,
        "what": row.what,
        "verdict": result.verdict,
        "detected": row.detected,
        "done": row.done,
        "seen": row.seen,
        "test": row.shown_by,
        "flights": [_flight(flight) for flight in result.flights],
    }


def _flight(flight: Result) -> dict[str, Any]:
    if isinstance(flight, Unflown):
        return {"autopilot": flight.autopilot, "passed": False, "broken": [flight.reason]}
    measured = {key: _known(value) for key, value in asdict(flight.judgement.measured).items()}
    return {
        "autopilot": flight.autopilot,
        "passed": flight.passed,
        "broken": list(flight.judgement.broken),
        "outcome": flight.outcome,
        "note": flight.note,
        "measured": measured,
        "command": flight.command,
        "folder": None if flight.folder is None else str(flight.folder),
    }


def _known(value: float | int | str) -> float | int | str | None:
    if isinstance(value, float):
        return round(value, 4) if math.isfinite(value) else None
    return value
