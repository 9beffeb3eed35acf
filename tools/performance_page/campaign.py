"""The section on campaigns."""

from tools.performance_page.markdown import figure, holds, table
from tools.performance_page.results import Result


def section(result: Result) -> list[str]:
    """Speed-up beside a plain load's."""
    found = result.figures
    per_minute, around = found["flights_per_minute"], found["overhead_ms_per_flight"]
    rows = [
        (name, figure(per_minute[key]), figure(around[key], 2))
        for key, name in (("one", "1 process"), ("two", "2 processes"))
    ]
    by_round = ", ".join(f"{value:.2f}" for value in found["of_plain_by_round"])
    return [
        (
            f"{found['flights']} flights of trajectory 4 by each number of processes, in "
            f"{found['rounds']} rounds, with rounds of plain Python work between them: what two "
            "processes can gain on a machine is what the plain work gains."
        ),
        "",
        *table(["", "flights a minute", "ms around a flight"], rows),
        *table(
            ["two processes over one", "found", "limit", ""],
            [
                ("campaign", figure(found["speed_up"]) + " ×", "", ""),
                ("plain work, same run", figure(found["plain_speed_up"]) + " ×", "", ""),
                (
                    f"share of it (by round: {by_round})",
                    figure(found["of_plain"]),
                    f"≥ {found['goal']:g}",
                    holds(found["of_plain"] >= found["goal"]),
                ),
            ],
        ),
    ]


def noise(result: Result) -> str:
    """How far apart the rounds of the same were."""
    rounds = result.figures["of_plain_by_round"]
    return f"the same share came out between {min(rounds):.2f} and {max(rounds):.2f} in its rounds"
