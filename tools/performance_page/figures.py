"""The pictures of the page, as SVG."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tools.performance_page.results import Result

_STYLE = {
    "svg.hashsalt": "performance",
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "figure.facecolor": "white",
    "axes.facecolor": "white",
}
_OURS = "#1f5fa8"
_OTHERS = "#9a9a9a"
_FLOOR = "#2e8b57"
_LINES = (
    _FLOOR,
    _OURS,
    "#e07b00",
    "#b22222",
    "#d96ca8",
    "#8c564b",
    "#7a3e9d",
    "#17a2a2",
    "#a0a000",
    "#555555",
    "#111111",
)
_MARKERS = "sv^Dx+*<>p"
_COLOURS = {"flight": "#7a3e9d", "ours": _OURS, "floor": _FLOOR, "library": _OTHERS}


def write_figures(results: Mapping[str, Result], folder: Path, kind: str = "svg") -> list[Path]:
    """Draw what there are results for.

    Args:
        results: of the benchmarks.
        folder: to write into.
        kind: "svg", or "png" to look at.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    written = []
    with mpl.rc_context(_STYLE):
        for name, (benchmark, size, draw) in _DRAWN.items():
            if benchmark not in results:
                continue
            result = results[benchmark]
            figure = Figure(figsize=size, layout="constrained")
            draw(figure, result.figures)
            file = folder / f"performance-{name}.{kind}"
            about = {"Date": None, "Description": digest_line(result)} if kind == "svg" else None
            figure.savefig(file, metadata=about, dpi=110)
            written.append(file)
    return written


def digest_line(result: Result) -> str:
    """What a picture says of the results that it was drawn from."""
    return f"results {result.digest}"


def drawn_from() -> dict[str, str]:
    """Names of the pictures' files, and the benchmark that each shows."""
    return {f"performance-{name}.svg": benchmark for name, (benchmark, _, _) in _DRAWN.items()}


def _solvers(figure: Any, found: Mapping[str, Any]) -> None:  # noqa: ANN401
    """Median to p99 of each contender, a panel for each set."""
    axes = figure.subplots(1, len(found["sets"]), sharey=True, sharex=True)
    for axis, (name, one) in zip(axes, found["sets"].items(), strict=True):
        rows = list(one["contenders"].items())
        for k, (_, row) in enumerate(rows):
            colour = _COLOURS[row["kind"]]
            axis.plot(
                [row["median_us"], row["p99_us"]], [k, k], color=colour, linewidth=4, alpha=0.4
            )
            axis.plot(row["median_us"], k, "o", color=colour)
            axis.plot(row["p99_us"], k, "|", color=colour, markersize=9, markeredgewidth=2)
        axis.set_yticks(range(len(rows)), [who for who, _ in rows])
        axis.set_xscale("log")
        axis.set_xlabel("µs a tick: median (dot) to p99 (bar)")
        share = 100.0 * one["constrained_share"]
        axis.set_title(
            f"{name}: {share:.0f} % of the ticks constrained, N_h {one['horizon']}", fontsize=9
        )
    axes[0].invert_yaxis()


def _horizons(figure: Any, found: Mapping[str, Any]) -> None:  # noqa: ANN401
    """Time over N_h, both axes logarithmic."""
    horizons = found["horizons"]
    axes = figure.subplots(1, 2, sharey=True)
    keys = ("std_median", "hard_p99")
    for axis, key, title in zip(axes, keys, ("median, std", "p99, hard"), strict=True):
        for k, (name, row) in enumerate(horizons["contenders"].items()):
            ours = row["kind"] != "library"
            exponents = ", ".join(f"{row[f'exponent_{each}']:.2f}" for each in keys)
            axis.plot(
                horizons["values"],
                row[f"{key}_us"],
                marker="o" if ours else _MARKERS[k % len(_MARKERS)],
                markersize=6 if ours else 4,
                color=_LINES[k % len(_LINES)],
                linestyle="-" if ours else "--",
                linewidth=2.4 if ours else 1.0,
                label=f"{name}  ({exponents})",
            )
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xticks(horizons["values"], [str(n) for n in horizons["values"]])
        axis.minorticks_off()
        axis.set_xlabel("N_h")
        axis.set_title(title, fontsize=9)
    axes[0].set_ylabel("µs a tick")
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(
        handles,
        labels,
        title="in brackets the exponents: of the median (std), of p99 (hard)",
        loc="outside lower center",
        ncols=3,
        fontsize=7.5,
        title_fontsize=7.5,
    )


