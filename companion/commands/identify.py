"""What ``companion identify`` does: fly an excitation, or read one again, and make files of it."""

import json
import re
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal, TextIO

from rich.console import Console

from companion.config.models import VehicleConfig
from companion.config.resolve import FlightConfig, find_config
from companion.config.validation import validate
from companion.config.yaml_source import (
    ConfigError,
    Source,
    read_yaml,
    settings_of,
    with_settings,
)
from companion.experiments.identification_files import conclude
from companion.experiments.identification_flight import (
    BOX_M,
    HEIGHT_M,
    IdentificationPlan,
    load_identification,
    plan_identification,
)
from companion.experiments.progress import ProgressDisplay
from companion.experiments.provenance import version
from companion.flight.beginning import (
    begin_log,
    check_sharing,
    discard_log,
    key_to_sign_with,
    shim_options,
)
from companion.flight.conduct import Outcome
from companion.flight.errors import ShimRefusedError
from companion.flight.experiment import EXPERIMENT_CHANNELS
from companion.flight.records import CHANNELS
from companion.flight.shim_process import ShimOptions
from companion.identification.estimates import UnidentifiedError
from companion.identification.excitation_stack import HOLD
from companion.identification.identify import identify
from companion.identification.recording import Recording
from companion.identification.vehicle_file import check_name
from companion.link.link import LinkError
from companion.link.url import parse_link_url
from companion.mocap.sources import MocapError
from companion.recording.flight_log import MCAP_NAME, FlightLog, FlightLogError
from companion.report.identification_log import IdentificationLog, read_identification
from companion.report.identification_table import print_identification
from companion.report.result import result_object, write_result
from companion.report.terminal import TerminalObserver

Verdict = Literal["identified", "uncertified", "unidentified", "refused", "aborted"]
_WIDE = 1000
_OF_VEHICLE = "vehicle."
_OPTION_OF = {"link.system_id": "--system-id", "mocap.system": "--mocap"}


class BadInputError(Exception):
    """What was asked for can't be done as asked; the text names what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class IdentifyRequest:
    """The options of the command line."""

    mission_file: Path | None = None
    overrides: Mapping[str, object] = field(default_factory=dict)
    settings: tuple[str, ...] = ()
    """``KEY=VALUE`` each."""
    log: Path | None = None
    """Read this flight's log in place of flying."""
    name: str | None = None
    """What the vehicle is called in the files."""
    box_m: float | None = None
    """None: `BOX_M`."""
    height_m: float | None = None
    """None: `HEIGHT_M`."""
    lockstep: bool = False
    out: Path | None = None
    json_output: bool = False
    verbose: bool = False
    signing_key_file: Path | None = None


def run_identify(request: IdentifyRequest) -> Verdict:
    """Identify as asked, and tell about it.

    Raises:
        BadInputError: nothing was started.
    """
    console = _console(sys.stderr)
    if request.log is not None:
        return _from_log(request, request.log, console)
    try:
        config = load_identification(
            request.mission_file,
            request.overrides,
            settings_of(request.settings),
            name=request.name,
        )
        check_name(config.vehicle.name if request.name is None else request.name)
        plan = plan_identification(
            config,
            box_m=BOX_M if request.box_m is None else request.box_m,
            height_m=HEIGHT_M if request.height_m is None else request.height_m,
        )
        shim = shim_options(plan.config, lockstep=request.lockstep)
        key = key_to_sign_with(config.mission, request.signing_key_file)
        if shim is not None:
            shim = replace(shim, signing_key=key)
        if config.mission.connect is not None:
            parse_link_url(config.mission.connect)
        check_sharing(config.mission, lockstep=request.lockstep)
    except (ConfigError, LinkError) as error:
        raise BadInputError(str(error)) from error

    folder = request.out or _new_folder(config.vehicle)
    is_new = not folder.exists()
    began_s = time.perf_counter()
    try:
        log = begin_log(folder, (*CHANNELS, *EXPERIMENT_CHANNELS), lockstep=request.lockstep)
    except FlightLogError as error:
        raise BadInputError(str(error)) from error
    try:
        with TerminalObserver(console, verbose=request.verbose) as observer:
            outcome = _fly(plan, log, observer, shim, key, lockstep=request.lockstep)
    except (LinkError, MocapError, ShimRefusedError) as error:
        log.close()
        discard_log(folder, folder_too=is_new)
        raise BadInputError(str(error)) from error
    finally:
        log.close()
    if log.trouble is not None:
        console.print(f"warning: {log.trouble}", style="yellow")
    wall_s = time.perf_counter() - began_s
    _keep_result(plan.config, outcome, folder, wall_s, console)
    if outcome.outcome == "refused":
        return _end("refused", outcome.note, request, folder, console)
    if outcome.outcome == "aborted" or not outcome.completed:
        note = (
            f"{outcome.note.rstrip('.')}. Not identified: the excitation was not flown to its end. "
            f"`companion identify --log {folder}` tries it with what there is."
        )
        return _end("aborted", note, request, folder, console)
    return _conclude(request, folder, folder, _flown(config), console)


