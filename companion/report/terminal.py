"""What a person sees in the terminal: a line while flying, a table at the end."""

from typing import Any

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from companion.flight.observer import TickView

_COLOURS = {"info": "cyan", "warning": "yellow", "error": "bold red"}
_TICKS_PER_LINE = 10
"""Ticks between two refreshes of the live line."""


class TerminalObserver:
    """Shows phases, messages and a live line; use as a context manager."""

    def __init__(self, console: Console, *, verbose: bool) -> None:
        self._console = console
        self._verbose = verbose
        self._live = Live(Text(""), console=console, refresh_per_second=5, transient=True)
        self._ticks = 0

    def __enter__(self) -> "TerminalObserver":
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._live.stop()

    def phase(self, name: str, detail: str) -> None:
        """A phase begins: one line."""
        text = Text(f"  {name:<12}", style="bold")
        text.append(detail, style="dim")
        self._console.print(text)

    def tick(self, view: TickView) -> None:
        """Refresh the live line now and then."""
        self._ticks += 1
        if self._ticks % _TICKS_PER_LINE or not self._console.is_terminal:
            return
        done = round(view.progress * 20)
        bar = "█" * done + "·" * (20 - done)
        line = (
            f"  {bar} {view.progress:4.0%}  {view.phase:<9} "
            f"error {view.tracking_error_m * 1e3:6.1f} mm  tilt {view.tilt_deg:4.1f}°"
        )
        self._live.update(Text(line, style="yellow" if view.fallback else ""))

    def message(self, severity: str, text: str) -> None:
        """One line for a warning or an error; for other messages only when verbose."""
        if severity != "info" or self._verbose:
            self._console.print(Text(f"  {severity}: {text}", style=_COLOURS.get(severity, "")))


def result_table(result: dict[str, Any]) -> Table:
    """The table at the end of a flight."""
    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim")
    table.add_column()
    outcome = str(result["outcome"])
    colour = {"landed": "green", "refused": "red"}.get(outcome, "yellow")
    table.add_row("outcome", Text(outcome, style=f"bold {colour}"))
    if result["note"]:
        table.add_row("", str(result["note"]))
    table.add_row(
        "flight",
        f"trajectory {result['trajectory']}, {result['controller']}, {result['vehicle']}, "
        + (f"wind {result['wind']}, seed {result['seed']}" if result["wind"] else "real"),
    )
    mean = result["mean_tracking_error_m"]
    if mean is not None:
        table.add_row(
            "tracking error",
            f"[bold]{mean * 1e3:.1f} mm[/] mean, {result['rms_tracking_error_m'] * 1e3:.1f} rms, "
            f"{result['max_tracking_error_m'] * 1e3:.1f} max, against {result['error_against']}",
        )
        reported = result["reported_mean_tracking_error_m"]
        if reported is not None:
            table.add_row("", f"{reported * 1e3:.1f} mm mean as reported by the autopilot")
    if result["fan_or_wind_peak_accel_m_s2"]:
        table.add_row("wind", f"at most {result['fan_or_wind_peak_accel_m_s2']:.2f} m/s²")
    table.add_row(
        "control",
        f"{result['ticks']} ticks, {result['missed_deadlines']} deadlines missed, "
        f"{result['fallbacks']} on a fallback",
    )
    latency, noise = result["latency_ms"], result["timer_noise_ms"]
    if latency is not None:
        table.add_row(
            "latency",
            f"{latency['p50']:.2f} ms median, {latency['p99']:.2f} p99, {latency['max']:.2f} max"
            + (f" (timers of this machine: {noise['p99']:.2f} p99)" if noise else ""),
        )
    ratio = result["flight_s"] / result["wall_s"] if result["wall_s"] else 0.0
    table.add_row(
        "time", f"{result['flight_s']:.1f} s flown in {result['wall_s']:.1f} s ({ratio:.1f} ×)"
    )
    if result["log_dir"]:
        table.add_row("log", str(result["log_dir"]))
    return table
