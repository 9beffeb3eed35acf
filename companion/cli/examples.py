"""What the end of a command's help says: examples to copy, and where to read on."""

from dataclasses import dataclass

FLY, PREPARE, STUDY, LOGS, SET_UP = (
    "Fly",
    "Know a vehicle, find gains",
    "Study in simulation",
    "Look at flights and logs",
    "Files and this computer",
)


@dataclass(frozen=True, slots=True)
class About:
    """Of one command."""

    panel: str
    """Under which `companion --help` lists it."""
    short: str
    """What it does, in one line of 80 columns beside its name."""
    examples: tuple[str, ...] = ()
    """Commands that work when typed, the plainest first."""
    read: tuple[str, ...] = ()
    """Documents."""


ROOT_EPILOG = (
    "\b\n`companion COMMAND --help` says more, with examples."
    "\nRead next: README.md, docs/command-line.md"
)
ABOUT: dict[str, About] = {
    "fly": About(
        FLY,
        "Fly a trajectory, simulated or real, and report how it tracked.",
        (
            "companion fly --traj 4",
            "companion fly --traj 5 --wind fan --lockstep --seed 1",
            "companion fly --mission mission.yaml --out flights/first",
            "companion fly --connect udpin://127.0.0.1:14540 --vehicle x500",
        ),
        ("docs/command-line.md", "docs/safety.md"),
    ),
    "check": About(
        FLY,
        "Look a vehicle over: what stands against a flight, and the remedy.",
        (
            "companion check --lockstep",
            "companion check --connect udpin://127.0.0.1:14540 --vehicle x500",
            "companion check --connect serial:///dev/ttyUSB0:921600 --fix",
        ),
        ("docs/preflight.md",),
    ),
    "mocap": About(
        FLY,
        "Give an autopilot motion-capture poses, and fly nothing.",
        ("companion mocap --connect udpin://127.0.0.1:14540 --mocap udp",),
        ("docs/mocap.md",),
    ),
    "land": About(
        FLY,
        "Let a running flight land where it is.",
        ("companion land", "companion land --pid 4711"),
        ("docs/safety.md",),
    ),
    "abort": About(
        FLY,
        "Let a running flight stop commanding: the autopilot takes over.",
        ("companion abort",),
        ("docs/safety.md",),
    ),
    "resume": About(
        FLY,
        "Let a flight that was handed over fly its trajectory anew.",
        ("companion resume",),
        ("docs/safety.md",),
    ),
    "identify": About(
        PREPARE,
        "Fly a minute of excitation; write the vehicle's file and gains.",
        (
            "companion identify --vehicle x500 --lockstep --out my-x500",
            "companion identify --connect udpin://127.0.0.1:14540 --name mine",
            "companion identify --log my-x500",
        ),
        ("docs/identify.md", "docs/recommended-gains.md"),
    ),
    "tune": About(
        PREPARE,
        "Search for a baseline controller's gains by simulated flights.",
        ("companion tune lqr-l1 --traj 4", "companion tune pid-l1 --budget 20 --starts 1"),
        ("docs/paper.md",),
    ),
    "certify": About(
        PREPARE,
        "Check a controller's theory: stability, bounds, margins.",
        (
            "companion certify mpc-l1 --vehicle bebop2",
            "companion certify mpc-l1 --set controller.l1.k='[2, 2, 2]' --wind 6",
        ),
        ("docs/certify.md",),
    ),
    "compare": About(
        STUDY,
        "Fly controllers side by side: winds, perturbed vehicles, seeds.",
        (
            "companion compare mpc-l1 lqr-l1 --traj 4 --seeds 1",
            "companion compare mpc-l1 mpc-l1-plus --wind calm --wind fan",
            "companion compare mpc-l1 --perturb all --seeds 3",
        ),
        ("docs/compare.md",),
    ),
    "campaign": About(
        STUDY,
        "Fly many simulated flights over sampled parameters; resumable.",
        (
            "companion campaign brief",
            "companion campaign robustness --resume",
            "companion campaign brief --point 3",
        ),
        ("docs/campaigns.md",),
    ),
    "report": About(
        STUDY,
        "Report on a campaign or a flight: did it track, and if not why?",
        ("companion report campaigns/brief", "companion report flights/first"),
        ("docs/campaign-report.md", "docs/reports.md"),
    ),
    "faults": About(
        STUDY,
        "Fly the table of faults: does each flight end as promised?",
        ("companion faults --only loss --autopilot px4", "companion faults"),
        ("docs/fault-table.md", "docs/faults.md"),
    ),
    "paper": About(
        STUDY,
        "Fly the paper's experiments, and judge its claims.",
        ("companion paper --quick", "companion paper"),
        ("docs/paper.md",),
    ),
    "live": About(
        LOGS,
        "Show a recorded flight in a browser.",
        ("companion live flights/first",),
        ("docs/live.md",),
    ),
    "replay": About(
        LOGS,
        "Feed a log's inputs through the controller again, bit for bit.",
        ("companion replay flights/first", "companion replay flights/first --controller lqr-l1"),
        ("docs/replay.md",),
    ),
    "recover": About(
        LOGS,
        "Save what is whole of a log that was cut off.",
        ("companion recover flights/first",),
        ("docs/logs.md",),
    ),
    "export": About(
        LOGS,
        "Write a flight's log as tables, or for other programs.",
        (
            "companion export flights/first",
            "companion export flights/first --to foxglove",
            "companion export flights/first --to csv --out tables",
        ),
        ("docs/export.md",),
    ),
    "new": About(
        SET_UP,
        "Write a commented file to begin with: a mission, a controller, …",
        (
            "companion new mission",
            "companion new mission fan.yaml --traj 5",
            "companion new controller mine.yaml --from mpc-l1 --vehicle x500",
            "companion new trajectory loop.csv",
        ),
        ("docs/command-line.md",),
    ),
    "schema": About(
        SET_UP,
        "Print the JSON Schema of a kind of YAML file, for editors.",
        ("companion schema", "companion schema mission"),
        ("docs/command-line.md",),
    ),
    "doctor": About(
        SET_UP,
        "Look this computer over, for a bug report.",
        ("companion doctor", "companion doctor --json > doctor.json"),
        ("docs/command-line.md", "docs/real-time.md"),
    ),
}
"""By the commands' names, in the order in which `companion --help` has them."""


def epilog(name: str) -> str:
    """The end of a command's help; its paragraphs keep their lines, as a backspace tells click."""
    about = ABOUT.get(name)
    if about is None:
        return ""
    parts = []
    if about.examples:
        parts.append("\b\nExamples:\n" + "\n".join(f"  {one}" for one in about.examples))
    if about.read:
        parts.append("\b\nRead next: " + ", ".join(about.read))
    return "\n\n".join(parts)