def _from_log(request: IdentifyRequest, folder: Path, console: Console) -> Verdict:
    """Identify from a flight that was flown already.

    Raises:
        BadInputError: options that only a flight could heed.
    """
    unheeded = _only_of_a_flight(request)
    if unheeded:
        raise BadInputError(
            "--log reads a flight that was flown; nothing is connected or simulated. Leave "
            f"{', '.join(unheeded)} out, or --log."
        )
    try:
        if request.name is not None:
            check_name(request.name)
        _named_vehicle(request)
    except ConfigError as error:
        raise BadInputError(str(error)) from error
    if not (folder / MCAP_NAME).is_file():
        raise BadInputError(
            f"{folder}: there is no {MCAP_NAME} in it. Give the folder of a flight of "
            "`companion identify`."
        )
    return _conclude(request, folder, request.out or folder, f"from the log {folder}", console)


def _only_of_a_flight(request: IdentifyRequest) -> list[str]:
    """The options given that only a flight could heed: all but the vehicle's and the files'."""
    given = {
        "--mission": request.mission_file is not None,
        "--lockstep": request.lockstep,
        "--box": request.box_m is not None,
        "--height": request.height_m is not None,
        "--signing-key-file": request.signing_key_file is not None,
    }
    found = [option for option, is_given in given.items() if is_given]
    found += [f"--{key}" for key in request.overrides if key != "vehicle"]
    keys = [pair.partition("=")[0].strip() for pair in request.settings]
    found += [
        _OPTION_OF.get(key, f"--set {key}") for key in keys if not key.startswith(_OF_VEHICLE)
    ]
    return found


def _conclude(
    request: IdentifyRequest, log: Path, out: Path, how: str, console: Console
) -> Verdict:
    """From a log to the files; `how` it was flown goes into the vehicle's."""
    try:
        kept = read_identification(log)
        vehicle = _vehicle(request, kept.vehicle)
    except ConfigError as error:
        raise BadInputError(str(error)) from error
    except UnidentifiedError as error:
        return _end("unidentified", str(error), request, log, console)
    console.print(_played(kept.recording))
    if request.log is not None:  # a flight has told it by itself
        for _, left in kept.recording.left:
            console.print(f"warning: {left}", style="yellow")
    try:
        out.mkdir(parents=True, exist_ok=True)
        console.print("fitting, and looking for gains that hold: about a minute")
        identified = identify(kept.recording, thrust_curve=vehicle.thrust_curve)
        with ProgressDisplay("looking for gains", "rounds") as display:
            result = conclude(
                identified,
                kept.recording,
                vehicle,
                out,
                _source(how, kept),
                progress=lambda done, total: display(done, total, None),
            )
    except UnidentifiedError as error:
        return _end("unidentified", str(error), request, log, console)
    except OSError as error:
        raise BadInputError(
            f"{out}: can't be written: {error.strerror or error}. Choose another folder with --out."
        ) from error
    if request.json_output:
        sys.stdout.write(json.dumps(result.record, allow_nan=False, ensure_ascii=False) + "\n")
    else:
        print_identification(_console(sys.stdout), identified, result, verbose=request.verbose)
    return "identified" if result.certified else "uncertified"


def _flown(config: FlightConfig) -> str:
    """How a flight was flown."""
    if config.mission.connect is not None:
        return f"flown on {datetime.now(UTC).astimezone():%Y-%m-%d}"
    return f"flown in the embedded shim, seed {config.mission.seed}"


