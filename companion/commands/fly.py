"""What ``companion fly`` does: configure, check, fly, score, draw, tell."""

import json
import re
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TextIO

from rich.console import Console
from rich.text import Text

from companion.commands.fly_again import flying_command
from companion.config.models import MissionConfig
from companion.config.resolve import FlightConfig, controller_path, load_flight
from companion.config.yaml_source import ConfigError, settings_of
from companion.experiments.provenance import commit, version
from companion.flight.assemble import attitude_gains, infeasibilities, make_stack, make_trajectory
from companion.flight.assemble_plus import thrust_before_asking
from companion.flight.beginning import (
    begin_log,
    check_sharing,
    discard_log,
    key_to_sign_with,
    shim_options,
)
from companion.flight.conduct import Outcome, OutcomeName
from companion.flight.configuration_record import configuration_record
from companion.flight.errors import ShimRefusedError
from companion.flight.records import CHANNELS
from companion.flight.shim_process import ShimOptions
from companion.link.link import LinkError
from companion.link.url import parse_link_url
from companion.live.access import is_loopback
from companion.live.beside import LivePage, LivePageError, PageOptions, start_page
from companion.mocap.sources import MocapError
from companion.recording.flight_log import FlightLog, FlightLogError
from companion.report.aftermath import score_and_draw
from companion.report.flight_page import NAME as PAGE_NAME
from companion.report.pages.provenance import Provenance
from companion.report.result import result_object
from companion.report.summary import print_summary
from companion.report.terminal import TerminalObserver
from companion.trajectories.from_file import TrajectoryFileError
from companion.trajectories.trajectory import Trajectory

_R_MAX_WARNING_SHARE = 0.5
_WIDE = 1000


class BadInputError(Exception):
    """What was asked for can't be done as asked; the text names what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class FlyRequest:
    """The options of the command line."""

    mission_file: Path | None
    overrides: Mapping[str, object]
    settings: tuple[str, ...]
    """``KEY=VALUE`` each."""
    lockstep: bool
    out: Path | None
    json_output: bool
    verbose: bool
    signing_key_file: Path | None = None
    """Wins over the mission's."""
    live: PageOptions | None = None
    """Show the flight on a page while it flies."""


def run_fly(request: FlyRequest) -> OutcomeName:
    """Fly as asked and tell about it.

    Raises:
        BadInputError: nothing was started.
    """
    console = _console(sys.stderr)
    try:
        config = load_flight(request.mission_file, request.overrides, settings_of(request.settings))
        trajectory = make_trajectory(config.mission)
        _check_controller(config)
        shim = shim_options(config, lockstep=request.lockstep)
        key = key_to_sign_with(config.mission, request.signing_key_file)
        if shim is not None:
            shim = replace(shim, signing_key=key)
        if config.mission.connect is not None:
            parse_link_url(config.mission.connect)
        check_sharing(config.mission, lockstep=request.lockstep)
        if request.live is not None and request.lockstep:
            raise ConfigError(
                "a flight in lockstep is over before anybody could look: leave --live out, and "
                "look at it afterwards with `companion live FOLDER`."
            )
    except (ConfigError, TrajectoryFileError, LinkError) as error:
        raise BadInputError(str(error)) from error
    problems = infeasibilities(trajectory, config.mission, config.vehicle)
    if problems:
        return _refuse(config, "\n".join(problems), request, console)

    folder = request.out or _new_folder(config.mission)
    started = time.perf_counter()
    is_new = not folder.exists()
    try:
        log = begin_log(folder, CHANNELS, lockstep=request.lockstep)
    except FlightLogError as error:
        raise BadInputError(str(error)) from error
    page = None
    try:
        if request.live is not None:
            page = _show_live(config, log, request.live, console)
        with TerminalObserver(console, verbose=request.verbose) as observer:
            outcome = _fly(config, trajectory, log, observer, shim, key, lockstep=request.lockstep)
    except (LinkError, MocapError, ShimRefusedError, LivePageError) as error:
        if page is not None:
            page.feed.end(time.monotonic(), {"outcome": "refused", "note": str(error)})
        log.close()
        discard_log(folder, folder_too=is_new)
        raise BadInputError(str(error)) from error
    finally:
        log.close()
    wall_s = time.perf_counter() - started

    made = Provenance(_command(request), version(), commit())
    result, trouble = score_and_draw(config, outcome, folder, wall_s, made)
    if trouble is not None:
        console.print(f"warning: {folder} is not complete: {trouble}", style="yellow")
    if log.trouble is not None:
        console.print(f"warning: {log.trouble}", style="yellow")
    if outcome.r_max_active_share > _R_MAX_WARNING_SHARE:
        console.print(
            f"warning: the bound r_max was active in {outcome.r_max_active_share:.0%} of the "
            "plans; r2 is being clipped most of the time. Raise controller.mpc.r_max_m_s2 if "
            "tracking suffers.",
            style="yellow",
        )
    if page is not None:
        page.feed.end(time.monotonic(), result)
    _tell(result, request)
    if (folder / PAGE_NAME).is_file() and not request.json_output:
        where = Text(f"{'page':<16}", style="dim").append(str(folder / PAGE_NAME), "not dim")
        _console(sys.stdout).print(where, soft_wrap=True)
    return outcome.outcome


