"""Tables of a flight: what they are, and who takes their rows.

Tidy: a row is one record or one message, a column is one figure.  A vector is spread over columns,
one an axis.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

BATCH = 4096
"""Rows of a table that wait in memory."""


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table."""

    name: str
    kind: str
    """number (64 bits), single (32 bits), integer, unsigned, boolean, string."""
    unit: str = ""
    frame: str = ""
    about: str = ""


def file_stem(topic: str) -> str:
    """What a topic's file may be called: whoever made the log, it lies in the folder asked for."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", topic).strip("_") or "topic"


LOG_TIME = Column("log_time_s", "number", "s", "", "the companion's clock, since the log's time 0")


@dataclass(frozen=True, slots=True)
class Table:
    """A table: where it goes, and its columns."""

    name: str
    """Path without ending: `control`, or `mavlink/ODOMETRY`."""
    columns: tuple[Column, ...]
    about: str = ""


class TableWriter(Protocol):
    """Takes a table's rows, many at a time."""

    def write(self, columns: Sequence[Sequence[Any]]) -> None:
        """Add rows, given as one sequence for each column; None where a value is not known."""

    def close(self) -> None:
        """Finish the file."""


Begin = Callable[[Table], TableWriter]
"""Begins a table's file."""


class Rows:
    """Rows of a table on their way to its file; a bounded number of them waits."""

    __slots__ = ("_columns", "_writer", "count", "table")

    def __init__(self, table: Table, begin: Begin) -> None:
        """Begin the table's file."""
        self.table = table
        self.count = 0
        self._writer = begin(table)
        self._columns: list[list[Any]] = [[] for _ in table.columns]

    def add(self, row: Sequence[Any]) -> None:
        """Add one row."""
        for column, value in zip(self._columns, row, strict=True):
            column.append(value)
        if len(self._columns[0]) >= BATCH:
            self._flush()

    def close(self) -> None:
        """Write what waits, and finish the file."""
        try:
            self._flush()
        finally:
            self._writer.close()

    def _flush(self) -> None:
        waiting = len(self._columns[0])
        if waiting:
            self._writer.write(self._columns)
            self.count += waiting
            for column in self._columns:
                column.clear()
