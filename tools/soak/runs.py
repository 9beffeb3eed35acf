"""Runs of a soak: a child flies, this process watches it and reads its logs."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from tools.soak.child import LONG, MANY, REAL_TIME
from tools.soak.figure_eight import write_figure_eight
from tools.soak.flown_log import p99_ms, windows
from tools.soak.gauges import held_by
from tools.soak.plans import ROUND, FlightPlan, rounds

LATENCY = ("latency_s", 1e-3)
"""Field of the control records, and 1 ms in its unit: from a sample to its setpoint."""
COMPUTED = ("computed_us", 1e3)
"""The same of the controller's processor time: in lockstep no time passes while it computes."""
_WINDOW_S = {REAL_TIME: 10.0, LONG: 60.0}
_SHORTEST_FLIGHT_S = 40.0
_HOUR_S = 3600.0

Tell = Callable[[str], None]


class ChildError(Exception):
    """The process that flies has failed; the text has the end of what it said."""


@dataclass(slots=True)
class Run:
    """What was seen of a run."""

    name: str
    samples: list[dict[str, Any]] = field(default_factory=list)
    """What was held; `time_s` rises."""
    latencies: list[dict[str, Any]] = field(default_factory=list)
    """99th percentiles of windows or flights: `time_s`, `p99_ms`."""
    flights: list[dict[str, Any]] = field(default_factory=list)
    """How each ended, and what was flown."""


def real_time(folder: Path, minutes: float, plan: FlightPlan, tell: Tell) -> Run:
    """One flight over UDP, the shim being a process of its own.

    Raises:
        ChildError: the companion's process has failed.
        ValueError: no such trajectory can be had (see `figure_eight`).
    """
    return _long(REAL_TIME, folder, minutes, plan, LATENCY, tell)


def long_flight(folder: Path, minutes: float, plan: FlightPlan, tell: Tell) -> Run:
    """One flight in lockstep.

    Raises:
        ChildError: the process has failed.
        ValueError: no such trajectory can be had (see `figure_eight`).
    """
    return _long(LONG, folder, minutes, plan, COMPUTED, tell)


def many_flights(
    folder: Path, hours: float, autopilot: str | None, controller: str | None, tell: Tell
) -> Run:
    """Whole flights in lockstep, one after another in one process, in whole rounds.

    Raises:
        ChildError: the process has failed.
    """
    run = Run(MANY)
    # The child is given more flights than it needs; it is ended at the end of a round.
    most = round(hours * _HOUR_S / _SHORTEST_FLIGHT_S / ROUND + 1) * ROUND
    plans = list(islice(rounds(autopilot, controller), most))
    with closing(_said(MANY, folder, plans)) as said:
        for line in said:
            number = line["number"]
            flown = folder / f"flight-{number:04d}"
            latency_ms = p99_ms(flown, *COMPUTED)
            shutil.rmtree(flown)
            run.samples.append(line)
            if latency_ms is not None:
                run.latencies.append({"time_s": line["time_s"], "p99_ms": latency_ms})
            run.flights.append({**asdict(plans[number]), **_ending(line)})
            tell(
                f"flight {number + 1}: {line['outcome']}; {line['time_s'] / _HOUR_S:.2f} h, "
                f"{line['memory_mib']:.1f} MiB, "
                + ("nothing tracked" if latency_ms is None else f"p99 {latency_ms:.2f} ms")
                + (f" ({line['note']})" if line["note"] else "")
            )
            if (number + 1) % ROUND == 0 and line["time_s"] >= hours * _HOUR_S:
                break
    shutil.rmtree(folder)
    return run


def _long(
    mode: str,
    folder: Path,
    minutes: float,
    plan: FlightPlan,
    field_per_ms: tuple[str, float],
    tell: Tell,
) -> Run:
    folder.mkdir(parents=True, exist_ok=True)
    write_figure_eight(Path(str(plan.trajectory)), minutes * 60.0)
    run = Run(mode)
    with closing(_said(mode, folder, [plan])) as said:
        for line in said:
            if line["what"] == "flown":
                run.flights.append({**asdict(plan), **_ending(line)})
                continue
            if mode == REAL_TIME:
                line |= asdict(held_by(line.pop("pid")))
            if line["phase"] != "track":
                continue
            run.samples.append(line)
            if len(run.samples) % 60 == 1:
                tell(f"{mode}: {line['time_s']:.0f} s, {line['memory_mib']:.2f} MiB")
    for window in windows(folder / "flight-0000", *field_per_ms, _WINDOW_S[mode]):
        run.latencies.append(asdict(window))
    return run


def _ending(line: dict[str, Any]) -> dict[str, Any]:
    names = ("outcome", "completed", "note", "flight_s", "ticks", "missed_deadlines")
    times = ("latency_ms", "timer_noise_ms")
    return {name: line[name] for name in (*names, *times)}


def _said(
    mode: str, folder: Path, plans: Sequence[FlightPlan]
) -> Generator[dict[str, Any], None, None]:
    """Start the process that flies; what it says, until it ends or the generator is closed.

    Raises:
        ChildError: it has failed.
    """
    folder.mkdir(parents=True, exist_ok=True)
    told = {"mode": mode, "folder": str(folder), "plans": [asdict(plan) for plan in plans]}
    order = folder / "order.json"
    order.write_text(json.dumps(told))
    complaints = folder / "complaints.txt"
    with (
        complaints.open("w") as errors,
        subprocess.Popen(
            [sys.executable, "-m", "tools.soak.child", str(order)],
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
        ) as process,
    ):
        assert process.stdout is not None
        try:
            for line in process.stdout:
                yield json.loads(line)
        except BaseException:  # enough has been said, among others
            process.kill()
            raise
        status = process.wait()
    if status != 0:
        text = complaints.read_text().strip()[-2000:]
        raise ChildError(f"the process that flies ended with status {status}: {text}")
