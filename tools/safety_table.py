"""Writes the table of faults into docs/safety.md: its rows, and what `companion faults` measured.

    companion faults --out faults
    python tools/safety_table.py faults/faults.json
    python tools/safety_table.py --check      # do the rows in the docs say what the table says?

The table stands between two markers.  The check looks at everything but what was measured.
"""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from companion.experiments.faults.table import Row, load_table

DOCS = Path(__file__).parents[1] / "docs" / "safety.md"
BEGIN, END = "<!-- faults table -->", "<!-- end -->"
_TITLES = {"link": "the link", "vehicle": "the vehicle", "process": "the companion's process"}
_COLUMNS = (
    "fault",
    "what is detected",
    "after",
    "what is done",
    "how it ends",
    "what the user sees",
    "shown by",
)
_MEASURED = (2, 4)
"""Columns that the check passes over in rows that are flown."""
_SHORT = {"px4": "PX4", "ardupilot": "ArduPilot"}
Cells = tuple[str, ...]


def cells(row: Row, flights: list[dict[str, Any]]) -> Cells:
    """A row's cells.

    Args:
        row: of the table.
        flights: of it, as faults.json has them.
    """
    promised = row.promise is not None
    return tuple(
        " ".join(text.replace("|", "/").split())
        for text in (
            f"`{row.name}`: {row.what}",
            row.detected,
            row.after or (_each(flights, _after) if promised else "–"),
            row.done,
            _each(flights, _ending) if promised else "–",
            row.seen,
            f"`{row.shown_by}`",
        )
    )


def _each(flights: list[dict[str, Any]], tell: Callable[[dict[str, Any]], str]) -> str:
    """What is told of each flight; once if it is the same."""
    told = {_SHORT[flight["autopilot"]]: tell(flight) for flight in flights}
    if len(set(told.values())) == 1 and len(told) > 1:
        return str(next(iter(told.values())))
    return "; ".join(f"{name} {text}" for name, text in told.items()) or "–"


def _after(flight: dict[str, Any]) -> str:
    seconds = flight.get("measured", {}).get("detected_after_s")
    return "–" if seconds is None else f"{seconds:.2f} s"


def _ending(flight: dict[str, Any]) -> str:
    measured = flight.get("measured", {})
    ending = str(measured.get("ending", "not flown"))
    error = measured.get("mean_error_mm")
    return f"{ending}, {error:.0f} mm" if ending == "landed" and error is not None else ending


def table(rows: tuple[Row, ...], measured: dict[str, list[dict[str, Any]]]) -> str:
    """The whole table, in parts by what is hurt."""
    parts = []
    for group, title in _TITLES.items():
        of_group = [row for row in rows if row.group == group]
        if not of_group:
            continue
        lines = [
            f"### Faults of {title}",
            "",
            _line(_COLUMNS),
            "|" + "---|" * len(_COLUMNS),
            *(_line(cells(row, measured.get(row.name, []))) for row in of_group),
        ]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def failures(measured: dict[str, list[dict[str, Any]]]) -> list[str]:
    """Flights that failed, or were not flown: what they measured is no promise.

    Args:
        measured: flights by row, as faults.json has them.
    """
    return [
        f"{name} ({flight['autopilot']})"
        for name, flights in measured.items()
        for flight in flights
        if not flight["passed"]
    ]


def _line(texts: Cells) -> str:
    return "| " + " | ".join(texts) + " |"


def split(text: str) -> tuple[str, str, str]:
    """What stands before, between and behind the markers.

    Raises:
        SystemExit: there are no markers.
    """
    before, found, rest = text.partition(BEGIN)
    between, ended, behind = rest.partition(END)
    if not found or not ended:
        raise SystemExit(f"{DOCS} has no lines {BEGIN} and {END}. Put them where the table goes.")
    return before, between, behind


def differences(rows: tuple[Row, ...], text: str) -> list[str]:
    """Rows of the docs that do not say what the table says, measured figures aside.

    Args:
        rows: of the table.
        text: of the docs.
    """
    _, between, _ = split(text)
    lines = [line for line in between.splitlines() if line.startswith("| `")]
    found = [tuple(part.strip() for part in line.strip("|").split(" | ")) for line in lines]
    shown = {row[0]: row for row in found}
    expected = {cells(row, [])[0]: row for row in rows}
    wrong = [f"the table has no row like {name}" for name in shown if name not in expected]
    for name, row in expected.items():
        if name not in shown:
            wrong.append(f"{row.name} is missing, or its first cell is another")
        elif _static(row, shown[name]) != _static(row, cells(row, [])):
            wrong.append(f"{row.name} says something else")
    if not wrong and list(shown) != _grouped(rows):
        wrong.append("the rows stand in another order")
    return wrong


def _grouped(rows: tuple[Row, ...]) -> list[str]:
    return [cells(row, [])[0] for group in _TITLES for row in rows if row.group == group]


def _static(row: Row, texts: Cells) -> Cells:
    passed_over = _MEASURED if row.kind == "flight" else ()
    return tuple(text for column, text in enumerate(texts) if column not in passed_over)


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("faults", nargs="?", type=Path, help="faults.json of the whole table")
    parser.add_argument("--check", action="store_true", help="compare, and write nothing")
    options = parser.parse_args()
    rows = load_table().rows
    text = DOCS.read_text(encoding="utf-8")
    if options.check:
        wrong = differences(rows, text)
        for sentence in wrong:
            print(sentence)
        return 1 if wrong else 0
    if options.faults is None:
        parser.error("give faults.json, as `companion faults` writes it, or --check")
    written = json.loads(options.faults.read_text(encoding="utf-8"))
    measured = {row["name"]: row["flights"] for row in written["rows"]}
    unknown = [row.name for row in rows if row.kind == "flight" and row.name not in measured]
    if unknown:
        parser.error(f"{options.faults} lacks {', '.join(unknown)}: run the whole table")
    failed = failures(measured)
    if failed:
        parser.error(
            f"{options.faults} has flights that failed: {', '.join(failed)}. Mend them first"
        )
    made = written["made"]
    commit = f" (commit {made['commit']})" if made["commit"] else ""
    note = (
        f"Measured by `{made['command']}`{commit}: *after* counts from the\n"
        "fault's beginning to the first word about it, and errors are means over the trajectory, "
        "against the\n"
        "truth. `companion faults --only NAME` flies a row.\n"
    )
    before, _, behind = split(text)
    DOCS.write_text(
        f"{before}{BEGIN}\n{note}\n{table(rows, measured)}\n{END}{behind}", encoding="utf-8"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