def _lockstep(figure: Any, found: Mapping[str, Any]) -> None:  # noqa: ANN401
    """What takes the time of a simulated second, flight by flight."""
    flights = {f"{one['autopilot']}, {one['equations']}": one for one in found["flights"]}
    columns = {name: one["ms_per_s"] for name, one in flights.items()}
    _stacked(figure.subplots(), columns, "ms of processor for a simulated second")


def _profiles(figure: Any, found: Mapping[str, Any]) -> None:  # noqa: ANN401
    """What takes a flight's time, then and now."""
    commits = found["commits"]
    columns = {f"{name}: {commits[name]}": found[name]["seconds"] for name in ("before", "now")}
    _stacked(figure.subplots(), columns, "s of processor for a flight")


def _stacked(axis: Any, columns: Mapping[str, Mapping[str, float]], unit: str) -> None:  # noqa: ANN401
    """One bar for each column, its parts one after the other."""
    parts = list(dict.fromkeys(part for column in columns.values() for part in column))
    names = list(columns)
    reached = [0.0] * len(names)
    for k, part in enumerate(parts):
        lengths = [columns[name].get(part, 0.0) for name in names]
        axis.barh(names, lengths, left=reached, label=part, color=_LINES[k % len(_LINES)])
        reached = [a + b for a, b in zip(reached, lengths, strict=True)]
    axis.invert_yaxis()
    axis.set_xlabel(unit)
    axis.figure.legend(loc="outside lower center", ncols=3, fontsize=7.5)


def _latency(figure: Any, found: Mapping[str, Any]) -> None:  # noqa: ANN401
    """Quantiles of each client, and of the timers beside it."""
    axis = figure.subplots()
    names = list(found["clients"])
    for k, name in enumerate(names):
        one = found["clients"][name]
        for offset, key, colour in (
            (-0.14, "latency_ms", _OURS),
            (0.14, "timer_noise_ms", _OTHERS),
        ):
            p50, p99, most = (max(1e-3, one[key][q]) for q in ("p50", "p99", "max"))
            y = k + offset
            label = {"latency_ms": "state to setpoint", "timer_noise_ms": "timers alone"}[key]
            axis.plot([p50, most], [y, y], color=colour, alpha=0.3, linewidth=3)
            axis.plot(
                [p50, p99], [y, y], color=colour, linewidth=3, label=label if k == 0 else None
            )
            axis.plot(p50, y, "o", color=colour)
            axis.plot(p99, y, "|", color=colour, markersize=9, markeredgewidth=2)
    axis.set_yticks(range(len(names)), names)
    axis.invert_yaxis()
    axis.set_xscale("log")
    axis.set_xlabel("ms: median (dot), p99 (bar), greatest (end of the line)")
    axis.legend(fontsize=8)


_Draw = Callable[[Any, Mapping[str, Any]], None]
_DRAWN: dict[str, tuple[str, tuple[float, float], _Draw]] = {
    "solvers": ("tick", (10.0, 4.6), _solvers),
    "horizons": ("tick", (10.0, 5.0), _horizons),
    "lockstep": ("lockstep", (9.0, 3.6), _lockstep),
    "profiles": ("profiles", (9.0, 2.8), _profiles),
    "latency": ("latency", (8.0, 3.2), _latency),
}
