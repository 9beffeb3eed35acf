"""From what was identified to the files and the certificate of an identification."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from companion.config.models import MissionConfig, VehicleConfig
from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.experiments.certified import certificate_subject
from companion.experiments.controller_file import write_whole
from companion.identification.estimates import Identified
from companion.identification.files import WrittenFiles, write_files
from companion.identification.record import identification_record
from companion.identification.recording import Recording
from companion.report.identification_table import Concluded
from companion.theory.certificate import Certificate, certify

JSON_NAME = "identify.json"
_GAP_S = 0.05
_WIND_M_S = 4.5
"""As `companion certify` reckons with by default."""


def conclude(
    identified: Identified, recording: Recording, base: VehicleConfig, folder: Path, source: str
) -> Concluded:
    """Write the files, and certify the gains that were derived; about a minute.

    Args:
        identified: what was found.
        recording: in which.
        base: the vehicle's name and limits.
        folder: exists.
        source: when and how it was identified.

    Raises:
        OSError: something can't be written.
    """
    rate_hz = _rate_hz(recording)
    written = write_files(
        identified,
        base,
        folder,
        source=source,
        climb_rate_field=recording.thrust_meaning.kind == "climb_rate",
        shaped_commands=recording.autopilot == "ardupilot",
        state_rate_hz=rate_hz,
    )
    certificate, note = _certificate(written, rate_hz)
    certified = certificate is not None and certificate.holds
    record: dict[str, Any] = {
        "verdict": "identified" if certified else "uncertified",
        "note": note,
        "vehicle": written.vehicle.name,
        "source": source,
        "autopilot": recording.autopilot,
        "thrust_field": recording.thrust_meaning.kind,
        "certified": certified,
        **identification_record(identified, written.recommendation),
        "files": [str(path) for path in (*written.paths, folder / JSON_NAME)],
    }
    text = json.dumps(record, indent=2, allow_nan=False, ensure_ascii=False)
    write_whole(folder / JSON_NAME, text + "\n")
    return Concluded(certified, note, certificate, record)


def _rate_hz(recording: Recording) -> float:
    """Of the samples; their times jitter, and some are lost."""
    steps_s = np.diff(recording.time_s)
    return float(round(1.0 / float(np.mean(steps_s[steps_s < _GAP_S]))))


def _certificate(written: WrittenFiles, rate_hz: float) -> tuple[Certificate | None, str]:
    """Of the gains of `mpc-l1`, with what is to be said where they have none."""
    if written.recommendation is None:
        return None, written.note
    mission = MissionConfig(state_rate_hz=rate_hz)
    config = FlightConfig(mission, written.vehicle, written.recommendation.controller)
    try:
        certificate = certify(certificate_subject(config, _WIND_M_S))
    except (ConfigError, ValueError) as error:
        return None, f"no certificate: {error}"
    reasons = [
        f"{axis.axis}: {condition.reason}"
        for axis in certificate.axes
        for condition in axis.conditions
        if condition.reason
    ]
    return certificate, "; ".join(reasons)
