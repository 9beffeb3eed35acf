"""Target: everything that reads logs and lists back: tlog, MCAP, records, restore lists.

Beside damaged files there are whole ones whose records say what no flight ever said.
"""

import json
import random
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.exceptions import McapError

from companion.config.resolve import load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.check.restore_file import RestoreFileError, read_restore_file
from companion.flight.experiment import EXPERIMENT, EXPERIMENT_CHANNELS, THRUST_REPORT
from companion.flight.observer import SilentObserver
from companion.flight.records import CHANNELS
from companion.flight.replay.recorded import ReplayError
from companion.flight.replay.recorded import read_flight as read_for_replay
from companion.flight.shim_process import ShimOptions
from companion.identification.estimates import UnidentifiedError
from companion.lockstep import fly_in_lockstep
from companion.mavlink.framing import Framer
from companion.recording.flight_log import MCAP_NAME, TLOG_NAME, FlightLog
from companion.recording.mcap_log import McapLog, read_records
from companion.recording.mcap_recovery import (
    NotOursError,
    examine_mcap,
    write_recovered_mcap,
)
from companion.recording.tlog import read_tlog
from companion.recording.tlog_recovery import examine_tlog, write_recovered_tlog
from companion.report.flight_data import read_flight
from companion.report.identification_log import read_identification
from tools.fuzz.scratch import scratch_folder
from tools.fuzz.target import FindingError

_TLOG, _MCAP, _RESTORE, _RECORDS = range(4)
_ODD: tuple[Any, ...] = (
    *(None, True, -1, 0, 1e308, -1e308, 1 << 80, "", "x", "nan", [], {}, [1.0, 2.0], [None] * 3),
    *([[1.0]], {"x": 1}, "a" * 1000, [1e300] * 5, [0.0, 0.0, 0.0], [0.0] * 4, 1e-320, "track"),
)
_KEPT = 40
_LONGEST = 1 << 18
_RESTORE_LIST = {
    "about": "x",
    "autopilot": "px4",
    "system_id": 1,
    "parameters": [{"name": "COM_OBL_RC_ACT", "old": 0.0, "new": 5.0, "why": "x"}],
}
_JSON_ODD = (
    *(b"[" * 100_000, b"{", b"", b"null", b"[]", b"1", b"\xff", b'{"a":' * 20_000, b"NaN"),
    *(b"1" * 10_000, b'"\\ud800"', b"1e999", b"-Infinity", b"\x00", b'{"parameters": 1}'),
)


