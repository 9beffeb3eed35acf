"""What the comparison says of each recording and aspect, given the known differences."""

from dataclasses import dataclass, field
from functools import cache

from tests.sitl_shim.captures.compare import ASPECTS, differences
from tests.sitl_shim.captures.conversation import read_capture
from tests.sitl_shim.captures.known import KNOWN, Known
from tests.sitl_shim.captures.replay import SETTINGS, replay


@dataclass(frozen=True)
class Verdict:
    """One aspect of one recording."""

    known: tuple[Known, ...] = ()
    """Known differences that showed."""
    unknown: tuple[str, ...] = field(default=())
    """What differs and is not listed."""

    @property
    def word(self) -> str:
        if self.unknown:
            return "differs"
        return "listed" if self.known else "same"


@cache
def verdicts(capture: str) -> dict[str, Verdict]:
    """By aspect."""
    found = differences(read_capture(capture), replay(capture))
    result = {}
    for aspect in ASPECTS:
        listed: list[Known] = []
        unknown = []
        for text in found[aspect]:
            covering = [known for known in KNOWN if known.covers(capture, aspect, text)]
            listed += covering
            if not covering:
                unknown.append(text)
        result[aspect] = Verdict(tuple(dict.fromkeys(listed)), tuple(unknown))
    return result


_INTRODUCTION = """# The shim against recordings of real autopilots

Recordings of a real PX4 v1.17 and a real ArduCopter 4.7 with their clients are replayed to the
shim: what the clients said is said to it at the same boot times, and what it answers is compared
with what the real one answered, up to times and noise. **same**: nothing differs. **listed**: what
differs is listed below. A difference that is not listed fails the tests
(`tests/sitl_shim/captures`). The recordings are described in `tests/data/captures/README.md`; this
page is written by `python tools/differences.py`.
"""


def page() -> str:
    """docs/differences.md."""
    names = list(SETTINGS)
    lines = [_INTRODUCTION, f"| | {' | '.join(names)} |", "|---|" + "---|" * len(names)]
    for aspect in ASPECTS:
        words = " | ".join(verdicts(name)[aspect].word for name in names)
        lines.append(f"| {aspect} | {words} |")
    for title, flavour in (("PX4", "px4"), ("ArduPilot", "ardupilot")):
        lines += ["", f"## {title}", "", "| aspect | what differs | why |", "|---|---|---|"]
        shown = {
            known
            for name in names
            if name.startswith(flavour)
            for verdict in verdicts(name).values()
            for known in verdict.known
        }
        lines += [
            f"| {known.aspect} | {known.what} | {known.why} |" for known in KNOWN if known in shown
        ]
    return "\n".join(lines) + "\n"
