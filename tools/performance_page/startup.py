"""The section on start-up times and memory."""

from tools.performance_page.markdown import figure, holds, table
from tools.performance_page.results import Result

_PACKAGES = 8
_HELP = "companion --help"


def section(result: Result) -> list[str]:
    """Each command, the flight's first events, and what its imports take."""
    found = result.figures
    processes = found["processes"]
    rows = [
        (
            f"`{name}`" if name.startswith("companion") else name,
            figure(one["wall_s"]["median"]),
            f"{figure(one['wall_s']['min'])}–{figure(one['wall_s']['max'])}",
            figure(one["processor_s"]),
            figure(one["peak_memory_mib"]),
            str(one["runs"]),
        )
        for name, one in processes.items()
    ]
    heads = ["process", "median, s", "range, s", "processor, s", "most memory, MiB", "runs"]
    goal, reached = found["goal_help_s"], processes[_HELP]["wall_s"]["median"]
    lines = [
        *table(heads, rows),
        f"Limit: `{_HELP}` within {goal:g} s: {holds(reached <= goal)}.",
        "",
    ]
    for name, one in processes.items():
        events = one.get("events_s")
        if events:
            told = ", ".join(f"*{event}* {figure(time_s)} s" for event, time_s in events.items())
            lines += [f"`{name}`, after its process's start: {told}.", ""]
    for name, spent in found["imports_ms"].items():
        told = ", ".join(
            f"{package} {figure(ms, 2)}" for package, ms in list(spent.items())[:_PACKAGES]
        )
        total = figure(sum(spent.values()))
        lines += [
            (
                f"Imports of `{name}`, ms (telling it takes time, too; mind the shares): {told}; "
                f"all {total}."
            ),
            "",
        ]
    return lines


def noise(result: Result) -> str:
    """What an empty Python takes."""
    empty = result.figures["processes"].get("python")
    if empty is None:
        return ""
    return f"a Python that does nothing takes {figure(empty['wall_s']['median'])} s"
