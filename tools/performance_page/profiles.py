"""The section on what takes a flight's time, then and now."""

from tools.performance_page.markdown import figure, table
from tools.performance_page.results import Result


def section(result: Result) -> list[str]:
    """Seconds of each part."""
    found = result.figures
    before, now = found["before"], found["now"]
    rows = []
    for part in before["seconds"] | now["seconds"]:
        pair = [one["seconds"].get(part, 0.0) for one in (before, now)]
        shares = [f"{100.0 * one['share'].get(part, 0.0):.0f} %" for one in (before, now)]
        rows.append((part, figure(pair[0], 2), shares[0], figure(pair[1], 2), shares[1]))
    rows.append(
        ("all", figure(before["processor_s"]), "100 %", figure(now["processor_s"]), "100 %")
    )
    commits = found["commits"]
    heads = [f"at {commits['before']}, s", "share", f"at {commits['now']}, s", "share"]
    return [
        (
            f"`companion fly --traj {found['trajectory']} --lockstep`, whole but for its imports, "
            f"rounds of each, in turns: {found['rounds']}; "
            f"{figure(found['times_as_fast'])} times as fast."
        ),
        "",
        *table(["whose code, libraries counted for who calls them", *heads], rows),
        "![What takes a flight's time, then and now](images/performance-profiles.svg)",
        "",
    ]
