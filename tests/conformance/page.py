"""The page that tells which client takes which step with which flavour."""

from collections.abc import Sequence
from importlib.metadata import version

from tests.conformance.steps import FLAVOURS, TITLES, Session

_HEAD = """\
# Conformance

Real clients, which nobody here wrote, against both flavours of the simulated autopilot, over UDP.
Written by `python tools/conformance.py`; the tests in `tests/conformance/` take the same steps and
compare this page with what they saw.

Each step is one thing that a user of the client does; "yes" means that it came out as it does with
the real autopilot, by what the client itself reports.
"""


def page(sessions: Sequence[Session]) -> str:
    """The page, in Markdown."""
    parts = [_HEAD]
    for client, package in (("MAVSDK", "mavsdk"), ("MAVProxy", "mavproxy")):
        mine = {s.flavour: s for s in sessions if s.client == client}
        parts += [f"\n## {client} {version(package)}\n", *table(mine)]
    return "\n".join(parts) + "\n"


def table(sessions: dict[str, Session]) -> list[str]:
    """Rows of one client: step × flavour."""
    names: list[str] = []
    for flavour in FLAVOURS:
        names += [step.name for step in sessions[flavour].steps if step.name not in names]
    names.sort(key=lambda name: min(_place(sessions[f], name) for f in FLAVOURS))
    lines = [
        f"| step | {' | '.join(TITLES[flavour] for flavour in FLAVOURS)} |",
        "|---|---|---|",
    ]
    for name in names:
        cells = [_cell(sessions[flavour], name) for flavour in FLAVOURS]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def verdicts(text: str) -> dict[tuple[str, str, str], bool]:
    """What a page says: (client, step, flavour) → passed."""
    found: dict[tuple[str, str, str], bool] = {}
    client = ""
    for line in text.splitlines():
        if line.startswith("## "):
            client = line[3:].split()[0]
        if not line.startswith("| ") or line.startswith("| step "):
            continue
        name, *cells = (cell.strip() for cell in line.strip("|").split(" | "))
        for flavour, cell in zip(FLAVOURS, cells, strict=True):
            if cell != "–":
                found[(client, name, flavour)] = cell.startswith("yes")
    return found


def _place(session: Session, name: str) -> int:
    names = [step.name for step in session.steps]
    return names.index(name) if name in names else len(names)


def _cell(session: Session, name: str) -> str:
    for step in session.steps:
        if step.name == name:
            text = step.seen.replace("|", "/").replace("\n", " ")
            return f"{'yes' if step.passed else '**no**'}: {text}"
    return "–"
