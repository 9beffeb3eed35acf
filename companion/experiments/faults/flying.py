"""Flies one row under one autopilot, whole, in lockstep, and judges it."""

import json
import math
import shlex
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.config.models import MissionConfig
from companion.config.resolve import FlightConfig, load_flight
from companion.experiments.faults.curves import Curves, make_curves
from companion.experiments.faults.judging import Judgement, Limits, judge
from companion.experiments.faults.reading import read_evidence
from companion.experiments.faults.table import FaultTable, Flavour, Row
from companion.flight.assemble import make_trajectory
from companion.flight.beginning import begin_log, log_begins_us
from companion.flight.embedded_shim import embedded_shim
from companion.flight.observer import SilentObserver
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep
from companion.mavlink.dialects import dialect_named
from companion.mavlink.framing import Framer
from companion.mavlink.messages import COMPONENT_TRUTH, MessageId
from companion.mavlink.telemetry import Rejected, state_from_odometry
from companion.recording.flight_log import FlightLog

_DOWN_M = 0.03
_STILL_M_S = 0.05
_RESTS_S = 1.0


@dataclass(frozen=True, slots=True)
class Order:
    """A flight to be flown, as it goes to a worker."""

    row: Row
    autopilot: Flavour
    mission: tuple[tuple[str, Any], ...]
    """Of the table."""
    aftermath_s: float
    seed: int
    folder: Path
    """Of the flight's files: made, and taken away again if all was kept and `keep` is false."""
    keep: bool = False

    @property
    def title(self) -> str:
        """Row and autopilot."""
        return f"{self.row.name} ({self.autopilot})"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What came of an order."""

    row: str
    autopilot: Flavour
    judgement: Judgement
    outcome: str
    """The companion's word."""
    note: str
    curves: Curves
    command: str
    """The command line that flies it again."""
    folder: Path | None
    """Of the flight's files; None if they are gone."""

    @property
    def passed(self) -> bool:
        """Whether all promises were kept."""
        return self.judgement.passed


def orders(table: FaultTable, rows: tuple[Row, ...], folder: Path, seed: int) -> list[Order]:
    """The flights of some rows under each of their autopilots.

    Args:
        table: that they are of.
        rows: those of a process are passed over.
        folder: below which the flights' files are made.
        seed: of each flight.
    """
    return [
        Order(
            row,
            autopilot,
            tuple(table.mission.items()),
            table.aftermath_s,
            seed,
            folder / "flights" / f"{row.name}-{autopilot}",
        )
        for row in rows
        if row.kind == "flight"
        for autopilot in row.autopilots
    ]


def configured(order: Order) -> FlightConfig:
    """The flight's configuration.

    Raises:
        ConfigError: the row's mission can't be used.
    """
    overrides, settings = _mission(order)
    return load_flight(None, overrides, settings)


def fly_order(order: Order) -> Verdict:
    """Fly, read, judge.

    Raises:
        ConfigError: the row's mission can't be used.
        TrajectoryFileError: nor its trajectory.
        ShimRefusedError: the shim can't simulate its faults.
        OSError: the folder can't be written.
    """
    config = configured(order)
    shutil.rmtree(order.folder, ignore_errors=True)
    log = begin_log(order.folder, CHANNELS, lockstep=True)
    aftermath = _Aftermath(log)
    try:
        outcome = fly_in_lockstep(
            config,
            make_trajectory(config.mission),
            log,
            SilentObserver(),
            embedded_shim(config),
            aftermath=aftermath if order.aftermath_s > 0.0 else None,
            aftermath_s=order.aftermath_s,
        )
    finally:
        log.close()
    evidence = read_evidence(
        order.folder,
        dialect_named(order.autopilot),
        log_begins_us(lockstep=True),
        outcome=outcome.outcome,
        completed=outcome.completed,
        note=outcome.note,
        ended_s=aftermath.began_s,
    )
    promise = order.row.promised(order.autopilot)
    judgement = judge(promise, evidence, limits(config))
    keep = order.keep or not judgement.passed
    if not keep:
        shutil.rmtree(order.folder, ignore_errors=True)
    return Verdict(
        order.row.name,
        order.autopilot,
        judgement,
        outcome.outcome,
        outcome.note,
        make_curves(promise, evidence, judgement.measured.detected_after_s),
        command(order),
        order.folder if keep else None,
    )


def limits(config: FlightConfig) -> Limits:
    """What a flight's configuration says of what may be sent."""
    return Limits(
        math.radians(config.vehicle.tilt_limit_deg), config.mission.supervisor.state_age_limit_s
    )


def command(order: Order) -> str:
    """The command line that flies an order again."""
    overrides, settings = _mission(order)
    words = ["companion", "fly", "--lockstep"]
    names = {"trajectory": "traj"}
    options = {"trajectory", "controller", "vehicle", "wind", "faults", "seed", "autopilot"}
    for key, value in overrides.items():
        if key in options:
            told = value if isinstance(value, str) else json.dumps(value)
            words += [f"--{names.get(key, key)}", told]
        else:
            words += ["--set", f"{key}={json.dumps(value)}"]
    for key, text in settings.items():
        words += ["--set", f"{key}={text}"]
    return shlex.join(words)


def _mission(order: Order) -> tuple[dict[str, object], dict[str, str]]:
    """Keys of the mission, and those that are set below others."""
    keys = {**dict(order.mission), **order.row.mission}
    keys |= {"faults": order.row.faults, "autopilot": order.autopilot, "seed": order.seed}
    known = MissionConfig.model_fields
    overrides = {key: value for key, value in keys.items() if key in known}
    settings = {key: json.dumps(value) for key, value in keys.items() if key not in known}
    return overrides, settings


class _Aftermath:
    """Records what the vehicle does when nobody flies it any more, until it lies still."""

    def __init__(self, log: FlightLog) -> None:
        self._log = log
        self._framer = Framer()
        self._rests_since_s: float | None = None
        self._began_s: float | None = None

    @property
    def began_s(self) -> float:
        """When the companion's flight was over; infinite if nothing came after it."""
        return math.inf if self._began_s is None else self._began_s

    def __call__(self, data: bytes, time_s: float) -> bool:
        """Take a datagram; whether the vehicle has been lying still for long enough."""
        if self._began_s is None:
            self._began_s = time_s
        for frame in self._framer.feed(data):
            self._log.frame_in(time_s, frame.raw)
            if frame.component_id == COMPONENT_TRUTH and frame.message_id == MessageId.ODOMETRY:
                state = state_from_odometry(frame)
                if not isinstance(state, Rejected):
                    speed = math.hypot(*state.velocity_enu_m_s)
                    rests = state.position_enu_m[2] < _DOWN_M and speed < _STILL_M_S
                    if not rests:
                        self._rests_since_s = None
                    elif self._rests_since_s is None:
                        self._rests_since_s = time_s
        since_s = self._rests_since_s
        return since_s is not None and time_s - since_s > _RESTS_S
