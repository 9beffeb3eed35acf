"""The section on the batched study."""

from tools.performance_page.markdown import figure, table
from tools.performance_page.results import Result


def section(result: Result) -> list[str]:
    """Agreement with single flights, and the speed."""
    found = result.figures
    speed, lost = found["vehicle_seconds_per_second"], found["lost"]
    agreement = [
        ("flown both ways to the end", str(found["compared"])),
        ("error, batched over single: median", figure(found["median_ratio"])),
        ("the same: 10 % … 90 %", f"{figure(found['ratio_p10'])} … {figure(found['ratio_p90'])}"),
        ("the same: farthest from 1", figure(found["worst_ratio"])),
        ("rank correlation of the errors", figure(found["rank_correlation"])),
        (
            "rank correlation over the nominal vehicle's error",
            figure(found["rank_correlation_over_nominal"]),
        ),
        ("points lost by both", str(lost["both"])),
        ("lost by the single flight alone", str(lost["flight_alone"])),
        ("lost by the batched one alone", str(lost["batched_alone"])),
        ("lost by neither", str(lost["none"])),
    ]
    speeds = [
        ("single flights", figure(speed["single"])),
        (f"batched, {speed['vehicles']} vehicles", figure(speed["batched"])),
        ("ratio", figure(found["speed_ratio"])),
    ]
    lines = [
        *table(["against single flights", ""], agreement),
        *table(["vehicle-seconds per second of processor time", ""], speeds),
        f"A solver was needed for {100.0 * speed['constrained_share']:.1f} % of the plans.",
        "",
    ]
    if "map" in found:
        said = found["map"]
        lines += [
            (
                f"A map of {said['vehicles']} vehicles took {figure(said['seconds'])} s of "
                f"processor time; {100.0 * said['lost_share']:.0f} % of them were lost."
            ),
            "",
        ]
    return lines
