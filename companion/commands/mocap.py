"""What ``companion mocap`` does: poses of a motion-capture system to an autopilot, and no more."""

import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.text import Text

from companion.config.resolve import load_flight
from companion.config.signing_key import signing_key
from companion.config.yaml_source import ConfigError, settings_of
from companion.flight.errors import LinkLostError
from companion.flight.mocap_alone import bridge_alone
from companion.link.link import LinkError
from companion.link.url import parse_link_url
from companion.mocap.sources import MocapError

_STYLES = {"warning": "yellow", "error": "red"}
_WIDE = 1000


class BadInputError(Exception):
    """What was asked for can't be done as asked; the text names what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class MocapRequest:
    """The options of the command line."""

    mission_file: Path | None
    overrides: Mapping[str, object]
    settings: tuple[str, ...]
    """``KEY=VALUE`` each."""
    signing_key_file: Path | None = None


def run_mocap(request: MocapRequest) -> None:
    """Bridge until a person ends it, or the link is lost, which is told.

    Raises:
        BadInputError: nothing was started.
        KeyboardInterrupt: a person ended it.
    """
    try:
        config = load_flight(request.mission_file, request.overrides, settings_of(request.settings))
        mission = config.mission
        if mission.connect is None:
            raise ConfigError(
                "an autopilot is needed that fuses the poses: give --connect, for instance "
                "udpin://127.0.0.1:14540."
            )
        if mission.mocap is None:
            raise ConfigError(
                "the mission says nothing of motion capture: give --mocap SYSTEM, or `mocap` in "
                "the mission."
            )
        url = parse_link_url(mission.connect)
        signing = mission.link.signing
        path = request.signing_key_file
        if path is None and signing is not None and signing.key_file is not None:
            path = Path(signing.key_file)
        key = signing_key(path, os.environ, wanted=signing is not None)
    except (ConfigError, LinkError) as error:
        raise BadInputError(str(error)) from error
    # What is not for a terminal is not wrapped.
    console = Console(stderr=True, highlight=False, width=None if sys.stderr.isatty() else _WIDE)

    def tell(severity: str, text: str) -> None:
        console.print(Text(text, style=_STYLES.get(severity, "")))

    try:
        bridge_alone(mission, url, tell, signing_key=key)
    except (LinkError, MocapError) as error:
        raise BadInputError(str(error)) from error
    except LinkLostError as error:
        tell("error", str(error))
