"""The summary box of the table of faults: how many rows ended as promised, and which did not."""

from collections.abc import Sequence

from companion.experiments.faults.study import Result, Unflown
from companion.experiments.faults.written import RowResult, counts, passed
from companion.report.pages.glance import Glance, KeyFigure, Level

_MOST_NAMED = 8


def table_glance(results: Sequence[RowResult]) -> Glance:
    """The box."""
    found = counts(results)
    good, bad = found["passed"], found["failed"]
    flown = good + bad
    failed = [result for result in results if result.verdict == "failed"]
    level: Level
    if not flown:
        level, sentence = "none", "No row was flown: those of a process are run by pytest -m faults"
    elif not bad:
        level = "good"
        sentence = f"All {flown} rows ended as promised" if flown > 1 else "It ended as promised"
    else:
        names = ", ".join(result.row.name for result in failed[:_MOST_NAMED])
        more = f" and {len(failed) - _MOST_NAMED} more" if len(failed) > _MOST_NAMED else ""
        level = "bad"
        sentence = f"{good} of {flown} rows ended as promised; not so: {names}{more}"
    reasons = [
        f"{result.row.name} ({flight.autopilot}): {'; '.join(_broken(flight))}"
        for result in failed
        for flight in result.flights
        if not passed(flight)
    ]
    figures = (
        KeyFigure("as promised", f"{good} of {flown}"),
        KeyFigure("not as promised", f"{bad}", "", "bad" if bad else None),
        KeyFigure("flights", f"{sum(len(result.flights) for result in results)}"),
        KeyFigure("run by pytest", f"{found['not flown']}"),
    )
    return Glance(level, f"{sentence}.", figures, tuple(reasons[:_MOST_NAMED]))


def _broken(flight: Result) -> tuple[str, ...]:
    if isinstance(flight, Unflown):
        return (flight.reason,)
    return tuple(flight.judgement.broken)