def _fly(
    config: FlightConfig,
    trajectory: Trajectory,
    log: FlightLog,
    observer: TerminalObserver,
    shim: ShimOptions | None,
    key: bytes | None,
    *,
    lockstep: bool,
) -> Outcome:
    if lockstep:
        from companion.lockstep import fly_in_lockstep

        assert shim is not None
        return fly_in_lockstep(config, trajectory, log, observer, shim, signing_key=key)
    from companion.flight.real_time import fly_in_real_time

    return fly_in_real_time(config, trajectory, log, observer, shim, signing_key=key)


def _show_live(
    config: FlightConfig, log: FlightLog, options: PageOptions, console: Console
) -> LivePage:
    """Serve the flight's page, and say where.

    Raises:
        LivePageError: it can't be served.
    """
    page = start_page(configuration_record(config, replayable=True), options.host, options.port)
    log.listener = page.feed
    console.print(f"live page: {page.url}", soft_wrap=True)
    if not is_loopback(options.host):
        console.print(
            "warning: others on the network can look on; who has the address with its token can "
            "land the vehicle, or abort the flight.",
            style="yellow",
        )
    return page


def _check_controller(config: FlightConfig) -> None:
    """Refuse what no law can be made of, and what must not leave the simulator.

    Raises:
        ConfigError: with the controller's file and the remedy.
    """
    controller, mission = config.controller, config.mission
    if mission.setpoint == "rates":
        attitude_gains(config.vehicle)
    try:
        make_stack(
            controller,
            config.vehicle,
            mission,
            thrust=thrust_before_asking(config.vehicle),
        )
    except ConfigError as error:
        path = controller_path(mission.controller, config.vehicle.name)
        raise ConfigError(f"{path}: {error}") from error
    if mission.connect and controller.l1 and controller.l1.discretisation == "euler":
        raise ConfigError(
            "the explicit Euler step (controller.l1.discretisation) is for study in the simulator: "
            "it is unstable for Γ dt > 1. Leave --connect or the setting out."
        )


def _new_folder(mission: MissionConfig) -> Path:
    """A folder under flights/ that does not exist yet."""
    stamp = datetime.now(UTC).astimezone().strftime("%Y%m%d-%H%M%S")
    name = re.sub(r"[^A-Za-z0-9-]+", "-", Path(str(mission.trajectory)).stem)
    base = Path("flights") / f"{stamp}-traj-{name}"
    folder, number = base, 2
    while folder.exists():
        folder = base.with_name(f"{base.name}-{number}")
        number += 1
    return folder


def _command(request: FlyRequest) -> str:
    return flying_command(
        request.mission_file,
        request.overrides,
        request.settings,
        request.signing_key_file,
        lockstep=request.lockstep,
    )


def _refuse(
    config: FlightConfig, reason: str, request: FlyRequest, console: Console
) -> OutcomeName:
    outcome = Outcome("refused", False, reason, None, 0, 0, 0, None, None, 0.0, 0.0)
    result = result_object(config.mission, outcome, None, wall_s=0.0, log_dir=None)
    console.print(f"refused: {reason}", style="red")
    if request.json_output:
        _tell(result, request)
    return "refused"


def _tell(result: dict[str, Any], request: FlyRequest) -> None:
    """The result on stdout: one JSON object, or a table."""
    if request.json_output:
        sys.stdout.write(json.dumps(result, allow_nan=False) + "\n")
    else:
        print_summary(_console(sys.stdout), result)


def _console(stream: TextIO) -> Console:
    """What is not for a terminal is not wrapped."""
    width = None if stream.isatty() else _WIDE
    return Console(file=stream, highlight=False, width=width)
