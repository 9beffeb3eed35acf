"""Tables as CSV files; `columns.csv` says each column's unit, frame and meaning."""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from companion.export.tables import Begin, Table, TableWriter

DICTIONARY = "columns.csv"


def csv_tables(folder: Path) -> Begin:
    """What begins a CSV file for each table in a folder."""

    def begin(table: Table) -> TableWriter:
        path = folder / f"{table.name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        return _CsvWriter(path, [column.name for column in table.columns])

    return begin


def write_dictionary(folder: Path, tables: Iterable[Table]) -> None:
    """Write what each column of the tables is.

    Raises:
        OSError: it cannot be written.
    """
    writer = _CsvWriter(folder / DICTIONARY, ["table", "column", "type", "unit", "frame", "about"])
    try:
        for table in tables:
            for column in table.columns:
                writer.row(
                    [table.name, column.name, column.kind, column.unit, column.frame, column.about]
                )
    finally:
        writer.close()


class _CsvWriter:
    """Writes one table; what is not known is an empty cell."""

    def __init__(self, path: Path, header: Sequence[str]) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file, lineterminator="\n")
        self._writer.writerow(header)

    def row(self, values: Sequence[Any]) -> None:
        self._writer.writerow(values)

    def write(self, columns: Sequence[Sequence[Any]]) -> None:
        self._writer.writerows(zip(*columns, strict=True))

    def close(self) -> None:
        self._file.close()
