"""An identification flight's log, read again: its recording, and what was known of the vehicle."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError
from pydantic import ValidationError

from companion.config.models import VehicleConfig
from companion.flight.experiment import EXPERIMENT, THRUST_REPORT
from companion.flight.records import CONTROL
from companion.identification.estimates import UnidentifiedError
from companion.identification.from_records import recording_from_records
from companion.identification.recording import Recording
from companion.recording.flight_log import MCAP_NAME
from companion.recording.mcap_log import read_records


@dataclass(frozen=True, slots=True)
class IdentificationLog:
    """What an identification flight has left."""

    recording: Recording
    vehicle: VehicleConfig
    """As it was known before the flight."""


def read_identification(folder: Path) -> IdentificationLog:
    """Read the log in a flight's folder, finished or not.

    Raises:
        UnidentifiedError: there is no log, or it is not one of an identification flight.
    """
    path = folder / MCAP_NAME
    kept: dict[str, list[Mapping[str, Any]]] = {
        topic: [] for topic in (CONTROL.topic, THRUST_REPORT.topic, EXPERIMENT.topic)
    }
    try:
        for record in read_records(path):
            if record.topic in kept:
                kept[record.topic].append(record.values)
    except (OSError, ValueError, McapError) as error:
        reason = error.strerror if isinstance(error, OSError) else None
        raise UnidentifiedError(
            f"{path}: {reason or error}. Give the folder of a flight of `companion identify`."
        ) from error
    try:
        recording = recording_from_records(
            kept[CONTROL.topic], kept[THRUST_REPORT.topic], kept[EXPERIMENT.topic]
        )
        vehicle = VehicleConfig.model_validate(kept[EXPERIMENT.topic][-1]["vehicle"])
    except (LookupError, TypeError, ValueError, ArithmeticError, ValidationError) as error:
        raise UnidentifiedError(
            f"{path}: its records are not those of an identification flight ({error}). Fly it "
            "again with this release."
        ) from error
    return IdentificationLog(recording, vehicle)
