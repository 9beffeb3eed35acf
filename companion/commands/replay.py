"""What ``companion replay`` does: read a flight's log, feed it through the controller, compare."""

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from companion.config.yaml_source import ConfigError
from companion.flight.assemble import recorded_trajectory
from companion.flight.configuration_record import made_by
from companion.flight.replay.question import with_controller
from companion.flight.replay.recorded import RecordedFlight, ReplayError, read_flight
from companion.flight.replay.replay import Replay, replay
from companion.recording.whole_file import made_whole, write_whole
from companion.report.replay_figure import draw_replay
from companion.report.replay_figures import ReplayFigures, replay_figures
from companion.trajectories.from_file import TrajectoryFileError

_WIDE = 1000
_SHOWN = 5


class BadInputError(Exception):
    """What was asked for can't be done as asked; the text names what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class ReplayRequest:
    """The options of the command line."""

    log: Path
    """A flight's folder, or one of its two files."""
    controller: str | None
    """To ask what this one would have sent; None: the one that flew."""
    json_output: bool
    out: Path | None = None
    """Where `replay.json` and `replay.png` go; None: the flight's folder."""


def run_replay(request: ReplayRequest) -> int:
    """Replay and tell.

    Returns:
        Exit code: 0 if every setpoint is the same, bit for bit, or another controller was asked
        for; else 1.

    Raises:
        BadInputError: the log cannot be replayed.
    """
    try:
        flight = read_flight(request.log)
        config = flight.config
        if request.controller is not None:
            config = with_controller(config, request.controller)
        replayed = replay(
            flight, recorded_trajectory(flight.config, flight.trajectory_text), config
        )
    except (ReplayError, ConfigError, TrajectoryFileError) as error:
        raise BadInputError(str(error)) from error
    if not replayed.setpoints:
        raise BadInputError(f"{request.log}: no setpoint left in this flight: nothing to replay.")
    figures = replay_figures(replayed)
    record = _record(request, flight, replayed, figures)
    trouble = _write(request, flight, figures, record)
    if request.json_output:
        sys.stdout.write(json.dumps(record, allow_nan=False) + "\n")
    else:
        _tell(request, record, replayed)
    if trouble:
        Console(file=sys.stderr, highlight=False).print(f"warning: {trouble}", style="yellow")
    return 0 if replayed.identical or request.controller is not None else 1


def _record(
    request: ReplayRequest, flight: RecordedFlight, replayed: Replay, figures: ReplayFigures
) -> dict[str, Any]:
    flown = flight.config.mission.controller
    return {
        "log": str(request.log),
        "flown": flown,
        "replayed": request.controller or flown,
        **figures.record(),
        "first_difference_s": replayed.differing[0].time_s if replayed.differing else None,
        "made_by": dict(flight.made_by),
        "differs_in": _differs_in(flight.made_by),
    }


def _differs_in(recorded: Mapping[str, str]) -> dict[str, list[str]]:
    """Versions and machine that are not those of the flight: then, and now."""
    now = made_by()
    return {
        name: [recorded.get(name, ""), now.get(name, "")]
        for name in sorted({*recorded, *now})
        if recorded.get(name) != now.get(name)
    }


def _write(
    request: ReplayRequest,
    flight: RecordedFlight,
    figures: ReplayFigures,
    record: Mapping[str, Any],
) -> str:
    """Write file and picture; what is wrong with that, empty if nothing."""
    log = request.log
    folder = request.out or (log.parent if log.suffix in (".mcap", ".tlog") else log)
    flown = flight.config.mission.controller
    try:
        write_whole(folder / "replay.json", json.dumps(record, allow_nan=False, indent=2) + "\n")
        made_whole(
            folder / "replay.png",
            lambda path: draw_replay(figures, flown, record["replayed"], path),
        )
    except OSError as error:
        return f"nothing was written to {folder}: {error.strerror or error}. Name one with --out."
    return ""


def _tell(request: ReplayRequest, record: Mapping[str, Any], replayed: Replay) -> None:
    console = Console(file=sys.stdout, highlight=False)
    if not sys.stdout.isatty():
        console.width = _WIDE
    table = Table(show_header=False, box=None, padding=(0, 2, 0, 0))
    table.add_row("flown with", record["flown"])
    if request.controller is not None:
        table.add_row("replayed with", record["replayed"])
    table.add_row("setpoints", f"{record['setpoints']:,}")
    table.add_row("identical", f"{record['identical']:,}")
    if record["unmatched"]:
        table.add_row("not compared", f"{record['unmatched']:,}, of which the log lacks a part")
    for name, said in record["differs_in"].items():
        table.add_row(f"{name}", f"{said[0] or 'unknown'} then, {said[1] or 'unknown'} now")
    if replayed.differing:
        rates = "rate_rms_deg_s" in record
        unit = "deg/s" if rates else "°"
        rms, most = (
            (record["rate_rms_deg_s"], record["rate_max_deg_s"])
            if rates
            else (record["tilt_rms_deg"], record["tilt_max_deg"])
        )
        if rms is not None:
            table.add_row("rates" if rates else "tilt", f"{rms:.3g} {unit} rms, {most:.3g} most")
            table.add_row(
                "thrust", f"{record['thrust_rms']:.3g} rms, {record['thrust_max']:.3g} most"
            )
    console.print(table)
    if request.controller is None:
        for setpoint in replayed.differing[:_SHOWN]:
            made = "nothing" if setpoint.replayed is None else setpoint.replayed.hex()
            console.print(
                f"differs at {setpoint.time_s:.3f} s ({setpoint.phase}): "
                f"{setpoint.recorded.hex()} then, {made} now",
                style="yellow",
            )
    if replayed.identical:
        console.print("every setpoint is the same, bit for bit", style="green")
