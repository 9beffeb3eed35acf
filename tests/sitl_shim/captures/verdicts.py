"""What the comparison says of each recording and aspect, given the known differences."""

from collections.abc import Mapping
from dataclasses import dataclass

from tests.sitl_shim.captures.compare import ASPECTS, compare
from tests.sitl_shim.captures.conversation import Capture, Conversation
from tests.sitl_shim.captures.known import KNOWN, NOT_COMPARED, Known
from tests.sitl_shim.captures.replay import SETTINGS

FLAVOURS: Mapping[str, str] = {"px4": "PX4", "ardupilot": "ArduPilot"}
NOTHING = "–"


@dataclass(frozen=True)
class Verdict:
    """One aspect of one recording."""

    compared: int
    """How much the recording has of it."""
    known: tuple[Known, ...]
    """Known differences that showed."""
    unknown: tuple[str, ...]
    """What differs and is not listed."""

    @property
    def word(self) -> str:
        if self.unknown:
            return "differs"
        if self.known:
            return "listed"
        return "same" if self.compared else NOTHING


def verdicts(capture: Capture, ours: Conversation) -> dict[str, Verdict]:
    """By aspect."""
    result = {}
    for aspect, comparison in compare(capture, ours).items():
        listed: list[Known] = []
        unknown = []
        for text in dict.fromkeys(comparison.differences):
            covering = [known for known in KNOWN if known.covers(capture.name, aspect, text)]
            listed += covering
            if not covering:
                unknown.append(text)
        result[aspect] = Verdict(comparison.compared, tuple(dict.fromkeys(listed)), tuple(unknown))
    return result


_INTRODUCTION = f"""# The shim against recordings of real autopilots

Recordings of a real PX4 v1.17 and a real ArduCopter 4.7 with their clients are replayed to the
shim: what the clients said is said to it at the same boot times, and what it answers is compared
with what the real one answered, up to times and noise. **same**: nothing differs. **listed**: what
differs is listed below. **{NOTHING}**: the recording has nothing of the kind. A difference that is
not listed, or is larger than listed, fails the tests (`tests/sitl_shim/captures`), and so does one
that is listed and does not show. The recordings are described in `tests/data/captures/README.md`;
this page is written by `python tools/differences.py`.
"""


def page(words: Mapping[str, Mapping[str, str]]) -> str:
    """docs/differences.md, from the word for each recording and aspect."""
    names = list(SETTINGS)
    lines = [_INTRODUCTION, f"| | {' | '.join(names)} |", "|---|" + "---|" * len(names)]
    for aspect in ASPECTS:
        lines.append(f"| {aspect} | {' | '.join(words[name][aspect] for name in names)} |")
    for flavour, title in FLAVOURS.items():
        lines += ["", f"## {title}", "", "| aspect | what differs | why |", "|---|---|---|"]
        lines += [
            f"| {known.aspect} | {known.what} | {known.why} |"
            for known in KNOWN
            if known.captures[0].startswith(flavour)
        ]
        lines += ["", "| aspect | what is not compared |", "|---|---|"]
        lines += [
            f"| {absent.aspect} | {absent.what} |"
            for absent in NOT_COMPARED
            if absent.flavour == flavour
        ]
    return "\n".join(lines) + "\n"


def words_on(text: str) -> dict[str, dict[str, str]]:
    """The words in the first table of a page, by recording and aspect."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in text.split("\n## ")[0].splitlines()
        if line.startswith("|") and not line.startswith("|---")
    ]
    names = rows[0][1:]
    return {name: {row[0]: row[column] for row in rows[1:]} for column, name in enumerate(names, 1)}
