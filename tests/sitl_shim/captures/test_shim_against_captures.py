"""Every recording of a real autopilot, replayed to the shim, is answered as it was then."""

from pathlib import Path

import pytest

from tests.sitl_shim.captures.compare import ASPECTS
from tests.sitl_shim.captures.conversation import CAPTURES, read_capture
from tests.sitl_shim.captures.known import KNOWN, NOT_COMPARED
from tests.sitl_shim.captures.replay import SETTINGS, replay
from tests.sitl_shim.captures.verdicts import FLAVOURS, NOTHING, page, verdicts, words_on

PAGE = (Path(__file__).parents[3] / "docs" / "differences.md").read_text()


def test_every_recording_is_replayed() -> None:
    assert {path.name.split(".")[0] for path in CAPTURES.glob("*.tlog.gz")} == set(SETTINGS)


# One test per recording, for each test is given to one process and a replay takes a second.
@pytest.mark.parametrize("name", list(SETTINGS))
def test_the_shim_answers_as_the_real_one_did(name: str) -> None:
    capture = read_capture(name)
    found = verdicts(capture, replay(capture))
    assert {aspect: v.unknown for aspect, v in found.items() if v.unknown} == {}
    shown = {known for verdict in found.values() for known in verdict.known}
    listed = [known for known in KNOWN if name in known.captures]
    assert [known.what for known in listed if known not in shown] == [], "listed, but not so"
    words = {aspect: verdict.word for aspect, verdict in found.items()}
    assert words == words_on(PAGE)[name], "run: python tools/differences.py"


def test_the_page_tells_what_is_listed() -> None:
    assert page(words_on(PAGE)) == PAGE, "run: python tools/differences.py"


def test_the_size_that_is_covered_is_on_the_page() -> None:
    sized = [known for known in KNOWN if known.up_to is not None]
    assert [k.what for k in sized if f"up to {k.up_to:g}" not in k.what] == []
    assert [k.what for k in KNOWN if ("(?P<size>" in k.text) != (k in sized)] == []


@pytest.mark.parametrize("flavour", list(FLAVOURS))
def test_each_aspect_is_compared_somewhere_or_said_not_to_be(flavour: str) -> None:
    words = [words for name, words in words_on(PAGE).items() if name.startswith(flavour)]
    never = [aspect for aspect in ASPECTS if all(each[aspect] == NOTHING for each in words)]
    assert never == [a.aspect for a in NOT_COMPARED if a.flavour == flavour and a.wholly]
