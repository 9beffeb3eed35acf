"""Every recording of a real autopilot, replayed to the shim, is answered as it was then."""

from pathlib import Path

import pytest

from tests.sitl_shim.captures.compare import ASPECTS
from tests.sitl_shim.captures.conversation import CAPTURES
from tests.sitl_shim.captures.known import KNOWN
from tests.sitl_shim.captures.replay import SETTINGS
from tests.sitl_shim.captures.verdicts import page, verdicts

PAGE = Path(__file__).parents[3] / "docs" / "differences.md"


def test_every_recording_is_replayed() -> None:
    assert {path.name.split(".")[0] for path in CAPTURES.glob("*.tlog.gz")} == set(SETTINGS)


@pytest.mark.parametrize("aspect", list(ASPECTS))
@pytest.mark.parametrize("capture", list(SETTINGS))
def test_the_shim_answers_as_the_real_one_did(capture: str, aspect: str) -> None:
    assert verdicts(capture)[aspect].unknown == ()


def test_no_difference_is_listed_that_is_none() -> None:
    shown = {
        known for name in SETTINGS for verdict in verdicts(name).values() for known in verdict.known
    }
    assert [known.what for known in KNOWN if known not in shown] == []


def test_the_page_says_what_was_found() -> None:
    assert PAGE.read_text() == page(), "run: python tools/differences.py"
