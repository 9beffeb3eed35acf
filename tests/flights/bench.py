"""Flies missions in lockstep for tests, with things that happen on the way."""

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from companion.config.resolve import configs_folder, load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.conduct import Outcome
from companion.flight.embedded_shim import faults_text
from companion.flight.inbox import Inbox
from companion.flight.records import CHANNELS
from companion.flight.shim_process import ShimOptions
from companion.lockstep import fly_in_lockstep
from companion.recording.flight_log import FlightLog
from companion.recording.mcap_log import read_records
from tests.flights.wire import Wire

SHORT = "t,x,y,z\n0,0,0,2.4\n1,0.3,0.1,2.4\n2,0.7,0.1,2.3\n3,0.5,-0.2,2.4\n4,0.4,-0.3,2.5\n"
"""Four seconds near the place of take-off."""
STATE_AGE_LIMIT_S = 0.1
LEVEL_DEG = 0.01


@dataclass
class Seen:
    """An observer that remembers, and lets things happen a while after a phase has begun."""

    happenings: list[tuple[str, float, Callable[[], None]]] = field(default_factory=list)
    phases: list[tuple[float, str]] = field(default_factory=list)
    messages: list[tuple[float, str, str]] = field(default_factory=list)
    ticks: int = 0

    def phase(self, name, detail):
        loop = asyncio.get_running_loop()
        self.phases.append((loop.time(), name))
        waiting = [h for h in self.happenings if h[0] == name]
        self.happenings = [h for h in self.happenings if h[0] != name]
        for _, delay_s, action in waiting:
            if delay_s == 0.0:
                action()
            else:
                loop.call_later(delay_s, action)

    def tick(self, view):
        self.ticks += 1

    def message(self, severity, text):
        self.messages.append((asyncio.get_running_loop().time(), severity, text))


@dataclass
class Flown:
    """A flight that is over."""

    outcome: Outcome
    folder: Path
    wire: Wire
    seen: Seen

    def records(self, topic):
        return [r for r in read_records(self.folder / "flight.mcap") if r.topic == topic]

    def told(self, text):
        """Times at which a text was told: on the display, in the log, and on the wire."""
        shown = [t for t, _, said in self.seen.messages if text in said]
        logged = [text in r.values["text"] for r in self.records("event") if is_message(r)]
        logged = [said for said in logged if said]
        on_wire = [said for said in self.wire.texts if text in said]
        assert len(shown) == len(logged) == len(on_wire), (text, shown, logged, on_wire)
        return shown

    def began(self, phase):
        return next(t for t, name in self.seen.phases if name == phase)

    @property
    def was_armed(self):
        return any(armed for _, armed in self.wire.armed)


def is_message(event):
    """True for what a person was told, as against the phases in the same channel."""
    return not event.values["text"].startswith("phase ")


class Bench:
    """Flies into folders below one."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.wire = Wire()
        self.inbox = Inbox()
        self.happenings: list[tuple[str, float, Callable[[], None]]] = []
        self.flies: str | None = None
        """The autopilot that the shim plays; None: the mission's."""
        (folder / "short.csv").write_text(SHORT)

    def after(self, phase, delay_s, action):
        """Let something happen a while after a phase has begun (for the first time)."""
        self.happenings.append((phase, delay_s, action))

    def fly(
        self,
        *,
        options=None,
        settings=None,
        make_solver=None,
        speed=1.0,
        check=True,
        sensors=None,
        airborne=False,
        key=None,
        shim_key=None,
        boot_scale=0.1,
        parameters=None,
        faults=None,
    ):
        """Fly a short mission, or what the options say.

        `faults` is a file's path, a shipped name, YAML that begins with a brace, or a dict.
        """
        if faults is not None:
            options = {"faults": faults} | (options or {})
        overrides = {"trajectory": str(self.folder / "short.csv"), "seed": 1} | (options or {})
        keys = {"hover_s": "0.2"} | (settings or {})
        config = load_flight(None, overrides, keys)
        mission = config.mission
        wind = f"fan-{mission.trajectory}" if mission.wind == "fan" else mission.wind
        folder = self.folder / "flight"
        log = FlightLog(folder, CHANNELS)
        seen = Seen(self.happenings)
        scenario = configs_folder() / "scenarios" / f"{wind}.yaml"
        autopilot = self.flies or ("px4" if mission.autopilot == "auto" else mission.autopilot)
        self.wire.listen_as(autopilot)
        shim = ShimOptions(
            autopilot,
            mission.vehicle,
            scenario,
            mission.seed,
            speed,
            sensors,
            parameters or {},
            boot_scale=boot_scale if autopilot == "ardupilot" else 1.0,
            faults=faults_text(mission),
            signing_key=shim_key,
        )
        outcome = fly_in_lockstep(
            config,
            make_trajectory(mission),
            log,
            seen,
            shim,
            inbox=self.inbox,
            from_shim=self.wire.tap_from_shim,
            to_shim=self.wire.tap_to_shim,
            make_solver=make_solver,
            airborne=airborne,
            signing_key=key,
        )
        log.close()
        assert log.trouble is None
        assert log.lost == 0
        if check:
            assert_setpoints_are_sound(self.wire, config.vehicle.tilt_limit_deg)
        return Flown(outcome, folder, self.wire, seen)


def assert_setpoints_are_sound(wire, tilt_limit_deg):
    """Finite, of unit norm, within the vehicle's limits, and level unless the state is fresh."""
    for s in wire.setpoints:
        assert all(math.isfinite(c) for c in (*s.quaternion, s.thrust)), s
        assert abs(math.hypot(*s.quaternion) - 1.0) < 1e-4, s
        assert 0.0 <= s.thrust <= 1.0, s
        # u holds the sines of roll and pitch; together they may tilt a little less.
        assert s.tilt_deg <= tilt_limit_deg + 0.1, s
        assert s.mask == 7, s
        assert s.state_age_s <= STATE_AGE_LIMIT_S or s.tilt_deg < LEVEL_DEG, s
