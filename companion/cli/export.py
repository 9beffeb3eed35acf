"""``companion export`` on the command line."""

from pathlib import Path
from typing import Annotated

import typer

from companion.cli import completion
from companion.cli.common import bad_input

_FORMATS = {
    "parquet": "tables for pandas, polars, DuckDB",
    "csv": "the same tables as CSV",
    "foxglove": "an MCAP that Foxglove draws in three dimensions",
    "rerun": "a recording for the rerun viewer",
}


def export(
    flight: Annotated[
        Path,
        typer.Argument(
            help="A flight's folder, or a log in it, finished or cut off.",
            metavar="FOLDER",
            autocompletion=completion.logs,
        ),
    ],
    to: Annotated[
        str,
        typer.Option(
            "--to",
            help="parquet, csv, foxglove or rerun.",
            metavar="FORMAT",
            autocompletion=completion.one_of(_FORMATS),
        ),
    ] = "parquet",
    out: Annotated[
        Path | None,
        typer.Option(
            help="For tables the folder to make, by default FOLDER/parquet or FOLDER/csv; else the "
            "folder of the file, by default the flight's.",
            metavar="DIR",
        ),
    ] = None,
) -> None:
    """Write a flight's logs as tables, or as another program's file; the logs stay as they are.

    Exit status: 0 written; 2 bad input, or there is something at that place already.
    """
    from companion.commands.export import ExportRequest, run_export
    from companion.recording.flight_files import FlightFilesError

    try:
        run_export(ExportRequest(flight, to, out))
    except FlightFilesError as error:
        raise bad_input(error) from error
