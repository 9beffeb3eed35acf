"""Tables as Parquet files; units, frames and meanings are in the columns' metadata."""

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from companion.export.errors import MissingExtraError
from companion.export.tables import Begin, Column, Table, TableWriter
from companion.extras import install_extra

_TYPES = {
    "number": "float64",
    "single": "float32",
    "integer": "int64",
    "unsigned": "uint64",
    "boolean": "bool_",
    "string": "string",
}


def parquet_tables(folder: Path, metadata: dict[str, str]) -> Begin:
    """What begins a Parquet file for each table.

    Args:
        folder: of the files.
        metadata: of each file, besides what the table says.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    arrow, parquet = _pyarrow()

    def begin(table: Table) -> TableWriter:
        path = folder / f"{table.name}.parquet"
        path.parent.mkdir(parents=True, exist_ok=True)
        return _ParquetWriter(arrow, parquet, path, table, metadata)

    return begin


class _ParquetWriter:
    """Writes one table; what waits is written as one group of rows."""

    def __init__(
        self,
        arrow: ModuleType,
        parquet: ModuleType,
        path: Path,
        table: Table,
        metadata: dict[str, str],
    ) -> None:
        self._arrow = arrow
        about = {"about": table.about} if table.about else {}
        self._schema = arrow.schema(
            [
                arrow.field(
                    column.name, getattr(arrow, _TYPES[column.kind])(), metadata=_said(column)
                )
                for column in table.columns
            ],
            metadata=metadata | about,
        )
        self._writer = parquet.ParquetWriter(path, self._schema, compression="zstd")

    def write(self, columns: Sequence[Sequence[Any]]) -> None:
        arrays = [
            self._arrow.array(values, field.type)
            for values, field in zip(columns, self._schema, strict=True)
        ]
        self._writer.write_batch(self._arrow.RecordBatch.from_arrays(arrays, schema=self._schema))

    def close(self) -> None:
        self._writer.close()


def _said(column: Column) -> dict[str, str]:
    said = {"unit": column.unit, "frame": column.frame, "about": column.about}
    return {key: value for key, value in said.items() if value}


def _pyarrow() -> tuple[ModuleType, ModuleType]:
    try:
        import pyarrow as arrow
        import pyarrow.parquet as parquet
    except ImportError as error:
        raise MissingExtraError(
            f"Parquet needs pyarrow: {install_extra('study')} (--to csv needs nothing)"
        ) from error
    return arrow, parquet
