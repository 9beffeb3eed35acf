"""What a flight's command settles before anything is started, whatever is flown."""

import contextlib
import os
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from companion.config.models import MissionConfig
from companion.config.resolve import FlightConfig
from companion.config.signing_key import signing_key
from companion.config.yaml_source import ConfigError
from companion.flight.embedded_shim import embedded_shim
from companion.flight.shared_link.endpoints import Endpoint
from companion.flight.shim_process import ShimOptions
from companion.flight.stages.mission_backend import require_mavsdk
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, FlightLog
from companion.recording.schema import ChannelSpec

_LOCKSTEP_FLUSH_S = 2.0
"""Of simulated time, some 50 ms of a processor's: the system is asked to write no more often than
a person could kill the flight."""


def check_sharing(mission: MissionConfig, *, lockstep: bool) -> None:
    """Refuse endpoints and a mission backend that cannot be had.

    Raises:
        ConfigError: they need real time, or what is not installed.
        LinkError: an endpoint cannot be one.
    """
    link = mission.link
    if lockstep and (link.forward or link.mission_backend != "companion"):
        raise ConfigError(
            "clients of link.forward, MAVSDK among them, live in real time; with --lockstep there "
            "is none. Leave --lockstep or the setting out."
        )
    for endpoint in link.forward:
        Endpoint(endpoint)
    if link.mission_backend == "mavsdk":
        require_mavsdk()


def key_to_sign_with(mission: MissionConfig, file: Path | None) -> bytes | None:
    """The key with which packets are signed, if they are.

    Args:
        mission: may name the key's file.
        file: wins over the mission's.

    Raises:
        ConfigError: there is one, or should be, and it is not to be had or not kept well.
    """
    signing = mission.link.signing
    path = file
    if path is None and signing is not None and signing.key_file is not None:
        path = Path(signing.key_file)
    return signing_key(path, os.environ, wanted=signing is not None)


def shim_options(config: FlightConfig, *, lockstep: bool) -> ShimOptions | None:
    """The embedded shim, or None for a real autopilot."""
    mission = config.mission
    if mission.connect is not None:
        if "wind" in mission.model_fields_set:
            raise ConfigError(
                "--wind belongs to the embedded shim; with --connect the weather is what it is. "
                "Leave one of the two out (`wind` and `connect` in a mission file)."
            )
        if mission.sensors is not None:
            raise ConfigError(
                "--sensors belongs to the embedded shim; with --connect the vehicle has its own. "
                "Leave one of the two out (`sensors` and `connect` in a mission file)."
            )
        if mission.plant is not None:
            raise ConfigError(
                "`plant` belongs to the embedded shim; with --connect the vehicle is a real one. "
                "Leave one of the two out."
            )
        if mission.faults is not None:
            raise ConfigError(
                "--faults belongs to the embedded shim; a real vehicle is not hurt on purpose. "
                "Leave one of the two out (`faults` and `connect` in a mission file)."
            )
        if lockstep:
            raise ConfigError(
                "--lockstep belongs to the embedded shim; with --connect time is real. Leave one "
                "of the two out."
            )
        return None
    return embedded_shim(config)


def log_begins_us(*, lockstep: bool) -> int:
    """Epoch of the log's time stamps: simulated time begins at a fixed moment."""
    if lockstep:
        return round(datetime(2020, 1, 1, tzinfo=UTC).timestamp() * 1e6)
    from companion.flight.real_time import log_base_us

    return log_base_us()


def begin_log(folder: Path, channels: Sequence[ChannelSpec], *, lockstep: bool) -> FlightLog:
    """Begin the log of a flight.

    Raises:
        FlightLogError: the folder or a file in it cannot be made.
    """
    base_us = log_begins_us(lockstep=lockstep)
    if lockstep:
        return FlightLog(folder, channels, base_us=base_us, flush_interval_s=_LOCKSTEP_FLUSH_S)
    return FlightLog(folder, channels, base_us=base_us)


def discard_log(folder: Path, *, folder_too: bool) -> None:
    """Take back the log of a flight that could not be begun, so that --out can be used again."""
    with contextlib.suppress(OSError):
        for name in (TLOG_NAME, MCAP_NAME):
            (folder / name).unlink(missing_ok=True)
        if folder_too:
            folder.rmdir()
