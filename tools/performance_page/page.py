"""The page: one section for each benchmark, measured or not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tools.performance_page import batched, campaign, latency, lockstep, profiles, startup, tick
from tools.performance_page.results import Result

_HEAD = """\
# Performance

Written by `python -m tools.performance_page` from what the benchmarks kept in `benchmarks/results`:
every figure below was measured by the command that stands over it, on the machine and at the commit
that stand there too. A commit with a + had changes that were not committed. The noise floor is what
the machine itself adds; no figure can be trusted below it. Take your own:

```
pip install -e '.[bench]'
python benchmarks/tick.py --keep     # and latency, lockstep, profiles, campaign, startup, batched
python -m tools.performance_page
```
"""


@dataclass(frozen=True, slots=True)
class Section:
    """Of one benchmark."""

    name: str
    title: str
    about: str
    lines: Callable[[Result], list[str]]
    noise: Callable[[Result], str]


def _not_measured(result: Result) -> str:
    return "not measured in this run (it is processor time)"


SECTIONS = (
    Section(
        "tick",
        "The control tick",
        "What one tick of the control laws takes, and the quadratic programme within it in the "
        "hands of other solvers.",
        tick.section,
        tick.noise,
    ),
    Section(
        "latency",
        "From state to setpoint",
        "Real time over UDP: from the state that leaves the autopilot to the setpoint that answers "
        "it, seen from outside.",
        latency.section,
        latency.noise,
    ),
    Section(
        "lockstep",
        "Flights in lockstep",
        "How fast a whole simulated flight passes, boot to disarm, through MAVLink bytes, logged.",
        lockstep.section,
        lockstep.noise,
    ),
    Section(
        "profiles",
        "Then and now",
        "What takes a whole flight's time, before the work on speed and since.",
        profiles.section,
        tick.noise,
    ),
    Section(
        "campaign",
        "Campaigns",
        "What a second process brings to many flights, beside what it brings to plain work.",
        campaign.section,
        campaign.noise,
    ),
    Section(
        "batched",
        "The batched study",
        "Thousands of vehicles in one array, for wide maps of robustness.",
        batched.section,
        _not_measured,
    ),
    Section(
        "startup",
        "Start and memory",
        "Whole processes, from their start to their end.",
        startup.section,
        startup.noise,
    ),
)


def page(results: Mapping[str, Result]) -> str:
    """The whole page."""
    lines = [_HEAD]
    for section in SECTIONS:
        lines += [f"## {section.title}", "", section.about, ""]
        result = results.get(section.name)
        if result is None:
            lines += [
                f"Not measured yet: `python benchmarks/{section.name}.py --keep` does it.",
                "",
            ]
            continue
        lines += [*_origin(result, section.noise(result)), *section.lines(result)]
    return "\n".join(lines).rstrip("\n") + "\n"


def _origin(result: Result, noise: str) -> list[str]:
    machine = result.machine
    libraries = ", ".join(f"{name} {version}" for name, version in machine["libraries"].items())
    floor = f" Noise floor: {noise}." if noise else ""
    count = machine["processors"]
    return [
        (
            f"`{result.command}`, {result.date}, commit {result.commit}. {machine['processor']}, "
            f"{count} processor{'s' if count != 1 else ''}, load {machine['load_before']:g} before "
            f"it; {machine['system']}, Python {machine['python']}; {libraries}.{floor}"
        ),
        "",
    ]
