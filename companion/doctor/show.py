"""The doctor's lines on a terminal, in a file, and as an object for machines."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from companion.doctor.item import Health, Item, worst
from companion.doctor.readings import Readings

_MARKS = {
    Health.OK: ("ok", "green"),
    Health.NOTE: ("note", "cyan"),
    Health.PROBLEM: ("PROBLEM", "bold red"),
}
_SUBJECT_CELLS = 20


def print_items(console: Console, items: Sequence[Item]) -> None:
    """Print a line for each, what to do below it, and what it comes to.

    Args:
        console: where to.
        items: in the order in which they are told.
    """
    table = Table(box=None, pad_edge=False, show_header=False)
    table.add_column(overflow="fold", max_width=_SUBJECT_CELLS)
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for item in items:
        mark, style = _MARKS[item.health]
        text = Text(item.found)
        if item.remedy:
            text.append(f"\n→ {item.remedy}", style="bold")
        table.add_row(item.subject, Text(mark, style=style), text)
    console.print(table)
    console.print()
    console.print(Text(summary(items), style=_MARKS[worst(items)][1]))


def summary(items: Sequence[Item]) -> str:
    """One line: how many of what."""
    problems = sum(item.health is Health.PROBLEM for item in items)
    notes = sum(item.health is Health.NOTE for item in items)
    told = f"{notes} note{'s' if notes != 1 else ''}"
    if problems:
        return f"{problems} problem{'s' if problems != 1 else ''}, {told}: see above"
    return f"no problems, {told}"


def doctor_object(items: Sequence[Item], readings: Readings) -> dict[str, Any]:
    """The same for machines, with the readings that it was judged by."""
    return {
        "verdict": str(worst(items)),
        "items": [{**asdict(item), "health": str(item.health)} for item in items],
        "readings": asdict(readings),
    }
