"""The table at the end of a flight."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

_COLOURS = {"landed": "green", "tracked": "green", "refused": "red", "aborted": "yellow"}
_LABEL_CELLS = 14
_GAUGES = {"y_tilde": "ỹ", "sigma": "σ̂", "slew": "setpoint slew", "delay": "delay"}


def print_summary(console: Console, result: dict[str, Any]) -> None:
    """Print a result as a table, and below it where the flight's files are.

    Args:
        console: where to.  On a terminal the reason of a refusal or an abort stands above already,
            as an error.
        result: as `result_object` makes it.
    """
    said_already = console.is_terminal and result["outcome"] != "landed"
    rows = _rows(result, with_note=not said_already)
    if console.is_terminal:
        console.print(_table(rows))
    else:  # in a file a line for each, without the blanks that fill a table's cells
        for name, value in rows:
            console.print(Text(f"{name:<{_LABEL_CELLS}}  ").append_text(value), soft_wrap=True)
    if result["log_dir"]:
        where = Text(f"{'files':<{_LABEL_CELLS}}  ", style="dim")
        where.append(_from_here(Path(result["log_dir"])), style="not dim")
        console.print(where, soft_wrap=True)


def _table(rows: list[tuple[str, Text]]) -> Table:
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim", no_wrap=True, min_width=_LABEL_CELLS)
    table.add_column()
    for name, value in rows:
        table.add_row(name, value)
    return table


def _rows(result: dict[str, Any], *, with_note: bool) -> list[tuple[str, Text]]:
    outcome = str(result["outcome"])
    said = Text(outcome, style=f"bold {_COLOURS.get(outcome, '')}".strip())
    if outcome == "landed" and not result["completed"]:
        said.append(", the trajectory was not flown to its end", style="yellow")
    rows = [("outcome", said)]
    if result["note"] and with_note:
        rows.append(("", Text(result["note"])))
    weather = "a real vehicle" if result["wind"] is None else f"wind {result['wind']}"
    seed = "" if result["seed"] is None else f", seed {result['seed']}"
    flown = f"trajectory {result['trajectory']}, {result['controller']}, {result['vehicle']}"
    under = "" if result["autopilot"] is None else f" under {result['autopilot']}"
    rows.append(("flight", Text(f"{flown}{under}, {weather}{seed}")))
    rows += _error_rows(result)
    if result["fan_or_wind_peak_accel_m_s2"]:
        push = f"pushed with {result['fan_or_wind_peak_accel_m_s2']:.2f} m/s² at most"
        rows.append(("wind", Text(push)))
    if result["event"]:
        rows.append(("event", _event(result["event"])))
    if result["ticks"]:
        rows.append(("control", _control(result)))
    rows += _monitor_rows(result)
    latency, noise = result["latency_ms"], result["timer_noise_ms"]
    if latency is not None:
        text = f"p50 {_ms(latency['p50'])}, p99 {_ms(latency['p99'])}, max {_ms(latency['max'])} ms"
        if noise is not None:
            text += f" (machine's timers: p99 {_ms(noise['p99'])})"
        rows.append(("latency", Text(text)))
    if result["rejected_packets"]:
        counts = result["rejected_packets"].items()
        listed = ", ".join(f"{count} {reason}" for reason, count in counts)
        rows.append(("not read", Text(f"packets: {listed}", style="yellow")))
    if result["flight_s"]:
        text = f"{result['flight_s']:.1f} s flown"
        if result["wall_s"]:
            ratio = result["flight_s"] / result["wall_s"]
            text += f" in {result['wall_s']:.1f} s ({ratio:.1f} ×)"
        rows.append(("time", Text(text)))
    return rows


def _error_rows(result: dict[str, Any]) -> list[tuple[str, Text]]:
    mean = result["mean_tracking_error_m"]
    if mean is None:
        return []
    text = Text(f"{mean * 1e3:.1f} mm", style="bold")
    text.append(
        f" mean, {result['rms_tracking_error_m'] * 1e3:.1f} rms, "
        f"{result['max_tracking_error_m'] * 1e3:.1f} max, against {result['error_against']}",
        style="not bold",
    )
    rows = [("tracking error", text)]
    reported = result["reported_mean_tracking_error_m"]
    if reported is not None and result["error_against"] == "truth":
        rows.append(("", Text(f"{reported * 1e3:.1f} mm mean, as the autopilot reported it")))
    return rows


def _event(event: dict[str, Any]) -> Text:
    height_mm, side_mm = (event[f"peak_{k}_error_m"] * 1e3 for k in ("height", "horizontal"))
    text = Text(f"{event['what']} at {event['at_s']:.1f} s: ")
    text.append(f"{height_mm:.0f} mm off in height, {side_mm:.0f} sideways at most, ")
    back_s = event["recovery_s"]
    if back_s is None:
        return text.append("not back before the end", style="yellow")
    return text.append(f"back after {back_s:.2f} s" if back_s else "never 30 mm worse than before")


def _control(result: dict[str, Any]) -> Text:
    text = Text(f"{result['ticks']} ticks")
    one_missed = result["missed_deadlines"] == 1
    for count, what in (
        (result["missed_deadlines"], "deadline missed" if one_missed else "deadlines missed"),
        (result["fallbacks"], "on a fallback"),
    ):
        text.append(f", {count} {what}", style="yellow" if count else "")
    return text


def _monitor_rows(result: dict[str, Any]) -> list[tuple[str, Text]]:
    """Who flew when, and the monitor's gauge that came nearest to its bound."""
    rows: list[tuple[str, Text]] = []
    for change in result["controller_changes"]:
        planned = change["cause"] == "switch" and change["handed_over"]
        said = Text(
            f"t = {change['t_s']:.1f} s: {change['text']}", style="" if planned else "yellow"
        )
        rows.append(("" if rows else "controllers", said))
    worst = result["monitor_worst"]
    if worst:
        name, value = max(worst.items(), key=lambda item: item[1])
        text = f"{_GAUGES[name]} up to {value:.2f} of its bound"
        rows.append(("monitor", Text(text, style="yellow" if value > 1.0 else "")))
    return rows


def _ms(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _from_here(folder: Path) -> str:
    """The folder as one would type it here."""
    here = Path.cwd()
    return str(folder.relative_to(here)) if folder.is_relative_to(here) else str(folder)