class LogFiles:
    """See the module."""

    unit = "documents"

    def __init__(self) -> None:
        """Prepare: a short flight leaves the logs that everything is made of."""
        self._folder = scratch_folder()
        flown = self._folder / "flown"
        _fly(flown)
        self._tlog = _short_tlog((flown / TLOG_NAME).read_bytes())
        records = [[r.topic, r.time_s, r.values] for r in read_records(flown / MCAP_NAME)]
        control = [r for r in records if r[0] == "control"]
        told = [r for r in records if r[0] in ("configuration", "input", "event")]
        plans = [r for r in records if r[0] == "plan"]
        self._records = sorted(
            [*told[:12], *control[:20], *plans[:6], *_experiment(told, control)],
            key=lambda record: record[1],
        )
        self._mcap = self._written(self._records[:_KEPT])
        shutil.rmtree(flown)
        for kind in (_TLOG, _MCAP, _RESTORE, _RECORDS):
            self.run(bytes((kind,)) + self._whole(kind))

    def _whole(self, kind: int) -> bytes:
        match kind:
            case 0:
                return self._tlog
            case 1:
                return self._mcap
            case 2:
                return json.dumps(_RESTORE_LIST).encode()
            case _:
                return _dumped(self._records)

    # --- inputs ---

    def generate(self, rng: random.Random) -> bytes:
        """One of the files, varied."""
        kind = rng.choice((_TLOG, _MCAP, _MCAP, _RESTORE, _RECORDS, _RECORDS, _RECORDS))
        return self.mutate(bytes((kind,)) + self._whole(kind), rng)

    def mutate(self, data: bytes, rng: random.Random) -> bytes:
        """The same kind of file, varied once more."""
        kind, content = data[0] % 4 if data else 0, data[1:]
        if kind in (_TLOG, _MCAP) or rng.random() < 0.05:
            return bytes((kind,)) + _other_bytes(content, rng)
        if rng.random() < 0.02:
            return bytes((kind,)) + rng.choice(_JSON_ODD)
        try:
            value = json.loads(content)
        except (ValueError, RecursionError):
            return bytes((kind,)) + _other_bytes(content, rng)
        for _ in range(rng.choice((1, 1, 2, 4))):
            value = _other_value(value, rng)
        return bytes((kind,)) + _dumped(value)

    def pieces(self, data: bytes) -> list[bytes]:
        """The kind; then records, or stretches of bytes."""
        if data[:1] == bytes((_RECORDS,)):
            try:
                records = json.loads(data[1:])
            except (ValueError, RecursionError):
                records = None
            if isinstance(records, list):
                return [data[:1], *(_dumped(record) for record in records)]
        return [data[:1], *(data[i : i + 16] for i in range(1, len(data), 16))]

    def join(self, pieces: list[bytes]) -> bytes:
        """The input of these."""
        if pieces and pieces[0] == bytes((_RECORDS,)):
            return pieces[0] + b"[" + b",".join(pieces[1:]) + b"]"
        return b"".join(pieces)

    # --- running ---

    def run(self, data: bytes) -> int:
        """Give one file to all that read its kind."""
        kind, content = data[0] % 4 if data else 0, data[1 : _LONGEST + 1]
        match kind:
            case 0:
                self._run_tlog(content)
            case 1:
                self._run_mcap(content)
            case 2:
                self._run_restore(content)
            case _:
                self._run_records(content)
        return 1

    def _run_tlog(self, content: bytes) -> None:
        path = self._put(TLOG_NAME, content)
        _allowed(lambda: list(read_tlog(path)), OSError, ValueError)
        found = examine_tlog(path, _is_packet)
        out = self._fresh("recovered.tlog")
        write_recovered_tlog(path, found, out)
        if len(list(read_tlog(out))) != found.packets:
            raise FindingError("a recovered tlog is not what was found")
        if out.stat().st_size > len(content):
            raise FindingError("a recovered tlog is larger than what it is of")

    def _run_mcap(self, content: bytes) -> None:
        path = self._put(MCAP_NAME, content)
        self._put(TLOG_NAME, self._tlog)
        self._read_all(path)
        try:
            found = examine_mcap(path)
        except (NotOursError, OSError):
            return
        out = self._fresh("recovered.mcap")
        write_recovered_mcap(path, found, out)
        for _ in read_records(out):
            pass

    def _run_restore(self, content: bytes) -> None:
        path = self._put("restore.json", content)
        _allowed(lambda: read_restore_file(path), RestoreFileError)

    def _run_records(self, content: bytes) -> None:
        try:
            records = json.loads(content)
        except (ValueError, RecursionError):
            return
        path = self._put(MCAP_NAME, self._written(records if isinstance(records, list) else []))
        self._put(TLOG_NAME, self._tlog)
        self._read_all(path)

    def _read_all(self, path: Path) -> None:
        _allowed(lambda: list(read_records(path)), OSError, McapError)
        _allowed(lambda: read_flight(path.parent), OSError, ValueError, McapError)
        _allowed(lambda: read_identification(path.parent), UnidentifiedError)
        _allowed(lambda: read_for_replay(path.parent), ReplayError)

    def _put(self, name: str, content: bytes) -> Path:
        path = self._folder / name
        path.write_bytes(content)
        return path

    def _fresh(self, name: str) -> Path:
        path = self._folder / name
        path.unlink(missing_ok=True)
        return path

    def _written(self, records: list[Any]) -> bytes:
        """An MCAP file with these records, as far as they are some."""
        path = self._fresh("made.mcap")
        log = McapLog(path, (*CHANNELS, *EXPERIMENT_CHANNELS))
        for record in records:
            if not isinstance(record, list) or len(record) != 3:
                continue
            topic, time_s, values = record
            if not isinstance(topic, str) or not isinstance(values, dict):
                continue
            at_s = float(time_s) if isinstance(time_s, int | float) else 0.0
            log.write(topic[:40], min(max(at_s, 0.0), 1e6) if at_s == at_s else 0.0, values)
        log.close()
        return path.read_bytes()


