"""What ``companion check`` does: configure, connect, judge, tell; with leave, set and restore."""

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from rich.console import Console
from rich.text import Text

from companion.config.resolve import FlightConfig, load_flight
from companion.config.signing_key import signing_key
from companion.config.yaml_source import ConfigError, settings_of
from companion.flight.assemble import make_trajectory
from companion.flight.check.checking import Checked, CheckOrder, Tell
from companion.flight.check.restore_file import RestoreFileError, RestoreList, read_restore_file
from companion.flight.embedded_shim import embedded_shim
from companion.flight.errors import ShimRefusedError
from companion.flight.shim_process import ShimOptions
from companion.link.link import LinkError
from companion.link.url import parse_link_url
from companion.preflight.finding import Verdict, worst
from companion.report.findings import findings_object, print_findings
from companion.trajectories.from_file import TrajectoryFileError

_WIDTH = 80
_STYLES = {"warning": "yellow", "error": "red"}


class BadInputError(Exception):
    """What was asked for can't be done as asked; the text names what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class CheckRequest:
    """The options of the command line."""

    mission_file: Path | None
    overrides: Mapping[str, object]
    settings: tuple[str, ...]
    """``KEY=VALUE`` each."""
    lockstep: bool = False
    fix: bool = False
    restore: Path | None = None
    out: Path | None = None
    """The restore file of ``--fix``."""
    signing_key_file: Path | None = None
    json_output: bool = False


def run_check(request: CheckRequest) -> Verdict:
    """Check as asked and tell about it.

    Returns:
        The worst verdict.

    Raises:
        BadInputError: nothing was connected to.
        KeyboardInterrupt: a person ended it.
    """
    try:
        config = load_flight(request.mission_file, request.overrides, settings_of(request.settings))
        order = CheckOrder(
            config,
            make_trajectory(config.mission),
            fix_into=_restore_file(request),
            restore=_restore_list(request, config),
        )
        shim = _shim_options(config, lockstep=request.lockstep)
        key = _signing_key(config, request)
        if shim is not None:
            shim = replace(shim, signing_key=key)
        if config.mission.connect is not None:
            parse_link_url(config.mission.connect)
    except (ConfigError, TrajectoryFileError, LinkError, RestoreFileError) as error:
        raise BadInputError(str(error)) from error
    console = _console(sys.stderr if request.json_output else sys.stdout)

    def tell(severity: str, text: str) -> None:
        console.print(Text(text, style=_STYLES.get(severity, "")), soft_wrap=True)

    try:
        checked = _check(order, tell, shim, key, lockstep=request.lockstep)
    except (LinkError, ShimRefusedError) as error:
        raise BadInputError(str(error)) from error
    if checked.restored and request.restore is not None:
        request.restore.unlink(missing_ok=True)
    _show(checked, config, request, console)
    return worst(checked.findings)


def _check(
    order: CheckOrder,
    tell: Tell,
    shim: ShimOptions | None,
    key: bytes | None,
    *,
    lockstep: bool,
) -> Checked:
    if lockstep:
        from companion.lockstep import check_in_lockstep

        assert shim is not None
        return check_in_lockstep(order, tell, shim, signing_key=key)
    from companion.flight.check.check_real_time import check_in_real_time

    return check_in_real_time(order, tell, shim, signing_key=key)


def _shim_options(config: FlightConfig, *, lockstep: bool) -> ShimOptions | None:
    if config.mission.connect is None:
        return embedded_shim(config)
    if lockstep:
        raise ConfigError(
            "--lockstep belongs to the embedded shim; with --connect time is real. Leave one of "
            "the two out."
        )
    return None


def _signing_key(config: FlightConfig, request: CheckRequest) -> bytes | None:
    """The key with which packets are signed, if they are.

    Raises:
        ConfigError: there is one, or should be, and it is not to be had or not kept well.
    """
    signing = config.mission.link.signing
    path = request.signing_key_file
    if path is None and signing is not None and signing.key_file is not None:
        path = Path(signing.key_file)
    return signing_key(path, os.environ, wanted=signing is not None)


def _restore_list(request: CheckRequest, config: FlightConfig) -> RestoreList | None:
    if request.restore is None:
        return None
    if request.fix:
        raise ConfigError("--fix sets parameters and --restore sets them back: give one of them.")
    if config.mission.connect is None:
        raise ConfigError(
            "--restore needs the vehicle that the parameters were set on: give --connect."
        )
    return read_restore_file(request.restore)


def _restore_file(request: CheckRequest) -> Path | None:
    if not request.fix:
        if request.out is not None and request.restore is not None:
            raise ConfigError(
                "--out does not go with --restore: its list is read, none is written."
            )
        if request.out is not None:
            raise ConfigError("--out names the restore file of --fix: give both, or neither.")
        return None
    stamp = datetime.now(UTC).astimezone().strftime("%Y%m%d-%H%M%S")
    return request.out or Path(f"restore-{stamp}.json")


def _show(checked: Checked, config: FlightConfig, request: CheckRequest, console: Console) -> None:
    mission = config.mission
    link = mission.connect or f"the embedded shim ({config.vehicle.name})"
    if request.json_output:
        data = findings_object(checked.findings, checked.facts, link)
        sys.stdout.write(json.dumps(data, allow_nan=False, ensure_ascii=False) + "\n")
        return
    print_findings(console, checked.findings, f"check of {link}")


def _console(stream: TextIO) -> Console:
    """What is not for a terminal is as wide as a narrow one."""
    return Console(file=stream, highlight=False, width=None if stream.isatty() else _WIDTH)