def _source(how: str, kept: IdentificationLog) -> str:
    """When and how, for the vehicle's file."""
    words = [f"companion identify {version()}", f"under {kept.recording.autopilot}", how]
    return f"{', '.join(words)}. The limits are those that were known before."


def _vehicle(request: IdentifyRequest, flown: VehicleConfig) -> VehicleConfig:
    """The vehicle whose name and limits the file takes over: the one that was flown.

    Where a log is read again, options may say it differently.

    Raises:
        ConfigError: they say what no vehicle can be.
    """
    vehicle = flown
    if request.log is not None:
        source = _named_vehicle(request) or Source(
            f"the vehicle in {request.log}", flown.model_dump(mode="json"), {}
        )
        vehicle = validate(VehicleConfig, _with_limits(request, source))
    return vehicle if request.name is None else vehicle.model_copy(update={"name": request.name})


def _named_vehicle(request: IdentifyRequest) -> Source | None:
    """The file of the vehicle that was named; None if none was.

    Raises:
        ConfigError: there is no such vehicle, or not with what is set of it.
    """
    name = request.overrides.get("vehicle")
    if not isinstance(name, str):
        return None
    source = read_yaml(find_config("vehicle", name))
    validate(VehicleConfig, _with_limits(request, source))
    return source


def _with_limits(request: IdentifyRequest, source: Source) -> Source:
    """A vehicle with what `--set vehicle.…` says of it."""
    said = settings_of(request.settings)
    settings = {key.removeprefix(_OF_VEHICLE): value for key, value in said.items()}
    return with_settings(source, settings, _OF_VEHICLE)


def _fly(
    plan: IdentificationPlan,
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
        return fly_in_lockstep(
            plan.config,
            plan.trajectory,
            log,
            observer,
            shim,
            signing_key=key,
            experiment=plan.experiment,
        )
    from companion.flight.real_time import fly_in_real_time

    return fly_in_real_time(
        plan.config,
        plan.trajectory,
        log,
        observer,
        shim,
        signing_key=key,
        experiment=plan.experiment,
    )


def _played(recording: Recording) -> str:
    """What of the excitation was flown, in one line."""
    names: list[str] = []
    counts: list[int] = []
    for name in recording.segment.tolist():
        if not names or names[-1] != name:
            names.append(name)
            counts.append(0)
        counts[-1] += 1
    seconds = recording.time_s[-1] - recording.time_s[0]
    each: dict[str, int] = {}
    for name, count in zip(names, counts, strict=True):
        if name != HOLD:
            each[name] = each.get(name, 0) + count
    said = ", ".join(f"{name} {count}" for name, count in each.items())
    return f"{len(recording)} samples in {seconds:.0f} s under {recording.autopilot}: {said}"


def _keep_result(
    config: FlightConfig, outcome: Outcome, folder: Path, wall_s: float, console: Console
) -> None:
    """`result.json` beside the log, as of any flight."""
    result = result_object(config.mission, outcome, None, wall_s=wall_s, log_dir=folder.resolve())
    try:
        write_result(folder, result)
    except OSError as error:
        console.print(f"warning: {folder} is not complete: {error}", style="yellow")


def _end(
    verdict: Verdict, note: str, request: IdentifyRequest, folder: Path, console: Console
) -> Verdict:
    """Tell that there are no figures, and why."""
    console.print(f"{verdict}: {note}", style="red")
    if request.json_output:
        said: dict[str, Any] = {"verdict": verdict, "note": note, "log_dir": str(folder.resolve())}
        sys.stdout.write(json.dumps(said, ensure_ascii=False) + "\n")
    return verdict


def _new_folder(vehicle: VehicleConfig) -> Path:
    """A folder under flights/ that does not exist yet."""
    stamp = datetime.now(UTC).astimezone().strftime("%Y%m%d-%H%M%S")
    name = re.sub(r"[^A-Za-z0-9-]+", "-", vehicle.name)
    base = Path("flights") / f"{stamp}-identify-{name}"
    folder, number = base, 2
    while folder.exists():
        folder = base.with_name(f"{base.name}-{number}")
        number += 1
    return folder


def _console(stream: TextIO) -> Console:
    """What is not for a terminal is not wrapped."""
    return Console(file=stream, highlight=False, width=None if stream.isatty() else _WIDE)
