"""From what was identified to the files and the certificates of an identification."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from companion.config.models import ControllerConfig, MissionConfig, VehicleConfig
from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.experiments.certified import certificate_subject, plus_subject
from companion.identification.estimates import Identified
from companion.identification.files import Derived, derive, write_files
from companion.identification.record import identification_record
from companion.identification.recording import Recording
from companion.recording.whole_file import write_whole
from companion.report.identification_table import Concluded, GainsVerdict, wide_figures
from companion.theory.certificate import certify
from companion.theory.plus_certificate import certify_plus

JSON_NAME = "identify.json"
_GAP_S = 0.05
_WIND_M_S = 4.5
"""As `companion certify` reckons with by default."""


def conclude(
    identified: Identified,
    recording: Recording,
    base: VehicleConfig,
    folder: Path,
    source: str,
    progress: Callable[[int, int], None] | None = None,
) -> Concluded:
    """Derive gains and certify them, about a minute; then write the files.

    Args:
        identified: what was found.
        recording: in which.
        base: the vehicle's name and limits.
        folder: exists.
        source: when and how it was identified.
        progress: told how many rounds of the search for gains are done, and of how many.

    Raises:
        OSError: something can't be written.
    """
    rate_hz = _rate_hz(recording)
    derived = derive(
        identified,
        base,
        source=source,
        climb_rate_field=recording.thrust_meaning.kind == "climb_rate",
        shaped_commands=recording.autopilot == "ardupilot",
        state_rate_hz=rate_hz,
        progress=progress,
    )
    verdicts = (_paper_verdict(derived, rate_hz), _plus_verdict(derived, rate_hz))
    certified = all(verdict.holds for verdict in verdicts)
    wide = wide_figures(identified)
    notes = [f"{v.controller}: {v.note}" for v in verdicts if not v.holds]
    (folder / JSON_NAME).unlink(missing_ok=True)
    paths = write_files(derived, folder)
    record: dict[str, Any] = {
        "verdict": "identified" if certified else "uncertified",
        "note": "; ".join([*notes, *wide]),
        "vehicle": derived.vehicle.name,
        "source": source,
        "autopilot": recording.autopilot,
        "thrust_field": recording.thrust_meaning.kind,
        "certified": certified,
        "certificates": {v.controller: {"holds": v.holds, "note": v.note} for v in verdicts},
        "wide_intervals": list(wide),
        **identification_record(identified, derived.recommendation),
        "files": [str(path) for path in (*paths, folder / JSON_NAME)],
    }
    text = json.dumps(record, indent=2, allow_nan=False, ensure_ascii=False)
    write_whole(folder / JSON_NAME, text + "\n")
    return Concluded(verdicts, wide, record)


def _rate_hz(recording: Recording) -> float:
    """Of the samples; their times jitter, and some are lost."""
    steps_s = np.diff(recording.time_s)
    return float(round(1.0 / float(np.mean(steps_s[steps_s < _GAP_S]))))


def _paper_verdict(derived: Derived, rate_hz: float) -> GainsVerdict:
    """On the gains of `mpc-l1`, with what is to be said where there are none."""
    name = "mpc-l1"
    if derived.recommendation is None:
        return GainsVerdict(name, holds=False, note=derived.note)
    config = _config(derived, derived.recommendation.controller, rate_hz)
    try:
        certificate = certify(certificate_subject(config, _WIND_M_S))
    except (ConfigError, ValueError) as error:
        return GainsVerdict(name, holds=False, note=f"no certificate: {error}")
    return GainsVerdict.of(name, certificate)


def _plus_verdict(derived: Derived, rate_hz: float) -> GainsVerdict:
    """On the gains of `mpc-l1-plus`."""
    name = "mpc-l1-plus"
    config = _config(derived, derived.plus, rate_hz)
    try:
        certificate = certify_plus(plus_subject(config, _WIND_M_S))
    except (ConfigError, ValueError) as error:
        return GainsVerdict(name, holds=False, note=f"no certificate: {error}")
    return GainsVerdict.of(name, certificate)


def _config(derived: Derived, controller: ControllerConfig, rate_hz: float) -> FlightConfig:
    return FlightConfig(MissionConfig(state_rate_hz=rate_hz), derived.vehicle, controller)
