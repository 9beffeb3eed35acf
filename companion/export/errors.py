"""What can stand in the way of an export."""

from companion.recording.flight_files import FlightFilesError


class ExportError(FlightFilesError):
    """Nothing was exported; the text says what, where and the remedy."""


class MissingExtraError(ExportError):
    """A library of an optional extra is not installed; the text says how to get it."""