def _allowed(read: Callable[[], object], *errors: type[Exception]) -> None:
    """Read; the documented errors are none."""
    try:
        read()
    except errors as error:
        if not str(error):
            raise FindingError("an error says nothing") from error


def _is_packet(raw: bytes) -> bool:
    return len(Framer().feed(raw)) == 1


def _fly(folder: Path) -> None:
    """A flight of a second, in the air."""
    points = folder.parent / "short.csv"
    points.write_text("t,x,y,z\n0,0,0,2\n0.4,0.05,0,2\n0.8,0.1,0,2\n")
    config = load_flight(None, {"trajectory": str(points), "seed": 1}, {"hover_s": "0.1"})
    log = FlightLog(folder, CHANNELS)
    trajectory = make_trajectory(config.mission)
    fly_in_lockstep(
        config,
        trajectory,
        log,
        SilentObserver(),
        ShimOptions("px4", config.mission.vehicle, "calm", 1),
        airborne=True,
    )
    log.close()


def _short_tlog(data: bytes) -> bytes:
    """Some records of a log, of all kinds."""
    with tempfile.NamedTemporaryFile(suffix=".tlog") as file:
        file.write(data)
        file.flush()
        records = list(read_tlog(file.name))
    step = max(1, len(records) // 150)
    chosen = records[:80] + records[80::step]
    return b"".join(r.time_us.to_bytes(8, "big") + r.raw for r in chosen)


def _experiment(told: list[Any], control: list[Any]) -> list[list[Any]]:
    """Records as an identification flight leaves them."""
    vehicle = next(record[2]["vehicle"] for record in told if record[0] == "configuration")
    experiment = {
        "autopilot": "px4", "thrust_kind": "collective", "thrust_climb_m_s": None,
        "thrust_descent_m_s": None, "box_horizontal_m": 2.0, "box_vertical_m": 1.0,
        "hover_guess": 0.5, "vehicle": vehicle,
    }  # fmt: skip
    reports = [
        [THRUST_REPORT.topic, record[1],
         {"autopilot_time_s": record[2]["autopilot_time_s"], "thrust": 0.5}]
        for record in control[:8]
    ]  # fmt: skip
    return [[EXPERIMENT.topic, control[0][1], experiment], *reports]


def _dumped(value: object) -> bytes:
    try:
        return json.dumps(value).encode()
    except (ValueError, RecursionError):
        return b"[]"


def _other_bytes(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(changed) + 1)
        match rng.randrange(6):
            case 0:
                changed = changed[:at]
            case 1:
                del changed[at : at + rng.choice((1, 2, 8, 100))]
            case 2:
                changed[at:at] = rng.randbytes(rng.choice((1, 4, 30)))
            case 3:
                changed[at : at + 8] = rng.choice((0, 1, 255, 1 << 31, 1 << 63, (1 << 64) - 1)
                                                  ).to_bytes(8, "little")  # fmt: skip
            case 4:
                changed += bytes(rng.choice((1, 100, 5000)))
            case _:
                if at < len(changed):
                    changed[at] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _other_value(value: Any, rng: random.Random) -> Any:  # noqa: ANN401 - any JSON
    """The same with one thing changed, somewhere below."""
    if isinstance(value, dict) and value and rng.random() < 0.93:
        key = rng.choice(sorted(value))
        changed = dict(value)
        if rng.random() < 0.05:
            del changed[key]
        else:
            changed[key] = _other_value(value[key], rng)
        return changed
    if isinstance(value, list) and value and rng.random() < 0.9:
        at = rng.randrange(len(value))
        chance = rng.random()
        if chance < 0.05:
            return value[:at] + value[at + 1 :]
        if chance < 0.1:
            return [*value[:at], value[at], *value[at:]]
        return [*value[:at], _other_value(value[at], rng), *value[at + 1 :]]
    return rng.choice(_ODD)
