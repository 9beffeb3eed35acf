"""What is said of a part that is too short to tell anything."""

import dataclasses

import numpy as np
import pytest

from companion.identification.estimates import UnidentifiedError
from companion.identification.parts import require
from tests.companion.identification.synthetic import Noise, Truth, record, without

LEFT = "the part 'roll' is not played beyond 0.3 of its 7.8 s: wind"


@pytest.fixture(scope="module")
def whole():
    return record(Truth(), Noise(), 1)


def refusal(recording, name):
    with pytest.raises(UnidentifiedError) as refused:
        require(recording, name)
    return str(refused.value)


def test_of_a_part_that_was_left_the_cause_is_told(whole):
    flown = dataclasses.replace(without(whole, "roll"), left=(("roll", LEFT), ("pitch", "else")))
    said = refusal(flown, "roll")
    assert f"{LEFT}. Fly it again" in said
    assert "else" not in said
    assert "ended early" not in said


def test_a_flight_that_went_on_was_not_ended_early(whole):
    said = refusal(without(whole, "pitch"), "pitch")
    assert "though the flight went on" in said
    assert "ended early" not in said


def test_a_flight_that_ended_in_the_midst_was_ended_early(whole):
    begin = int(np.flatnonzero(whole.segment == "pitch")[0])
    ended = whole.rows(np.arange(len(whole)) < begin + 50)
    assert "the flight was ended early. Fly it to its end" in refusal(ended, "pitch")
    assert "the flight was ended early. Fly it to its end" in refusal(ended, "swing")
